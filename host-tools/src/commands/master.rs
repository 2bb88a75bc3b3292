//! `greyrig master`: is the rig still what it was?

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde_json::json;
use sha2::{Digest, Sha256};

use super::answer::Answer;
use super::input::{self, Input};
use super::paint::{BAD, painted};
use super::stdout;
use super::table::{Column, Table as Shown};
use super::terminal::Terminal;
use super::words;
use crate::answers::next::{CommandLine, Files};
use crate::check::{self, Purpose};
use crate::error::{Error, Result};
use crate::model::{DetectorEntry, Model, Origin};
use crate::monitor::calibrate::by_motor;
use crate::monitor::drift::{FALSE_ALARMS, FEWEST, WEIGHT};
use crate::monitor::golden::{self, Chart, History, Run, Study};
use crate::monitor::test::{Outcome, Test, test};
use crate::output;
use crate::recording::Recording;
use crate::report::{Curves, Report, Table};

/// Exit code of a golden motor that fails, and of a rig that has drifted.
const FAILED: u8 = 1;
/// Exit code where no verdict is possible.
const NO_VERDICT: u8 = 4;

/// Tests the golden motor at the start of a shift: the rig's verdict on it, drift against its history, repeatability.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  greyrig master golden-1.csv golden-2.csv golden-3.csv --model station.toml --history golden.csv\n  \
    greyrig master study-*.csv --model station.toml --study\n\n\
    Exit code: 0 the motor passes and nothing has drifted, 1 it fails or the rig has drifted, 4 it cannot be judged."
)]
pub struct Args {
    #[command(flatten)]
    input: Input,
    /// Model file with the detector's limits, from `greyrig calibrate`
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// History of the golden motor, to which a line for each run is added; without it nothing is said about drift
    #[arg(long, value_name = "FILE.csv", conflicts_with = "study")]
    history: Option<PathBuf>,
    /// Checks at the begin of the history that teach what is usual
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u64).range(FEWEST as u64..=1000))]
    baseline: u64,
    /// Gauge study: several motors (# serial:), each run as often, perhaps on several rigs (# rig:) or by several
    /// people (# operator:)
    #[arg(long)]
    study: bool,
    #[command(flatten)]
    answer: Answer,
}

impl Args {
    /// The command that goes on: where a motor that fails is off, or the same with a history.
    fn next(&self, tests: &[Test]) -> Option<CommandLine> {
        let files = self.input.files();
        let model = |line: CommandLine| line.option("--model", [self.model.display()]);
        if let Some(place) = tests.iter().position(|test| test.verdict == Outcome::Fail) {
            let one = Files { recordings: vec![files.recordings.get(place)?.clone()], ..files };
            return Some(model(one.again(CommandLine::new("compare"))));
        }
        let master = || model(files.again(CommandLine::new("master"))).option("--history", ["golden.csv"]);
        (self.history.is_none() && !self.study).then(master)
    }
}

/// Runs the command.
///
/// # Errors
/// A model without limits, recordings that cannot be used or are of different motors, a file that cannot be read or
/// written.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    if let Some(path) = &args.answer.report {
        output::refuse_overwrite(path, args.answer.force)?;
    }
    args.history.as_deref().map_or(Ok(()), History::check)?;
    let model = Model::load(&args.model)?;
    let detector = model.limits(&args.model)?;
    let mut recordings = args.input.load(&terminal.context())?;
    if !args.study && by_motor(&recordings).len() > 1 && recordings.iter().any(|r| r.metadata().contains_key("serial"))
    {
        return Err(Error::usage(
            "the recordings are of several motors",
            "give runs of the golden motor only (# serial: in the file), or --study for a gauge study",
        ));
    }
    check::mask(&mut recordings, Purpose::Detection);
    let mut tests = Vec::new();
    for recording in &recordings {
        crate::compare::same_type(&model, recording)?;
        tests.push(test(&model, detector, recording, &terminal.context())?);
    }
    let verdict = tests.iter().map(|t| t.verdict).max().unwrap_or(Outcome::CannotJudge);
    let shift = if args.study {
        Shift { study: Some(study(&recordings, &tests, detector)?), ..Shift::default() }
    } else {
        golden_motor(args, &model, detector, &recordings, &tests, terminal)?
    };
    let findings = input::question(&mut recordings, model.kind, Purpose::Detection);
    // Of a motor that does not pass nothing can be said about the rig.
    let drifted = verdict == Outcome::Pass && shift.charts.iter().any(Chart::drifted);
    if let Some(path) = &args.answer.report {
        let files: Vec<Origin> = recordings.iter().map(Origin::from).collect();
        page(&tests, &shift, drifted).recordings(&files).write(path, args.answer.force)?;
        eprintln!("report: {}", path.display());
    }
    if args.answer.json {
        let charts: Vec<_> = shift.charts.iter().map(|c| json!({ "chart": c, "drifted": c.drifted() })).collect();
        stdout::print_json(
            "master",
            &args.input.names(),
            json!({
                "verdict": verdict, "drifted": drifted, "checks": shift.checks, "charts": charts, "study": shift.study,
                "false_alarms_per_check": FALSE_ALARMS, "runs": tests, "model": args.model,
                "data_findings": findings,
            }),
        )?;
    } else {
        print(args, &tests, &shift, drifted)?;
        stdout::print_next(args.next(&tests).as_ref())?;
    }
    Ok(match verdict {
        Outcome::Fail => ExitCode::from(FAILED),
        Outcome::CannotJudge => ExitCode::from(NO_VERDICT),
        Outcome::Pass if drifted => ExitCode::from(FAILED),
        Outcome::Pass => ExitCode::SUCCESS,
    })
}

/// What the rig has shown.
#[derive(Default)]
struct Shift {
    charts: Vec<Chart>,
    /// Checks of this motor with this model, this one included.
    checks: usize,
    study: Option<Vec<Study>>,
}

fn golden_motor(
    args: &Args,
    model: &Model,
    detector: &DetectorEntry,
    recordings: &[Recording],
    tests: &[Test],
    terminal: &Terminal,
) -> Result<Shift> {
    let digest = digest(model);
    let opened = |path: &Path| terminal.watching("history", |ctx| History::open(path, ctx));
    let mut history = args.history.as_deref().map(opened).transpose()?;
    if let Some(warning) = history.as_ref().and_then(History::warning) {
        eprintln!("greyrig: {warning}");
    }
    for (path, line) in args.history.iter().zip(&history).flat_map(|(path, h)| h.torn.iter().map(move |n| (path, n))) {
        eprintln!("greyrig: {}:{line}: not a whole line, left out", path.display());
    }
    let before = history.as_ref().map_or_else(Vec::new, |h| h.runs.clone());
    let check = before.iter().map(|r| r.check).max().unwrap_or(0) + 1;
    let runs: Vec<Run> = recordings
        .iter()
        .zip(tests)
        .map(|(r, t)| Run::new(check, r.metadata().get("date").map_or("", String::as_str), &digest, t))
        .collect();
    if let Some(history) = &mut history {
        history.append(&runs)?;
    }
    let serial = &runs[0].serial;
    let others = before.iter().filter(|r| r.serial != *serial || r.model != digest).count();
    if others > 0 {
        eprintln!("greyrig: {others} runs of the history are of another motor or another model, and do not count");
    }
    let same: Vec<Run> =
        before.into_iter().filter(|r| r.serial == *serial && r.model == digest).chain(runs.clone()).collect();
    let charts = golden::charts(&same, args.baseline as usize, detector);
    Ok(Shift { checks: charts[0].checks.len(), charts, study: None })
}

/// Of all that makes figures: the motor with its effects, filter, correction; not of limits and provenance.
fn digest(model: &Model) -> String {
    let bare = Model { detector: None, provenance: crate::model::Provenance::default(), ..model.clone() };
    let text = serde_json::to_string(&bare).unwrap_or_default();
    Sha256::digest(text.as_bytes()).iter().take(4).map(|byte| format!("{byte:02x}")).collect()
}

/// The runs as motors × appraisers × repetitions.
fn study(recordings: &[Recording], tests: &[Test], detector: &DetectorEntry) -> Result<Vec<Study>> {
    let appraiser = |r: &Recording| r.metadata().get("operator").or_else(|| r.metadata().get("rig")).cloned();
    let mut appraisers: Vec<Option<String>> = recordings.iter().map(appraiser).collect();
    appraisers.sort();
    appraisers.dedup();
    let cells: Vec<Vec<Vec<_>>> = by_motor(recordings)
        .iter()
        .map(|runs| {
            let figures = |k: &usize| Run::new(0, "", "", &tests[*k]).figures;
            let by =
                |a: &Option<String>| runs.iter().filter(|k| appraiser(&recordings[**k]) == *a).map(figures).collect();
            appraisers.iter().map(by).collect()
        })
        .collect();
    golden::study(&cells, detector).ok_or_else(|| {
        let counts: Vec<String> = cells.iter().flatten().map(|runs| runs.len().to_string()).collect();
        Error::usage(
            format!(
                "this is no balanced study: {} motors, {} rigs or people, runs {}",
                cells.len(),
                appraisers.len(),
                counts.join(" ")
            ),
            "give at least two motors (# serial:), each run equally often, twice or more, on each rig",
        )
    })
}

fn print(args: &Args, tests: &[Test], shift: &Shift, drifted: bool) -> Result<()> {
    for t in tests {
        let serial = t.serial.as_deref().map_or_else(String::new, |s| format!(", motor {s}"));
        let verdict = painted(words::style_of(t.verdict), t.verdict.words());
        stdout::print_line(&format!("{}{serial}: {verdict}", t.recording))?;
        for reason in &t.reasons {
            stdout::print_line(&format!("  {reason}"))?;
        }
        for alarm in t.alarms.iter().take(3) {
            stdout::print_line(&format!("  {} at {:.1} times the limit: {}", alarm.cause, alarm.ratio, alarm.suspect))?;
        }
    }
    if let Some(study) = &shift.study {
        stdout::print_line(&studied(study))?;
        return Ok(());
    }
    stdout::print_line(&charted(&shift.charts))?;
    if args.history.is_none() {
        return stdout::print_line("no --history: nothing is said about drift");
    }
    let baseline = args.baseline as usize;
    stdout::print_line(&if tests.iter().any(|t| t.verdict != Outcome::Pass) {
        "nothing is said about drift: the golden motor does not pass".to_owned()
    } else if drifted {
        let which: Vec<&str> = shift.charts.iter().filter(|c| c.drifted()).map(|c| c.figure).collect();
        let alarm = painted(BAD, "ALARM: the rig has drifted");
        format!("{alarm}: {}. Find out why before motors are judged", which.join(", "))
    } else if shift.checks <= baseline {
        format!("check {} of the {baseline} that teach what is usual: nothing is said about drift yet", shift.checks)
    } else {
        format!("no drift (a rig that has not drifted is called in at most {} % of checks)", 100.0 * FALSE_ALARMS)
    })
}

const CHARTED: [&str; 6] =
    ["figure", "this check", "usual", "check/limit", "average/limit", "run to run (1 σ), of tolerance"];

fn chart_rows(charts: &[Chart]) -> Vec<Vec<String>> {
    let row = |c: &Chart| {
        let last = c.points.last();
        let ratio = |x: Option<f64>| x.map_or_else(|| "–".to_owned(), |x| format!("{x:.2}"));
        vec![
            c.figure.to_owned(),
            c.checks.last().map_or_else(|| "–".to_owned(), |x| golden::told(c.figure, *x)),
            c.baseline.map_or_else(
                || "–".to_owned(),
                |b| format!("{} ± {}", golden::told(c.figure, b.mean), golden::told(c.figure, b.deviation)),
            ),
            ratio(last.map(|p| p.individual)),
            ratio(last.map(|p| p.average)),
            c.gauge.map_or_else(
                || "–".to_owned(),
                |g| {
                    let share = c.of_tolerance.map_or_else(String::new, |t| format!(", {:.1} %", 100.0 * t));
                    format!("{}{share}", golden::told(c.figure, g.repeatability))
                },
            ),
        ]
    };
    charts.iter().map(row).collect()
}

fn charted(charts: &[Chart]) -> String {
    in_terminal(CHARTED, chart_rows(charts))
}

const STUDIED: [&str; 7] =
    ["figure", "run to run", "rig to rig", "gauge R&R", "motor to motor", "of all scatter, of tolerance", "categories"];

fn study_rows(study: &[Study]) -> Vec<Vec<String>> {
    let row = |s: &Study| {
        let number = |x: f64| golden::told(s.figure, x);
        let g = &s.gauge;
        let tolerance = s.of_tolerance.map_or_else(String::new, |t| format!(", {:.1} %", 100.0 * t));
        vec![
            s.figure.to_owned(),
            number(g.repeatability),
            number(g.reproducibility),
            number(g.gauge),
            number(g.part),
            format!("{:.1} %{tolerance}", 100.0 * g.of_total()),
            g.categories().to_string(),
        ]
    };
    study.iter().map(row).collect()
}

fn studied(study: &[Study]) -> String {
    in_terminal(STUDIED, study_rows(study))
}

/// The figure's name, then numbers.
fn in_terminal<const N: usize>(columns: [&str; N], rows: Vec<Vec<String>>) -> String {
    let column = |title: &str| if title == "figure" { Column::text(title) } else { Column::figure(title) };
    let mut table = Shown::new(columns.map(column));
    table.rows(rows);
    table.to_string()
}

fn page<'a>(tests: &[Test], shift: &Shift, drifted: bool) -> Report<'a> {
    let rows = tests
        .iter()
        .map(|t| vec![t.recording.clone(), t.serial.clone().unwrap_or_default(), t.verdict.words().to_owned()])
        .collect();
    let columns = |names: &[&str]| names.iter().map(|s| (*s).to_owned()).collect();
    let mut report = Report::new(if drifted { "Golden motor: the rig has drifted" } else { "Golden motor" }).table(
        "Runs",
        Table { caption: "This check".to_owned(), columns: columns(&["recording", "serial", "verdict"]), rows },
    );
    if let Some(study) = &shift.study {
        let caption = "Gauge repeatability and reproducibility, standard deviations by analysis of variance".to_owned();
        return report.table("Gauge R&R", Table { caption, columns: columns(&STUDIED), rows: study_rows(study) });
    }
    let caption = format!(
        "Individuals and moving average (weight {WEIGHT}) against the first checks; all together call in at most {} % of checks of a rig \
         that has not drifted",
        100.0 * FALSE_ALARMS
    );
    report = report.table("Drift", Table { caption, columns: columns(&CHARTED), rows: chart_rows(&shift.charts) });
    for chart in shift.charts.iter().filter(|c| c.points.len() > 1) {
        let of = |get: &dyn Fn(&golden::Point) -> f64| {
            let first = chart.baseline.map_or(0, |b| b.checks) + 1;
            chart.points.iter().enumerate().map(|(k, p)| ((first + k) as f64, get(p))).collect::<Vec<_>>()
        };
        report = report.curves(
            chart.figure.to_owned(),
            Curves {
                caption: "Beyond −1 and 1 it calls".to_owned(),
                x: "check".to_owned(),
                y: "deviation over its limit".to_owned(),
                logarithmic: false,
                curves: vec![
                    ("check".to_owned(), of(&|p| p.individual)),
                    ("moving average".to_owned(), of(&|p| p.average)),
                ],
            },
        );
    }
    report
}
