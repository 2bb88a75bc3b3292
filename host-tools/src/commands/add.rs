//! `greyrig add`: adds effects to a model, identifies again, and judges the gain on data held out.

use std::path::PathBuf;
use std::process::ExitCode;

use greyrig::effects::{EffectId, Identifiers};
use serde_json::json;

use super::answer::Answer;
use super::stdout;
use super::terminal::Terminal;
use super::{input, words};
use crate::addition::{Addition, Additions, Stage, add_to, held_of, stage};
use crate::check;
use crate::check::Purpose;
use crate::error::{Error, Place, Result};
use crate::held_out::split;
use crate::model::{Assignment, Model, Origin};
use crate::output;
use crate::recording::{MapArgs, Recording};
use crate::report::{Report, Step};
use crate::term::Formula;

/// Adds effects to a model, identifies again, and shows the error fall, on data held out.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  greyrig add saturation --model model.toml staircase.csv ramp.csv --out model2.toml\n\n\
    Identifiers of the catalogue among the arguments are effects, all else recordings. With several recordings each gain is\n\
    judged on the last one, which the fit does not see; with a single one, on the last third of the time until all is at rest.\n\
    Where an effect comes to nothing, another one that no recording separates from it (see `greyrig effects`) takes its place."
)]
pub struct Args {
    /// Effects of the catalogue, and recordings
    #[arg(required = true, value_name = "EFFECT|RUN")]
    arguments: Vec<PathBuf>,
    /// Term of your own in the voltage balance, or after `torque:` in the torque balance, such as 'k*i*abs(i)'
    /// (repeatable)
    #[arg(long, value_name = "FORMULA")]
    term: Vec<Formula>,
    /// Model file to start from
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Model file to write
    #[arg(long, value_name = "MODEL2.toml")]
    out: Option<PathBuf>,
    #[command(flatten)]
    map: MapArgs,
    #[command(flatten)]
    answer: Answer,
}

/// Runs the command.
///
/// # Errors
/// A model or recordings that cannot be used, or a file that cannot be written.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    for path in args.out.iter().chain(&args.answer.report) {
        output::refuse_overwrite(path, args.answer.force)?;
    }
    let known = |path: &PathBuf| path.to_str()?.parse().ok();
    let effects: Vec<EffectId> = args.arguments.iter().filter_map(known).collect();
    let files: Vec<PathBuf> = args.arguments.iter().filter(|a| known(a).is_none()).cloned().collect();
    if (effects.is_empty() && args.term.is_empty()) || files.is_empty() {
        return Err(Error::usage(
            "add needs at least one effect or --term, and one recording",
            format!("effects are {Identifiers}"),
        ));
    }
    let model = Model::load(&args.model)?;
    if let Some(id) = effects.iter().find(|id| model.effects.iter().any(|e| e.id == **id)) {
        return Err(Error::usage(format!("the model has {id} already"), "leave it out, or add another effect"));
    }
    let mut recordings = input::load(&files, &args.map, &terminal.context())?;
    let findings = input::question(&mut recordings, model.kind, Purpose::Fit);
    input::refuse(&findings)?;
    let (training, held_out) = split(&recordings);
    refuse_seen(&training, &held_out)?;

    let held = terminal.watching("what has to be known", |ctx| held_of(&model, &effects, &recordings, ctx))?;
    let additions = Additions { effects: &effects, terms: &args.term, held: &held };
    let stages = terminal.watching("stages", |ctx| -> Result<Vec<Stage>> {
        let staged = |effects, terms| {
            // What is known of an effect is of no use to a model that does not have it yet.
            let held: Vec<Assignment> = held.iter().filter(|a| is_of(effects, a)).cloned().collect();
            stage(&model, Additions { effects, terms, held: &held }, &training, &held_out, ctx)
        };
        let with_effects = (0..=effects.len()).map(|count| staged(&effects[..count], &[]));
        let with_terms = (1..=args.term.len()).map(|count| staged(&effects, &args.term[..count]));
        with_effects.chain(with_terms).collect()
    })?;
    let (first, last) = (&stages[0], &stages[stages.len() - 1]);
    let judged = last.shows(&model, &held_out, &terminal.context())?;
    let accepted = judged && first.held_out.esr.falls_to(&last.held_out.esr);
    // What is written has seen all the data; the judgement above has not.
    let Addition { effects: added, identification: mut final_fit } =
        terminal.watching("all data", |ctx| add_to(&model, additions, &recordings, ctx))?;
    if !judged {
        let note = "what was held out shows nothing of what was added, as a coast-down does of what goes with the current: give another \
                    recording";
        final_fit.notes.push(note.to_owned());
    }
    final_fit.model.judged(accepted);
    if let Some(path) = &args.out {
        final_fit.model.save(path, args.answer.force)?;
    }
    if let Some(path) = &args.answer.report {
        let steps: Vec<Step> = stages.iter().map(|s| Step { label: s.label.clone(), esr: s.held_out.esr }).collect();
        let files: Vec<Origin> = recordings.iter().map(Origin::from).collect();
        Report::new("The error falls")
            .waterfall("Error-to-signal ratio on data held out", &steps, last.held_out.noise_floor)
            .comparison("After, on data held out", &last.held_out, &last.model)
            .comparison("Before, on data held out", &first.held_out, &first.model)
            .recordings(&files)
            .write(path, args.answer.force)?;
        eprintln!("report: {}", path.display());
    }
    if args.answer.json {
        let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
        stdout::print_json(
            "add",
            &names,
            json!({
                "effects": added,
                "terms": args.term.iter().map(Formula::text).collect::<Vec<_>>(),
                "esr_before": first.training,
                "esr_after": last.training,
                "held_out_before": first.held_out.esr,
                "held_out_after": last.held_out.esr,
                "noise_floor": last.held_out.noise_floor,
                "parameters": final_fit.parameters,
                "notes": final_fit.notes,
                "accepted": accepted,
                "data_findings": findings,
                "model": args.out,
            }),
        )?;
        return Ok(ExitCode::SUCCESS);
    }
    stdout::print_line(&waterfall(&stages))?;
    stdout::print_line(&format!("\n{}", words::parameters(&final_fit)))?;
    for note in &final_fit.notes {
        stdout::print_line(&format!("note: {note}"))?;
    }
    stdout::print_line(match (accepted, judged) {
        (true, _) => "\naccepted: the error falls on data that the fit has not seen",
        (false, false) => "\nnot accepted: the data that the fit has not seen cannot judge it",
        (false, true) => {
            "\nnot accepted: the error does not fall on data that the fit has not seen; this effect is not what is missing"
        }
    })?;
    if let Some(path) = &args.out {
        stdout::print_line(&format!("written: {}", path.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Whether a parameter is that of one of these effects.
fn is_of(effects: &[EffectId], assigned: &Assignment) -> bool {
    effects.iter().any(|id| id.description().parameters.iter().any(|p| p.name == assigned.name))
}

/// Data that the fit has seen prove nothing.
fn refuse_seen(training: &[Recording], held_out: &[Recording]) -> Result<()> {
    for judge in held_out {
        if let Some(seen) = training.iter().find(|seen| check::same(seen, judge)) {
            return Err(Error::input(
                Place::file(judge.path()),
                format!(
                    "it holds the same samples as {}, and cannot judge what was fitted to them",
                    seen.path().display()
                ),
                "give another recording last, or this one alone",
            ));
        }
    }
    Ok(())
}

fn waterfall(stages: &[Stage]) -> String {
    let mut table = words::table(&["error-to-signal ratio", "current", "speed", "held out: current", "speed"]);
    for s in stages {
        let (training, held_out) = (s.training, s.held_out.esr);
        table.add_row(
            [s.label.clone()].into_iter().chain(
                [
                    training.current.or(training.torque),
                    training.speed,
                    held_out.current.or(held_out.torque),
                    held_out.speed,
                ]
                .map(words::percent),
            ),
        );
    }
    let floor = stages[stages.len() - 1].held_out.noise_floor;
    table.add_row([
        "noise floor".into(),
        String::new(),
        String::new(),
        words::percent(floor.current),
        words::percent(floor.speed),
    ]);
    table.to_string()
}
