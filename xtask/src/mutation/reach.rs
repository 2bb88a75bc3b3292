//! Which tests reach a change, and whether they notice it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use super::outcome::Outcome;
use super::switch::{REACHED, VARIABLE};
use crate::cargo::not_started;

/// Tests run in up to three lots, the quickest ones first: those that take up to so many seconds together, and the
/// rest.
const LOTS_S: [f64; 3] = [0.5, 5.0, f64::INFINITY];
/// A lot that takes so many times as long as without a change does not end.
const PATIENCE: f64 = 10.0;
/// Added to it, for a machine that is busy, s.
const AT_LEAST_S: f64 = 15.0;
/// What a test may take of the memory's addresses, KiB: a change may fill any memory.
const MEMORY_KIB: u64 = 16_000_000;

/// A test.
struct Test {
    program: PathBuf,
    name: String,
    seconds: f64,
}

/// Tests, and what each reaches.
pub struct Reach {
    folder: PathBuf,
    tests: Vec<Test>,
    /// For each place the tests, by number.
    of_place: BTreeMap<usize, BTreeSet<usize>>,
}

/// Runs each test in a process of its own and without a change.
///
/// # Errors
/// A test that fails though nothing is changed.
pub fn measure(programs: &[PathBuf], folder: &Path, file: &Path) -> Result<Reach, String> {
    let mut reach = Reach { folder: folder.to_owned(), tests: Vec::new(), of_place: BTreeMap::new() };
    for program in programs {
        let mut list = Command::new(program);
        list.args(["--list", "--format", "terse"]).current_dir(folder);
        let output = list.output().map_err(|error| not_started(&list, &error))?;
        for name in String::from_utf8_lossy(&output.stdout).lines().filter_map(|line| line.strip_suffix(": test")) {
            reach.add(program, name, file)?;
        }
    }
    Ok(reach)
}

impl Reach {
    fn add(&mut self, program: &Path, name: &str, file: &Path) -> Result<(), String> {
        // Nothing to lose where there is none.
        let _ = std::fs::remove_file(file);
        let begin = Instant::now();
        let mut command = Command::new(program);
        command.args(["--exact", name]).current_dir(&self.folder).env(REACHED, file);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let status = command.status().map_err(|error| not_started(&command, &error))?;
        if !status.success() {
            return Err(format!("{name} fails though nothing is changed"));
        }
        let seconds = begin.elapsed().as_secs_f64();
        let reached = std::fs::read_to_string(file).unwrap_or_default();
        for place in reached.lines().filter_map(|line| line.parse().ok()) {
            self.of_place.entry(place).or_default().insert(self.tests.len());
        }
        self.tests.push(Test { program: program.to_owned(), name: name.to_owned(), seconds });
        Ok(())
    }

    /// Whether a test notices a change, by its number and the place that it stands at.
    ///
    /// # Errors
    /// Where the tests cannot be started.
    pub fn try_change(&self, number: usize, place: usize) -> Result<Outcome, String> {
        let mut tests: Vec<&Test> =
            self.of_place.get(&place).into_iter().flatten().map(|test| &self.tests[*test]).collect();
        tests.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        let mut rest = &tests[..];
        for lot_s in LOTS_S {
            let mut sum = 0.0;
            let within = |test: &&&Test| {
                sum += test.seconds;
                sum <= lot_s
            };
            let (lot, others) = rest.split_at(rest.iter().take_while(within).count());
            rest = others;
            for program in lot.iter().map(|test| &test.program).collect::<BTreeSet<_>>() {
                let own: Vec<&Test> = lot.iter().filter(|test| test.program == *program).copied().collect();
                match self.run(number, program, &own)? {
                    None => return Ok(Outcome::Endless),
                    Some(status) if !status.success() => return Ok(Outcome::Caught),
                    Some(_) => {}
                }
            }
        }
        Ok(Outcome::Missed)
    }

    /// `None` after too long a time.
    fn run(&self, number: usize, program: &Path, tests: &[&Test]) -> Result<Option<ExitStatus>, String> {
        let limit_s = tests.iter().map(|test| test.seconds).sum::<f64>() * PATIENCE + AT_LEAST_S;
        let names = tests.iter().map(|test| &test.name);
        // A shell, since only it can tell the system what a process may take.
        let mut command = Command::new("sh");
        command.arg("-c").arg(format!("ulimit -c 0; ulimit -v {MEMORY_KIB}; exec \"$0\" \"$@\"")).arg(program);
        command.arg("--exact").args(names).current_dir(&self.folder).env(VARIABLE, (number + 1).to_string());
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = command.spawn().map_err(|error| not_started(&command, &error))?;
        wait(&mut child, limit_s).map_err(|error| format!("{}: {error}", program.display()))
    }
}

fn wait(child: &mut Child, limit_s: f64) -> std::io::Result<Option<ExitStatus>> {
    let begin = Instant::now();
    while begin.elapsed().as_secs_f64() < limit_s {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        sleep(Duration::from_millis(5));
    }
    child.kill()?;
    child.wait()?;
    Ok(None)
}
