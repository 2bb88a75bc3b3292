//! The page of `greyrig serve`: its sources in TypeScript are sound, and what is bundled in `host-tools/assets` is made
//! of them.

use std::path::Path;
use std::process::Command;

use crate::cargo::run_command;

/// What is run in `host-tools/web`, in this order. Packages run nothing when they are installed.
const STEPS: [&[&str]; 4] =
    [&["ci", "--ignore-scripts", "--no-audit", "--no-fund"], &["run", "check"], &["run", "compare"], &["test"]];

/// Checks it.
pub fn check() -> Result<(), String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-tools/web");
    for arguments in STEPS {
        run_command(Command::new("npm").args(arguments).current_dir(&folder))?;
    }
    Ok(())
}
