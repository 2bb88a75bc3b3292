//! A recording from the microcontroller: every sample in its place, and what was lost marked.

use std::ops::Range;
use std::time::Duration;

use greyrig::link::message::{Message, Request, Samples};
use greyrig::link::packing;
use greyrig::units::Counts;

use super::connection::{Connection, Device, Port};
use super::update::reopen;
use crate::error::{Error, Result};
use crate::output;

/// Without a sample for so long, something is wrong.
const SILENCE: Duration = Duration::from_secs(3);

/// Consecutive samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Capture {
    /// Number of the first one, since the microcontroller's start.
    pub first: u32,
    /// One per sample; none where it was lost.
    pub samples: Vec<Option<Counts>>,
    /// How often the link was opened again.
    pub reconnections: usize,
}

impl Capture {
    /// Nothing yet, with room for a number of samples.
    pub fn with_room(count: usize) -> Self {
        Self { first: 0, samples: Vec::with_capacity(count), reconnections: 0 }
    }

    /// Takes a frame's samples, up to a number of samples in all; says whether it could use them.
    pub fn take(&mut self, samples: &Samples, most: usize) -> Option<()> {
        let counts = packing::unpack(samples.count.into(), samples.packed)?;
        if self.samples.is_empty() {
            self.first = samples.first;
        }
        let place = samples.first.wrapping_sub(self.first) as usize;
        // A frame from before, or one so far ahead that it could only be one.
        if place < self.samples.len() {
            return None;
        }
        self.samples.resize(place.min(most), None);
        self.samples.extend(counts.map(Some));
        self.samples.truncate(most);
        Some(())
    }

    /// The samples from a number on, so many; those that are not in it are missing.
    #[must_use]
    pub fn window(&self, first: u32, count: usize) -> Self {
        // Negative where the window begins before the capture.
        let offset = i64::from(first.wrapping_sub(self.first).cast_signed());
        let at =
            |n: usize| usize::try_from(offset + n as i64).ok().and_then(|n| self.samples.get(n).copied().flatten());
        Self { first, samples: (0..count).map(at).collect(), reconnections: self.reconnections }
    }

    /// Where samples are missing, as places in [`Capture::samples`].
    pub fn lost(&self) -> Vec<Range<usize>> {
        let mut lost: Vec<Range<usize>> = Vec::new();
        for (n, _) in self.samples.iter().enumerate().filter(|(_, sample)| sample.is_none()) {
            match lost.last_mut() {
                Some(range) if range.end == n => range.end += 1,
                _ => lost.push(n..n + 1),
            }
        }
        lost
    }
}

/// Records a number of samples. If the link breaks, it is opened again; samples that went by meanwhile are lost.
///
/// # Errors
/// A link that does not come back, a microcontroller that has restarted, Ctrl-C.
pub fn record(port: &Port, device: &Device, mut connection: Connection, count: usize) -> Result<Capture> {
    let mut capture = Capture::with_room(count);
    let bar = output::progress("recording", count as u64);
    connection.tell(Request::StartCapture)?;
    while capture.samples.len() < count {
        match receive(&mut connection, &mut capture, count) {
            Ok(()) => bar.set_position(capture.samples.len() as u64),
            Err(Error::Interrupted) => {
                bar.finish_and_clear();
                // Politeness only: the next one who asks stops it, too.
                let _ = connection.tell(Request::Stop);
                return Err(Error::Interrupted);
            }
            Err(error) => {
                bar.suspend(|| eprintln!("greyrig: {error}: trying again"));
                connection = reopen(port, device)?;
                let now = connection.status()?.samples;
                let next = capture.first.wrapping_add(capture.samples.len() as u32);
                if !capture.samples.is_empty() && now.wrapping_sub(next).cast_signed() < 0 {
                    return Err(Error::link(
                        "the microcontroller has restarted during the recording",
                        "check its supply, and record again",
                    ));
                }
                connection.tell(Request::StartCapture)?;
                capture.reconnections += 1;
            }
        }
    }
    bar.finish_and_clear();
    connection.tell(Request::Stop)?;
    Ok(capture)
}

/// Takes samples for a moment.
fn receive(connection: &mut Connection, capture: &mut Capture, count: usize) -> Result<()> {
    let before = capture.samples.len();
    let full = connection.listen(SILENCE, |message| {
        if let Message::Samples(samples) = message { capture.take(samples, count) } else { None }
    })?;
    match full {
        Some(()) => Ok(()),
        None if capture.samples.len() > before => Ok(()),
        None => Err(Error::link("no samples come", "check that the sampling runs: its fault counters say more")),
    }
}
