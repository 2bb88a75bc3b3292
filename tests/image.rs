//! Programs for the microcontroller, built by the Cargo that runs the test. A file that each package's tests include.

use std::path::PathBuf;
use std::process::{Command, Stdio};

/// Builds a program by these arguments of Cargo, and gives the path to it.
pub fn build(arguments: &[&str]) -> PathBuf {
    let output = Command::new(env!("CARGO"))
        .args(arguments)
        .args(["--message-format", "json-render-diagnostics"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .stderr(Stdio::inherit())
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "needs the target: rustup target add thumbv7em-none-eabihf");
    let messages = String::from_utf8(output.stdout).expect("cargo writes UTF-8");
    let (_, rest) = messages.split_once("\"executable\":\"").expect("cargo names the executable");
    rest.split('"').next().expect("a string ends").into()
}
