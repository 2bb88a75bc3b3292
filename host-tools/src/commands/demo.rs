//! `greyrig demo`: the whole story on built-in data, without hardware.

mod paper;

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::json;

use super::words;
use crate::anfis;
use crate::compare::{Comparison, compare};
use crate::diagnose::{Options, Progress, diagnose};
use crate::error::Result;
use crate::hybrid;
use crate::identify::{self, Identification, Method, Settings};
use crate::model::{DetectorEntry, Kind, Model, Origin};
use crate::monitor::calibrate::calibrate;
use crate::monitor::test::{Test, test};
use crate::output;
use crate::recording::Recording;
use crate::report::figures::error_falling;
use crate::report::{Report, Step, Table};
use crate::rig::{Motor, Setup};

/// What the motor hides; the seed chooses. The first is a motor whose physical model alone is off by the paper's 20 %.
const HIDDEN: [&[&str]; 8] = [
    &["saturation=0.42", "hysteresis"],
    &["saturation:langevin=0.4", "brush_drop=4"],
    &["inductance_saturation=0.6"],
    &["hysteresis=0.4", "channel_delay=150e-6"],
    &["saturation=0.3", "eddy_current=150e-6"],
    &["current_compression=0.07", "brush_drop=3"],
    &["windage_exponent=2.8", "remanence=0.15"],
    &["channel_delay=120e-6"],
];

/// The whole story on built-in data: simulate a motor that hides something, identify, compare,
/// see where it fails, learn what is missing, add it, watch the error fall, and judge motors by it.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig demo --report demo.html")]
pub struct Args {
    /// Report to write [default: greyrig-demo.html, with a number if that exists]
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Picture of the errors to write, SVG
    #[arg(long, value_name = "FILE.svg")]
    figure: Option<PathBuf>,
    /// What the motor hides, and the noise of the virtual rig
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Replace an existing report
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// One way to a model, judged on data that it has not seen.
struct Attempt {
    label: String,
    identification: Identification,
    held_out: Comparison,
}

/// Runs the command.
///
/// # Errors
/// A report that cannot be written, or an interrupt.
pub fn run(args: &Args) -> Result<ExitCode> {
    let report = args.report.clone().unwrap_or_else(unused_name);
    output::refuse_overwrite(&report, args.force)?;
    let say = |text: &str| if args.json { Ok(()) } else { output::print_line(text) };

    say("1. A motor on the virtual rig: a 1.4 kW vacuum-cleaner motor at 50 Hz that hides something.\n   \
         Training: an amplitude staircase of 24 s. Held out: a ramp of 20 s, which no fit sees.\n")?;
    let training = record("staircase", "staircase.csv", hidden(args.seed), args.seed)?;
    let held_out = record("ramp", "ramp.csv", hidden(args.seed), args.seed + 1)?;

    let attempt = |label: &str, method, effects: &[&str]| -> Result<Attempt> {
        let effects = effects.iter().map(|id| (*id).to_owned()).collect();
        let settings = Settings { method, effects, ..Settings::new(Kind::Universal) };
        let identification = identify::identify(&training, &settings)?;
        let held_out = compare(&identification.model, &held_out)?;
        Ok(Attempt { label: label.to_owned(), identification, held_out })
    };
    let mut attempts =
        vec![attempt("least squares", Method::LeastSquares, &[])?, attempt("output error", Method::OutputError, &[])?];
    say("2. The physical model by the paper's method, linear least squares in continuous time:\n")?;
    say(&words::parameters(&attempts[0].identification))?;
    say("\n3. The same model refined by output error, on the free run itself:\n")?;
    say(&words::parameters(&attempts[1].identification))?;
    for note in &attempts[1].identification.notes {
        say(&format!("note: {note}"))?;
    }
    say("\n4. Where it fails on the held-out ramp, in free run from the voltage alone:\n")?;
    say(&words::regions(&attempts[1].held_out))?;

    say("\n5. Which effect of the catalogue is missing:\n")?;
    let options = Options { settings: Settings::new(Kind::Universal), exclude: Vec::new(), candidates_refined: true };
    let bar = output::progress("diagnosis", 40);
    let diagnosis = diagnose(&training, &options, &|at| {
        if let Progress::Doing(what) = at {
            bar.set_message(what.to_owned());
        }
        bar.inc(1);
    })?;
    bar.finish_and_clear();
    say(&super::diagnose::candidates(&diagnosis))?;
    say(&format!("\nverdict: {}\n{}", super::diagnose::headline(&diagnosis), diagnosis.verdict.text))?;

    let found = &diagnosis.verdict.effects;
    for count in 1..=found.len() {
        attempts.push(attempt(&format!("+ {}", found[count - 1]), Method::OutputError, &found[..count])?);
    }
    let improved = &attempts[attempts.len() - 1];
    say("\n6. Added, and identified again:\n")?;
    say(&words::parameters(&improved.identification))?;
    say("\n7. The error falls, on the ramp that no fit has seen:\n")?;
    let mut table = words::table(&["model", "current", "speed"]);
    for attempt in &attempts {
        let esr = attempt.held_out.esr;
        table.add_row([attempt.label.clone(), words::percent(esr.current), words::percent(esr.speed)]);
    }
    let floor = improved.held_out.noise_floor;
    table.add_row(["noise floor".to_owned(), words::percent(floor.current), words::percent(floor.speed)]);
    say(&table.to_string())?;

    say("\n8. A learned correction (ANFIS) beside the model, and how much of the current it makes, from 1 s on:\n")?;
    let physical = &attempts[1].identification.model;
    let corrections = [
        ("physical model", corrected(physical, &training, &held_out)?),
        ("with what was missing", corrected(&improved.identification.model, &training, &held_out)?),
    ];
    let mut table = words::table(&["model", "current", "with correction", "black box"]);
    for (label, c) in &corrections {
        table.add_row([
            (*label).to_owned(),
            words::percent(c.before),
            words::percent(c.after),
            words::percent(c.share),
        ]);
    }
    say(&table.to_string())?;

    say("\n9. Ten healthy motors of the type (3 % scatter) teach the detector; then three others are judged:\n")?;
    let (detector, tests) = station(&corrections[1].1.model, hidden(args.seed))?;
    let residuals = of_the_type(&corrections[1].1.model, &detector, hidden(args.seed))?;
    let mut table = words::table(&["motor", "verdict", "why"]);
    for (label, test) in &tests {
        let why = test.alarms.first().map_or_else(String::new, |a| {
            format!("{} at {:.2} s, {:.0} times the limit: {}", a.cause, a.t_s, a.ratio, a.suspect)
        });
        table.add_row([(*label).to_owned(), test.verdict.words().to_owned(), why]);
    }
    say(&table.to_string())?;

    let steps: Vec<Step> = attempts.iter().map(|a| Step { label: a.label.clone(), esr: a.held_out.esr }).collect();
    if let Some(path) = &args.figure {
        output::write_file(path, args.force, |out| out.write_all(error_falling(&steps, floor).as_bytes()))?;
    }
    let files: Vec<Origin> = training.iter().chain(&held_out).map(Origin::from).collect();
    let [alone, with_correction] = &corrections[0].1.comparisons;
    let page = Report::new("A motor with a hidden effect")
        .lead(format!(
            "What the physical model alone explains of a motor that hides something, where it fails, what is missing, and \
             what is left once that is in it. Verdict: {}.",
            super::diagnose::headline(&diagnosis)
        ))
        .waterfall("Error-to-signal ratio on the held-out ramp", &steps, floor)
        .text("Why", diagnosis.verdict.text.clone())
        .table("Candidates", super::diagnose::candidates_in_report(&diagnosis))
        .table("A learned correction beside the model", correction_in_report(&corrections))
        .table("Motors judged", tests_in_report(&tests));
    paper::figures(page, alone, with_correction, &residuals)
        .comparison("Physical model alone", &attempts[1].held_out, &attempts[1].identification.model)
        .comparison("With what was missing", &improved.held_out, &improved.identification.model)
        .recordings(&files)
        .fact("Command", format!("greyrig demo --seed {}", args.seed))
        .write(&report, args.force)?;
    say(&format!("\nThe motor did hide: {}.\n\nreport: {}", hidden(args.seed).join(" "), report.display()))?;

    if args.json {
        output::print_json(
            "demo",
            &files.iter().map(|f| f.file.clone()).collect::<Vec<_>>(),
            json!({
                "attempts": attempts.iter().map(|a| json!({
                    "method": a.label,
                    "parameters": a.identification.parameters,
                    "held_out": a.held_out.esr,
                })).collect::<Vec<_>>(),
                "noise_floor": floor,
                "where": attempts[1].held_out.regions,
                "hidden": hidden(args.seed),
                "verdict": diagnosis.verdict,
                "corrections": corrections.iter().map(|(label, c)| json!({
                    "model": label, "held_out_before": c.before, "held_out_after": c.after, "correction_share": c.share,
                })).collect::<Vec<_>>(),
                "motors": tests.iter().map(|(label, t)| json!({ "motor": label, "test": t })).collect::<Vec<_>>(),
                "report": report,
            }),
        )?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A model with a learned correction, and what that does for the current on data held out.
struct Corrected {
    model: Model,
    /// Without and with it.
    comparisons: [Comparison; 2],
    before: Option<f64>,
    after: Option<f64>,
    share: Option<f64>,
}

/// Begin of a recording that is neither learnt nor judged, s.
const BLANKING_S: f64 = 1.0;
/// The same for the station's test, which begins with a soft start, s.
const RUN_UP_S: f64 = 3.0;

fn corrected(model: &Model, training: &[Recording], held_out: &[Recording]) -> Result<Corrected> {
    let settings = hybrid::settings(anfis::Method::Varpro, 60);
    let (hybrid, _) = hybrid::train(model, training, BLANKING_S, &settings, &mut |_| ControlFlow::Continue(()))?;
    let judged: Vec<Recording> = held_out.iter().map(|r| super::train::without_start(r, BLANKING_S)).collect();
    let (before, after) = (compare(model, &judged)?, compare(&hybrid, &judged)?);
    let share = super::train::correction_share(&before, &after);
    Ok(Corrected {
        model: hybrid,
        before: before.esr.current,
        after: after.esr.current,
        share,
        comparisons: [before, after],
    })
}

fn correction_in_report(corrections: &[(&str, Corrected)]) -> Table {
    let row = |(label, c): &(&str, Corrected)| {
        vec![(*label).to_owned(), words::percent(c.before), words::percent(c.after), words::percent(c.share)]
    };
    Table {
        caption: "Error-to-signal ratio of the current on the held-out ramp from 1 s on, and the part of the current that the \
                  correction makes: the more is named, the less is black box"
            .to_owned(),
        columns: ["model", "current", "with correction", "black box"].map(str::to_owned).to_vec(),
        rows: corrections.iter().map(row).collect(),
    }
}

/// Limits from ten healthy motors, and the tests of three others.
fn station(model: &Model, hidden: &[&str]) -> Result<(DetectorEntry, Vec<(&'static str, Test)>)> {
    let motor = |seed: u64, fault: Option<&str>| -> Result<Recording> {
        let motor = Motor::sample_from_population(&Motor::universal(), 0.03, seed);
        let mut setup = Setup::new(Kind::Universal).profile("steady")?.seconds(7.0).seed(seed).motor(motor);
        for effect in hidden {
            setup = setup.effect(effect)?;
        }
        if let Some(fault) = fault {
            setup = setup.fault(fault)?;
        }
        Ok(setup.run()?.recording)
    };
    let healthy: Vec<Recording> = (1..=10).map(|seed| motor(seed, None)).collect::<Result<_>>()?;
    let (detector, _) = calibrate(model, &healthy, RUN_UP_S, &mut || ())?;
    let tests = [
        ("healthy", None),
        ("sparking brushes from 5 s on", Some("sparking=0.2@5")),
        ("bearing friction doubled from 5 s on", Some("bearing_friction=1@5")),
    ]
    .into_iter()
    .map(|(label, fault)| Ok((label, test(model, &detector, &motor(99, fault)?)?)))
    .collect::<Result<_>>()?;
    Ok((detector, tests))
}

/// The motor that the model is of, healthy and with brushes that spark from 5 s on: the paper's case, in which no scatter of the
/// lot hides the residual.
fn of_the_type(model: &Model, detector: &DetectorEntry, hidden: &[&str]) -> Result<[Test; 2]> {
    let run = |fault: Option<&str>| -> Result<Test> {
        let mut setup = Setup::new(Kind::Universal).profile("steady")?.seconds(7.0).seed(99);
        for effect in hidden {
            setup = setup.effect(effect)?;
        }
        if let Some(fault) = fault {
            setup = setup.fault(fault)?;
        }
        test(model, detector, &setup.run()?.recording)
    };
    Ok([run(None)?, run(Some("sparking=0.2@5"))?])
}

fn tests_in_report(tests: &[(&str, Test)]) -> Table {
    let row = |(label, t): &(&str, Test)| {
        let why = t.alarms.first().map_or_else(String::new, |a| {
            format!("{} at {:.2} s, {:.0} times the limit: {}", a.cause, a.t_s, a.ratio, a.suspect)
        });
        vec![(*label).to_owned(), t.verdict.words().to_owned(), why]
    };
    Table {
        caption: "Other motors of the type, judged by limits from ten healthy ones".to_owned(),
        columns: ["motor", "verdict", "why"].map(str::to_owned).to_vec(),
        rows: tests.iter().map(row).collect(),
    }
}

/// What the motor of a seed hides.
fn hidden(seed: u64) -> &'static [&'static str] {
    HIDDEN[(seed.saturating_sub(1) % HIDDEN.len() as u64) as usize]
}

fn record(profile: &str, name: &str, hidden: &[&str], seed: u64) -> Result<Vec<Recording>> {
    let mut setup = Setup::new(Kind::Universal).profile(profile)?.seed(seed);
    for effect in hidden {
        setup = setup.effect(effect)?;
    }
    let mut recording = setup.run()?.recording;
    recording.path = name.into();
    Ok(vec![recording])
}

/// A name that no file has yet.
fn unused_name() -> PathBuf {
    (1..)
        .map(
            |n| {
                if n == 1 {
                    PathBuf::from("greyrig-demo.html")
                } else {
                    PathBuf::from(format!("greyrig-demo-{n}.html"))
                }
            },
        )
        .find(|path| !path.exists())
        .unwrap_or_default()
}
