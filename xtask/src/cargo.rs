//! Cargo, run in the workspace's root.

use std::path::Path;
use std::process::Command;

use crate::tally::Tally;

/// Runs cargo with these arguments; its output goes to the terminal.
pub fn cargo(arguments: &[&str]) -> Result<Tally, String> {
    run_command(&mut cargo_command(arguments))
}

/// Cargo in the workspace's root: the one that runs this program, so that the toolchain is the same.
pub fn cargo_command(arguments: &[&str]) -> Command {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.args(arguments).current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."));
    command
}

/// Runs a command whose output goes to the terminal.
pub fn run_command(command: &mut Command) -> Result<Tally, String> {
    let status = command.status().map_err(|error| not_started(command, &error))?;
    if status.success() { Ok(Tally::default()) } else { Err(format!("{} ended with {status}", shown(command))) }
}

/// Why a command could not be run at all.
pub fn not_started(command: &Command, error: &std::io::Error) -> String {
    format!("{} cannot be started: {error}", shown(command))
}

/// The command as one would type it.
pub fn shown(command: &Command) -> String {
    let program = Path::new(command.get_program()).file_name().unwrap_or_default().to_string_lossy();
    let arguments = command.get_args().map(|argument| argument.to_string_lossy());
    std::iter::once(program).chain(arguments).collect::<Vec<_>>().join(" ")
}
