//! `greyrig store run`: one question to many recordings.

use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::json;

use super::super::stdout;
use super::super::terminal::Terminal;
use super::{INTERRUPTED, counted, tell};
use crate::answers::next::CommandLine;
use crate::error::{EXIT_BAD_INPUT, Error, Result};
use crate::model::Kind;
use crate::store::job::{Job, Task};
use crate::store::run::run as run_all;
use crate::store::{Filter, Store};

/// Ask all recordings that are meant, on all cores, and keep what comes of it in the store.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  greyrig store run motors identify --where line=A3,from=2026-11-01,to=2026-11-30\n  \
    greyrig store run motors monitor --model model.toml\n\n\
    A result is known by its recording, the model and the version of greyrig: what is there is not asked again, and\n\
    work that was cut off goes on. RAYON_NUM_THREADS sets the number of cores."
)]
pub struct Args {
    /// Folder of the store
    #[arg(value_name = "STORE")]
    store: PathBuf,
    /// The question
    #[arg(value_enum, value_name = "QUESTION")]
    job: Job,
    /// Model file; monitor needs one with limits
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Kind of motor, without a model; by itself what each recording tells
    #[arg(long, value_enum, conflicts_with = "model")]
    kind: Option<Kind>,
    /// Which recordings: line=…,type=…,day=…,from=…,to=…,serial=…
    #[arg(long = "where", value_name = "CONDITIONS", default_value = "")]
    filter: Filter,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// A folder that is no store, a model that cannot be used, a store that cannot be written to.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let task = Task::new(args.job, args.model.as_deref(), args.kind)?;
    let store = Store::open(&args.store)?;
    let ran = terminal.watching_with("store run", |ctx, bar| {
        run_all(&store, &task, &args.filter, ctx, &|path, error: &Error| bar.suspend(|| tell(path, error)))
    })?;
    if args.json {
        let body = json!({
            "store": args.store, "question": args.job.name(), "model": args.model, "model_key": task.model_key,
            "asked": ran.asked(), "done_before": ran.done_before, "outcomes": ran.outcomes,
            "other_type": ran.other_type, "damaged": ran.damaged, "failed": ran.failed, "interrupted": ran.interrupted,
        });
        stdout::print_json("store run", &[], body)?;
    } else {
        let outcomes: Vec<String> = ran.outcomes.iter().map(|(outcome, n)| format!("{n} {outcome}")).collect();
        let of = if outcomes.is_empty() { String::new() } else { format!(" ({})", outcomes.join(", ")) };
        stdout::print_line(&format!(
            "{}: {} asked{of}, {} done before",
            args.store.display(),
            counted(ran.asked(), "recording"),
            ran.done_before
        ))?;
        if ran.other_type > 0 {
            stdout::print_line(&format!("  {} of another motor type than the model's left out", ran.other_type))?;
        }
        if ran.damaged > 0 {
            stdout::print_line(&format!("  {} left out", counted(ran.damaged, "damaged row")))?;
        }
        if ran.failed > 0 {
            stdout::print_line(&format!("  {} without an answer", counted(ran.failed, "recording")))?;
        }
        if ran.interrupted {
            stdout::print_line("interrupted; the same command goes on from there")?;
        } else {
            stdout::print_next(Some(&CommandLine::new("store ls").files([&args.store])))?;
        }
    }
    Ok(match (ran.interrupted, ran.damaged + ran.failed) {
        (true, _) => ExitCode::from(INTERRUPTED),
        (false, 0) => ExitCode::SUCCESS,
        (false, _) => ExitCode::from(EXIT_BAD_INPUT),
    })
}
