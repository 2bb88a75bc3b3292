//! `greyrig add`: adds effects to a model, identifies again, and judges the gain on data held out.

use std::path::PathBuf;
use std::process::ExitCode;

use greyrig::effects::EffectId;

use super::answer::Answer;
use super::stdout;
use super::terminal::Terminal;
use super::{input, words};
use crate::addition::Stage;
use crate::answers::add::Request;
use crate::error::Result;
use crate::model::Model;
use crate::output;
use crate::recording::MapArgs;
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
    let request = Request { effects, terms: args.term.clone() };
    request.check(!files.is_empty())?;
    let model = Model::load(&args.model)?;
    request.check_model(&model)?;
    let given = request.question(&model, input::load(&files, &args.map, &terminal.context())?);
    input::tell(&given.findings);
    let answer = terminal.watching("add", |ctx| request.answer(&model, given, ctx))?;
    let final_fit = &answer.identification;
    if let Some(path) = &args.out {
        final_fit.model.save(path, args.answer.force)?;
    }
    if let Some(path) = &args.answer.report {
        answer.report().write(path, args.answer.force)?;
        eprintln!("report: {}", path.display());
    }
    if args.answer.json {
        stdout::print_as_it_is(&answer.as_json(args.out.as_deref())?.to_string())?;
        return Ok(ExitCode::SUCCESS);
    }
    stdout::print_line(&waterfall(&answer.stages))?;
    stdout::print_line(&format!("\n{}", words::parameters(final_fit)))?;
    for note in &final_fit.notes {
        stdout::print_line(&format!("note: {note}"))?;
    }
    stdout::print_line(match (answer.accepted, answer.judged) {
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
