//! `greyrig store get`: one recording out of the store.

use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::json;

use super::super::stdout;
use super::super::terminal::Terminal;
use super::tell;
use crate::answers::next::CommandLine;
use crate::error::{Error, Place, Result};
use crate::store::listing::get;
use crate::store::{Filter, Store};
use crate::{output, recording};

/// One recording out of the store, to a file that every command reads.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: greyrig store get motors S00017 --out run.csv")]
pub struct Args {
    /// Folder of the store
    #[arg(value_name = "STORE")]
    store: PathBuf,
    /// Serial number, or the begin of the SHA-256 (8 digits at least)
    #[arg(value_name = "KEY")]
    key: String,
    /// Where to look: line=…,type=…,day=…,from=…,to=…
    #[arg(long = "where", value_name = "CONDITIONS", default_value = "")]
    filter: Filter,
    /// The file to write: .csv or .parquet
    #[arg(long, value_name = "RUN")]
    out: PathBuf,
    /// Replace the output file if it exists
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// No recording of this key, or several; a file that cannot be written.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    output::refuse_overwrite(&args.out, args.force)?;
    let store = Store::open(&args.store)?;
    let entry = terminal.watching("store", |ctx| get(&store, &args.key, &args.filter, ctx, &tell))?;
    let made = entry.recording().map_err(|e| {
        Error::input(
            Place::file(&args.store),
            format!("the row of {:?} is no recording: {e}", args.key),
            "restore the store from a copy",
        )
    })?;
    recording::write(&made, &args.out, args.force, &terminal.context())?;
    if args.json {
        let body = json!({
            "store": args.store, "out": args.out, "sha256": entry.content.to_string(), "serial": entry.serial,
            "samples": entry.samples, "sample_time_s": entry.sample_time_s, "file": entry.name,
        });
        stdout::print_json("store get", &[args.out.display().to_string()], body)?;
    } else {
        stdout::print_line(&format!(
            "{}: {} samples, {:.6} s apart, of {}",
            args.out.display(),
            entry.samples,
            entry.sample_time_s,
            entry.name
        ))?;
        stdout::print_next(Some(&CommandLine::new("check").files([&args.out])))?;
    }
    Ok(ExitCode::SUCCESS)
}
