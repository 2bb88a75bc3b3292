//! What can go wrong, said in one line: where, what, and what to do; and the exit code that goes with it.

mod insufficient;

use std::fmt;
use std::path::{Path, PathBuf};

pub use insufficient::Insufficient;

use crate::context::Interrupted;
use crate::spelling;

/// Exit code of wrong usage and bad input.
pub const EXIT_BAD_INPUT: u8 = 2;
/// Exit code of trouble with the hardware or the link to it.
pub const EXIT_HARDWARE: u8 = 3;

/// A place in a file: line and column count from one; zero means "not known".
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub path: PathBuf,
    /// Line, from one.
    pub line: usize,
    /// Column, from one.
    pub column: usize,
}

impl Place {
    /// A whole file.
    pub fn file(path: impl AsRef<Path>) -> Self {
        Self { path: path.as_ref().to_owned(), line: 0, column: 0 }
    }
    /// A line and a column of a file.
    pub fn at(path: impl AsRef<Path>, line: usize, column: usize) -> Self {
        Self { path: path.as_ref().to_owned(), line, column }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if self.line > 0 {
            write!(f, ":{}", self.line)?;
            if self.column > 0 {
                write!(f, ":{}", self.column)?;
            }
        }
        Ok(())
    }
}

/// An error that the user can act on.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file holds something that cannot be used.
    #[error("{place}: {what}; {remedy}")]
    Input {
        /// Where it is.
        place: Place,
        /// What is wrong.
        what: String,
        /// What the user can do about it.
        remedy: String,
    },
    /// Recordings do not hold what is asked of them.
    #[error("{place}: {cause}; {}", .cause.remedy())]
    Insufficient {
        /// The first of them.
        place: Place,
        /// What they do not hold.
        cause: Insufficient,
    },
    /// The command line asks for something impossible.
    #[error("{what}; {remedy}")]
    Usage {
        /// What is wrong.
        what: String,
        /// What the user can do about it.
        remedy: String,
    },
    /// The operating system refused a file.
    #[error("{path}: {source}; {remedy}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's own words.
        source: std::io::Error,
        /// What the user can do about it.
        remedy: String,
    },
    /// The hardware, or the link to it, does not do what it should.
    #[error("{what}; {remedy}")]
    Link {
        /// What is wrong.
        what: String,
        /// What the user can do about it.
        remedy: String,
    },
    /// The user pressed Ctrl-C; nothing half-written is left.
    #[error("interrupted; nothing was written")]
    Interrupted,
}

/// A result with the user's kind of error.
pub type Result<T> = std::result::Result<T, Error>;

/// The result of work that the caller can do without: none where recordings or a model do not allow it.
///
/// # Errors
/// All others: an interrupt, what the system refuses, trouble with the hardware.
pub fn if_possible<T>(result: Result<T>) -> Result<Option<T>> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(Error::Input { .. } | Error::Insufficient { .. } | Error::Usage { .. }) => Ok(None),
        Err(other @ (Error::Io { .. } | Error::Link { .. } | Error::Interrupted)) => Err(other),
    }
}

/// A sentence may quote a file, and a quotation may hold line ends.
fn one_line(text: impl Into<String>) -> String {
    text.into().replace(char::is_control, " ")
}

impl Error {
    /// An input error at a place.
    pub fn input(place: Place, what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Input { place, what: one_line(what), remedy: one_line(remedy) }
    }
    /// An error of the command line.
    pub fn usage(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Usage { what: one_line(what), remedy: one_line(remedy) }
    }
    /// A name on the command line that there is not: `introduction` stands before those that there are.
    pub fn unknown<'a>(what: &str, given: &str, known: impl IntoIterator<Item = &'a str>, introduction: &str) -> Self {
        Self::usage(format!("there is no {what} '{given}'"), spelling::advice(given, known, introduction))
    }
    /// Trouble with the hardware or the link to it.
    pub fn link(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Link { what: one_line(what), remedy: one_line(remedy) }
    }
    /// A refusal by the operating system, with the advice that fits its kind.
    pub fn io(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        use std::io::ErrorKind as K;
        let path = path.as_ref().to_owned();
        let remedy = match source.kind() {
            K::NotFound => match spelling::file(&path) {
                Some(meant) => one_line(format!("did you mean {}?", meant.display())),
                None => "check the spelling and the folder".to_owned(),
            },
            K::PermissionDenied => "check the permissions of the file and of its folder".to_owned(),
            K::StorageFull | K::QuotaExceeded => {
                "free some space and run the command again; nothing was written".to_owned()
            }
            K::IsADirectory => "name a file, not a folder".to_owned(),
            _ => "check the file and the medium it is on".to_owned(),
        };
        Self::Io { path, source, remedy }
    }
    /// Recordings that do not hold what is asked of them.
    pub fn insufficient(place: Place, cause: Insufficient) -> Self {
        Self::Insufficient { place, cause }
    }
    /// Where it is, if that is in a file.
    pub fn place(&self) -> Option<String> {
        match self {
            Self::Input { place, .. } | Self::Insufficient { place, .. } => Some(place.to_string()),
            Self::Io { path, .. } => Some(path.display().to_string()),
            Self::Usage { .. } | Self::Link { .. } | Self::Interrupted => None,
        }
    }
    /// What is wrong.
    pub fn what(&self) -> String {
        match self {
            Self::Input { what, .. } | Self::Usage { what, .. } | Self::Link { what, .. } => what.clone(),
            Self::Insufficient { cause, .. } => cause.to_string(),
            Self::Io { source, .. } => source.to_string(),
            Self::Interrupted => Interrupted.to_string(),
        }
    }
    /// What the user can do about it.
    pub fn remedy(&self) -> String {
        match self {
            Self::Input { remedy, .. }
            | Self::Usage { remedy, .. }
            | Self::Io { remedy, .. }
            | Self::Link { remedy, .. } => remedy.clone(),
            Self::Insufficient { cause, .. } => cause.remedy(),
            Self::Interrupted => "run it again; nothing was written".to_owned(),
        }
    }
    /// The exit code for the shell.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Interrupted => 130,
            Self::Link { .. } => EXIT_HARDWARE,
            _ => EXIT_BAD_INPUT,
        }
    }
}

impl From<Interrupted> for Error {
    fn from(_: Interrupted) -> Self {
        Self::Interrupted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_that_can_be_done_without_is_stopped_all_the_same() {
        assert_eq!(if_possible(Ok(1)).unwrap(), Some(1));
        let refused = Error::insufficient(Place::file("run.csv"), Insufficient::NoUsableSample);
        assert_eq!(if_possible::<i32>(Err(refused)).unwrap(), None);
        assert!(matches!(if_possible::<i32>(Err(Interrupted.into())), Err(Error::Interrupted)));
    }
}
