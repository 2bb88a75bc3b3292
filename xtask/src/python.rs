//! The Python package: a wheel, built and installed into an environment of its own, its tests, and its types.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::cargo::{cargo_command, not_started, run_command, shown};
use crate::tally::Tally;

/// The package, from the workspace's root.
const PACKAGE: &str = "host-tools/python";
/// What is installed beside the wheel.
const REQUIREMENTS: &str = "host-tools/python/tests/requirements.txt";

/// The feature with which the package takes what the tests have built.
const AS_TESTS: &str = "as-tests";

/// Builds the wheel, installs it, runs pytest with `arguments`, and has pyright check the types. `as_tests` sets the
/// profile of the other tests, so that what they have built serves here.
///
/// # Errors
/// What cannot be built, installed or started; types that do not fit. Tests that fail are counted.
pub fn check(as_tests: fn(&mut Command) -> &mut Command, arguments: &[String]) -> Result<Tally, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let target = target(&root);
    let environment = Environment::at(target.join("python"))?;
    environment.provide(&root.join(REQUIREMENTS))?;
    let command = build_command(as_tests)?;
    let wheels = target.join("wheels");
    // What an earlier version has left is not to be taken for this one.
    let _ = std::fs::remove_dir_all(&wheels);
    let mut maturin = environment.program("maturin");
    maturin.args(["build", "--release", "--locked", "--features", AS_TESTS, "--compatibility", "linux", "--out"]);
    maturin.arg(&wheels);
    maturin.arg("--manifest-path").arg(root.join(PACKAGE).join("Cargo.toml"));
    run_command(as_tests(maturin.current_dir(&root)))?;
    let wheel = only_file(&wheels)?;
    let mut install = environment.program("pip");
    run_command(install.args(["install", "--quiet", "--force-reinstall", "--no-deps"]).arg(wheel))?;

    let package = root.join(PACKAGE);
    let mut types = environment.program("pyright");
    types.arg("--pythonpath").arg(environment.program_path("python")).current_dir(&package);
    run_command(&mut types)?;
    // From the folder of the tests, so that the package is the one that was installed.
    let mut tests = environment.program("python");
    tests.args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider", "--rootdir"]).arg(&package).args(arguments);
    tests.env("GREYRIG", command).current_dir(package.join("tests"));
    counted(&mut tests)
}

/// Builds the command that the answers are held against.
fn build_command(as_tests: fn(&mut Command) -> &mut Command) -> Result<PathBuf, String> {
    let packages = ["--package", "greyrig-host", "--package", "greyrig-python", "--bin", "greyrig"];
    let features = ["--features", "greyrig-host/full", "--features", "greyrig-python/as-tests"];
    let mut build = cargo_command(&["build", "--release", "--locked"]);
    build.args(packages).args(features);
    run_command(as_tests(&mut build))?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    Ok(target(&root).join("release").join(format!("greyrig{}", std::env::consts::EXE_SUFFIX)))
}

/// Where builds go.
fn target(root: &Path) -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from)
}

/// Runs pytest, and counts by the last line that it prints.
fn counted(command: &mut Command) -> Result<Tally, String> {
    let output = command.output().map_err(|error| not_started(command, &error))?;
    let (text, errors) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let tally = tally(&text);
    if output.status.success() {
        print!("{text}");
        return Ok(tally);
    }
    println!("{text}\n{errors}");
    if tally.failed > 0 { Ok(tally) } else { Err(format!("{} ended with {}", shown(command), output.status)) }
}

/// The counts of `3 failed, 40 passed, 1 skipped in 20.13s`.
fn tally(output: &str) -> Tally {
    let last = output.lines().rfind(|line| line.contains(" in ") && line.contains("passed") || line.contains("failed"));
    let words: Vec<&str> = last.unwrap_or_default().split([' ', ',', '=']).filter(|word| !word.is_empty()).collect();
    let count = |what: &str| {
        let at = words.iter().position(|word| *word == what)?;
        words.get(at.checked_sub(1)?)?.parse::<usize>().ok()
    };
    let failed = count("failed").unwrap_or(0) + count("error").or(count("errors")).unwrap_or(0);
    let skipped = (0..count("skipped").unwrap_or(0)).map(|_| ("python".to_owned(), "see pytest -rs".to_owned()));
    Tally { passed: count("passed").unwrap_or(0), failed, skipped: skipped.collect() }
}

fn only_file(folder: &Path) -> Result<PathBuf, String> {
    let files = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut files: Vec<PathBuf> = files.flatten().map(|entry| entry.path()).collect();
    match (files.pop(), files.len()) {
        (Some(file), 0) => Ok(file),
        (_, more) => Err(format!("{} holds {more} wheels too many, or none", folder.display())),
    }
}

/// A virtual environment of Python.
struct Environment(PathBuf);

impl Environment {
    /// The one in a folder, made if it is not there.
    fn at(folder: PathBuf) -> Result<Self, String> {
        let environment = Self(folder);
        if !environment.program_path("python").is_file() {
            run_command(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&environment.0))?;
        }
        Ok(environment)
    }

    fn program_path(&self, name: &str) -> PathBuf {
        self.0.join("bin").join(name)
    }

    fn program(&self, name: &str) -> Command {
        let mut command = Command::new(self.program_path(name));
        // As `activate` does; maturin looks there for the interpreter.
        command.env("VIRTUAL_ENV", &self.0).env_remove("PYTHONHOME").env_remove("PYTHONPATH");
        command
    }

    /// Installs what is required, unless that was done before.
    fn provide(&self, requirements: &Path) -> Result<(), String> {
        let read = |path: &Path| std::fs::read(path).ok();
        let known = self.0.join("requirements.txt");
        if read(requirements).is_some() && read(requirements) == read(&known) {
            return Ok(());
        }
        let mut pip = self.program("pip");
        run_command(
            pip.args(["install", "--quiet", "--disable-pip-version-check", "--requirement"]).arg(requirements),
        )?;
        std::fs::copy(requirements, known).map_err(|error| format!("{}: {error}", self.0.display()))?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_what_pytest_prints() {
        let of = |text: &str| {
            let Tally { passed, failed, skipped } = tally(text);
            (passed, failed, skipped.len())
        };
        assert_eq!(of("....\n41 passed in 20.13s\n"), (41, 0, 0));
        assert_eq!(of("FAILED test_x.py::test_y - failed to see\n2 failed, 39 passed, 1 skipped in 3.20s"), (39, 2, 1));
        assert_eq!(of("== 1 error in 0.20s =="), (0, 0, 0), "then the exit code tells");
        assert_eq!(of("3 passed, 2 errors in 0.20s"), (3, 2, 0));
    }
}
