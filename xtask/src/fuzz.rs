//! Fuzzing: each target of `tests/fuzz`, with overflow checks in our own crates. Only these are built anew; what they
//! stand on is that of the tests.
//!
//! An input that fails goes to `tests/fuzz/reproducers`, where the tests run it from then on.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::cargo::{cargo_command, not_started};
use crate::tally::Tally;

/// Seconds for each target where nothing else is asked for.
const USUAL_S: u64 = 60;
/// Seconds for each target among the checks: a minute and a half in all.
const SMOKE_S: u64 = 4;

/// How long, from which seed, and what.
struct Plan {
    seconds: u64,
    seed: u64,
    targets: Vec<String>,
}

/// `cargo xtask fuzz [--seconds N] [--seed N] [TARGET]…`.
pub fn run(arguments: &[String]) -> ExitCode {
    match wanted(arguments).and_then(|plan| fuzz(&plan)) {
        Ok(tally) if tally.failed == 0 => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(sentence) => {
            eprintln!("xtask: {sentence}");
            ExitCode::from(2)
        }
    }
}

/// Each target for some seconds, the same inputs each time.
pub fn smoke() -> Result<Tally, String> {
    fuzz(&Plan { seconds: SMOKE_S, seed: 1, targets: all()? })
}

/// Without a seed every run has inputs of its own.
fn wanted(arguments: &[String]) -> Result<Plan, String> {
    let seed = SystemTime::now().duration_since(UNIX_EPOCH).map_or(1, |time| time.as_secs());
    let all = all()?;
    let mut plan = Plan { seconds: USUAL_S, seed, targets: Vec::new() };
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        let place = match argument.as_str() {
            "--seconds" => &mut plan.seconds,
            "--seed" => &mut plan.seed,
            target if all.iter().any(|known| known == target) => {
                plan.targets.push(target.to_owned());
                continue;
            }
            unknown => return Err(format!("there is no target {unknown}; the targets are {}", all.join(", "))),
        };
        let number = rest.next().and_then(|n| n.parse().ok()).filter(|n| *n > 0);
        *place = number.ok_or_else(|| format!("{argument} needs a whole number from 1 on"))?;
    }
    if plan.targets.is_empty() {
        plan.targets = all;
    }
    Ok(plan)
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The targets: each has a folder of seeds, as `tests/fuzz/tests/corpus.rs` checks.
fn all() -> Result<Vec<String>, String> {
    let folder = root().join("tests/fuzz/corpus");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut names: Vec<String> =
        entries.filter_map(Result::ok).map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    Ok(names)
}

fn fuzz(plan: &Plan) -> Result<Tally, String> {
    let program = build()?;
    let mut tally = Tally::default();
    let mut table = Vec::new();
    for target in &plan.targets {
        let (told, well) = one(&program, target, plan)?;
        if well {
            tally.passed += 1;
        } else {
            tally.failed += 1;
        }
        table.push((target, told, well));
    }
    println!("\n{:12} {:>10} {:>6} {:>10}  result", "target", "inputs", "kept", "memory, MB");
    for (target, told, well) in &table {
        let [inputs, kept, memory] = told;
        println!("{target:12} {inputs:>10} {kept:>6} {memory:>10}  {}", if *well { "ok" } else { "FAILED" });
    }
    let inputs: u64 = table.iter().map(|(_, [inputs, ..], _)| inputs).sum();
    println!("{inputs} inputs, {} of {} targets failed; seed {}", tally.failed, table.len(), plan.seed);
    Ok(tally)
}

/// Builds the program with overflow checks in our own crates.
fn build() -> Result<PathBuf, String> {
    let mut command = cargo_command(&["build", "--release", "--package", "greyrig-fuzz", "--locked"]);
    for package in ["greyrig", "greyrig-host", "greyrig-fuzz"] {
        for check in ["overflow-checks", "debug-assertions"] {
            command.args(["--config", &format!("profile.release.package.{package}.{check}=true")]);
        }
    }
    // As the tests, so that both stand on the same builds.
    command.env("CARGO_PROFILE_RELEASE_LTO", "off").env("CARGO_PROFILE_RELEASE_DEBUG", "false");
    let status = command.status().map_err(|error| not_started(&command, &error))?;
    if !status.success() {
        return Err("the fuzz targets do not build".to_owned());
    }
    let folder = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from);
    Ok(root().join(folder).join("release/greyrig-fuzz"))
}

/// Runs one target: inputs, inputs kept and memory, and whether nothing failed.
fn one(program: &Path, target: &str, plan: &Plan) -> Result<([u64; 3], bool), String> {
    eprintln!("=== {target}");
    let save = root().join("tests/fuzz/reproducers").join(target);
    let command = || {
        let mut command = Command::new(program);
        command.arg(target).arg("--seconds").arg(plan.seconds.to_string()).arg("--seed").arg(plan.seed.to_string());
        command.arg("--save").arg(&save).stdin(Stdio::null());
        command
    };
    let not_run = |e: std::io::Error| format!("{} cannot be started: {e}", program.display());
    let output = command().stderr(Stdio::inherit()).output().map_err(not_run)?;
    let text = String::from_utf8_lossy(&output.stdout);
    let number = |name: &str| {
        let mut words = text.split_whitespace().skip_while(|word| *word != name);
        words.nth(1).and_then(|n| n.parse().ok()).unwrap_or(0)
    };
    if text.is_empty() && output.status.code() != Some(1) {
        // Neither a panic nor a hang: a stack that is full, or memory. The same inputs again, each written down before
        // it runs.
        let trace = save.join("aborted");
        std::fs::create_dir_all(&save).map_err(|e| format!("{}: {e}", save.display()))?;
        eprintln!("{target} ended with {}: once more, with the input in {}", output.status, trace.display());
        let _ = command().arg("--trace").arg(&trace).stdout(Stdio::null()).stderr(Stdio::null()).status();
    }
    Ok((["inputs", "kept", "memory"].map(number), output.status.success()))
}
