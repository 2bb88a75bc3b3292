//! `greyrig diagnose`: which physical effect is missing.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use greyrig::effects::EffectId;

use super::answer::Answer;
use super::input::{self, Input};
use super::paint::{DOUBT, GOOD, painted};
use super::stdout;
use super::table::{Cell, Column, Table};
use super::terminal::Terminal;
use super::words;
use crate::answers::diagnose::{CANDIDATE_COLUMNS, GAIN_COLUMN, Request, candidate_rows, shape_caption};
use crate::between::Course;
use crate::diagnose::shape::Shape;
use crate::diagnose::{Diagnosis, VerdictKind};
use crate::error::Result;
use crate::model::{Assignment, Base, Kind, Model, catalogue};
use crate::output;

/// Which physical effect is missing, how sure, what it is confused with, and the experiment that would tell.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  greyrig diagnose staircase.csv --model model.toml\n  \
    greyrig diagnose ramp.csv --kind pm-dc --base viscous --fix R=3.4 --fix L=2.85e-3")]
pub struct Args {
    #[command(flatten)]
    input: Input,
    /// Model file to start from; without it the base model is identified
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Kind of motor, without a model file; by itself what the recordings tell as their `motor`, or else universal
    #[arg(long, value_enum, conflicts_with = "model")]
    kind: Option<Kind>,
    /// Friction terms of the base model, without a model file
    #[arg(long, value_enum, conflicts_with = "model")]
    base: Option<Base>,
    /// Parameter with a known value, SI (repeatable)
    #[arg(long, value_name = "NAME=VALUE")]
    fix: Vec<Assignment>,
    /// Effect that is not to be considered (repeatable)
    #[arg(long, value_name = "ID")]
    exclude: Vec<String>,
    /// What the voltage does between its samples [default: what the data tell, where they are sampled slowly; else
    /// smooth]
    #[arg(long = "input", value_enum, value_name = "COURSE")]
    course: Option<Course>,
    #[command(flatten)]
    answer: Answer,
}

/// Runs the command.
///
/// # Errors
/// A model or recordings that cannot be used, or a report that cannot be written.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    if let Some(path) = &args.answer.report {
        output::refuse_overwrite(path, args.answer.force)?;
    }
    let model = args.model.as_deref().map(Model::load).transpose()?;
    let request = Request {
        kind: args.kind,
        base: args.base,
        fixed: args.fix.clone(),
        exclude: catalogue::effects(&args.exclude)?,
        course: args.course,
    };
    let given = request.question(model.as_ref(), args.input.load(&terminal.context())?);
    input::tell(&given.findings);
    let (began, ranked) = (Instant::now(), AtomicBool::new(false));
    let answer = terminal.watching_with("diagnosis", |ctx, bar| {
        let first_look = |candidates: &[(EffectId, f64)]| {
            if !ranked.swap(true, Ordering::Relaxed) {
                bar.println(first_look(candidates, began.elapsed()));
            }
        };
        request.answer(model.as_ref(), given, ctx, &first_look)
    })?;
    let next = request.next_command(&answer, &args.input.files(), args.model.as_deref());
    if let (Some(path), Some(report)) = (&args.answer.report, answer.report()) {
        report.write(path, args.answer.force)?;
        eprintln!("report: {}", path.display());
    }
    if args.answer.json {
        stdout::print_as_it_is(&answer.as_json(next.as_ref())?.to_string())?;
        return Ok(ExitCode::SUCCESS);
    }
    let Some(d) = &answer.diagnosis else {
        let reason = answer.stopped().unwrap_or_default();
        stdout::print_line(&format!("verdict: {}\n  {reason}", painted(DOUBT, "insufficient data")))?;
        stdout::print_next(next.as_ref())?;
        return Ok(ExitCode::SUCCESS);
    };
    if let Some(comparison) = &answer.comparison {
        stdout::print_line(&words::errors(comparison))?;
        stdout::print_line("\nwhere the model fails:")?;
        stdout::print_line(&words::regions(comparison))?;
        stdout::print_line("")?;
    }
    if !d.candidates.is_empty() {
        stdout::print_line(&candidates(d))?;
    }
    let odds = d.odds().map_or_else(String::new, |odds| format!(" (odds: {odds})"));
    let style = if d.verdict.kind == VerdictKind::None { GOOD } else { DOUBT };
    stdout::print_line(&format!("\nverdict: {}{odds}", painted(style, d.headline())))?;
    for line in d.verdict.text.lines() {
        stdout::print_line(&format!("  {line}"))?;
    }
    if let Some(shape) = &d.shape {
        stdout::print_line(&format!("\n{}", shape_caption(shape)))?;
        stdout::print_line(&drawn(shape))?;
    }
    if let Some(next) = &d.verdict.next_experiment {
        stdout::print_line(&format!("next recording: {next}"))?;
    }
    if !d.clean.is_empty() {
        stdout::print_line(&words::note(cleanness(d)))?;
    }
    if let (Some(current), Some(speed)) = (d.esr_after.current, d.esr_after.speed)
        && !d.verdict.effects.is_empty()
        && d.esr_after != d.esr_before
    {
        stdout::print_line(&format!(
            "with that: current {}, speed {}",
            words::percent(Some(current)),
            words::percent(Some(speed))
        ))?;
    }
    stdout::print_next(next.as_ref())?;
    Ok(ExitCode::SUCCESS)
}

/// What was done to recordings that are cleaner than the model can be.
fn cleanness(d: &Diagnosis) -> String {
    format!(
        "cleaner than what a model does between samples: {}; to judge it, noise was added, half of what a converter of twelve bits has",
        d.clean.join(", ")
    )
}

/// The candidates that a first screening puts foremost.
fn first_look(candidates: &[(EffectId, f64)], after: Duration) -> String {
    let foremost: Vec<String> = candidates
        .iter()
        .take(5)
        .map(|(id, gain)| format!("{id} {:.0} %", 100.0 * (1.0 - (-0.5 * gain).exp())))
        .collect();
    format!("first look after {:.1} s, by how much the error might fall: {}", after.as_secs_f64(), foremost.join(", "))
}

/// The candidates as a table for the terminal.
pub fn candidates(d: &Diagnosis) -> String {
    let mut table = Table::new(CANDIDATE_COLUMNS.map(|title| match title {
        "step" | "candidate" => Column::text(title),
        "objection" => Column::prose(title),
        figure => Column::figure(figure),
    }));
    let gain = CANDIDATE_COLUMNS.iter().position(|title| *title == GAIN_COLUMN);
    for row in candidate_rows(d) {
        let cells = row.into_iter().enumerate();
        table.row(cells.map(|(k, text)| if Some(k) == gain { words::strong(text) } else { Cell::from(text) }));
    }
    table.to_string()
}

/// The curve, a row a point, with a bar.
fn drawn(shape: &Shape) -> String {
    const HALF: f64 = 12.0;
    let at = Column::figure(format!("{}, {}", shape.axis, words::unit(shape.axis_unit)));
    let mut table = Table::new([at, Column::figure(format!("missing, {}", words::unit(shape.unit))), Column::text("")]);
    let largest = shape.curve.iter().map(|p| p.missing.abs()).fold(f64::MIN_POSITIVE, f64::max);
    for p in &shape.curve {
        let length = (HALF * p.missing.abs() / largest).round() as usize;
        let bar = "█".repeat(length);
        let width = HALF as usize;
        let drawn = if p.missing < 0.0 { format!("{bar:>width$}│") } else { format!("{:width$}│{bar}", "") };
        table.row([format!("{:.4}", p.at), format!("{:+.3e}", p.missing), drawn]);
    }
    table.to_string()
}
