//! The `greyrig` command.

use std::process::ExitCode;

use clap::Parser;
use greyrig_host::commands::{self, Cli};
use greyrig_host::error::EXIT_BAD_INPUT;
use greyrig_host::output;

/// Keeps the memory of signals that come and go by the thousand, which the system's would give back and take anew.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let cli = match Cli::try_parse_from(commands::arguments()) {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    output::catch_interrupts();
    match cli.command.run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("greyrig: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

/// Help and version go to stdout as they are; a wrong command line gets one line.
fn usage(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        // A reader that has gone away is no concern here.
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    if error.kind() == clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        let _ = error.print();
        return ExitCode::from(EXIT_BAD_INPUT);
    }
    let text = error.render().to_string();
    let told: Vec<&str> = text
        .lines()
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .collect();
    eprintln!("greyrig: {}; --help shows what there is", told.join(" ").trim_start_matches("error: "));
    ExitCode::from(EXIT_BAD_INPUT)
}
