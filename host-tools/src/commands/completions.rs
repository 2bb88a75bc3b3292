//! `greyrig completions`: completion for the shell.

use std::process::ExitCode;

use clap::CommandFactory;

use super::Cli;
use crate::error::Result;

/// Completion script for a shell.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig completions bash > ~/.local/share/bash-completion/completions/greyrig")]
pub struct Args {
    /// The shell
    shell: clap_complete::Shell,
}

/// Runs the command.
///
/// # Errors
/// None; a reader that has gone away ends it quietly.
pub fn run(args: &Args) -> Result<ExitCode> {
    clap_complete::generate(args.shell, &mut Cli::command(), "greyrig", &mut std::io::stdout());
    Ok(ExitCode::SUCCESS)
}
