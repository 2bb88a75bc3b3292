//! `greyrig compare`: a model against measurements, and where it fails.

use std::path::PathBuf;
use std::process::ExitCode;

use super::answer::Answer;
use super::input::{self, Input};
use super::stdout;
use super::terminal::Terminal;
use super::words;
use crate::answers::compare::Request;
use crate::answers::next::CommandLine;
use crate::between::Course;
use crate::error::Result;
use crate::model::Model;
use crate::output;
use crate::recording::check_extension;

/// Model against measurement, and where the model fails.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  greyrig compare run.csv --model model.toml --report report.html\n  \
    greyrig compare a.csv b.csv --model model.toml --out series.parquet")]
pub struct Args {
    #[command(flatten)]
    input: Input,
    /// Model file
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// What the voltage does between its samples [default: what the data tell, where they are sampled slowly; else
    /// smooth]
    #[arg(long = "input", value_enum, value_name = "COURSE")]
    course: Option<Course>,
    /// Series to write, .csv or .parquet: measured, modelled and residual of each sample, and whether it lies where the
    /// model fails; of several recordings one below the other, with their names in the column `recording`
    #[arg(long, value_name = "SERIES")]
    out: Option<PathBuf>,
    #[command(flatten)]
    answer: Answer,
}

/// Runs the command.
///
/// # Errors
/// A model or recordings that cannot be used, or a report that cannot be written.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    for path in args.out.iter().chain(&args.answer.report) {
        output::refuse_overwrite(path, args.answer.force)?;
    }
    args.out.as_deref().map_or(Ok(()), check_extension)?;
    let model = Model::load(&args.model)?;
    let request = Request { course: args.course };
    let given = request.question(&model, args.input.load(&terminal.context())?);
    input::tell(&given.findings);
    let answer = request.answer(&model, given, &terminal.context())?;
    if let Some(path) = &args.out {
        answer.series().write(path, args.answer.force, &terminal.context())?;
    }
    if let Some(path) = &args.answer.report {
        answer.report().write(path, args.answer.force)?;
        eprintln!("report: {}", path.display());
    }
    if args.answer.json {
        stdout::print_as_it_is(&answer.as_json(args.out.as_deref())?.to_string())?;
    } else {
        stdout::print_line(&words::errors(&answer.comparison))?;
        stdout::print_line(&format!("\nwhere the model fails:\n{}", words::regions(&answer.comparison)))?;
        if let Some(path) = &args.out {
            stdout::print_line(&format!("\nwritten: {}", path.display()))?;
        }
        let next = args.input.files().again(CommandLine::new("diagnose")).option("--model", [args.model.display()]);
        stdout::print_next(Some(&next.option("--input", args.course.map(Course::name))))?;
    }
    Ok(ExitCode::SUCCESS)
}
