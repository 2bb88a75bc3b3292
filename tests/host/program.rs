//! The program as a user starts it.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Columns for programs whose sentences a test looks into: none of them is folded.
pub const WIDE: &str = "1000";

/// Runs the program in a folder.
pub fn greyrig(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .env("COLUMNS", WIDE)
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("greyrig runs")
}

/// What it answers as JSON.
pub fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = greyrig(folder, &[arguments, &["--json"]].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}
