//! A copy of the repository in which a package has all its changes, each behind a switch.

use std::collections::{BTreeMap, BTreeSet};
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use cargo_metadata::Message;
use cargo_metadata::diagnostic::DiagnosticLevel;

use super::Part;
use super::changes::Change;
use super::switch::{self, Switched};
use crate::cargo::{cargo_command, not_started, shown};

/// More attempts than this are a mistake of the program: each leaves out what did not build in the one before.
const ATTEMPTS: usize = 20;

/// The tests, and where each change went: the number of the switch that it stands behind, if it could be built.
pub struct Built {
    pub programs: Vec<PathBuf>,
    pub places: Vec<Option<usize>>,
}

/// Copies, changes and builds.
///
/// # Errors
/// What does not build for another reason than a change.
pub fn build(part: &Part, changes: &[Change], root: &Path, tree: &Path) -> Result<Built, String> {
    let mut files: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    changes.iter().enumerate().for_each(|(k, change)| files.entry(&change.file).or_default().push(k));
    let library = Path::new(part.folder).join("src/lib.rs");
    let library = library.strip_prefix(".").unwrap_or(&library);
    for file in tracked(root)? {
        if !files.contains_key(file.as_str()) && Path::new(&file) != library {
            put(&tree.join(&file), &std::fs::read(root.join(&file)).map_err(|e| format!("{file}: {e}"))?)?;
        }
    }
    let text =
        std::fs::read_to_string(root.join(library)).map_err(|error| format!("{}: {error}", library.display()))?;
    put(&tree.join(library), switch::library(&text).as_bytes())?;

    let mut left_out: BTreeSet<usize> = BTreeSet::new();
    for _ in 0..ATTEMPTS {
        let mut switched: BTreeMap<&str, Switched> = BTreeMap::new();
        for (file, numbers) in &files {
            let source = std::fs::read_to_string(root.join(file)).map_err(|error| format!("{file}: {error}"))?;
            let numbers = numbers.iter().filter(|k| !left_out.contains(k)).map(|k| (*k, &changes[*k])).collect();
            let result = switch::file(&source, numbers).map_err(|error| format!("{file}: {error}"))?;
            put(&tree.join(file), result.text.as_bytes())?;
            switched.insert(file, result);
        }
        match attempt(part, tree)? {
            Attempt::Built(programs) => {
                let mut places = vec![None; changes.len()];
                switched.values().flat_map(|s| &s.placed).for_each(|placed| places[placed.change] = Some(placed.place));
                return Ok(Built { programs, places });
            }
            Attempt::Errors(errors) => {
                let before = left_out.len();
                for error in &errors {
                    let file = switched.get(error.file.as_str());
                    left_out.extend(file.map(|s| s.at(error.byte)).unwrap_or_default());
                }
                if left_out.len() == before {
                    // What a change breaks elsewhere in its file.
                    let of_files = errors.iter().filter_map(|error| files.get(error.file.as_str())).flatten();
                    left_out.extend(of_files.copied());
                }
                if left_out.len() == before {
                    let first = errors.first().map_or("no reason", |error| &error.text);
                    return Err(format!("{} does not build for a reason that is no change: {first}", part.package));
                }
            }
        }
    }
    Err(format!("{}: what is changed does not build after {ATTEMPTS} attempts", part.package))
}

/// An error of the compiler.
struct BuildError {
    file: String,
    byte: usize,
    text: String,
}

enum Attempt {
    Built(Vec<PathBuf>),
    Errors(Vec<BuildError>),
}

/// Builds the tests: what they stand on as for releases, our own code with checks of overflow and quickly.
fn attempt(part: &Part, tree: &Path) -> Result<Attempt, String> {
    let mut command =
        cargo_command(&["test", "--no-run", "--release", "--locked", "--message-format", "json", "--quiet"]);
    command.args(["--package", part.package]).args(part.tests);
    for package in ["greyrig", "greyrig-host"] {
        for setting in ["opt-level=1", "overflow-checks=true", "debug-assertions=true"] {
            command.arg("--config").arg(format!("profile.release.package.{package}.{setting}"));
        }
    }
    let settings = [("LTO", "off"), ("DEBUG", "false"), ("INCREMENTAL", "true")];
    settings.iter().for_each(|(name, value)| _ = command.env(format!("CARGO_PROFILE_RELEASE_{name}"), value));
    command.current_dir(tree).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut child = command.spawn().map_err(|error| not_started(&command, &error))?;
    let output = BufReader::new(child.stdout.take().ok_or("cargo without its output")?);
    let (mut programs, mut errors) = (Vec::new(), Vec::new());
    for message in Message::parse_stream(output) {
        match message.map_err(|error| error.to_string())? {
            Message::CompilerArtifact(artifact) if artifact.profile.test => {
                programs.extend(artifact.executable.map(PathBuf::from));
            }
            Message::CompilerMessage(of) if of.message.level == DiagnosticLevel::Error => {
                let spans = of.message.spans.iter().filter(|span| span.is_primary);
                let text = of.message.rendered.clone().unwrap_or_else(|| of.message.message.clone());
                errors.extend(spans.map(|span| BuildError {
                    file: span.file_name.clone(),
                    byte: span.byte_start as usize,
                    text: text.clone(),
                }));
            }
            _ => {}
        }
    }
    let status = child.wait().map_err(|error| error.to_string())?;
    if status.success() {
        Ok(Attempt::Built(programs))
    } else if errors.is_empty() {
        Err(format!("{} ended with {status}", shown(&command)))
    } else {
        Ok(Attempt::Errors(errors))
    }
}

/// Files of the repository, those that are new included.
fn tracked(root: &Path) -> Result<Vec<String>, String> {
    let mut command = Command::new("git");
    command.args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]).current_dir(root);
    let output = command.output().map_err(|error| not_started(&command, &error))?;
    let names = String::from_utf8_lossy(&output.stdout);
    let there = |name: &&str| root.join(name).is_file();
    Ok(names.split('\0').filter(|name| !name.is_empty()).filter(there).map(str::to_owned).collect())
}

/// Writes a file unless it is as it should be, so that Cargo builds nothing anew without a need.
fn put(path: &Path, bytes: &[u8]) -> Result<(), String> {
    if std::fs::read(path).is_ok_and(|there| there == bytes) {
        return Ok(());
    }
    let folder = path.parent().unwrap_or(path);
    let written = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(path, bytes));
    written.map_err(|error| format!("{}: {error}", path.display()))
}
