//! What has gone wrong, told: a line on stderr, and with `--json` an object on stdout as well.

use std::ffi::OsString;
use std::process::ExitCode;

use clap::CommandFactory;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use serde_json::json;

use super::Cli;
use super::paint::{STRONG, painted};
use super::{stderr, stdout};
use crate::error::{EXIT_BAD_INPUT, Error};
use crate::spelling;

/// What a command line has asked for, as far as that is told before it is understood.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Asked {
    /// The command, by the words that name it.
    command: String,
    /// Whether one JSON object is wanted on stdout.
    json: bool,
    /// Whether there is anything at all.
    nothing: bool,
}

impl Asked {
    /// Of a command line, the program's own name first.
    pub fn of(arguments: &[OsString]) -> Self {
        let words: Vec<&str> =
            arguments.iter().skip(1).map_while(|word| word.to_str().filter(|word| *word != "--")).collect();
        let has_parts = words.first().is_some_and(|word| ["anfis", "store"].contains(word));
        let depth = if has_parts { 2 } else { 1 };
        let named = words.iter().take_while(|word| !word.starts_with('-')).take(depth);
        let command = named.copied().collect::<Vec<_>>().join(" ");
        Self { command, json: words.contains(&"--json"), nothing: arguments.len() < 2 }
    }

    /// Tells what has gone wrong, and the exit code of that.
    pub fn tell(&self, error: &Error) -> ExitCode {
        stderr::trouble(error);
        self.answer(error.place(), &error.what(), &error.remedy());
        ExitCode::from(error.exit_code())
    }

    /// Tells of a command line that is not understood, in one line; help and version go to stdout as they are, and who
    /// asks for nothing is greeted.
    pub fn tell_usage(&self, error: &clap::Error) -> ExitCode {
        const REMEDY: &str = "--help shows what there is";
        if !error.use_stderr() {
            // A reader that has gone away is no concern here.
            let _ = error.print();
            return ExitCode::SUCCESS;
        }
        if self.nothing {
            // The same.
            let _ = stdout::print_line(&greeting());
            return ExitCode::SUCCESS;
        }
        if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
            let _ = error.print();
            self.answer(None, "there is no command", REMEDY);
            return ExitCode::from(EXIT_BAD_INPUT);
        }
        let what = wrong(error);
        let remedy = self.meant(error).map_or_else(|| REMEDY.to_owned(), |name| format!("did you mean {name}?"));
        stderr::trouble(format!("{what}; {remedy}"));
        self.answer(None, &what, &remedy);
        ExitCode::from(EXIT_BAD_INPUT)
    }

    /// What was meant by a name that the command line does not know.
    fn meant(&self, error: &clap::Error) -> Option<String> {
        let text = |kind: ContextKind| match error.get(kind)? {
            ContextValue::String(text) => Some(text.clone()),
            ContextValue::Strings(texts) => texts.first().cloned(),
            _ => None,
        };
        let mut program = Cli::command();
        let (given, known) = match error.kind() {
            ErrorKind::InvalidSubcommand => {
                let parent = self.command.split(' ').next().and_then(|name| program.find_subcommand(name));
                let commands = parent.unwrap_or(&program).get_subcommands();
                (text(ContextKind::InvalidSubcommand)?, commands.map(|c| c.get_name().to_owned()).collect())
            }
            ErrorKind::UnknownArgument => {
                program.build();
                let command = self.command.split(' ').try_fold(&program, |at, name| at.find_subcommand(name))?;
                let options = command.get_arguments().filter_map(|argument| argument.get_long());
                (text(ContextKind::InvalidArg)?, options.map(|name| format!("--{name}")).collect::<Vec<_>>())
            }
            ErrorKind::InvalidValue => match error.get(ContextKind::ValidValue)? {
                ContextValue::Strings(known) => (text(ContextKind::InvalidValue)?, known.clone()),
                _ => return None,
            },
            _ => return None,
        };
        spelling::meant(&given, known.iter().map(String::as_str)).map(str::to_owned)
    }

    fn answer(&self, place: Option<String>, what: &str, remedy: &str) {
        if self.json {
            let error = json!({ "place": place, "what": what, "remedy": remedy });
            // Where stdout is what has failed, the line on stderr has to do.
            let _ =
                stdout::print_as_it_is(&json!({ "schema": 1, "command": self.command, "error": error }).to_string());
        }
    }
}

/// What is wrong with a command line, in one line and without advice.
fn wrong(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let told: Vec<&str> = text
        .lines()
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .map(str::trim)
        .filter(|line| !line.is_empty() && !line.starts_with("tip:"))
        .collect();
    told.join(" ").trim_start_matches("error: ").to_owned()
}

/// What there is to begin with, for whoever calls the program by its name alone.
fn greeting() -> String {
    let command = |text: &str| painted(STRONG, text);
    format!(
        "greyrig {}: models of electric motors that say what they are missing.\n\
         {} shows the whole story on built-in data, without hardware.\n\
         {} begins with your own data; {} tells the rest.",
        env!("CARGO_PKG_VERSION"),
        command("greyrig demo"),
        command("greyrig check RUN.csv"),
        command("greyrig --help"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_for_is_told_of_any_command_line() {
        let of = |line: &str| Asked::of(&line.split(' ').map(OsString::from).collect::<Vec<_>>());
        let asked = |command: &str, json| Asked { command: command.to_owned(), json, nothing: false };
        assert_eq!(of("greyrig compare run.csv --json --model m.toml"), asked("compare", true));
        assert_eq!(of("greyrig anfis fit --json"), asked("anfis fit", true));
        assert_eq!(of("greyrig --json nonsense"), asked("", true));
        assert_eq!(of("greyrig convert -- --json"), asked("convert", false));
        assert_eq!(of("greyrig"), Asked { nothing: true, ..Asked::default() });
    }
}
