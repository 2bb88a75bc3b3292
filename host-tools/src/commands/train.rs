//! `greyrig train`: the learned correction of what the physical model leaves over.

use std::path::PathBuf;
use std::process::ExitCode;

use super::anfis::{Bell, parse_bell};
use super::answer::Answer;
use super::input::{self, Input};
use super::paint::{DOUBT, painted};
use super::stdout;
use super::table::{Cell, Column, Table};
use super::terminal::Terminal;
use super::words;
use crate::anfis::{Method, Trained};
use crate::answers::next::CommandLine;
use crate::answers::train::{Answer as Answered, Request};
use crate::compare::{Comparison, PerSignal};
use crate::error::Result;
use crate::hybrid;
use crate::model::Model;
use crate::network::FiringName;
use crate::output;

/// Trains the correction (ANFIS) on what the model leaves over, and judges it on data held out.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig train --model model.toml staircase.csv ramp.csv --out hybrid.toml\n\n\
    With several recordings the correction is judged on the last one, which it does not see; with a single one, on the last third of the\n\
    time until all is at rest.")]
pub struct Args {
    #[command(flatten)]
    input: Input,
    /// Model file to correct
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Model file to write
    #[arg(long, value_name = "MODEL2.toml")]
    out: Option<PathBuf>,
    /// Begin of each recording that is neither learnt nor judged, s: the start of the motor, as in the detector
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    blanking: f64,
    /// Epochs at most
    #[arg(long, default_value_t = 60)]
    epochs: usize,
    /// How the premises are trained
    #[arg(long, value_enum, default_value = "varpro")]
    method: Method,
    /// Exponent b of the bells: trained, or fixed for a network that takes half the time on the microcontroller
    #[arg(long, value_name = "free|1|2", default_value = "free", value_parser = parse_bell)]
    bell: Bell,
    /// Ridge of least squares as a fraction of rows over columns
    #[arg(long, default_value_t = hybrid::RIDGE)]
    ridge: f64,
    /// Firing operator
    #[arg(long, value_enum, default_value = "product")]
    firing: FiringName,
    /// Tell what a fourth input would gain, the modelled current so long ago, s. The model that is written has none:
    /// the microcontroller's network has no memory
    #[arg(long, value_name = "S")]
    delay: Option<f64>,
    /// Threads, 0 for all processors
    #[arg(long, default_value_t = 0)]
    threads: usize,
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
    let request = Request {
        blanking_s: args.blanking,
        epochs: args.epochs,
        method: args.method,
        exponent: args.bell.0,
        ridge: args.ridge,
        firing: args.firing,
        delay_s: args.delay,
        threads: args.threads,
    };
    request.check()?;
    let model = Model::load(&args.model)?;
    let given = request.question(&model, args.input.load(&terminal.context())?);
    input::tell(&given.findings);
    let answer = terminal.watching("training", |ctx| request.answer(&model, given, ctx))?;
    if let Some(path) = &args.out {
        answer.model.save(path, args.answer.force)?;
    }
    if let Some(path) = &args.answer.report {
        answer.report().write(path, args.answer.force)?;
        eprintln!("report: {}", path.display());
    }
    if args.answer.json {
        stdout::print_as_it_is(&answer.as_json(args.out.as_deref())?.to_string())?;
        return Ok(ExitCode::SUCCESS);
    }
    tell(&answer)?;
    if let Some(path) = &args.out {
        stdout::print_line(&format!("written: {}", path.display()))?;
        let next = args.input.files().again(CommandLine::new("compare")).option("--model", [path.display()]);
        stdout::print_next(Some(&next))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn tell(answer: &Answered) -> Result<()> {
    stdout::print_line(&table(&answer.before, &answer.after))?;
    stdout::print_line(&format!("\n{}", answer.in_words()))?;
    if let (Some(d), Some(delay)) = (&answer.delayed, answer.delay_s) {
        let chk = |t: &Trained| t.rmse_chk.map_or_else(|| "–".to_owned(), |e| format!("{e:.4} A"));
        stdout::print_line(&format!(
            "with the modelled current of {delay} s ago as a fourth input ({} rules in place of {}) the error on rows kept back would be \
             {} in place of {}",
            d.net.rules(),
            answer.trained.net.rules(),
            chk(d),
            chk(&answer.trained)
        ))?;
    }
    for note in answer.trained.notes() {
        stdout::print_line(&words::note(note))?;
    }
    if !answer.accepted() {
        stdout::print_line(&format!(
            "{}: the error does not fall on data that the training has not seen",
            painted(DOUBT, "not accepted")
        ))?;
    }
    Ok(())
}

fn table(before: &[Comparison; 2], after: &[Comparison; 2]) -> String {
    let figures = ["current", "speed", "held out: current", "speed"].map(Column::figure);
    let mut table = Table::new([Column::text("error-to-signal ratio")].into_iter().chain(figures));
    let mut row = |label: &str, training: PerSignal, held_out: PerSignal, judged: fn(String) -> Cell| {
        let [current, speed] = [training.current, training.speed].map(words::percent);
        let [judged_current, judged_speed] = [held_out.current, held_out.speed].map(words::percent).map(judged);
        table.row([Cell::from(label), current.into(), speed.into(), judged_current, judged_speed]);
    };
    row("physical model", before[0].esr, before[1].esr, words::strong);
    row("+ correction", after[0].esr, after[1].esr, words::strong);
    row("noise floor", after[0].noise_floor, after[1].noise_floor, words::faint);
    table.to_string()
}
