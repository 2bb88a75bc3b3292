//! The command that goes on from an answer, ready for a shell.

use std::fmt;
use std::path::{Path, PathBuf};

/// A command line of this program, or several that follow one another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CommandLine(Vec<String>, Option<Box<CommandLine>>);

impl CommandLine {
    /// Of a command without arguments; one of several words is a part of a command, as `store run`.
    pub fn new(command: &str) -> Self {
        Self(["greyrig"].into_iter().chain(command.split(' ')).map(str::to_owned).collect(), None)
    }

    /// With arguments.
    pub fn with<T: fmt::Display>(mut self, words: impl IntoIterator<Item = T>) -> Self {
        self.0.extend(words.into_iter().map(|word| word.to_string()));
        self
    }

    /// Followed by another one, where it has succeeded.
    pub fn then(mut self, next: Self) -> Self {
        self.1 = Some(Box::new(match self.1.take() {
            Some(own) => own.then(next),
            None => next,
        }));
        self
    }

    /// With files.
    pub fn files<'a>(self, files: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        self.with(files.into_iter().map(|file| file.display()))
    }

    /// With an option, once for each value.
    pub fn option<T: fmt::Display>(mut self, name: &str, values: impl IntoIterator<Item = T>) -> Self {
        for value in values {
            self.0.push(name.to_owned());
            self.0.push(value.to_string());
        }
        self
    }
}

impl fmt::Display for CommandLine {
    /// Each word as a POSIX shell takes it for one.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Only a NUL cannot be quoted, which no argument holds.
        let quoted = shlex::try_join(self.0.iter().map(String::as_str));
        f.write_str(&quoted.unwrap_or_else(|_| self.0.join(" ")))?;
        self.1.as_ref().map_or(Ok(()), |next| write!(f, " && {next}"))
    }
}

/// The first of `model.toml`, `model2.toml`, `model3.toml` … that does not exist, beside a file and by its name.
pub fn unused(model: &Path) -> PathBuf {
    let extension =
        model.extension().map_or_else(|| "toml".into(), |extension| extension.to_string_lossy().into_owned());
    let stem = model.file_stem().map_or_else(|| "model".into(), |stem| stem.to_string_lossy().into_owned());
    // A name that is a number goes on behind a hyphen.
    let stem = match stem.trim_end_matches(|c: char| c.is_ascii_digit()) {
        "" => format!("{stem}-"),
        name => name.to_owned(),
    };
    let numbered = |n: u32| {
        model.with_file_name(format!("{stem}{}.{extension}", if n == 1 { String::new() } else { n.to_string() }))
    };
    (1..).map(numbered).find(|path| !path.exists()).unwrap_or_else(|| numbered(1))
}

/// Files of recordings, and how their columns are named: what a command line says of them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Files {
    /// The files.
    pub recordings: Vec<PathBuf>,
    /// Pieces of `--map`.
    pub map: Vec<String>,
}

impl Files {
    /// A command on the same recordings, read in the same way.
    pub fn again(&self, command: CommandLine) -> CommandLine {
        self.again_with(command, "")
    }

    /// The same with the option that mends them: a channel is mapped once.
    pub fn again_with(&self, command: CommandLine, remedy: &str) -> CommandLine {
        let words = shlex::split(remedy).unwrap_or_default();
        let mapped = |map: &&String| {
            let target = map.split('=').next().unwrap_or_default();
            words.iter().any(|word| word.split('=').next() == Some(target))
        };
        let others = self.map.iter().filter(|map| !mapped(map));
        command.files(&self.recordings).option("--map", others).with(&words)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_takes_each_word_for_one() {
        let line = CommandLine::new("add")
            .with(["saturation"])
            .option("--term", ["torque: k*w"])
            .files(&[PathBuf::from("my run.csv")])
            .option("--model", ["it's.toml"]);
        assert_eq!(line.to_string(), r#"greyrig add saturation --term 'torque: k*w' 'my run.csv' --model "it's.toml""#);
    }

    #[test]
    fn one_command_follows_another() {
        let line = CommandLine::new("store add").with(["a"]).then(CommandLine::new("b")).then(CommandLine::new("c"));
        assert_eq!(line.to_string(), "greyrig store add a && greyrig b && greyrig c");
    }

    #[test]
    fn a_file_that_is_there_is_not_written_over() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let model = folder.path().join("pump.toml");
        assert_eq!(unused(&model), model);
        for name in ["pump.toml", "pump2.toml"] {
            std::fs::write(folder.path().join(name), "").expect("a file");
        }
        assert_eq!(unused(&model), folder.path().join("pump3.toml"));
        assert_eq!(unused(&folder.path().join("pump2.toml")), folder.path().join("pump3.toml"));
        std::fs::write(folder.path().join("1400-.toml"), "").expect("a file");
        assert_eq!(unused(&folder.path().join("1400.toml")), folder.path().join("1400-2.toml"));
    }
}
