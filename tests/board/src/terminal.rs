//! A pseudo-terminal in place of the ST-LINK's serial port.

use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};

use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// What waits for a host that does not read: more is lost, as it is on a serial line.
const MOST_WAITING: usize = 1 << 16;

/// The board's end of the terminal.
pub struct Terminal {
    own: File,
    /// Kept open, so that the terminal stays when a host closes its end.
    _other: File,
    name: String,
    waiting: VecDeque<u8>,
}

impl Terminal {
    /// Opens a new one: bytes pass as they are.
    ///
    /// # Errors
    /// What the system says.
    pub fn open() -> io::Result<Self> {
        let own = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&own)?;
        unlockpt(&own)?;
        let name = ptsname(&own, Vec::new())?.into_string().map_err(|_| ErrorKind::InvalidData)?;
        let other = rustix::fs::open(&name, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())?;
        let mut settings = tcgetattr(&other)?;
        settings.make_raw();
        tcsetattr(&other, OptionalActions::Now, &settings)?;
        rustix::io::ioctl_fionbio(&own, true)?;
        Ok(Self { own: own.into(), _other: other.into(), name, waiting: VecDeque::new() })
    }

    /// What the host opens.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the host has written.
    ///
    /// # Errors
    /// What the system says.
    pub fn read(&mut self) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; 4096];
        match self.own.read(&mut bytes) {
            Ok(count) => {
                bytes.truncate(count);
                Ok(bytes)
            }
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(Vec::new()),
            Err(e) => Err(e),
        }
    }

    /// Writes for the host; what it does not take waits.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.waiting.extend(bytes);
        let surplus = self.waiting.len().saturating_sub(MOST_WAITING);
        self.waiting.drain(..surplus);
        while !self.waiting.is_empty() {
            match self.own.write(self.waiting.as_slices().0) {
                Ok(count) => {
                    self.waiting.drain(..count);
                }
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => break,
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }
}
