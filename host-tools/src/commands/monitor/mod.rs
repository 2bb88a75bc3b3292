//! `greyrig monitor`: the detector, on recordings or on line.

mod live;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde_json::{Map, Value, json};

use super::answer::Answer as Answering;
use super::input;
use super::paint::{STRONG, painted};
use super::terminal::Terminal;
use super::words;
use crate::answers::monitor::{self, Answer, Request};
use crate::answers::next::{CommandLine, Files};
use crate::commands::stdout;
use crate::error::{Error, Result};
use crate::journal::{self, Journal};
use crate::model::{Model, Origin};
use crate::monitor::test::{Outcome, Test};
use crate::output;
use crate::recording::MapArgs;

/// Exit code of a motor that fails its test.
const FAILED: u8 = 1;
/// Exit code where no verdict is possible.
const NO_VERDICT: u8 = 4;
/// First line of the results.
const RESULTS: &str = "recording,serial,verdict,t_s,kind,suspect,ratio,reason";

/// Judges motors, on recordings of one run each or over the link: pass, fail or cannot judge.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  greyrig monitor motor-17.csv --model station.toml --report motor-17.html --results today.csv\n  \
    greyrig monitor --port /dev/ttyACM0 --model station.toml --serial 17 --results today.csv\n\n\
    Over the link the test begins when the supply is switched on, and ends after --seconds or when it has been switched off.\n\
    Exit code: 0 all motors pass, 1 a motor fails, 4 a motor cannot be judged, 3 trouble with the link, 130 after Ctrl-C."
)]
pub struct Args {
    /// Recordings of one motor type, in any supported format
    #[arg(required_unless_present = "port", conflicts_with = "port", value_name = "RUN")]
    recordings: Vec<PathBuf>,
    #[command(flatten)]
    map: MapArgs,
    /// Test a motor over the link: a serial device, a pseudo-terminal, or tcp:HOST:PORT
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// File in which a virtual board publishes its time (`greyrig board --clock`): time-outs follow it, not real time
    #[arg(long, value_name = "FILE")]
    clock: Option<PathBuf>,
    /// Length of a test over the link, s
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Serial number of the motor that is tested, where its recording does not tell it (# serial:)
    #[arg(long, value_name = "NUMBER")]
    serial: Option<String>,
    /// Recording of a test over the link to write: .csv or .parquet
    #[arg(long, value_name = "RUN")]
    out: Option<PathBuf>,
    /// Model file with the detector's limits, from `greyrig calibrate`
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Pressure of the air, hPa, where the recording does not tell it (# air_pressure_hpa:)
    #[arg(long, value_name = "HPA")]
    air_hpa: Option<f64>,
    /// Temperature of the motor, °C, where the recording does not tell it (column temp_c)
    #[arg(long, value_name = "C", allow_negative_numbers = true)]
    temp_c: Option<f64>,
    /// Motor type that is being tested; a model of another type is refused
    #[arg(long = "type", value_name = "NAME")]
    motor: Option<String>,
    /// File to which a line for each motor is added
    #[arg(long, value_name = "FILE.csv")]
    results: Option<PathBuf>,
    #[command(flatten)]
    answer: Answering,
}

/// Runs the command.
///
/// # Errors
/// A model without limits or of another type, recordings that cannot be used, a file that cannot be written, trouble
/// with the link.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    for path in args.answer.report.iter().chain(&args.out) {
        output::refuse_overwrite(path, args.answer.force)?;
    }
    if let Some(path) = &args.results {
        journal::check(path, RESULTS)?;
    }
    let model = Model::load(&args.model)?;
    let request = request(args);
    request.check_model(&model)?;
    let detector = model.limits(&args.model)?;
    let judged = match &args.port {
        Some(port) => live::run(args, &request, port, &model, detector, terminal)?,
        None => replayed(args, &request, &model, terminal)?,
    };
    let tests = &judged.tests;
    let worst = monitor::worst(tests);
    if let Some(path) = &args.answer.report {
        monitor::report(tests, detector, &judged.files).write(path, args.answer.force)?;
        eprintln!("report: {}", path.display());
    }
    if args.answer.json {
        let names: Vec<String> = args.recordings.iter().map(|p| p.display().to_string()).collect();
        let told = monitor::told(&names, tests, Some(&args.model), judged.more)?;
        stdout::print_as_it_is(&told.to_string())?;
    } else {
        for test in tests {
            print(test)?;
        }
        stdout::print_next(args.next(tests).as_ref())?;
    }
    Ok(match worst {
        Outcome::Pass => ExitCode::SUCCESS,
        Outcome::Fail => ExitCode::from(FAILED),
        Outcome::CannotJudge => ExitCode::from(NO_VERDICT),
    })
}

impl Args {
    /// The command that goes on: where the first motor that fails is off, or what is wrong with the recording of one
    /// that cannot be judged.
    fn next(&self, tests: &[Test]) -> Option<CommandLine> {
        let worst = monitor::worst(tests);
        let command = match worst {
            Outcome::Pass => return None,
            Outcome::Fail => CommandLine::new("compare"),
            Outcome::CannotJudge => CommandLine::new("check"),
        };
        let place = tests.iter().position(|test| test.verdict == worst)?;
        let file = if self.port.is_some() { self.out.as_ref()? } else { self.recordings.get(place)? };
        let files = Files { recordings: vec![file.clone()], map: self.map.map.clone() };
        let model = (worst == Outcome::Fail).then(|| self.model.display());
        Some(files.again(command).option("--model", model))
    }
}

/// Motors that have been judged.
struct Judged {
    tests: Vec<Test>,
    files: Vec<Origin>,
    /// What else the JSON object tells.
    more: Map<String, Value>,
}

fn request(args: &Args) -> Request {
    let Args { motor, serial, air_hpa, temp_c, .. } = args;
    Request { motor: motor.clone(), serial: serial.clone(), air_hpa: *air_hpa, temp_c: *temp_c }
}

fn replayed(args: &Args, request: &Request, model: &Model, terminal: &Terminal) -> Result<Judged> {
    only_over_the_link(args)?;
    let ctx = &terminal.context();
    let given = request.question(model, input::load(&args.recordings, &args.map, ctx)?)?;
    input::tell(&given.findings);
    let mut each = |test: &Test| note(args.results.as_deref(), test, terminal);
    let Answer { given, tests, .. } = request.answer(model, &args.model, given, ctx, &mut each)?;
    let more = Map::from_iter([("data_findings".to_owned(), json!(given.findings))]);
    Ok(Judged { tests, files: given.origins(), more })
}

/// Refuses what a replay has no use for.
fn only_over_the_link(args: &Args) -> Result<()> {
    let given =
        [("--clock", args.clock.is_some()), ("--seconds", args.seconds.is_some()), ("--out", args.out.is_some())];
    match given.iter().find(|(_, given)| *given) {
        Some((name, _)) => {
            Err(Error::usage(format!("{name} is for a test over the link"), "give --port, or leave it out"))
        }
        None => Ok(()),
    }
}

/// Adds a line to the results, if they are kept, and has it on the disk before the next motor.
fn note(results: Option<&Path>, test: &Test, terminal: &Terminal) -> Result<()> {
    let Some(path) = results else { return Ok(()) };
    let first = test.alarms.first();
    let line = [
        journal::cell(&test.recording),
        journal::cell(test.serial.as_deref().unwrap_or("")),
        test.verdict.words().to_owned(),
        first.map_or_else(String::new, |a| format!("{:.3}", a.t_s)),
        first.map_or_else(String::new, |a| a.kind.to_owned()),
        first.map_or_else(String::new, |a| journal::cell(&a.suspect)),
        first.map_or_else(String::new, |a| format!("{:.3}", a.ratio)),
        journal::cell(&test.reasons.join("; ")),
    ];
    let mut journal = terminal.watching("results", |ctx| Journal::open(path, RESULTS, ctx))?;
    if let Some(warning) = journal.warning() {
        eprintln!("greyrig: {warning}");
    }
    journal.append(&[line.join(",")])
}

fn print(test: &Test) -> Result<()> {
    stdout::print_line(&format!(
        "{}: {} ({} of {} periods judged)",
        test.recording,
        painted(words::style_of(test.verdict), test.verdict.words()),
        test.periods[0],
        test.periods[1]
    ))?;
    for reason in &test.reasons {
        stdout::print_line(&format!("  {reason}"))?;
    }
    for alarm in test.alarms.iter().take(5) {
        let suspect = if alarm.suspect.is_empty() { String::new() } else { format!(", suspect: {}", alarm.suspect) };
        stdout::print_line(&format!(
            "  alarm from {:.2} to {:.2} s: {}, {} at {:.1} times the limit{suspect}",
            alarm.t_s, alarm.until_s, alarm.kind, alarm.cause, alarm.ratio
        ))?;
    }
    if test.alarms.len() > 5 {
        stdout::print_line(&format!("  and {} more alarms", test.alarms.len() - 5))?;
    }
    if let Some(first) = test.findings.first() {
        stdout::print_line(&format!(
            "  fault: {} ({}), {:.1} times the limit",
            painted(STRONG, &first.text),
            first.kind,
            first.ratio
        ))?;
        for other in test.findings.iter().skip(1).filter(|other| other.as_likely) {
            stdout::print_line(&format!("     or: {} ({})", other.text, other.kind))?;
        }
        stdout::print_line(&format!("  on the bench: {}", first.look_at))?;
    }
    for (k, suspect) in test.suspects.iter().enumerate() {
        stdout::print_line(&format!(
            "  {} {} ({}) explains {:.0} % of the deviations",
            if k == 0 { "suspect:" } else { "     or:" },
            suspect.text,
            suspect.kind,
            100.0 * suspect.explains
        ))?;
    }
    Ok(())
}
