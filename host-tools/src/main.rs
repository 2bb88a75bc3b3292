//! The `greyrig` command.

use std::process::ExitCode;

use clap::Parser;
use greyrig_host::commands::{self, Cli};
use greyrig_host::output;

fn main() -> ExitCode {
    let cli = Cli::parse_from(commands::arguments());
    output::catch_interrupts();
    match cli.command.run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("greyrig: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
