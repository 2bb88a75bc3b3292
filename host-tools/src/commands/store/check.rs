//! `greyrig store check`: whether the store holds what it says.

use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::json;

use super::super::stdout;
use super::super::terminal::Terminal;
use super::{counted, tell};
use crate::error::{EXIT_BAD_INPUT, Result};
use crate::store::Store;
use crate::store::verify::verify;

/// Read all of the store, and hold the samples of each recording against its SHA-256.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: greyrig store check motors\n\nEnds with code 2 where a row or a file is damaged.")]
pub struct Args {
    /// Folder of the store
    #[arg(value_name = "STORE")]
    store: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// A folder that is no store.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let store = Store::open(&args.store)?;
    let found = terminal.watching_with("store check", |ctx, bar| {
        verify(&store, ctx, &|path, error| bar.suspend(|| tell(path, error)))
    })?;
    if args.json {
        let mut body = json!(found);
        body["store"] = json!(args.store);
        body["whole"] = json!(found.is_whole());
        stdout::print_json("store check", &[], body)?;
    } else {
        stdout::print_line(&format!(
            "{}: {}, {}, {}",
            args.store.display(),
            counted(found.recordings, "recording"),
            counted(found.results, "result"),
            counted(found.files, "file")
        ))?;
        let forms: Vec<String> = found.kept_as.iter().map(|(form, n)| format!("{n} as {form}")).collect();
        if !forms.is_empty() {
            stdout::print_line(&format!("  channels kept bit for bit: {}", forms.join(", ")))?;
        }
        let wrong = [
            (found.damaged_files, "damaged file"),
            (found.damaged_rows, "damaged row"),
            (found.misplaced, "recording in another's folder"),
            (found.twice, "row that is there twice"),
            (found.without_recording, "result without its recording"),
            (found.unfinished, "file that was never finished (the next writer removes it)"),
            (found.strangers, "file that is no part of the store"),
        ];
        for (number, what) in wrong.into_iter().filter(|(number, _)| *number > 0) {
            stdout::print_line(&format!("  {number} × {what}"))?;
        }
        if found.is_whole() {
            stdout::print_line("all is as it was put in")?;
        }
    }
    Ok(if found.is_whole() { ExitCode::SUCCESS } else { ExitCode::from(EXIT_BAD_INPUT) })
}
