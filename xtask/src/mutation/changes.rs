//! What cargo-mutants would change.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::cargo::{cargo_command, not_started, shown};

/// A line and a column, both from 1; columns count characters.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Position {
    pub line: usize,
    pub column: usize,
}

/// From here to there.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Span {
    pub start: Position,
    pub end: Position,
}

/// A piece of text, and what is to stand there.
#[derive(Debug, Clone, Deserialize)]
pub struct Change {
    /// From the repository's root.
    pub file: String,
    /// Sort of change: `FnValue`, `BinaryOperator`, …
    pub genre: String,
    /// File, line, column and what is done.
    name: String,
    pub replacement: String,
    pub span: Span,
}

#[cfg(test)]
impl Change {
    /// One without a name of its own.
    pub fn of(file: &str, genre: &str, replacement: &str, span: Span) -> Self {
        let [file, genre, replacement, name] = [file, genre, replacement, ""].map(str::to_owned);
        Self { file, genre, name, replacement, span }
    }
}

/// What can be changed in a package.
///
/// # Errors
/// Where cargo-mutants fails or prints something else than it did.
pub fn list(package: &str) -> Result<Vec<Change>, String> {
    let mut command = cargo_command(&["mutants", "--list", "--json", "--package", package]);
    let output = command.output().map_err(|error| not_started(&command, &error))?;
    if !output.status.success() {
        return Err(format!("{} failed: {}", shown(&command), String::from_utf8_lossy(&output.stderr)));
    }
    serde_json::from_slice(&output.stdout).map_err(|error| format!("{}: {error}", shown(&command)))
}

/// What each change is called: file and what is done, without the line, which the next edit moves; with a number where
/// a file has several alike.
pub fn names(changes: &[Change]) -> Vec<String> {
    let plain = |change: &Change| {
        let what = change.name.splitn(4, ':').nth(3).unwrap_or(&change.name);
        format!("{}:{what}", change.file)
    };
    let mut of_a_name: BTreeMap<String, usize> = BTreeMap::new();
    changes.iter().for_each(|change| *of_a_name.entry(plain(change)).or_default() += 1);
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    let number = |change: &Change| {
        let name = plain(change);
        let seen = seen.entry(name.clone()).or_default();
        *seen += 1;
        if of_a_name[&name] == 1 { name } else { format!("{name} ({seen})") }
    };
    changes.iter().map(number).collect()
}
