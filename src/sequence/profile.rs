//! The profile: steps and ramps in volts over seconds, the same description that `greyrig simulate` and `plan` use.
//!
//! Within a segment the voltage goes in a straight line, `u(t) = from + (to − from)(t − t₀)/T`; with an alternating
//! supply it is the peak, and the supply makes the wave. The command is u over what the supply gives at full command.

use heapless::Vec;

/// Most segments. The longest profile of the virtual rig that a supply of one sign can run has twelve.
pub const MAX_SEGMENTS: usize = 24;
/// Longest profile, s.
pub const LONGEST_S: f64 = 3600.0;

/// What kind of voltage a supply gives.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Wave {
    /// Direct voltage of one sign.
    Direct,
    /// Sine; the command is its peak.
    Alternating {
        /// Its frequency, Hz.
        frequency_hz: f32,
    },
}

/// How the contactor stands in a segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Supplied {
    /// Closed.
    On,
    /// Open: the motor runs down, whatever the voltages say.
    Off,
}

/// A stretch of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Segment {
    /// Length, s.
    pub seconds: f32,
    /// Voltage at its begin, V; the peak of an alternating one.
    pub from_v: f32,
    /// Voltage at its end, V.
    pub to_v: f32,
    /// The contactor.
    pub supplied: Supplied,
}

/// A segment in samples and as a command.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    /// Samples before its end.
    end: u32,
    /// The command at its begin.
    from: f32,
    /// What the command gains with a sample.
    slope: f32,
    closed: bool,
}

/// A profile in samples, and where it is.
#[derive(Debug, Clone)]
pub struct Profile {
    pieces: Vec<Piece, MAX_SEGMENTS>,
    samples: u32,
    /// The piece under way, and samples before its begin.
    piece: usize,
    begin: u32,
}

impl Profile {
    /// From segments whose values are possible; as on the host, ends lie on whole samples, and what is left of one
    /// segment belongs to the next.
    pub fn new(segments: &[Segment], full_scale_v: f32, sample_rate_hz: f64) -> Self {
        let mut pieces = Vec::new();
        let (mut seconds, mut begin) = (0.0_f64, 0_u32);
        for segment in segments {
            seconds += f64::from(segment.seconds);
            // Half up: a length is not negative.
            let end = (seconds * sample_rate_hz + 0.5) as u32;
            let length = end.saturating_sub(begin);
            let closed = segment.supplied == Supplied::On;
            let [from, to] =
                [segment.from_v, segment.to_v].map(|volts| if closed { volts / full_scale_v } else { 0.0 });
            if length > 0 {
                // Not more than there is room for: both are lists of at most MAX_SEGMENTS.
                let _ = pieces.push(Piece { end, from, slope: (to - from) / length as f32, closed });
            }
            begin = end;
        }
        Self { pieces, samples: begin, piece: 0, begin: 0 }
    }

    /// Its length.
    #[inline]
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Begins anew.
    #[inline]
    pub fn rewind(&mut self) {
        (self.piece, self.begin) = (0, 0);
    }

    /// The command of a sample, 0 to 1, and whether the contactor is closed; samples come in order. None after the end.
    #[inline]
    pub fn at(&mut self, sample: u32) -> Option<(f32, bool)> {
        let mut piece = self.pieces.get(self.piece)?;
        while sample >= piece.end {
            (self.piece, self.begin) = (self.piece + 1, piece.end);
            piece = self.pieces.get(self.piece)?;
        }
        let command = piece.from + piece.slope * sample.saturating_sub(self.begin) as f32;
        Some((command.clamp(0.0, 1.0), piece.closed))
    }
}
