//! What became of the changes: counts, the list of before, and those of which it is known that nothing can notice them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// What became of a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// A test failed.
    Caught,
    /// A test did not end.
    Endless,
    /// All tests passed, or none reaches it.
    Missed,
    /// It is in a constant, or no program.
    NotBuilt,
}

const WORDS: [(Outcome, &str); 4] = [
    (Outcome::Caught, "caught"),
    (Outcome::Endless, "endless"),
    (Outcome::Missed, "missed"),
    (Outcome::NotBuilt, "not built"),
];

/// Counts of outcomes.
#[derive(Debug, Default, Clone, Copy)]
pub struct Counts {
    noticed: usize,
    missed: usize,
    /// Missed, and listed with a reason.
    listed: usize,
    not_built: usize,
}

impl Counts {
    /// Counts one more.
    pub fn add(&mut self, outcome: Outcome, is_listed: bool) {
        match outcome {
            Outcome::Caught | Outcome::Endless => self.noticed += 1,
            Outcome::Missed if is_listed => self.listed += 1,
            Outcome::Missed => self.missed += 1,
            Outcome::NotBuilt => self.not_built += 1,
        }
    }

    fn row(&self, name: &str) -> String {
        let viable = self.noticed + self.missed;
        let share =
            if viable > 0 { format!("{:.1} %", 100.0 * self.noticed as f64 / viable as f64) } else { "–".into() };
        let Self { noticed, missed, listed, not_built } = self;
        format!("{name:52} {noticed:8} {missed:8} {listed:8} {not_built:10} {share:>9}\n")
    }
}

/// A row for each file, and their sum.
pub fn table(counts: &BTreeMap<&str, Counts>) -> String {
    let mut text = format!(
        "{:52} {:>8} {:>8} {:>8} {:>10} {:>9}\n",
        "file", "noticed", "missed", "listed", "not built", "noticed"
    );
    let mut sum = Counts::default();
    for (file, of) in counts {
        text += &of.row(file);
        sum.noticed += of.noticed;
        sum.missed += of.missed;
        sum.listed += of.listed;
        sum.not_built += of.not_built;
    }
    text + &sum.row("all")
}

/// The changes that `docs/mutants.md` lists: what stands between backticks in the first column of the table of
/// survivors.
pub fn listed(root: &Path) -> Result<BTreeSet<String>, String> {
    let path = root.join("docs/mutants.md");
    let text = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    Ok(survivors(&text))
}

fn survivors(text: &str) -> BTreeSet<String> {
    let (_, section) = text.split_once("\n## Survivors\n").unwrap_or_default();
    let first = |line: &str| Some(line.strip_prefix("| `")?.split_once("` |")?.0.replace("\\|", "|"));
    section.lines().filter_map(first).collect()
}

/// What an earlier run wrote; nothing where there is none.
pub fn read(file: &Path) -> BTreeMap<String, Outcome> {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let entry = |line: &str| {
        let (word, name) = line.split_once('\t')?;
        WORDS.iter().find(|(_, known)| *known == word).map(|(outcome, _)| (name.to_owned(), *outcome))
    };
    text.lines().filter_map(entry).collect()
}

/// Writes the outcomes.
///
/// # Errors
/// Where the file cannot be written.
pub fn write(file: &Path, outcomes: &BTreeMap<String, Outcome>) -> Result<(), String> {
    let word = |outcome: &Outcome| WORDS.iter().find(|(known, _)| known == outcome).map_or("", |(_, word)| word);
    let text: String = outcomes.iter().map(|(name, outcome)| format!("{}\t{name}\n", word(outcome))).collect();
    std::fs::write(file, text).map_err(|error| format!("{}: {error}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn survivors_are_read_from_their_table() {
        let text = "| `before` | x |\n## Survivors\n\n| change | reason |\n| --- | --- |\n| `a: replace \\|\\| with &&` | why |\n";
        assert_eq!(survivors(text), BTreeSet::from(["a: replace || with &&".to_owned()]));
    }

    #[test]
    fn shares_are_of_what_could_be_noticed() {
        let mut counts = Counts::default();
        (0..9).for_each(|_| counts.add(Outcome::Caught, false));
        counts.add(Outcome::Missed, false);
        counts.add(Outcome::Missed, true);
        counts.add(Outcome::NotBuilt, false);
        assert!(counts.row("x").ends_with("90.0 %\n"), "{}", counts.row("x"));
    }
}
