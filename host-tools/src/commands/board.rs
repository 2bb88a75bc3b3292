//! `greyrig board`: starts the virtual board, a program of its own: its processor's licence (GPL-2.0) is not this
//! tool's.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use super::stdout;
use crate::error::{Error, Result};

/// Name of the program.
const PROGRAM: &str = "greyrig-board";

/// What makes it.
const BUILD: &str = "build it in a checkout with `cargo build --release --package greyrig-board` (needs cmake, a C compiler and libclang)";

/// What is told where the program is not there to tell it.
const HELP: &str = "\
A virtual board that runs the flashed image, behind a pseudo-terminal

Usage: greyrig board [OPTIONS]

The board is a program of its own, greyrig-board, which is not beside this one: its processor's licence (GPL-2.0) is not \
this tool's, so that no build of greyrig holds it. Build it in a checkout with

  cargo build --release --package greyrig-board

(needs cmake, a C compiler and libclang); then greyrig finds it beside itself or on the PATH, and greyrig board --help lists \
its options.

Example:
  greyrig board --fault sparking=0.3@5 --calibration-out rig.toml";

/// A virtual board that runs the flashed image, behind a pseudo-terminal.
#[derive(Debug, clap::Args)]
#[command(
    disable_help_flag = true,
    after_help = "Example:\n  greyrig board --fault sparking=0.3@5 --calibration-out rig.toml"
)]
pub struct Args {
    /// As `greyrig board --help` explains them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENT")]
    arguments: Vec<OsString>,
}

/// Runs the command.
///
/// # Errors
/// A program that is not there.
pub fn run(args: &Args) -> Result<ExitCode> {
    let beside = std::env::current_exe().ok().and_then(|own| {
        let program = own.with_file_name(format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX));
        program.is_file().then_some(program)
    });
    let mut command = Command::new(beside.unwrap_or_else(|| PathBuf::from(PROGRAM)));
    match start(command.args(&args.arguments)) {
        Err(_) if args.arguments.iter().any(|word| word == "--help" || word == "-h") => {
            stdout::print_line(HELP)?;
            Ok(ExitCode::SUCCESS)
        }
        started => {
            started.map_err(|_| Error::usage("the virtual board is not built", format!("{BUILD}, and run this again")))
        }
    }
}

/// The program takes the place of this one, and so gets its signals.
#[cfg(unix)]
fn start(command: &mut Command) -> std::io::Result<ExitCode> {
    Err(std::os::unix::process::CommandExt::exec(command))
}

#[cfg(not(unix))]
fn start(command: &mut Command) -> std::io::Result<ExitCode> {
    let status = command.status()?;
    Ok(ExitCode::from(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(crate::error::EXIT_HARDWARE)))
}
