//! `greyrig demo`: the whole story on built-in data, without hardware.

use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::json;

use super::words;
use crate::compare::{Comparison, compare};
use crate::error::Result;
use crate::identify::{self, Identification, Method, Settings};
use crate::model::{Kind, Origin};
use crate::output;
use crate::recording::Recording;
use crate::report::figures::error_falling;
use crate::report::{Report, Step};
use crate::rig::Setup;

/// Share of the flux that the hidden saturation takes at nominal peak current: where the physical model alone is off by
/// the paper's 20 %.
const SATURATION: &str = "saturation=0.42";

/// The whole story on built-in data: simulate a motor with a hidden effect, identify, compare, see where it fails.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig demo --report demo.html")]
pub struct Args {
    /// Report to write [default: greyrig-demo.html, with a number if that exists]
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Picture of the errors to write, SVG
    #[arg(long, value_name = "FILE.svg")]
    figure: Option<PathBuf>,
    /// Noise and motor of the virtual rig
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
    label: &'static str,
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

    say("1. A motor on the virtual rig: a 1.4 kW vacuum-cleaner motor at 50 Hz with a hidden effect.\n   \
         Training: an amplitude staircase of 24 s. Held out: a ramp of 20 s, which no fit sees.\n")?;
    let training = record("staircase", "staircase.csv", args.seed)?;
    let held_out = record("ramp", "ramp.csv", args.seed + 1)?;

    let attempt = |label, method, effects: &[&str]| -> Result<Attempt> {
        let effects = effects.iter().map(|id| (*id).to_owned()).collect();
        let settings = Settings { method, effects, ..Settings::new(Kind::Universal) };
        let identification = identify::identify(&training, &settings)?;
        let held_out = compare(&identification.model, &held_out)?;
        Ok(Attempt { label, identification, held_out })
    };
    let attempts = [
        attempt("least squares", Method::LeastSquares, &[])?,
        attempt("output error", Method::OutputError, &[])?,
        attempt("+ saturation", Method::OutputError, &["saturation"])?,
    ];
    let [first, last, improved] = &attempts;

    say("2. The physical model by the paper's method, linear least squares in continuous time:\n")?;
    say(&words::parameters(&first.identification))?;
    say("\n3. The same model refined by output error, on the free run itself:\n")?;
    say(&words::parameters(&last.identification))?;
    for note in &last.identification.notes {
        say(&format!("note: {note}"))?;
    }
    say("\n4. Where it fails on the held-out ramp, in free run from the voltage alone:\n")?;
    say(&words::regions(&last.held_out))?;
    say("\n5. Saturation of the flux added, and identified again:\n")?;
    say(&words::parameters(&improved.identification))?;
    say("\n6. The error falls, on the ramp that no fit has seen:\n")?;
    let mut table = words::table(&["model", "current", "speed"]);
    for attempt in &attempts {
        let esr = attempt.held_out.esr;
        table.add_row([attempt.label.to_owned(), words::percent(esr.current), words::percent(esr.speed)]);
    }
    let floor = improved.held_out.noise_floor;
    table.add_row(["noise floor".to_owned(), words::percent(floor.current), words::percent(floor.speed)]);
    say(&table.to_string())?;

    let steps: Vec<Step> = attempts.iter().map(|a| Step { label: a.label.to_owned(), esr: a.held_out.esr }).collect();
    if let Some(path) = &args.figure {
        output::write_file(path, args.force, |out| out.write_all(error_falling(&steps, floor).as_bytes()))?;
    }
    let files: Vec<Origin> = training.iter().chain(&held_out).map(Origin::from).collect();
    Report::new("A motor with a hidden effect")
        .lead("What the physical model alone explains of a motor whose flux saturates, where it fails, and what is left once saturation is in it.")
        .waterfall("Error-to-signal ratio on the held-out ramp", &steps, floor)
        .comparison("Physical model alone", &last.held_out, &last.identification.model)
        .comparison("With saturation", &improved.held_out, &improved.identification.model)
        .recordings(&files)
        .fact("Command", format!("greyrig demo --seed {}", args.seed))
        .write(&report, args.force)?;
    say(&format!(
        "\nWhat is left above the noise floor is a second hidden effect, hysteresis.\n\nreport: {}",
        report.display()
    ))?;

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
                "where": last.held_out.regions,
                "report": report,
            }),
        )?;
    }
    Ok(ExitCode::SUCCESS)
}

fn record(profile: &str, name: &str, seed: u64) -> Result<Vec<Recording>> {
    let mut recording = Setup::new(Kind::Universal)
        .effect(SATURATION)?
        .effect("hysteresis")?
        .profile(profile)?
        .seed(seed)
        .run()?
        .recording;
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
