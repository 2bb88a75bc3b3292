//! `cargo xtask mutants`: changes the code, one place at a time, and looks which change no test notices.
//!
//! What is changed stands in `.cargo/mutants.toml`; what survives for a reason, in `docs/mutants.md`.

use crate::cargo::{cargo_command, run_command};
use crate::needs::{self, Need};

/// A package, and which of its tests are to notice: those that call what is changed themselves.
const PARTS: [(&str, &[&str]); 2] = [("greyrig", &["--test", "core"]), ("greyrig-host", &["--lib"])];

/// Changes both packages, or the one that the first argument names; further arguments go to cargo-mutants, such as
/// `--file` or `--shard 1/8`.
///
/// # Errors
/// A change that no test noticed, or that cargo-mutants cannot be had.
pub fn run(arguments: &[String]) -> Result<(), String> {
    needs::provide([Need::Mutants].iter())?;
    let named = |(package, _): &&(&str, &[&str])| arguments.first().is_some_and(|first| first == package);
    let (parts, options) = match PARTS.iter().find(named) {
        Some(part) => (std::slice::from_ref(part), &arguments[1..]),
        None => (&PARTS[..], arguments),
    };
    let survived = parts.iter().filter_map(|(package, tests)| {
        let mut command = cargo_command(&["mutants", "--package", package]);
        command.args(["--output", &format!("target/mutants-{package}")]).args(options).arg("--").args(*tests);
        run_command(&mut command).err()
    });
    let survived: Vec<String> = survived.collect();
    if survived.is_empty() { Ok(()) } else { Err(survived.join("\n")) }
}
