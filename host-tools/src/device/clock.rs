//! The clock by which time-outs are counted: the system's, or that of a virtual board, which may be slower than real
//! time.
//!
//! A board publishes its time in a file: microseconds as a decimal number and a line end. The file is replaced, never
//! changed, so that a reader sees one time or the next.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::error::{Error, Result};
use crate::context::Context;

/// A board whose time has stood still for so long, in real time, has stopped.
const STANDSTILL: Duration = Duration::from_secs(10);

/// How often a pause looks at the clock.
const GLANCE: Duration = Duration::from_millis(5);

/// A clock.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum Clock {
    /// The system's.
    #[default]
    System,
    /// A board's, published in a file.
    Board(PathBuf),
}

impl From<Option<PathBuf>> for Clock {
    fn from(file: Option<PathBuf>) -> Self {
        file.map_or(Self::System, Self::Board)
    }
}

/// Publishes a board's time.
///
/// # Errors
/// What the system says.
pub fn publish(file: &Path, time: Duration) -> std::io::Result<()> {
    let mut new = file.as_os_str().to_owned();
    new.push(".new");
    std::fs::write(&new, format!("{}\n", time.as_micros()))?;
    std::fs::rename(&new, file)
}

fn published(file: &Path) -> Result<Duration> {
    let text = std::fs::read_to_string(file).map_err(|source| Error::NoClock { file: file.to_owned(), source })?;
    let time = text.trim_end().parse().map_err(|_| Error::NoTime(file.to_owned()))?;
    Ok(Duration::from_micros(time))
}

impl Clock {
    /// Begins to wait for so long.
    ///
    /// # Errors
    /// A board's clock that cannot be read.
    pub fn wait(&self, time: Duration) -> Result<Wait<'_>> {
        let real = Instant::now();
        let board = match self {
            Self::System => None,
            Self::Board(file) => Some((file.as_path(), published(file)?)),
        };
        Ok(Wait { board, real, left: time })
    }

    /// Does nothing for so long.
    ///
    /// # Errors
    /// A board's clock that cannot be read, or has stopped; an interrupt.
    pub fn pause(&self, time: Duration, ctx: &Context) -> Result<()> {
        let mut wait = self.wait(time)?;
        while !wait.is_over()? {
            ctx.check()?;
            std::thread::sleep(GLANCE);
        }
        Ok(())
    }
}

/// A time that passes.
#[derive(Debug)]
pub struct Wait<'a> {
    /// A board's clock, and what it has shown last.
    board: Option<(&'a Path, Duration)>,
    /// When the clock has moved last, in real time.
    real: Instant,
    left: Duration,
}

impl Wait<'_> {
    /// Whether the time is up.
    ///
    /// # Errors
    /// A board's clock that cannot be read, or has stopped.
    pub fn is_over(&mut self) -> Result<bool> {
        let real = Instant::now();
        let shown = self.board.map(|(file, _)| published(file)).transpose()?;
        self.pass(real, shown)
    }

    /// The clocks show these times.
    fn pass(&mut self, real: Instant, shown: Option<Duration>) -> Result<bool> {
        let still = real.saturating_duration_since(self.real);
        let passed = match (&mut self.board, shown) {
            (Some((file, before)), Some(now)) => {
                if now == *before && still >= STANDSTILL {
                    return Err(Error::Standstill { file: file.to_owned(), seconds: still.as_secs() });
                }
                if now == *before {
                    return Ok(self.left.is_zero());
                }
                // A board that was started anew begins at zero: nothing has passed.
                let passed = now.saturating_sub(*before);
                *before = now;
                passed
            }
            _ => still,
        };
        self.real = real;
        self.left = self.left.saturating_sub(passed);
        Ok(self.left.is_zero())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn the_systems_clock_is_real_time() {
        let mut wait = Clock::System.wait(SECOND).unwrap();
        let begin = wait.real;
        assert!(!wait.pass(begin + SECOND / 2, None).unwrap());
        assert!(!wait.pass(begin + SECOND * 9 / 10, None).unwrap());
        assert!(wait.pass(begin + SECOND, None).unwrap());
    }

    #[test]
    fn a_boards_clock_is_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("clock");
        let clock = Clock::Board(file.clone());
        let missing = clock.wait(SECOND).unwrap_err();
        assert!(matches!(&missing, Error::NoClock { file: told, .. } if *told == file), "{missing}");
        publish(&file, 5 * SECOND).unwrap();
        let mut wait = clock.wait(SECOND).unwrap();
        let begin = wait.real;
        // An hour of real time, in which the board moves on each nine seconds.
        for n in 0..400 {
            assert!(!wait.pass(begin + 9 * n * SECOND, Some(5 * SECOND + n * SECOND / 400)).unwrap(), "{n}");
        }
        publish(&file, 6 * SECOND).unwrap();
        assert!(wait.is_over().unwrap());
        std::fs::write(&file, "noon").unwrap();
        assert!(matches!(wait.is_over(), Err(Error::NoTime(_))));
    }

    /// Nobody waits for ever, and not because a board begins at zero again either.
    #[test]
    fn a_board_that_has_stopped_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("clock");
        publish(&file, 5 * SECOND).unwrap();
        let clock = Clock::Board(file);
        let mut wait = clock.wait(SECOND).unwrap();
        let begin = wait.real;
        assert!(!wait.pass(begin + 9 * SECOND, Some(5 * SECOND)).unwrap());
        assert!(!wait.pass(begin + 9 * SECOND, Some(SECOND)).unwrap());
        assert!(!wait.pass(begin + 18 * SECOND, Some(SECOND)).unwrap());
        let stopped = wait.pass(begin + 19 * SECOND, Some(SECOND)).unwrap_err();
        assert!(matches!(stopped, Error::Standstill { seconds: 10, .. }), "{stopped}");
        let mut wait = clock.wait(SECOND).unwrap();
        assert!(!wait.pass(begin, Some(SECOND)).unwrap());
        assert!(wait.pass(begin, Some(2 * SECOND)).unwrap());
    }
}
