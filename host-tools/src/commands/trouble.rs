//! What has gone wrong, told: a line on stderr, and with `--json` an object on stdout as well.

use std::ffi::OsString;
use std::process::ExitCode;

use clap::error::ErrorKind;
use serde_json::json;

use super::stdout;
use crate::error::{EXIT_BAD_INPUT, Error};

/// What a command line has asked for, as far as that is told before it is understood.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Asked {
    /// The command, by the words that name it.
    command: String,
    /// Whether one JSON object is wanted on stdout.
    json: bool,
}

impl Asked {
    /// Of a command line, the program's own name first.
    pub fn of(arguments: &[OsString]) -> Self {
        let words: Vec<&str> =
            arguments.iter().skip(1).map_while(|word| word.to_str().filter(|word| *word != "--")).collect();
        let has_parts = words.first().is_some_and(|word| ["anfis", "store"].contains(word));
        let depth = if has_parts { 2 } else { 1 };
        let named = words.iter().take_while(|word| !word.starts_with('-')).take(depth);
        Self { command: named.copied().collect::<Vec<_>>().join(" "), json: words.contains(&"--json") }
    }

    /// Tells what has gone wrong, and the exit code of that.
    pub fn tell(&self, error: &Error) -> ExitCode {
        eprintln!("greyrig: {error}");
        self.answer(error.place(), &error.what(), &error.remedy());
        ExitCode::from(error.exit_code())
    }

    /// Tells of a command line that is not understood, in one line; help and version go to stdout as they are.
    pub fn tell_usage(&self, error: &clap::Error) -> ExitCode {
        const REMEDY: &str = "--help shows what there is";
        if !error.use_stderr() {
            // A reader that has gone away is no concern here.
            let _ = error.print();
            return ExitCode::SUCCESS;
        }
        if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
            let _ = error.print();
            self.answer(None, "there is no command", REMEDY);
            return ExitCode::from(EXIT_BAD_INPUT);
        }
        let text = error.render().to_string();
        let told: Vec<&str> = text
            .lines()
            .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
            .map(str::trim)
            .filter(|line| !line.is_empty())
            .collect();
        let told = told.join(" ");
        let what = told.trim_start_matches("error: ");
        eprintln!("greyrig: {what}; {REMEDY}");
        self.answer(None, what, REMEDY);
        ExitCode::from(EXIT_BAD_INPUT)
    }

    fn answer(&self, place: Option<String>, what: &str, remedy: &str) {
        if self.json {
            let error = json!({ "place": place, "what": what, "remedy": remedy });
            // Where stdout is what has failed, the line on stderr has to do.
            let _ = stdout::print_line(&json!({ "schema": 1, "command": self.command, "error": error }).to_string());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_for_is_told_of_any_command_line() {
        let of = |line: &str| Asked::of(&line.split(' ').map(OsString::from).collect::<Vec<_>>());
        let asked = |command: &str, json| Asked { command: command.to_owned(), json };
        assert_eq!(of("greyrig compare run.csv --json --model m.toml"), asked("compare", true));
        assert_eq!(of("greyrig anfis fit --json"), asked("anfis fit", true));
        assert_eq!(of("greyrig --json nonsense"), asked("", true));
        assert_eq!(of("greyrig convert -- --json"), asked("convert", false));
        assert_eq!(of("greyrig"), asked("", false));
    }
}
