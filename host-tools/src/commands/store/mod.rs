//! `greyrig store`: many recordings, and what came of them.

mod add;
mod check;
mod get;
mod ls;
mod run;

use std::path::Path;
use std::process::ExitCode;

use clap::Subcommand;

use super::terminal::Terminal;
use crate::error::{Error, Result};

/// Exit code of work that was to stop.
const INTERRUPTED: u8 = 130;

/// A store of many recordings and of what came of them, in Parquet.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Add recordings that the store does not hold yet.
    Add(add::Args),
    /// What the store holds.
    Ls(ls::Args),
    /// Ask all recordings that are meant, on all cores.
    Run(run::Args),
    /// Whether the store holds what it says.
    Check(check::Args),
    /// One recording out of the store, to a file.
    Get(get::Args),
}

/// Runs the command.
///
/// # Errors
/// Whatever its part refuses.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    match &args.command {
        Command::Add(args) => add::run(args, terminal),
        Command::Ls(args) => ls::run(args, terminal),
        Command::Run(args) => run::run(args, terminal),
        Command::Check(args) => check::run(args, terminal),
        Command::Get(args) => get::run(args, terminal),
    }
}

/// Says on stderr which file cannot be used, and why.
fn tell(_: &Path, error: &Error) {
    eprintln!("greyrig: {error}");
}

/// A word with its number: `1 recording`, `2 recordings`.
fn counted(number: usize, word: &str) -> String {
    if number == 1 { format!("1 {word}") } else { format!("{number} {word}s") }
}
