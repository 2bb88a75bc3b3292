//! The checks, in the order in which they run: quick ones first.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use crate::book;
use crate::cargo::{cargo, cargo_command, not_started, run_command, shown};
use crate::dependencies;
use crate::fuzz;
use crate::needs::{self, Need};
use crate::packages;
use crate::page;
use crate::python;
use crate::size;
use crate::structure;
use crate::tally::Tally;

/// A check that can be run by its name.
pub struct Check {
    /// What the command line calls it.
    pub name: &'static str,
    /// What it checks.
    pub what: &'static str,
    /// What the machine has to have.
    needs: &'static [Need],
    /// Runs it, in its long version if it has one; what it prints has reached the terminal when it returns.
    run: fn(Length) -> Result<Tally, String>,
}

/// How thorough the checks are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Length {
    /// As after each change.
    Usual,
    /// Tests that have a long version run that.
    Long,
}

/// What asks for [`Length::Long`].
pub const LONG: &str = "--long";

/// Steps that run only when they are named: they build everything once more, or look for what nobody knows yet.
pub const BY_NAME: [&str; 2] = ["packages", "fuzz"];

/// The step that has a long version.
const TESTS: &str = "tests";

/// All checks. Those that only look at the code share what they know of the dependencies, and with the tests the build
/// scripts, the macros and what these build: one profile, and the features that development dependencies ask for, which
/// `cargo doc` takes into account where examples are documented.
pub const ALL: &[Check] = &[
    Check {
        name: "fmt",
        what: "the code is formatted",
        needs: &[Need::Rustfmt],
        run: |_| cargo(&["fmt", "--all", "--check"]),
    },
    Check {
        name: "structure",
        what: "no circle between files, no arrow up between modules, no comment too wide",
        needs: &[],
        run: |_| structure::check(&root()).map(|()| Tally::default()),
    },
    Check {
        name: "dependencies",
        what: "licences, sources, versions and the least Rust of all dependencies are as deny.toml says",
        needs: &[],
        run: |_| dependencies::check().map(|()| Tally::default()),
    },
    Check {
        name: "book",
        what: "the documentation builds as a book, and no link in it leads nowhere",
        needs: &[Need::Book],
        run: |_| book::check(&root()).map(|()| Tally::default()),
    },
    Check {
        name: "page",
        what: "the page's sources are sound, and its bundle is made of them",
        needs: &[Need::Node],
        run: |_| page::check().map(|()| Tally::default()),
    },
    Check {
        name: "clippy",
        what: "no lint complains, tests and benchmarks included",
        needs: &[Need::Clippy, Need::BoardTools],
        run: |_| {
            let all = ["--workspace", "--all-targets", "--all-features", "--locked"];
            run_command(
                as_tests(&mut cargo_command(&["clippy", "--release"])).args(all).args(["--", "--deny", "warnings"]),
            )
        },
    },
    Check {
        name: "doc",
        what: "the documentation has no warning",
        needs: &[Need::BoardTools],
        run: |_| {
            let programs = ["--bin", "xtask", "--bin", "greyrig-exam", "--bin", "greyrig-lot"];
            run_command(
                as_tests(&mut cargo_command(&["doc", "--release", "--lib", "--examples"]))
                    .args(programs)
                    .args(["--workspace", "--no-deps", "--all-features", "--locked"])
                    .env("RUSTDOCFLAGS", "--deny warnings"),
            )
        },
    },
    Check {
        name: "firmware",
        what: "both firmware images build, fit, have a bounded stack and a sampling interrupt that cannot panic",
        needs: &[Need::Clippy, Need::Target],
        run: firmware,
    },
    Check {
        name: "packages",
        what: "the published crates build from what their packages hold, and those hold nothing else",
        needs: &[Need::Target],
        run: |_| packages::check().map(|()| Tally::default()),
    },
    Check {
        name: TESTS,
        what: "all tests of the workspace, the emulated microcontroller, the virtual board and the browser included",
        needs: &[Need::Target, Need::Qemu, Need::Browser, Need::Node, Need::BoardTools],
        run: tests,
    },
    Check {
        name: "python",
        what: "the Python package builds as a wheel, answers as the command does, and its types fit",
        needs: &[Need::Python],
        run: |_| python::check(as_tests, &[]),
    },
    Check {
        name: "fuzz",
        what: "no fuzz target fails within some seconds; overflows panic",
        needs: &[],
        run: |_| fuzz::smoke(),
    },
];

/// The repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Builds the documentation as a book, and says where it is.
pub fn book() -> ExitCode {
    match needs::provide([Need::Book].iter()).and_then(|()| book::build(&root())) {
        Ok(_) => {
            println!("book/index.html");
            ExitCode::SUCCESS
        }
        Err(sentence) => {
            eprintln!("xtask: {sentence}");
            ExitCode::FAILURE
        }
    }
}

/// Examines the diagnosis or the detector: builds the program and hands it the arguments.
pub fn exam(program: &str, arguments: &[String]) -> ExitCode {
    let mut command = cargo_command(&[
        "run",
        "--quiet",
        "--release",
        "--package",
        "greyrig-exam",
        "--bin",
        program,
        "--locked",
        "--",
    ]);
    match command.args(arguments).status() {
        Ok(status) if status.success() => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("xtask: cargo cannot be run: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Builds and tests the Python package, with options of pytest's.
pub fn python(arguments: &[String]) -> ExitCode {
    let tested = needs::provide([Need::Python].iter()).and_then(|()| python::check(as_tests, arguments));
    match tested {
        Ok(tally) if tally.failed == 0 => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(sentence) => {
            eprintln!("xtask: {sentence}");
            ExitCode::FAILURE
        }
    }
}

/// The checks with these names, in the order of [`ALL`]; all but those of [`BY_NAME`] if there is no name. And how
/// thorough they are to be.
pub fn choose(arguments: &[String]) -> Result<(Vec<&'static Check>, Length), String> {
    let (options, names): (Vec<&str>, Vec<&str>) =
        arguments.iter().map(String::as_str).partition(|argument| *argument == LONG);
    if let Some(unknown) = names.iter().find(|name| !ALL.iter().any(|check| check.name == **name)) {
        let known: Vec<&str> = ALL.iter().map(|check| check.name).collect();
        return Err(format!("there is no step {unknown}; the steps are {}, the option is {LONG}", known.join(", ")));
    }
    let length = if options.is_empty() { Length::Usual } else { Length::Long };
    if length == Length::Long && !names.is_empty() && !names.contains(&TESTS) {
        return Err(format!("{LONG} is for the step {TESTS}; name that one, or none"));
    }
    let wanted = |check: &&Check| match names.as_slice() {
        [] => !BY_NAME.contains(&check.name),
        names => names.contains(&check.name),
    };
    Ok((ALL.iter().filter(wanted).collect(), length))
}

/// Provides what the checks need, runs them until one fails, and prints a table and the counts. A check that is not
/// made of tests counts as one; those that were not reached count as skipped.
pub fn run(checks: &[&Check], length: Length) -> ExitCode {
    let mut total = Tally::default();
    let mut table = Vec::new();
    let mut failure = None;

    let started = Instant::now();
    let begin = started;
    let wanted = checks.iter().flat_map(|check| check.needs);
    if let Err(sentence) = needs::provide(wanted) {
        failure = Some(sentence);
        total.failed += 1;
    }
    table.push(("needs", begin.elapsed(), if failure.is_none() { "ok" } else { "FAILED" }));

    for (place, check) in checks.iter().enumerate() {
        if failure.is_some() {
            total.skipped.push((check.name.to_owned(), "not reached".to_owned()));
            table.push((check.name, Duration::ZERO, "not reached"));
            continue;
        }
        let so_far = lasted(started.elapsed());
        eprintln!("\n=== step {} of {}, {so_far} so far: {}: {}", place + 1, checks.len(), check.name, check.what);
        let begin = Instant::now();
        let mut tally = (check.run)(length).unwrap_or_else(|sentence| {
            failure = Some(format!("{}: {sentence}", check.name));
            Tally::default()
        });
        if tally.failed > 0 && failure.is_none() {
            failure = Some(format!("{}: {} failed", check.name, tally.failed));
        }
        if failure.is_some() {
            tally.failed = tally.failed.max(1);
        } else if tally.is_empty() {
            tally.passed = 1;
        }
        table.push((check.name, begin.elapsed(), if failure.is_none() { "ok" } else { "FAILED" }));
        total.add(tally);
    }

    println!("\n{:12} {:>8}  result", "step", "seconds");
    for (name, time, result) in &table {
        println!("{name:12} {:>8.1}  {result}", time.as_secs_f64());
    }
    for (name, reason) in &total.skipped {
        println!("skipped: {name}: {reason}");
    }
    if let Some(sentence) = &failure {
        println!("xtask: {sentence}");
    }
    println!("{} in all", lasted(started.elapsed()));
    println!("{} passed, {} failed, {} skipped", total.passed, total.failed, total.skipped.len());
    if failure.is_none() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// A time as one says it: `4 s`, `12 min 05 s`.
fn lasted(time: Duration) -> String {
    match time.as_secs() {
        seconds @ 0..60 => format!("{seconds} s"),
        seconds => format!("{} min {:02} s", seconds / 60, seconds % 60),
    }
}

/// Runs all tests, even after one has failed, and counts them. Their output is shown if one fails.
/// In the profile of the tests: optimising each of their programs as a whole takes longer than running them, and nobody
/// debugs them here.
fn as_tests(command: &mut Command) -> &mut Command {
    command.env("CARGO_PROFILE_RELEASE_LTO", "off").env("CARGO_PROFILE_RELEASE_DEBUG", "false")
}

fn tests(length: Length) -> Result<Tally, String> {
    let mut command = cargo_command(&["test", "--release", "--workspace", "--features", "greyrig-host/full"]);
    // The output of tests that passed is where they say that they skipped something.
    command.args(["--locked", "--no-fail-fast", "--", "--show-output"]);
    as_tests(&mut command);
    // One more than the processors: some wait for a clock.
    let threads = std::thread::available_parallelism().map_or(2, |n| n.get() + 1);
    command.env("RUST_TEST_THREADS", threads.to_string());
    if length == Length::Long {
        command.env("GREYRIG_LONG", "1");
    }
    let output = command.stderr(Stdio::inherit()).output().map_err(|error| not_started(&command, &error))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let tally = Tally::of(&text);
    if output.status.success() {
        return Ok(tally);
    }
    println!("{text}");
    if tally.failed > 0 { Ok(tally) } else { Err(format!("{} ended with {}", shown(&command), output.status)) }
}

/// Lints and builds what runs on the microcontroller, and looks into the images.
fn firmware(_: Length) -> Result<Tally, String> {
    for (package, feature) in
        [("greyrig", Some("nucleo-g474re")), ("greyrig", Some("mps2-an386")), ("greyrig-target-tests", None)]
    {
        let mut arguments = vec!["clippy", "--target", needs::TARGET, "--profile", "firmware", "--locked"];
        arguments.extend(["--package", package]);
        if let Some(feature) = feature {
            arguments.extend(["--features", feature]);
        }
        arguments.extend(["--", "--deny", "warnings"]);
        cargo(&arguments)?;
    }
    size::images()?;
    Ok(Tally::default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_told_in_minutes_and_seconds() {
        let told = [0, 59, 60, 725].map(|seconds| lasted(Duration::from_secs(seconds)));
        assert_eq!(told, ["0 s", "59 s", "1 min 00 s", "12 min 05 s"]);
    }

    #[test]
    fn steps_are_chosen_by_name() {
        let names = |wanted: &[&str]| {
            let wanted: Vec<String> = wanted.iter().map(|&name| name.to_owned()).collect();
            choose(&wanted).map(|(checks, length)| (checks.iter().map(|check| check.name).collect::<Vec<_>>(), length))
        };
        let usual =
            vec!["fmt", "structure", "dependencies", "book", "page", "clippy", "doc", "firmware", "tests", "python"];
        assert_eq!(names(&[]), Ok((usual.clone(), Length::Usual)));
        assert_eq!(names(&["tests", "fmt"]), Ok((vec!["fmt", "tests"], Length::Usual)));
        assert_eq!(names(&["--long"]), Ok((usual, Length::Long)));
        assert_eq!(names(&["fuzz"]), Ok((vec!["fuzz"], Length::Usual)));
        assert_eq!(names(&["tests", "--long"]), Ok((vec!["tests"], Length::Long)));
        assert!(names(&["fmt", "--long"]).is_err_and(|sentence| sentence.contains("for the step tests")));
        assert!(names(&["tset"]).is_err_and(|sentence| sentence.contains("tset") && sentence.contains("clippy")));
    }
}
