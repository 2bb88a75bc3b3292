//! A recording from the microcontroller: every sample in its place, and what was lost marked.

use std::ops::Range;
use std::time::Duration;

use greyrig::link::message::{Message, Request, Samples};
use greyrig::link::packing;
use greyrig::units::Counts;

use super::connection::{Connection, Device, Port};
use super::error::{Error, Result, Work};
use super::update::reopen;
use crate::context::Context;

/// Without a sample for so long, something is wrong.
const SILENCE: Duration = Duration::from_secs(3);

/// So often in a row the link is opened again without a sample.
const FRUITLESS: usize = 3;

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
        // Numbers wrap: what lies more than half of them ahead is from before.
        let place = usize::try_from(samples.first.wrapping_sub(self.first).cast_signed()).ok()?;
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

    /// How many samples are missing.
    pub fn missing(&self) -> usize {
        self.samples.iter().filter(|sample| sample.is_none()).count()
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

/// A recording that has come to an end.
#[derive(Debug)]
pub struct Ended {
    /// What there is; at least one sample.
    pub capture: Capture,
    /// Why it ended before its time, if it did.
    pub early: Option<Error>,
}

/// Records a number of samples. What an earlier program has left running is stopped first. If the link breaks, it is
/// opened again; samples that went by meanwhile are lost. If it does not come back, or at Ctrl-C, what there is is
/// kept.
///
/// # Errors
/// Whatever comes before the first sample.
pub fn record(port: &Port, device: &Device, mut connection: Connection, count: usize, ctx: &Context) -> Result<Ended> {
    let mut capture = Capture::with_room(count);
    let filled = fill(port, device, &mut connection, &mut capture, count, ctx);
    // Politeness only: the next one who asks stops it, too.
    let _ = connection.tell(Request::Stop);
    match filled {
        Err(error) if capture.samples.is_empty() => Err(error),
        filled => Ok(Ended { capture, early: filled.err() }),
    }
}

fn fill(
    port: &Port,
    device: &Device,
    connection: &mut Connection,
    capture: &mut Capture,
    count: usize,
    ctx: &Context,
) -> Result<()> {
    connection.stop()?;
    connection.tell(Request::StartCapture)?;
    let mut fruitless = 0;
    while capture.samples.len() < count {
        match receive(connection, capture, count) {
            Ok(()) => {
                fruitless = 0;
                ctx.at("recording", capture.samples.len() as f64 / count as f64);
            }
            Err(stop @ Error::Interrupted(_)) => return Err(stop),
            Err(error) if fruitless == FRUITLESS => return Err(error),
            Err(error) => {
                fruitless += 1;
                ctx.goes_on_after(&error);
                *connection = reopen(port, device, ctx)?;
                let now = connection.status()?.samples;
                let next = capture.first.wrapping_add(capture.samples.len() as u32);
                if !capture.samples.is_empty() && now.wrapping_sub(next).cast_signed() < 0 {
                    return Err(Error::Restarted(Work::Recording));
                }
                connection.tell(Request::StartCapture)?;
                capture.reconnections += 1;
            }
        }
    }
    Ok(())
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
        None => Err(Error::NoSamples),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn take(capture: &mut Capture, first: u32, count: u8) -> Option<()> {
        let counts = vec![Counts { voltage: 1, current: 2, speed: 3 }; count.into()];
        let packed = packing::pack(&counts);
        capture.take(&Samples { first, count, packed: &packed }, 40)
    }

    #[test]
    fn frames_from_before_count_as_nothing() {
        let mut capture = Capture::with_room(40);
        assert_eq!(take(&mut capture, 5, 4), Some(()));
        // Of the recording before, by a little and by nearly all numbers.
        for first in [4, 1, 0, u32::MAX - 3, 0x8000_0010] {
            assert_eq!(take(&mut capture, first, 4), None, "{first}");
        }
        assert_eq!(take(&mut capture, 11, 4), Some(()));
        assert_eq!((capture.samples.len(), capture.missing()), (10, 2));
        assert_eq!(capture.lost(), std::slice::from_ref(&(4..6)));
    }

    #[test]
    fn numbers_wrap() {
        let mut capture = Capture::with_room(40);
        take(&mut capture, u32::MAX - 1, 4).unwrap();
        take(&mut capture, 2, 4).unwrap();
        assert_eq!((capture.samples.len(), capture.missing()), (8, 0));
        // A frame behind the end fills the place until there.
        take(&mut capture, 1_000, 4).unwrap();
        assert_eq!((capture.samples.len(), capture.missing()), (40, 32));
    }
}
