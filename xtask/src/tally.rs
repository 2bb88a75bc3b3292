//! Counts of tests, read from what Rust's test harness prints.

/// How many tests passed, failed, and were skipped.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Tests that ran and held.
    pub passed: usize,
    /// Tests that did not hold.
    pub failed: usize,
    /// Tests that were ignored, or that said `skipped: REASON`: name and reason.
    pub skipped: Vec<(String, String)>,
}

impl Tally {
    /// Reads the output of `cargo test … -- --show-output`. A test that prints a line `skipped: REASON` passes as far
    /// as the harness knows; here it does not.
    pub fn of(output: &str) -> Self {
        let mut tally = Self::default();
        let mut test = None;
        let mut silently_skipped: usize = 0;
        let mut of_failed_tests = false;
        for line in output.lines() {
            if let Some(summary) = line.strip_prefix("test result: ") {
                tally.passed += number_before(summary, " passed");
                tally.failed += number_before(summary, " failed");
                (test, of_failed_tests) = (None, false);
            } else if line == "failures:" {
                of_failed_tests = true;
            } else if of_failed_tests {
                // They count as failed, whatever else they say.
            } else if let Some(name) = line.strip_prefix("---- ").and_then(|rest| rest.strip_suffix(" stdout ----")) {
                test = Some(name);
            } else if let (Some(name), Some(reason)) = (test, line.strip_prefix("skipped: ")) {
                silently_skipped += 1;
                tally.skipped.push((name.to_owned(), reason.to_owned()));
                // It may leave out several of its cases, and is one test all the same.
                test = None;
            } else if let Some((name, reason)) = line.strip_prefix("test ").and_then(|r| r.split_once(" ... ignored")) {
                let reason = reason.strip_prefix(", ").unwrap_or("ignored");
                tally.skipped.push((name.to_owned(), reason.to_owned()));
            }
        }
        tally.passed = tally.passed.saturating_sub(silently_skipped);
        tally
    }

    /// Whether there was no test at all.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Adds another count to this one.
    pub fn add(&mut self, other: Self) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.skipped.extend(other.skipped);
    }
}

/// The number before a word of the summary `ok. 3 passed; 1 failed; …`.
fn number_before(summary: &str, word: &str) -> usize {
    let before = summary.split(word).next().filter(|before| before.len() < summary.len());
    before.and_then(|before| before.rsplit(' ').next()).and_then(|number| number.parse().ok()).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_what_the_harness_prints() {
        // As rustc 1.95's harness prints it.
        let output = "\nrunning 4 tests\ntest a ... ok\ntest reads::mdf ... ok\ntest slow ... ignored, takes an hour\n\
            test broken ... FAILED\n\nsuccesses:\n\n---- a stdout ----\nnothing skipped: here\n\n---- reads::mdf stdout ----\n\
            skipped: no data\nskipped: no data either\n\n\nsuccesses:\n    a\n    reads::mdf\n\nfailures:\n\n\
            ---- broken stdout ----\nskipped: no data\nassertion failed\n\ntest result: FAILED. 2 passed; 1 failed; 1 ignored; 0 measured; \
            0 filtered out; finished in 0.01s\n\nrunning 11 tests\n\
            test result: ok. 11 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s\n";
        let skipped = [("slow", "takes an hour"), ("reads::mdf", "no data")];
        let skipped = skipped.map(|(name, reason)| (name.to_owned(), reason.to_owned())).to_vec();
        assert_eq!(Tally::of(output), Tally { passed: 12, failed: 1, skipped });
    }
}
