//! `greyrig monitor`: the on-line detector, replayed.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde_json::json;

use super::input::Input;
use crate::error::{Error, Result};
use crate::model::{DetectorEntry, Model, Origin};
use crate::monitor::replay::Row;
use crate::monitor::test::{Outcome, Test, test};
use crate::output;
use crate::report::{Curves, Report, Table};

/// Exit code of a motor that fails its test.
const FAILED: u8 = 1;
/// Exit code where no verdict is possible.
const NO_VERDICT: u8 = 4;

/// Judges motors, one run each: pass, fail or cannot judge.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  greyrig monitor motor-17.csv --model station.toml --report motor-17.html --results today.csv\n\n\
    Exit code: 0 all motors pass, 1 a motor fails, 4 a motor cannot be judged."
)]
pub struct Args {
    #[command(flatten)]
    input: Input,
    /// Model file with the detector's limits, from `greyrig calibrate`
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Motor type that is being tested; a model of another type is refused
    #[arg(long = "type", value_name = "NAME")]
    motor: Option<String>,
    /// File to which a line for each motor is added
    #[arg(long, value_name = "FILE.csv")]
    results: Option<PathBuf>,
    /// Report to write, one HTML file that needs no network
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Replace existing files
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// A model without limits or of another type, recordings that cannot be used, a file that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    if let Some(path) = &args.report {
        output::refuse_overwrite(path, args.force)?;
    }
    let model = Model::load(&args.model)?;
    if let Some(wanted) = args.motor.as_deref().filter(|wanted| model.motor.as_deref() != Some(*wanted)) {
        return Err(Error::usage(
            format!("the model is of motor type {:?}, not {wanted:?}", model.motor.as_deref().unwrap_or("unknown")),
            "take the model of the type that is being tested",
        ));
    }
    let Some(detector) = &model.detector else {
        return Err(Error::usage(
            format!("{} holds no limits of the detector", args.model.display()),
            "learn them from healthy motors: greyrig calibrate RUN… --model MODEL --out MODEL2",
        ));
    };
    let recordings = args.input.load()?;
    let mut tests = Vec::new();
    for recording in &recordings {
        output::check_interrupt()?;
        crate::compare::same_type(&model, recording)?;
        let test = test(&model, detector, recording)?;
        if let Some(path) = &args.results {
            add_line(path, &test)?;
        }
        tests.push(test);
    }
    let worst = tests.iter().map(|t| t.verdict).max().unwrap_or(Outcome::CannotJudge);
    if let Some(path) = &args.report {
        let files: Vec<Origin> = recordings.iter().map(Origin::from).collect();
        report(&tests, detector, &files).write(path, args.force)?;
        eprintln!("report: {}", path.display());
    }
    if args.json {
        let alarms: Vec<_> = tests.iter().flat_map(|t| &t.alarms).collect();
        let body = json!({ "verdict": worst, "alarms": alarms, "runs": tests, "model": args.model });
        output::print_json("monitor", &args.input.names(), body)?;
    } else {
        for test in &tests {
            print(test)?;
        }
    }
    Ok(match worst {
        Outcome::Pass => ExitCode::SUCCESS,
        Outcome::Fail => ExitCode::from(FAILED),
        Outcome::CannotJudge => ExitCode::from(NO_VERDICT),
    })
}

/// Adds a line to the results, and has it on the disk before the next motor.
fn add_line(path: &Path, test: &Test) -> Result<()> {
    let failed = |e: std::io::Error| Error::io(path, e);
    let new = !path.exists();
    let mut file = OpenOptions::new().create(true).append(true).open(path).map_err(failed)?;
    let first = test.alarms.first();
    let field = |text: &str| {
        if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
    };
    let mut line = String::new();
    if new {
        line += "recording,serial,verdict,t_s,kind,suspect,ratio,reason\n";
    }
    line += &[
        field(&test.recording),
        field(test.serial.as_deref().unwrap_or("")),
        test.verdict.words().to_owned(),
        first.map_or_else(String::new, |a| format!("{:.3}", a.t_s)),
        first.map_or_else(String::new, |a| a.kind.to_owned()),
        first.map_or_else(String::new, |a| field(&a.suspect)),
        first.map_or_else(String::new, |a| format!("{:.3}", a.ratio)),
        field(&test.reasons.join("; ")),
    ]
    .join(",");
    line.push('\n');
    file.write_all(line.as_bytes()).and_then(|()| file.sync_all()).map_err(failed)
}

fn print(test: &Test) -> Result<()> {
    output::print_line(&format!(
        "{}: {} ({} of {} periods judged)",
        test.recording,
        test.verdict.words(),
        test.periods[0],
        test.periods[1]
    ))?;
    for reason in &test.reasons {
        output::print_line(&format!("  {reason}"))?;
    }
    for alarm in test.alarms.iter().take(5) {
        let suspect = if alarm.suspect.is_empty() { String::new() } else { format!(", suspect: {}", alarm.suspect) };
        output::print_line(&format!(
            "  alarm from {:.2} to {:.2} s: {}, {} at {:.1} times the limit{suspect}",
            alarm.t_s, alarm.until_s, alarm.kind, alarm.cause, alarm.ratio
        ))?;
    }
    if test.alarms.len() > 5 {
        output::print_line(&format!("  and {} more alarms", test.alarms.len() - 5))?;
    }
    for (k, suspect) in test.suspects.iter().enumerate() {
        output::print_line(&format!(
            "  {} {} ({}) explains {:.0} % of the deviations",
            if k == 0 { "suspect:" } else { "     or:" },
            suspect.text,
            suspect.kind,
            100.0 * suspect.explains
        ))?;
    }
    Ok(())
}

fn report<'a>(tests: &[Test], detector: &DetectorEntry, files: &[Origin]) -> Report<'a> {
    let rows = tests
        .iter()
        .map(|t| {
            let alarm = t.alarms.iter().max_by(|a, b| a.ratio.total_cmp(&b.ratio));
            vec![
                t.recording.clone(),
                t.serial.clone().unwrap_or_default(),
                t.verdict.words().to_owned(),
                alarm.map_or_else(|| t.reasons.join("; "), |a| format!("{}, {:.1} times the limit", a.cause, a.ratio)),
                alarm.map_or_else(String::new, |a| a.suspect.clone()),
            ]
        })
        .collect();
    let mut report = Report::new("Test of motors").table(
        "Verdicts",
        Table {
            caption: format!("Limits from {} healthy runs", detector.runs),
            columns: ["recording", "serial", "verdict", "why", "suspect"].map(str::to_owned).to_vec(),
            rows,
        },
    );
    for test in tests.iter().take(12) {
        report = report.curves(format!("{}: {}", test.recording, test.verdict.words()), ratios(test, detector));
    }
    report.recordings(files)
}

/// What is watched, over its limit, in time.
fn ratios(test: &Test, detector: &DetectorEntry) -> Curves {
    let of = |get: &dyn Fn(&Row) -> f64| test.replay.judged().map(|r| (r.t_s, get(r))).collect::<Vec<_>>();
    let over = |x: f32, limit: f64| if limit > 0.0 { f64::from(x) / limit } else { 0.0 };
    let beyond = |x: f32, [centre, half]: [f64; 2]| if half > 0.0 { (f64::from(x) - centre).abs() / half } else { 0.0 };
    Curves {
        caption: "What is watched, as a share of its limit; above 1 it calls".to_owned(),
        x: "time, s".to_owned(),
        y: "ratio to the limit".to_owned(),
        logarithmic: true,
        curves: vec![
            ("error of the current".to_owned(), of(&|r| over(r.features.current, detector.current))),
            ("error of the speed".to_owned(), of(&|r| over(r.features.speed, detector.speed))),
            ("current above 1 kHz".to_owned(), of(&|r| over(r.features.sparking, detector.sparking))),
            ("abrupt change of the current".to_owned(), of(&|r| over(r.jumps[0].abs(), detector.current_jump))),
            (
                "deviation of the current".to_owned(),
                of(&|r| beyond(r.features.current_deviation, detector.current_deviation)),
            ),
            (
                "deviation of the speed".to_owned(),
                of(&|r| beyond(r.features.speed_deviation, detector.speed_deviation)),
            ),
        ],
    }
}
