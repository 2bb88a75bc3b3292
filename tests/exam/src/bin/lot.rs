//! `cargo xtask lot`: false alarms and detection on a virtual production lot.

use std::path::{Path, PathBuf};

use clap::Parser;
use greyrig::detector::{Features, Verdict};
use greyrig_exam::lot::{FAULTS, Fault, Glance, MotorType, Onset, Station};
use greyrig_exam::roc::{area, characteristic, size_for};
use greyrig_exam::share::Share;
use greyrig_exam::spread::{Held, held};
use greyrig_host::error::Result;
use greyrig_host::monitor::test::{Outcome, Test};
use greyrig_host::output;
use greyrig_host::report::panels::{Panel, Scale, panels};
use rayon::prelude::*;

/// A fault counts as detectable from the size on at which so many motors with it are called.
const DETECTED: f64 = 0.95;
/// Ratio to the limit at which faults have to be put in the right place.
const CLEAR: f64 = 3.0;
/// Place of the size, among those of each fault, at which the paper's case is looked at.
const PAPER: usize = 3;

/// The detector on a virtual production lot.
#[derive(Debug, Parser)]
struct Args {
    /// Healthy motors to judge
    #[arg(long, default_value_t = 3000)]
    healthy: u64,
    /// Faulty motors for each fault, size and onset
    #[arg(long, default_value_t = 60)]
    faulty: u64,
    /// Faulty motors of each fault whose cause is looked for
    #[arg(long, default_value_t = 30)]
    isolated: u64,
    /// Healthy motors, and a tenth as many with each fault and size from the start, whose parameters are estimated
    #[arg(long, default_value_t = 300)]
    estimated: u64,
    /// Part of the flux that saturation takes from the motors of the type
    #[arg(long, default_value_t = 0.25)]
    saturation: f64,
    /// Staircases that teach the type's models
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=5))]
    staircases: u8,
    /// Only judge the type's models on so many other motors of the type, on a ramp
    #[arg(long)]
    spread: Option<u64>,
    /// Folder to which the figures are written, replacing those there
    #[arg(long)]
    figures: Option<PathBuf>,
}

/// What the stations have seen of the motors with a fault.
struct Seen {
    fault: &'static Fault,
    onset: Onset,
    /// By size, motor and station, with the begin of the fault, s.
    glances: Vec<Vec<(f64, Vec<Glance>)>>,
}

impl Seen {
    fn of(&self, size: usize, station: usize) -> Vec<(f64, Glance)> {
        self.glances[size].iter().map(|(onset, all)| (*onset, all[station])).collect()
    }

    /// Size and share of motors detected, size by size.
    fn detected(&self, station: usize) -> Vec<(f64, f64)> {
        let share = |k: usize| Share::of(&self.of(k, station), |(_, g)| g.verdict == Verdict::Fail).value();
        self.fault.sizes.iter().enumerate().map(|(k, size)| (*size, share(k))).collect()
    }
}

fn main() -> Result<()> {
    let args = Args::parse();
    let of = MotorType { saturation: args.saturation, staircases: usize::from(args.staircases) };
    let stations = of.stations()?;
    if let Some(count) = args.spread {
        return spread(&of, count, &stations);
    }
    let look = |seed: u64, fault: Option<(&str, f64)>, onset: Onset| -> Result<(f64, Vec<Glance>)> {
        let (recording, begin) = of.motor(seed, fault, onset)?;
        Ok((begin, stations.iter().map(|s| s.glance(&recording)).collect::<Result<_>>()?))
    };
    let healthy: Vec<Vec<Glance>> = (0..args.healthy)
        .into_par_iter()
        .map(|seed| {
            if seed % 100 == 0 {
                eprintln!("healthy {seed}/{}", args.healthy);
            }
            look(seed, None, Onset::During).map(|(_, glances)| glances)
        })
        .collect::<Result<_>>()?;
    println!("## Healthy motors\n\n| model | false alarms | cannot judge |\n| --- | --- | --- |");
    for (k, station) in stations.iter().enumerate() {
        let share = |what: Verdict| Share::of(&healthy, |all| all[k].verdict == what).exact();
        println!("| {} | {} | {} |", station.name, share(Verdict::Fail), share(Verdict::CannotJudge));
    }
    let grown = growth(&of, &stations)?;
    sparking(&of, stations.last())?;
    let mut seen = Vec::new();
    for onset in [Onset::During, Onset::Before] {
        for fault in FAULTS {
            eprintln!("{} {onset:?}", fault.id);
            let with = |n: usize, size: f64| {
                let seed = 2_000_000 + 1000 * n as u64;
                (0..args.faulty).into_par_iter().map(|k| look(seed + k, Some((fault.id, size)), onset)).collect()
            };
            let glances = fault.sizes.iter().enumerate().map(|(n, size)| with(n, *size)).collect::<Result<_>>()?;
            seen.push(Seen { fault, onset, glances });
        }
    }
    let names: Vec<&str> = stations.iter().map(|s| s.name).collect();
    for (onset, title) in
        [(Onset::During, "Faults that begin during the test"), (Onset::Before, "Faults from the start")]
    {
        println!("\n## {title}\n\n| fault | size | model | detected | median delay, s | median ratio to the limit |");
        println!("| --- | --- | --- | --- | --- | --- |");
        for s in seen.iter().filter(|s| s.onset == onset) {
            table(s, &names);
        }
    }
    println!("\n## Smallest size that {:.0} % of motors with it show\n", 100.0 * DETECTED);
    println!("| fault | begins | {} |\n| --- | --- | --- | --- | --- |", names.join(" | "));
    for s in &seen {
        let sizes: Vec<String> = (0..stations.len())
            .map(|k| size_for(DETECTED, &s.detected(k)).map_or_else(|| "–".to_owned(), |size| format!("{size:.3}")))
            .collect();
        println!("| {} | {} | {} |", s.fault.id, in_words(s.onset), sizes.join(" | "));
    }
    if let Some(folder) = &args.figures {
        draw(folder, &healthy, &seen, &grown, &names)?;
    }
    isolation(&of, &args, stations.last(), &seen)?;
    estimated(&of, args.estimated, stations.last())
}

/// Errors of the current on other motors, against what their scatter leaves.
fn spread(of: &MotorType, count: u64, stations: &[Station]) -> Result<()> {
    println!("## Error of the current on a ramp, from 1 s on; motor 0 is that of the type\n");
    println!("| motor | spread floor |{}", stations.iter().map(|s| format!(" {} |", s.name)).collect::<String>());
    println!("| --- | --- | --- | --- | --- |");
    let all: Vec<Held> = (0..=count).into_par_iter().map(|seed| held(of, seed, stations)).collect::<Result<_>>()?;
    for (n, held) in all.iter().enumerate() {
        let cells = held.errors.iter().map(|e| format!(" {:.2} % |", 100.0 * e));
        println!("| {n} | {:.2} % |{}", 100.0 * held.floor, cells.collect::<String>());
    }
    let above = |k: usize| -> Vec<f64> { all.iter().skip(1).map(|h| h.errors[k] - h.floor).collect() };
    let cell = |k: usize| {
        let most = above(k).into_iter().fold(f64::NEG_INFINITY, f64::max);
        format!(" {:.2} %, {:.2} % |", 100.0 * median(above(k)), 100.0 * most)
    };
    println!("| above the floor: median, most | |{}", (0..stations.len()).map(cell).collect::<String>());
    Ok(())
}

fn in_words(onset: Onset) -> &'static str {
    match onset {
        Onset::During => "during the test",
        Onset::Before => "before it",
    }
}

fn table(seen: &Seen, names: &[&str]) {
    for (n, size) in seen.fault.sizes.iter().enumerate() {
        for (k, name) in names.iter().enumerate() {
            let here = seen.of(n, k);
            let called: Vec<&(f64, Glance)> = here.iter().filter(|(_, g)| g.verdict == Verdict::Fail).collect();
            let delay = median(called.iter().filter_map(|(t, g)| g.alarm_s.map(|a| (a - t).max(0.0))).collect());
            println!(
                "| {} | {size} | {name} | {} | {} | {:.1} |",
                seen.fault.id,
                Share { hits: called.len(), cases: here.len() }.exact(),
                if seen.onset == Onset::During && delay.is_finite() { format!("{delay:.2}") } else { "–".to_owned() },
                median(here.iter().map(|(_, g)| g.score).collect()),
            );
        }
    }
}

/// Characteristics at the size at which the best station detects half, and smallest sizes.
fn draw(folder: &Path, healthy: &[Vec<Glance>], seen: &[Seen], grown: &[Vec<f64>], names: &[&str]) -> Result<()> {
    let write =
        |name: &str, text: &str| output::write_file(&folder.join(name), true, |out| out.write_all(text.as_bytes()));
    for (onset, name) in [(Onset::During, "roc-during.svg"), (Onset::Before, "roc-before.svg")] {
        let mut described = Vec::new();
        let drawn: Vec<Panel> = seen
            .iter()
            .filter(|s| s.onset == onset)
            .map(|s| {
                let last = names.len() - 1;
                let telling =
                    s.detected(last).iter().position(|(_, share)| *share >= 0.5).unwrap_or(s.fault.sizes.len() - 1);
                let curves: Vec<Vec<(f64, f64)>> = (0..names.len())
                    .map(|k| {
                        let faulty: Vec<f64> = s.of(telling, k).iter().map(|(_, g)| g.score).collect();
                        let fine: Vec<f64> = healthy.iter().map(|all| all[k].score).collect();
                        characteristic(&fine, &faulty)
                    })
                    .collect();
                let areas: Vec<String> = curves.iter().map(|c| format!("{:.2}", area(c))).collect();
                let title = format!("{} {}", s.fault.id.replace('_', " "), s.fault.sizes[telling]);
                described.push(format!("{title}: areas {}", areas.join(", ")));
                Panel {
                    title,
                    x: Scale::Linear("healthy motors called".to_owned(), 0.0, 1.0),
                    y: Scale::Linear("faulty motors called".to_owned(), 0.0, 1.0),
                    curves,
                    marks: false,
                }
            })
            .collect();
        let description = format!("Receiver operating characteristics. {}", described.join("; "));
        write(name, &panels(&description, names, &drawn, 3))?;
    }
    let faults: Vec<String> = FAULTS.iter().map(|f| f.id.replace('_', " ")).collect();
    let drawn: Vec<Panel> = [Onset::During, Onset::Before]
        .into_iter()
        .map(|onset| {
            let here: Vec<&Seen> = seen.iter().filter(|s| s.onset == onset).collect();
            let marks = |k: usize| {
                let at = |(row, s): (usize, &&Seen)| {
                    // Beside each other, so that none hides another.
                    size_for(DETECTED, &s.detected(k)).map(|size| (size, row as f64 + 0.2 * (k as f64 - 1.0)))
                };
                here.iter().enumerate().filter_map(at).collect::<Vec<_>>()
            };
            Panel {
                title: format!("Fault that begins {}", in_words(onset)),
                x: Scale::Logarithmic("smallest relative size that 95 % of motors show".to_owned(), 1e-3, 10.0),
                y: Scale::Names(faults.clone()),
                curves: (0..names.len()).map(marks).collect(),
                marks: true,
            }
        })
        .collect();
    let sized = FAULTS.iter().map(|f| format!("{} {}", f.id.replace('_', " "), f.sizes[PAPER])).collect();
    let growth = Panel {
        title: "The same motor, a fault from the start".to_owned(),
        x: Scale::Logarithmic("error with the fault over error without".to_owned(), 0.5, 1000.0),
        y: Scale::Names(sized),
        curves: (0..names.len())
            .map(|k| grown.iter().enumerate().map(|(row, g)| (g[k], row as f64 + 0.2 * (k as f64 - 1.0))).collect())
            .collect(),
        marks: true,
    };
    write("growth.svg", &panels("How much each fault raises the error of three models", names, &[growth], 1))?;
    write("detectable.svg", &panels("Smallest detectable size of each fault by three models", names, &drawn, 2))
}

/// By how much faults that are there from the start raise the error of the current or the speed, whichever rises more,
/// of the motor that the model was identified on.
fn growth(of: &MotorType, stations: &[Station]) -> Result<Vec<Vec<f64>>> {
    let errors = |fault: Option<(&str, f64)>| -> Result<Vec<[f64; 2]>> {
        let recording = of.type_motor(fault)?;
        stations.iter().map(|s| Ok(s.glance(&recording)?.errors())).collect()
    };
    let without = errors(None)?;
    println!("\n## The motor that the model is of, a fault from the start: error of current, speed\n");
    println!("| fault | size |{}", stations.iter().map(|s| format!(" {} |", s.name)).collect::<String>());
    println!("| --- | --- | --- | --- | --- |");
    let line = |id: &str, size: &str, errors: &[[f64; 2]]| {
        let cells = errors.iter().map(|[i, w]| format!(" {:.2} %, {:.2} % |", 100.0 * i, 100.0 * w));
        println!("| {id} | {size} |{}", cells.collect::<String>());
    };
    line("none", "–", &without);
    FAULTS
        .iter()
        .map(|fault| {
            let with = errors(Some((fault.id, fault.sizes[PAPER])))?;
            line(fault.id, &fault.sizes[PAPER].to_string(), &with);
            let grows = |(a, b): (&[f64; 2], &[f64; 2])| f64::max(a[0] / b[0], a[1] / b[1]);
            Ok(with.iter().zip(&without).map(grows).collect())
        })
        .collect()
}

/// By how much sparks raise what is watched of the motor that the model is of, by the station with the best model.
fn sparking(of: &MotorType, station: Option<&Station>) -> Result<()> {
    let (Some(station), Some(fault)) = (station, FAULTS.iter().find(|f| f.id == "sparking")) else { return Ok(()) };
    println!("\n## Sparking of the motor that the model is of, over the motor without the fault ({})\n", station.name);
    println!(
        "| passages with an arc | error of the current | current above 1 kHz | its power that goes with the current |"
    );
    println!("| --- | --- | --- | --- |");
    let without = station.glance(&of.type_motor(None)?)?.features;
    for size in fault.sizes {
        let with = station.glance(&of.type_motor(Some((fault.id, *size)))?)?.features;
        let times = |get: fn(&Features) -> f32| get(&with) / get(&without);
        println!(
            "| {:.1} % | {:.1} | {:.2} | {:.1} |",
            100.0 * size,
            times(|f| f.current),
            times(|f| f.sparking),
            times(|f| f.arcing)
        );
    }
    Ok(())
}

/// Where faults of three times the limit are put, by the station with the best model.
fn isolation(of: &MotorType, args: &Args, station: Option<&Station>, seen: &[Seen]) -> Result<()> {
    const PLACES: [&str; 3] = ["electrical", "mechanical", "sensor"];
    let Some(station) = station else { return Ok(()) };
    println!("\n## Where faults of {CLEAR} times the limit are put ({})\n", station.name);
    println!("| fault | size | sits | electrical | mechanical | sensor | not called | right |");
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    let (mut right, mut all) = (0, 0);
    for s in seen.iter().filter(|s| s.onset == Onset::During) {
        let last = s.glances[0].first().map_or(0, |(_, all)| all.len().saturating_sub(1));
        let ratios: Vec<(f64, f64)> = (0..s.fault.sizes.len())
            .map(|n| (s.fault.sizes[n], median(s.of(n, last).iter().map(|(_, g)| g.score).collect())))
            .collect();
        let Some(size) = size_for(CLEAR, &ratios) else { continue };
        let size = size.copysign(s.fault.sizes[0]);
        eprintln!("isolation {} {size:.3}", s.fault.id);
        let told: Vec<Option<&str>> = (0..args.isolated)
            .into_par_iter()
            .map(|k| {
                let (recording, onset) = of.motor(3_000_000 + k, Some((s.fault.id, size)), Onset::During)?;
                let test = station.test(&recording)?;
                Ok(test.alarms.iter().find(|a| a.until_s >= onset).map(|a| a.kind))
            })
            .collect::<Result<_>>()?;
        let counts = PLACES.map(|place| told.iter().filter(|t| **t == Some(place)).count());
        let here = Share::of(&told, |t| *t == Some(s.fault.kind));
        (right, all) = (right + here.hits, all + here.cases);
        println!(
            "| {} | {size:.3} | {} | {} | {} | {} | {} | {} |",
            s.fault.id,
            s.fault.kind,
            counts[0],
            counts[1],
            counts[2],
            told.len() - counts.iter().sum::<usize>(),
            here.exact(),
        );
    }
    println!("\nRight: {}", Share { hits: right, cases: all }.exact());
    Ok(())
}

/// What the whole test makes of faults that are there from the start, the parameters' estimation included.
fn estimated(of: &MotorType, count: u64, station: Option<&Station>) -> Result<()> {
    let Some(station) = station.filter(|_| count > 0) else { return Ok(()) };
    println!("\n## Faults from the start, with parameters estimated ({})\n", station.name);
    println!("| fault | size | fails | of these in the right place |\n| --- | --- | --- | --- |");
    let tested = |seed: u64, motors: u64, fault: Option<(&str, f64)>| -> Result<Vec<Test>> {
        let one = |k: u64| station.test(&of.motor(seed + k, fault, Onset::Before)?.0);
        (0..motors).into_par_iter().map(one).collect()
    };
    let fails = |t: &&Test| t.verdict == Outcome::Fail;
    let healthy = tested(4_000_000, count, None)?;
    println!("| none | – | {} | – |", Share::of(&healthy.iter().collect::<Vec<_>>(), fails).exact());
    for fault in FAULTS {
        let mut shares = Vec::new();
        for size in fault.sizes {
            eprintln!("estimated {} {size}", fault.id);
            let tests = tested(5_000_000, count / 10, Some((fault.id, *size)))?;
            let failed: Vec<&Test> = tests.iter().filter(fails).collect();
            let share = Share { hits: failed.len(), cases: tests.len() };
            let right = Share::of(&failed, |t| t.alarms.iter().any(|a| a.kind == fault.kind));
            println!("| {} | {size} | {} | {} |", fault.id, share.exact(), right.exact());
            shares.push((*size, share.value()));
        }
        let smallest = size_for(DETECTED, &shares).map_or_else(|| "–".to_owned(), |size| format!("{size:.3}"));
        println!("| {} | 95 % of motors from {smallest} on | | |", fault.id);
    }
    Ok(())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
