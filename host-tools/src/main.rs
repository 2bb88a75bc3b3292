//! The `greyrig` command.

use std::process::ExitCode;

use clap::Parser;
use greyrig_host::commands::Cli;
use greyrig_host::output;

fn main() -> ExitCode {
    let cli = Cli::parse();
    output::catch_interrupts();
    match cli.command.run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("greyrig: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
