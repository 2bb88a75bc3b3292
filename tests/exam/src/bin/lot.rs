//! `cargo xtask lot`: false alarms and detection on a virtual production lot.

use clap::Parser;
use greyrig_exam::lot::{FAULTS, motor, stations};
use greyrig_exam::score::Share;
use greyrig_host::monitor::test::{Outcome, Test};
use rayon::prelude::*;

/// The detector on a virtual production lot.
#[derive(Debug, Parser)]
struct Args {
    /// Healthy motors to judge
    #[arg(long, default_value_t = 3000)]
    healthy: u64,
    /// Faulty motors for each fault and size
    #[arg(long, default_value_t = 60)]
    faulty: u64,
}

/// What became of a faulty motor at one station.
struct Seen {
    failed: bool,
    delay_s: f64,
    kind: &'static str,
    ratio: f64,
}

fn main() -> greyrig_host::error::Result<()> {
    let args = Args::parse();
    let stations = stations()?;
    println!("## Healthy motors\n\n| model | false alarms | cannot judge |\n| --- | --- | --- |");
    let verdicts: Vec<Vec<Outcome>> = (0..args.healthy)
        .into_par_iter()
        .filter_map(|seed| {
            if seed % 100 == 0 {
                eprintln!("healthy {seed}/{}", args.healthy);
            }
            let (recording, _) = motor(seed, None).ok()?;
            stations.iter().map(|s| s.test(&recording).ok().flatten().map(|t| t.verdict)).collect()
        })
        .collect();
    for (k, station) in stations.iter().enumerate() {
        let of = |what: Outcome| Share::of(&verdicts, |v: &Vec<Outcome>| v[k] == what);
        println!("| {} | {} | {} |", station.name, of(Outcome::Fail), of(Outcome::CannotJudge));
    }
    println!("\n## Faults at a random time\n");
    println!("| fault | size | model | detected | median delay, s | right place | median ratio to the limit |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    for fault in FAULTS {
        for (n, size) in fault.sizes.iter().enumerate() {
            eprintln!("{} {size}", fault.id);
            let seen: Vec<Vec<Seen>> = (0..args.faulty)
                .into_par_iter()
                .filter_map(|k| {
                    let (recording, onset) = motor(2_000_000 + 1000 * n as u64 + k, Some((fault.id, *size))).ok()?;
                    let look = |t: Test| {
                        let alarm = t.alarms.iter().find(|a| a.until_s >= onset);
                        Seen {
                            failed: alarm.is_some(),
                            delay_s: alarm.map_or(f64::NAN, |a| (a.t_s - onset).max(0.0)),
                            kind: alarm.map_or("", |a| a.kind),
                            ratio: alarm.map_or(0.0, |a| a.ratio),
                        }
                    };
                    stations.iter().map(|s| s.test(&recording).ok().flatten().map(look)).collect()
                })
                .collect();
            for (k, station) in stations.iter().enumerate() {
                let here: Vec<&Seen> = seen.iter().map(|s| &s[k]).collect();
                let found: Vec<&&Seen> = here.iter().filter(|s| s.failed).collect();
                println!(
                    "| {} | {size} | {} | {} | {:.2} | {} | {:.1} |",
                    fault.id,
                    station.name,
                    Share::of(&here, |s| s.failed),
                    median(found.iter().map(|s| s.delay_s).collect()),
                    Share::of(&found, |s| s.kind == fault.kind),
                    median(found.iter().map(|s| s.ratio).collect()),
                );
            }
        }
    }
    Ok(())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
