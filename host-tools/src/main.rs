//! The `greyrig` command.

use std::process::ExitCode;

use clap::Parser;
use greyrig_host::commands::terminal::Terminal;
use greyrig_host::commands::trouble::Asked;
use greyrig_host::commands::{self, Cli};

/// Keeps the memory of signals that come and go by the thousand, which the system's would give back and take anew.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let arguments = commands::arguments();
    let asked = Asked::of(&arguments);
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => return asked.tell_usage(&error),
    };
    cli.command.run(&Terminal::new()).unwrap_or_else(|error| asked.tell(&error))
}
