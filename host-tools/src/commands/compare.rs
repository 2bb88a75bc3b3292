//! `greyrig compare`: a model against measurements, and where it fails.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde::Serialize;

use super::answer::Answer;
use super::input::{self, Answered, Input};
use super::stdout;
use super::terminal::Terminal;
use super::words;
use crate::between::Course;
use crate::check::Purpose;
use crate::compare::{Comparison, compare_along};
use crate::error::Result;
use crate::model::{Model, Origin};
use crate::output;
use crate::recording::check_extension;
use crate::report::Report;

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

/// A comparison, and where it was written to sample by sample.
#[derive(Serialize)]
struct Written<'a> {
    #[serde(flatten)]
    comparison: &'a Comparison,
    #[serde(skip_serializing_if = "Option::is_none")]
    out: Option<&'a Path>,
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
    let mut recordings = args.input.load(&terminal.context())?;
    let findings = input::question(&mut recordings, model.kind, Purpose::Fit);
    input::refuse(&findings)?;
    let comparison = compare_along(&model, &recordings, args.course, &terminal.context())?;
    if let Some(path) = &args.out {
        comparison.series(recordings[0].motion()).write(path, args.answer.force, &terminal.context())?;
    }
    if let Some(path) = &args.answer.report {
        let files: Vec<Origin> = recordings.iter().map(Origin::from).collect();
        let name = model.motor.as_deref().unwrap_or("motor");
        Report::new(format!("{name}: model against measurement"))
            .comparison("Model against measurement", &comparison, &model)
            .recordings(&files)
            .write(path, args.answer.force)?;
        eprintln!("report: {}", path.display());
    }
    if args.answer.json {
        let answer = Answered {
            answer: Written { comparison: &comparison, out: args.out.as_deref() },
            data_findings: &findings,
        };
        stdout::print_json("compare", &args.input.names(), answer)?;
    } else {
        stdout::print_line(&words::errors(&comparison))?;
        stdout::print_line(&format!("\nwhere the model fails:\n{}", words::regions(&comparison)))?;
        if let Some(path) = &args.out {
            stdout::print_line(&format!("\nwritten: {}", path.display()))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}
