//! `greyrig-board`: the virtual board behind a pseudo-terminal, in real time. `greyrig board` starts it.

use std::process::ExitCode;

#[cfg(unix)]
mod program;

#[cfg(unix)]
fn main() -> ExitCode {
    program::main()
}

#[cfg(not(unix))]
fn main() -> ExitCode {
    eprintln!("greyrig board: there are no pseudo-terminals on this system; use Linux or macOS");
    ExitCode::from(2)
}
