//! `cargo xtask semver REVISION`: does the public interface of the published crates break what stood on that revision?

use crate::cargo::{cargo_command, run_command};
use crate::needs::{self, Need};
use crate::packages::PUBLISHED;

/// Compares with a git revision, such as the tag of the last version.
///
/// # Errors
/// A change that the version number does not allow, or that cargo-semver-checks cannot be had.
pub fn run(revision: &str) -> Result<(), String> {
    needs::provide([Need::SemverChecks].iter())?;
    let mut command = cargo_command(&["semver-checks", "--baseline-rev", revision]);
    PUBLISHED.iter().for_each(|name| _ = command.args(["--package", name]));
    run_command(&mut command).map(|_| ())
}
