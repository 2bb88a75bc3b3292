//! `greyrig store add`: recordings into the store.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;

use serde_json::json;

use super::super::stdout;
use super::super::terminal::Terminal;
use super::{INTERRUPTED, counted};
use crate::answers::next::CommandLine;
use crate::error::{EXIT_BAD_INPUT, Error, Result};
use crate::recording::MapArgs;
use crate::store::add::{Given, add, files_of};
use crate::store::{Store, partition};

/// Add recordings that the store does not hold yet, whatever their files are called.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  greyrig store add motors today/*.csv\n  \
    greyrig store add motors incoming --line A3 --type M42 --date 2026-11-30\n\n\
    Ends with code 2 where a file was refused; all others are in the store then. Give the same command again after it\n\
    was cut off: nothing is added twice.")]
pub struct Args {
    /// Folder of the store; it is begun where there is none
    #[arg(value_name = "STORE")]
    store: PathBuf,
    /// Recordings in any supported format, or folders of them
    #[arg(required = true, value_name = "RUN")]
    recordings: Vec<PathBuf>,
    #[command(flatten)]
    map: MapArgs,
    /// Production line, where the recordings do not tell it (# line:, else # rig:)
    #[arg(long, value_name = "NAME")]
    line: Option<String>,
    /// Motor type, where the recordings do not tell it (# motor:)
    #[arg(long = "type", value_name = "NAME")]
    motor: Option<String>,
    /// Day or time, where the recordings do not tell it (# date:)
    #[arg(long, value_name = "DATE", value_parser = parse_date)]
    date: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

fn parse_date(text: &str) -> std::result::Result<String, String> {
    let known = partition::time(text).is_some();
    known.then(|| text.to_owned()).ok_or_else(|| "write it as 2026-01-31 or 2026-01-31T06:15:00".to_owned())
}

/// Runs the command.
///
/// # Errors
/// A store that cannot be written to.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let told = [("line", &args.line), ("motor", &args.motor), ("date", &args.date)];
    let given = Given {
        mapping: args.map.mapping()?,
        metadata: told.into_iter().filter_map(|(key, value)| Some((key, value.clone()?))).collect(),
    };
    let runs = files_of(&args.recordings)?;
    let store = Store::open_or_begin(&args.store)?;
    let refused = Mutex::new(Vec::new());
    let counts = terminal.watching_with("store add", |ctx, bar| {
        add(&store, &runs, &given, ctx, &|path, error: &Error| {
            bar.suspend(|| eprintln!("greyrig: {error}"));
            let refusal = json!({ "file": path, "what": error.what(), "remedy": error.remedy() });
            refused.lock().unwrap_or_else(|e| e.into_inner()).push(refusal);
        })
    })?;
    let refused = refused.into_inner().unwrap_or_else(|e| e.into_inner());
    if args.json {
        let names: Vec<String> = runs.iter().map(|run| run.display().to_string()).collect();
        let body = json!({
            "store": args.store, "given": counts.given, "added": counts.added, "already_there": counts.already_there,
            "refused": counts.refused, "left": counts.left, "kept_as": counts.kept_as, "refusals": refused,
            "interrupted": counts.interrupted,
        });
        stdout::print_json("store add", &names, body)?;
    } else {
        let left = if counts.left > 0 { format!(", {} not looked at", counts.left) } else { String::new() };
        stdout::print_line(&format!(
            "{}: {} added, {} already there, {} refused{left}, of {}",
            args.store.display(),
            counts.added,
            counts.already_there,
            counts.refused,
            counted(counts.given, "file"),
        ))?;
        if !counts.kept_as.is_empty() {
            let forms: Vec<String> = counts.kept_as.iter().map(|(form, n)| format!("{n} as {form}")).collect();
            stdout::print_line(&format!("  channels kept bit for bit: {}", forms.join(", ")))?;
        }
        if counts.interrupted {
            stdout::print_line("interrupted; the same command goes on from there")?;
        } else {
            let next = CommandLine::new("store run").files([&args.store]).with(["identify"]);
            stdout::print_next(Some(&next))?;
        }
    }
    Ok(match (counts.interrupted, counts.refused) {
        (true, _) => ExitCode::from(INTERRUPTED),
        (false, 0) => ExitCode::SUCCESS,
        (false, _) => ExitCode::from(EXIT_BAD_INPUT),
    })
}
