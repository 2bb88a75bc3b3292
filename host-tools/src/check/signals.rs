//! What the checks see of a recording.

use std::path::Path;

use super::criteria::WINDOW_SAMPLES;
use crate::recording::finding::{Code, DataFinding, Severity};
use crate::recording::{Channel, Motion, Recording, SourceColumn};

/// A recording's signals, and which of its samples count.
pub struct Signals<'a> {
    recording: &'a Recording,
    valid: Vec<bool>,
    left_out: Vec<bool>,
    /// Sampling interval, s.
    pub interval_s: f64,
    /// Voltage, V.
    pub voltage: Option<&'a [f64]>,
    /// Current, A; the torque, N m, where that stands in for it.
    pub current: Option<&'a [f64]>,
    /// Speed, rad/s, derived from the angle where only that was recorded.
    pub speed: Option<Vec<f64>>,
    /// Which channel the speed is from.
    pub speed_channel: Channel,
    /// Which channel the current is from.
    pub current_channel: Channel,
}

impl<'a> Signals<'a> {
    /// Of a recording.
    pub fn new(recording: &'a Recording) -> Self {
        let interval_s = recording.sample_time_s();
        let angle = || Some(slope(recording.channel(Channel::Angle)?, interval_s));
        let measured = recording.channel(Channel::Speed).map(<[f64]>::to_vec);
        let speed_channel = if measured.is_some() { Channel::Speed } else { Channel::Angle };
        let current = recording.channel(Channel::Current);
        let current_channel = if current.is_some() { Channel::Current } else { Channel::Torque };
        Self {
            recording,
            valid: recording.valid().to_vec(),
            left_out: vec![false; recording.len()],
            interval_s,
            voltage: recording.channel(Channel::Voltage),
            current: current.or_else(|| recording.channel(Channel::Torque)),
            speed: measured.or_else(angle),
            speed_channel,
            current_channel,
        }
    }

    /// The recording itself.
    pub fn recording(&self) -> &'a Recording {
        self.recording
    }

    /// Its file.
    pub fn path(&self) -> &'a Path {
        self.recording.path()
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.valid.len()
    }

    /// Whether a sample may be used.
    pub fn is_valid(&self, n: usize) -> bool {
        self.valid[n]
    }

    /// Leaves samples out of everything that follows.
    pub fn leave_out(&mut self, samples: &[usize]) {
        for &n in samples {
            self.valid[n] = false;
            self.left_out[n] = true;
        }
    }

    /// Whether the rotor is held.
    pub fn is_locked(&self, n: usize) -> bool {
        self.recording.rotor_locked().get(n).copied().unwrap_or(false)
    }

    /// Whether the supply is open.
    pub fn is_open(&self, n: usize) -> bool {
        self.recording.supply_open().get(n).copied().unwrap_or(false)
    }

    /// Whether the rotor is held, or the supply open, at every sample.
    pub fn always(&self, state: impl Fn(&Self, usize) -> bool) -> bool {
        (0..self.len()).all(|n| state(self, n))
    }

    /// The samples that a channel was measured at: not those that its file lacks, but those beyond its range.
    pub fn measured(&self, channel: Channel) -> Vec<usize> {
        let mut measured = self.left_out.iter().map(|out| !out).collect::<Vec<bool>>();
        self.recording.masked(channel).into_iter().for_each(|n| measured[n] = false);
        (0..self.len()).filter(|n| measured[*n]).collect()
    }

    /// A channel's samples, those that may not be used left out.
    pub fn usable(&self, channel: Channel) -> Option<Vec<f64>> {
        let values = self.recording.channel(channel)?;
        Some((0..values.len()).filter(|n| self.is_valid(*n)).map(|n| values[n]).collect())
    }

    /// The channels that there are.
    pub fn channels(&self) -> impl Iterator<Item = (Channel, &'a [f64])> + use<'a> {
        let recording = self.recording;
        Channel::ALL.into_iter().filter_map(move |c| Some((c, recording.channel(c)?)))
    }

    /// The unit of a channel.
    pub fn unit(&self, channel: Channel) -> &'static str {
        channel.unit(self.recording.motion())
    }

    /// Whether the drive turns.
    pub fn is_rotary(&self) -> bool {
        self.recording.motion() == Motion::Rotary
    }

    /// Time of a sample, s.
    pub fn time_s(&self, n: usize) -> f64 {
        self.recording.start_s() + n as f64 * self.interval_s
    }

    /// The column that a channel was taken from.
    pub fn source(&self, channel: Channel) -> SourceColumn {
        self.recording.source(channel.column())
    }

    /// `--map` of a channel with a factor on what it was taken from.
    pub fn map_times(&self, channel: Channel, factor: f64) -> String {
        self.source(channel).times(factor).map(channel.column())
    }

    /// `--map` of a channel in another unit.
    pub fn map_in(&self, channel: Channel, unit: &str) -> String {
        self.source(channel).in_unit(unit).map(channel.column())
    }

    /// A finding about this recording.
    pub fn finding(&self, code: Code, severity: Severity, text: impl Into<String>) -> DataFinding {
        DataFinding::new(code, severity, self.path(), text)
    }

    /// Samples in a window that is at least so long, s; even.
    pub fn window(&self, seconds: f64) -> usize {
        2 * (seconds / self.interval_s / 2.0).ceil().max(WINDOW_SAMPLES as f64 / 2.0) as usize
    }
}

/// Whether a channel's samples go in steps by their sensor or their logger, as has been found: its differences say
/// nothing else.
pub fn goes_in_steps(s: &Signals<'_>, channel: Channel, found: &[DataFinding]) -> bool {
    let steps = |code| {
        matches!(
            code,
            Code::HeldValues | Code::EncoderCounts | Code::PulsePeriod | Code::CoarseSteps | Code::SilentBelow
        )
    };
    found.iter().any(|f| f.recording == s.path() && f.channel == Some(channel) && steps(f.code))
}

fn slope(angle: &[f64], interval_s: f64) -> Vec<f64> {
    let last = angle.len().saturating_sub(1);
    (0..angle.len())
        .map(|n| {
            let (a, b) = (n.saturating_sub(1), (n + 1).min(last));
            (angle[b] - angle[a]) / ((b - a).max(1) as f64 * interval_s)
        })
        .collect()
}

/// The name of a channel in a sentence.
pub fn name(channel: Channel) -> &'static str {
    match channel {
        Channel::Voltage => "the voltage",
        Channel::Current => "the current",
        Channel::Speed => "the speed",
        Channel::Angle => "the angle",
        Channel::Torque => "the torque",
    }
}

/// Least and greatest.
pub fn extremes(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)))
}

/// Largest magnitude.
pub fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// Three significant digits.
pub fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let rounded: f64 = format!("{x:.2e}").parse().unwrap_or(x);
    if (1e-4..1e7).contains(&x.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}
