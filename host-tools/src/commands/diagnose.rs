//! `greyrig diagnose`: which physical effect is missing.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::ValueEnum;
use greyrig::effects::EffectId;
use serde_json::json;

use super::answer::Answer;
use super::input::{self, Answered, Input};
use super::next::{CommandLine, unused};
use super::stdout;
use super::terminal::Terminal;
use super::words;
use crate::between::Course;
use crate::check;
use crate::check::Purpose;
use crate::compare::{Comparison, PerSignal, compare_along};
use crate::diagnose::shape::Shape;
use crate::diagnose::{Diagnosis, Options, VerdictKind, diagnose_telling};
use crate::error::{Result, if_possible};
use crate::identify::{self, Settings};
use crate::model::{Assignment, Base, Kind, Model, Origin, catalogue};
use crate::numbers::figure;
use crate::output;
use crate::recording::finding::DataFinding;
use crate::recording::{Channel, Recording};
use crate::report::{Curves, Report, Table};

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
    let mut recordings = args.input.load(&terminal.context())?;
    let mut settings = match &model {
        Some(model) => Settings::of_model(model),
        None => {
            let kind = Kind::of(args.kind, &recordings);
            Settings { base: args.base.unwrap_or(Base::usual(kind)), ..Settings::new(kind) }
        }
    };
    settings.course = args.course;
    settings.fixed.extend(args.fix.iter().cloned());
    let findings = input::question(&mut recordings, settings.kind, Purpose::Fit);
    if let Some(stop) = check::stop(&findings) {
        return refused(args, stop, &findings);
    }
    let exclude = catalogue::effects(&args.exclude)?;
    let options = Options { settings: settings.clone(), exclude, candidates_refined: true };
    let (began, ranked) = (Instant::now(), AtomicBool::new(false));
    // What is compared is the base model as these recordings would have it: an effect is not to pass for a wrong R.
    let compared = || -> Result<Option<(Model, Option<Comparison>)>> {
        let along = |model: &Model| if_possible(compare_along(model, &recordings, args.course, &terminal.context()));
        let identified = if_possible(identify::identify(&recordings, &settings, &terminal.context()))?;
        let Some(fitted) = identified.map(|identified| identified.model) else { return Ok(None) };
        let mut comparison = along(&fitted)?;
        // The noise of the voltage goes through the model: of the one that was given, so that the floor is that of
        // `compare`.
        let given = model.as_ref().map(along).transpose()?.flatten();
        if let (Some(comparison), Some(given)) = (&mut comparison, given) {
            comparison.noise_floor = given.noise_floor;
            comparison.noise_floor_source = given.noise_floor_source;
        }
        Ok(Some((fitted, comparison)))
    };
    let diagnosed = || {
        terminal.watching_with("diagnosis", |ctx, bar| {
            let first_look = |candidates: &[(EffectId, f64)]| {
                if !ranked.swap(true, Ordering::Relaxed) {
                    bar.println(first_look(candidates, began.elapsed()));
                }
            };
            diagnose_telling(&recordings, &options, ctx, &first_look)
        })
    };
    let (result, compared) = rayon::join(diagnosed, compared);
    let d = result?;
    let next = next_command(args, &recordings, &d);
    let (fitted, comparison) = compared?.unzip();
    let comparison = comparison.flatten();
    if let (Some(path), Some(model), Some(comparison)) = (&args.answer.report, &fitted, &comparison) {
        let files: Vec<Origin> = recordings.iter().map(Origin::from).collect();
        let mut report = Report::new("Which effect is missing").lead(d.headline()).text("Why", d.verdict.text.clone());
        if let Some(shape) = &d.shape {
            report = report.curves("The shape of what is missing", shape_in_report(shape));
        }
        report
            .table("Candidates", candidates_in_report(&d))
            .comparison("The model as it is", comparison, model)
            .recordings(&files)
            .write(path, args.answer.force)?;
        eprintln!("report: {}", path.display());
    }
    if args.answer.json {
        let next = Next { next_command: &next, answer: d.as_json(comparison.as_ref()) };
        let answer = Answered { answer: next, data_findings: &findings };
        stdout::print_json("diagnose", &args.input.names(), answer)?;
        return Ok(ExitCode::SUCCESS);
    }
    if let Some(comparison) = &comparison {
        stdout::print_line(&words::errors(comparison))?;
        stdout::print_line("\nwhere the model fails:")?;
        stdout::print_line(&words::regions(comparison))?;
        stdout::print_line("")?;
    }
    if !d.candidates.is_empty() {
        stdout::print_line(&candidates(&d))?;
    }
    let odds = d.odds().map_or_else(String::new, |odds| format!(" (odds: {odds})"));
    stdout::print_line(&format!("\nverdict: {}{odds}", d.headline()))?;
    for line in d.verdict.text.lines() {
        stdout::print_line(&format!("  {line}"))?;
    }
    if let Some(shape) = &d.shape {
        stdout::print_line(&format!("\n{}", shape_caption(shape)))?;
        let mut table = words::table(&shape_columns(shape).each_ref().map(String::as_str));
        table.add_rows(shape_rows(shape));
        stdout::print_line(&table.to_string())?;
    }
    if let Some(next) = &d.verdict.next_experiment {
        stdout::print_line(&format!("next recording: {next}"))?;
    }
    if !d.clean.is_empty() {
        stdout::print_line(&format!("note: {}", cleanness(&d)))?;
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
    if let Some(next) = &next {
        stdout::print_as_it_is(&format!("next: {next}"))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// An answer with the command that goes on from it.
#[derive(serde::Serialize)]
struct Next<'a, T> {
    next_command: &'a Option<String>,
    #[serde(flatten)]
    answer: T,
}

/// The command that goes on from a verdict: what is missing is added, rivals are told apart, and a model that lacks
/// nothing is identified, or asked what these recordings would have shown.
fn next_command(args: &Args, recordings: &[Recording], d: &Diagnosis) -> Option<String> {
    let verdict = &d.verdict;
    let (none, no_terms): (&[EffectId], &[String]) = (&[], &[]);
    match verdict.kind {
        VerdictKind::MissingEffect if d.can_be_added => Some(with_more(args, &verdict.effects, no_terms).to_string()),
        VerdictKind::None => Some(match &args.model {
            Some(model) => {
                args.input.again(CommandLine::new("challenge")).option("--model", [model.display()]).to_string()
            }
            None => with_more(args, none, no_terms).to_string(),
        }),
        VerdictKind::Ambiguous if verdict.effects.len() > 1 => {
            let known = args.model.clone().unwrap_or_else(|| unused(Path::new("model.toml")));
            let rivals: Vec<&str> = verdict.effects.iter().map(|id| id.id()).collect();
            let largest = |channel| {
                let values = recordings.iter().filter_map(|r| r.channel(channel)).flatten();
                let largest = values.map(|x| x.abs()).fold(0.0, f64::max);
                (largest > 0.0).then(|| figure(largest, 3))
            };
            let plan = CommandLine::new("plan")
                .option("--model", [known.display()])
                .option("--rivals", [rivals.join(",")])
                .option("--max-voltage", largest(Channel::Voltage))
                .option("--max-current", largest(Channel::Current));
            Some(match args.model {
                Some(_) => plan.to_string(),
                None => format!("{} && {plan}", with_more(args, none, no_terms)),
            })
        }
        VerdictKind::OutsideCatalogue if !d.lead.as_arguments().is_empty() => {
            Some(with_more(args, none, &d.lead.as_arguments()).to_string())
        }
        _ => None,
    }
}

/// The command that gives the model effects and terms more, from the same recordings.
fn with_more(args: &Args, effects: &[EffectId], terms: &[String]) -> CommandLine {
    if let Some(model) = &args.model {
        let add = CommandLine::new("add").with(effects).option("--term", terms).option("--model", [model.display()]);
        return args.input.again(add).option("--out", [unused(model).display()]);
    }
    args.input
        .again(CommandLine::new("identify"))
        .option("--kind", args.kind)
        .option("--base", args.base.and_then(|base| base.to_possible_value()).map(|base| base.get_name().to_owned()))
        .option("--fix", args.fix.iter().map(|fixed| format!("{}={}", fixed.name, fixed.value)))
        .option("--input", args.course)
        .option("--effect", effects)
        .option("--term", terms)
        .option("--out", [unused(Path::new("model.toml")).display()])
}

/// The answer to recordings from which nothing could be told.
fn refused(args: &Args, stop: &DataFinding, findings: &[DataFinding]) -> Result<ExitCode> {
    let reason = format!("the recording: {}", stop.sentence());
    let next = stop.remedy.as_ref().map(|remedy| {
        let again = args.input.again_with(CommandLine::new("diagnose"), remedy);
        let kind = args.kind.filter(|_| !remedy.starts_with("--kind"));
        again.option("--kind", kind).option("--model", args.model.as_ref().map(|model| model.display())).to_string()
    });
    if args.answer.json {
        let verdict = json!({
            "kind": VerdictKind::InsufficientData, "effects": [], "sizes": [], "probability": null, "text": reason, "next_experiment": null,
            "remaining": null,
        });
        let answer = json!({
            "esr_before": PerSignal::default(), "esr_after": PerSignal::default(), "noise_floor": null, "where": null,
            "verdict": verdict, "remaining": null, "classes": [], "candidates": [], "screening": [], "lead": null, "shape": null,
            "decoy_gain": null, "dithered": [], "next_command": next, "data_findings": findings,
        });
        stdout::print_json("diagnose", &args.input.names(), answer)?;
    } else {
        stdout::print_line(&format!("verdict: insufficient data\n  {reason}"))?;
        if let Some(next) = &next {
            stdout::print_as_it_is(&format!("next: {next}"))?;
        }
    }
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

const CANDIDATE_COLUMNS: [&str; 7] =
    ["step", "candidate", "held-out error falls by", "current", "speed", "p", "objection"];

/// The candidates, best first, a row each.
fn rows(d: &Diagnosis) -> Vec<Vec<String>> {
    d.candidates
        .iter()
        .map(|c| {
            vec![
                c.step.to_string(),
                c.effect.to_string(),
                format!("{:.1} %", 100.0 * c.held_out_gain.max(0.0)),
                words::percent(c.esr_after.current),
                words::percent(c.esr_after.speed),
                if c.p_value < 1e-6 { "< 1e-6".to_owned() } else { format!("{:.1e}", c.p_value) },
                c.objection.unwrap_or("").to_owned(),
            ]
        })
        .collect()
}

/// The candidates as a table for the terminal.
pub fn candidates(d: &Diagnosis) -> String {
    let mut table = words::table(&CANDIDATE_COLUMNS);
    table.add_rows(rows(d));
    table.to_string()
}

/// The candidates as a table of the report.
pub fn candidates_in_report(d: &Diagnosis) -> Table {
    Table {
        caption: "Candidates step by step, best first; current and speed are free-run error-to-signal ratios"
            .to_owned(),
        columns: CANDIDATE_COLUMNS.map(str::to_owned).to_vec(),
        rows: rows(d),
    }
}

fn shape_caption(shape: &Shape) -> String {
    format!(
        "the shape of what is missing in the {} balance: {} orders it best ({:.0} % of its variance; current and speed together \
         {:.0} %)",
        shape.balance,
        shape.axis,
        100.0 * shape.explains,
        100.0 * shape.map_explains
    )
}

fn shape_in_report(shape: &Shape) -> Curves {
    Curves {
        caption: shape_caption(shape),
        x: format!("{}, {}", shape.axis, shape.axis_unit),
        y: format!("missing, {}", shape.unit),
        logarithmic: false,
        curves: vec![("what is missing".to_owned(), shape.curve.iter().map(|p| (p.at, p.missing)).collect())],
    }
}

fn shape_columns(shape: &Shape) -> [String; 3] {
    [format!("{}, {}", shape.axis, shape.axis_unit), format!("missing, {}", shape.unit), String::new()]
}

/// The curve, a row a point, with a bar.
fn shape_rows(shape: &Shape) -> Vec<Vec<String>> {
    const HALF: f64 = 12.0;
    let largest = shape.curve.iter().map(|p| p.missing.abs()).fold(f64::MIN_POSITIVE, f64::max);
    shape
        .curve
        .iter()
        .map(|p| {
            let length = (HALF * p.missing.abs() / largest).round() as usize;
            let bar = "█".repeat(length);
            let width = HALF as usize;
            let drawn = if p.missing < 0.0 { format!("{bar:>width$}│") } else { format!("{:width$}│{bar}", "") };
            vec![format!("{:.4}", p.at), format!("{:+.3e}", p.missing), drawn]
        })
        .collect()
}
