//! `greyrig add`: adds effects to a model, identifies again, and judges the gain on data held out.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use greyrig::effects::EffectId;

use super::answer::Answer;
use super::paint::{DOUBT, GOOD, painted};
use super::stdout;
use super::table::{Cell, Column, Table};
use super::terminal::Terminal;
use super::{input, words};
use crate::addition::Stage;
use crate::answers::add::Request;
use crate::answers::next::{CommandLine, Files, unused};
use crate::error::Result;
use crate::model::{Model, catalogue};
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

impl Args {
    /// The command that goes on: what the model still lacks, or the same with a file to write.
    fn next(&self, files: &Files, effects: &[EffectId], accepted: bool) -> CommandLine {
        if accepted && self.out.is_none() {
            let add = CommandLine::new("add").with(effects).option("--term", self.term.iter().map(Formula::text));
            let add = files.again(add.option("--model", [self.model.display()]));
            return add.option("--out", [unused(&self.model).display()]);
        }
        let model = self.out.as_ref().filter(|_| accepted).unwrap_or(&self.model);
        files.again(CommandLine::new("diagnose")).option("--model", [model.display()])
    }
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
    files.iter().try_for_each(|file| refuse_misspelt(file))?;
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
        stdout::print_line(&words::note(note))?;
    }
    let (style, word, why) = match (answer.accepted, answer.judged) {
        (true, _) => (GOOD, "accepted", "the error falls on data that the fit has not seen"),
        (false, false) => (DOUBT, "not accepted", "the data that the fit has not seen cannot judge it"),
        (false, true) => (
            DOUBT,
            "not accepted",
            "the error does not fall on data that the fit has not seen; this effect is not what is missing",
        ),
    };
    stdout::print_line(&format!("\n{}: {why}", painted(style, word)))?;
    if let Some(path) = &args.out {
        stdout::print_line(&format!("written: {}", path.display()))?;
    }
    let files = Files { recordings: files, map: args.map.map.clone() };
    stdout::print_next(Some(&args.next(&files, &request.effects, answer.accepted)))?;
    Ok(ExitCode::SUCCESS)
}

/// What is no file, and looks like no file's name, is a misspelt effect.
fn refuse_misspelt(file: &Path) -> Result<()> {
    let word = file.to_str().filter(|word| !word.contains(['.', '/', '\\']) && !file.exists());
    word.map_or(Ok(()), |word| catalogue::effect(word).map(|_| ()))
}

fn waterfall(stages: &[Stage]) -> String {
    let figures = ["current", "speed", "held out: current", "speed"].map(Column::figure);
    let mut table = Table::new([Column::text("error-to-signal ratio")].into_iter().chain(figures));
    for s in stages {
        let (training, held_out) = (s.training, s.held_out.esr);
        let [current, speed] = [training.current.or(training.torque), training.speed].map(words::percent);
        let judged = [held_out.current.or(held_out.torque), held_out.speed].map(words::percent).map(words::strong);
        let [judged_current, judged_speed] = judged;
        table.row([Cell::from(&s.label), current.into(), speed.into(), judged_current, judged_speed]);
    }
    let floor = stages[stages.len() - 1].held_out.noise_floor;
    let [current, speed] = [floor.current, floor.speed].map(words::percent).map(words::faint);
    table.row([words::faint("noise floor"), Cell::default(), Cell::default(), current, speed]);
    table.to_string()
}
