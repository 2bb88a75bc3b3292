//! The crates as a registry would hand them out: packed, unpacked elsewhere, and built from what the packages hold.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::cargo::{cargo_command, not_started, run_command};
use crate::needs;

/// The library crates, each after those that it depends on.
pub const PUBLISHED: [&str; 2] = ["greyrig", "greyrig-host"];

/// Folders that stay in the repository.
const BAGGAGE: [&str; 5] = ["tests/", "benches/", "docs/", "xtask/", "target/"];

/// Packs both crates and builds them from the packages: the core, the host on that core, and the firmware for the
/// emulator, whose linker scripts have to be in the package.
///
/// # Errors
/// What does not pack or build, or is baggage.
pub fn check() -> Result<(), String> {
    let mut pack = cargo_command(&["package", "--no-verify", "--allow-dirty", "--locked", "--quiet"]);
    PUBLISHED.iter().for_each(|name| _ = pack.args(["--package", name]));
    run_command(&mut pack)?;

    let target = target_folder()?;
    let folder = std::env::temp_dir().join(format!("greyrig-packages-{}", std::process::id()));
    let result = build_from_packages(&target, &folder);
    // Nothing that matters is left behind where this fails.
    let _ = std::fs::remove_dir_all(&folder);
    result
}

fn build_from_packages(target: &Path, folder: &Path) -> Result<(), String> {
    std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    for name in PUBLISHED {
        let package = target.join("package").join(format!("{name}-{}.crate", env!("CARGO_PKG_VERSION")));
        let mut tar = Command::new("tar");
        tar.arg("--extract").arg("--gzip").arg("--file").arg(&package).arg("--directory").arg(folder);
        run_command(&mut tar)?;
        without_baggage(name)?;
    }
    let unpacked = |name: &str| folder.join(format!("{name}-{}", env!("CARGO_PKG_VERSION")));
    let [core, host] = PUBLISHED.map(unpacked);
    // Dependencies are those of the other steps, built alike; the image has a place of its own, as its name is that of
    // the firmware's.
    let cargo = |place: &Path, target: &Path, arguments: &[&str]| {
        let mut command = cargo_command(arguments);
        command.current_dir(place).env("CARGO_TARGET_DIR", target).env("CARGO_PROFILE_DEV_OPT_LEVEL", "1");
        run_command(&mut command).map(|_| ())
    };
    cargo(&core, target, &["check", "--locked", "--quiet"])?;
    let image = ["build", "--profile", "firmware", "--target", needs::TARGET, "--features", "mps2-an386", "--quiet"];
    cargo(&core, &target.join("packages"), &[&image[..], &["--bin", "mps2-an386"]].concat())?;
    // As if the registry had the core already. Its path changes the lock file, so that this cannot be `--locked`.
    let registry = format!("patch.crates-io.greyrig.path={:?}", core.display().to_string());
    cargo(&host, target, &["check", "--config", &registry, "--quiet"])
}

/// Whether a package holds nothing but what its users need.
fn without_baggage(name: &str) -> Result<(), String> {
    let mut list = cargo_command(&["package", "--list", "--allow-dirty", "--quiet", "--package", name]);
    let output = list.output().map_err(|error| not_started(&list, &error))?;
    let files = String::from_utf8_lossy(&output.stdout);
    match files.lines().find(|file| BAGGAGE.iter().any(|folder| file.starts_with(folder))) {
        None => Ok(()),
        Some(file) => Err(format!("the package of {name} holds {file}; see `include` in its Cargo.toml")),
    }
}

/// Where Cargo builds.
fn target_folder() -> Result<PathBuf, String> {
    let mut metadata = cargo_command(&["metadata", "--no-deps", "--format-version", "1"]);
    let output = metadata.output().map_err(|error| not_started(&metadata, &error))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let (_, rest) = text.split_once("\"target_directory\":\"").ok_or("cargo does not tell where it builds")?;
    Ok(rest.split('"').next().unwrap_or_default().into())
}
