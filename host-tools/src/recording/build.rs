//! Building a recording: what it promises is checked here.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

use super::finding::DataFinding;
use super::{Channel, Extra, Motion, Recording, SourceColumn, gaps};

/// Why values are no recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InvalidRecording {
    /// Nothing was measured.
    #[error("there is no channel")]
    NoChannel,
    /// There is no sample.
    #[error("there are no samples")]
    NoSample,
    /// A column that is longer or shorter than the others.
    #[error("{column} has {found} samples, the others have {expected}")]
    Length {
        /// The column.
        column: String,
        /// Its samples.
        found: usize,
        /// The samples of the others.
        expected: usize,
    },
    /// A sampling interval that is no positive, finite time.
    #[error("{0} s is no sampling interval")]
    SampleTime(f64),
    /// A first sample at no finite time.
    #[error("the first sample is at {0} s")]
    Start(f64),
    /// A value that is infinite, or NaN in a column that has no masks.
    #[error("{column} is not finite at sample {sample}")]
    NotFinite {
        /// The column.
        column: String,
        /// The sample, from zero.
        sample: usize,
    },
    /// Every sample of a channel is masked.
    #[error("every sample of {column} is missing or marked invalid")]
    NothingLeft {
        /// The channel's column.
        column: &'static str,
    },
    /// A sample beyond the end.
    #[error("there is no sample {sample} among {len}")]
    NoSuchSample {
        /// The sample, from zero.
        sample: usize,
        /// The number of samples.
        len: usize,
    },
}

/// Collects what a recording consists of.
#[derive(Debug, Clone, Default)]
pub struct Builder {
    path: PathBuf,
    sha256: String,
    start_s: f64,
    sample_time_s: f64,
    channels: BTreeMap<Channel, Vec<f64>>,
    motion: Motion,
    valid: Vec<bool>,
    rotor_locked: Vec<bool>,
    supply_open: Vec<bool>,
    extras: Vec<Extra>,
    metadata: BTreeMap<String, String>,
    warnings: Vec<String>,
    findings: Vec<DataFinding>,
    gaps: Vec<Range<usize>>,
    sources: BTreeMap<&'static str, SourceColumn>,
}

impl Builder {
    /// Begins with a sampling interval, s.
    pub fn new(sample_time_s: f64) -> Self {
        Self { sample_time_s, ..Self::default() }
    }

    /// Where it came from, as the user named it.
    #[must_use]
    pub fn path(mut self, path: impl Into<PathBuf>) -> Self {
        self.path = path.into();
        self
    }

    /// SHA-256 of the file, in hexadecimal.
    #[must_use]
    pub fn sha256(mut self, sha256: impl Into<String>) -> Self {
        self.sha256 = sha256.into();
        self
    }

    /// Time of the first sample, s; zero unless told.
    #[must_use]
    pub fn start_s(mut self, start_s: f64) -> Self {
        self.start_s = start_s;
        self
    }

    /// Rotary, unless told, or linear.
    #[must_use]
    pub fn motion(mut self, motion: Motion) -> Self {
        self.motion = motion;
        self
    }

    /// A channel in SI units. A NaN is a missing sample: it is masked.
    #[must_use]
    pub fn channel(mut self, channel: Channel, values: Vec<f64>) -> Self {
        self.channels.insert(channel, values);
        self
    }

    /// Rows that may be used; all of them unless told. Of the others no value of any channel is taken.
    #[must_use]
    pub fn valid(mut self, valid: Vec<bool>) -> Self {
        self.valid = valid;
        self
    }

    /// Samples at which the rotor is held; empty: never.
    #[must_use]
    pub fn rotor_locked(mut self, flags: Vec<bool>) -> Self {
        self.rotor_locked = flags;
        self
    }

    /// Samples at which the supply is open; empty: never.
    #[must_use]
    pub fn supply_open(mut self, flags: Vec<bool>) -> Self {
        self.supply_open = flags;
        self
    }

    /// A column that is carried along.
    #[must_use]
    pub fn extra(mut self, extra: Extra) -> Self {
        self.extras.push(extra);
        self
    }

    /// `# key: value` lines and their like.
    #[must_use]
    pub fn metadata(mut self, metadata: BTreeMap<String, String>) -> Self {
        self.metadata = metadata;
        self
    }

    /// What the user should know about these data.
    #[must_use]
    pub fn warnings(mut self, warnings: Vec<String>) -> Self {
        self.warnings = warnings;
        self
    }

    /// What was found about these data while they were read.
    #[must_use]
    pub fn findings(mut self, findings: Vec<DataFinding>) -> Self {
        self.findings = findings;
        self
    }

    /// Stretches of samples that nobody recorded, in their order: no value of their rows is taken.
    #[must_use]
    pub fn gaps(mut self, gaps: Vec<Range<usize>>) -> Self {
        self.gaps = gaps;
        self
    }

    /// The column that a target of `--map` was taken from.
    #[must_use]
    pub fn source(mut self, target: &'static str, column: SourceColumn) -> Self {
        self.sources.insert(target, column);
        self
    }

    /// The recording.
    ///
    /// # Errors
    /// Whatever a [`Recording`] promises and these values do not keep.
    pub fn build(self) -> Result<Recording, InvalidRecording> {
        let Self { mut rotor_locked, mut supply_open, mut valid, .. } = self;
        let len = self.channels.values().next().ok_or(InvalidRecording::NoChannel)?.len();
        if len == 0 {
            return Err(InvalidRecording::NoSample);
        }
        if !(self.sample_time_s > 0.0 && self.sample_time_s.is_finite()) {
            return Err(InvalidRecording::SampleTime(self.sample_time_s));
        }
        if !self.start_s.is_finite() {
            return Err(InvalidRecording::Start(self.start_s));
        }
        for (column, flags) in [("valid", &valid), ("rotor_locked", &rotor_locked), ("supply_open", &supply_open)] {
            if !flags.is_empty() {
                check_length(column, flags.len(), len)?;
            }
        }
        self.extras.iter().try_for_each(|extra| check_extra(extra, len))?;
        if valid.is_empty() {
            valid = vec![true; len];
        }
        if let Some(gap) = self.gaps.iter().find(|gap| gap.end > len) {
            return Err(InvalidRecording::NoSuchSample { sample: gap.end - 1, len });
        }
        self.gaps.iter().for_each(|gap| valid[gap.clone()].fill(false));
        let masked_rows: Vec<usize> = (0..len).filter(|&k| !valid[k]).collect();
        let (mut channels, mut missing) = (BTreeMap::new(), Vec::new());
        for (channel, values) in self.channels {
            missing.push((channel, take_channel(channel, values, &masked_rows, len, &mut channels)?));
        }
        for flags in [&mut rotor_locked, &mut supply_open] {
            if !flags.is_empty() && !masked_rows.is_empty() {
                gaps::hold(flags, &masked_rows);
            }
        }
        let mut extras = self.extras;
        if !masked_rows.is_empty() {
            extras.iter_mut().for_each(|extra| gaps::hold(&mut extra.values, &masked_rows));
        }
        let mut recording = Recording {
            path: self.path,
            sha256: self.sha256,
            start_s: self.start_s,
            elapsed_s: 0.0,
            sample_time_s: self.sample_time_s,
            channels,
            motion: self.motion,
            valid,
            masked_rows,
            masked: BTreeMap::new(),
            rotor_locked,
            supply_open,
            extras,
            metadata: self.metadata,
            warnings: self.warnings,
            findings: self.findings,
            gaps: self.gaps,
            part: None,
            sources: self.sources,
        };
        missing.iter().for_each(|(channel, samples)| recording.note_missing(*channel, samples));
        Ok(recording)
    }
}

/// Takes a channel in, without what its masked samples hold. Which further samples are missing.
pub(super) fn take_channel(
    channel: Channel,
    mut values: Vec<f64>,
    masked: &[usize],
    len: usize,
    channels: &mut BTreeMap<Channel, Vec<f64>>,
) -> Result<Vec<usize>, InvalidRecording> {
    let column = channel.column();
    check_length(column, values.len(), len)?;
    masked.iter().for_each(|&k| values[k] = f64::NAN);
    if let Some(sample) = values.iter().position(|x| x.is_infinite()) {
        return Err(InvalidRecording::NotFinite { column: column.into(), sample });
    }
    let mut missing = gaps::bridge(&mut values).ok_or(InvalidRecording::NothingLeft { column })?;
    missing.retain(|k| masked.binary_search(k).is_err());
    channels.insert(channel, values);
    Ok(missing)
}

pub(super) fn check_samples(samples: &[usize], len: usize) -> Result<(), InvalidRecording> {
    match samples.iter().find(|&&k| k >= len) {
        Some(&sample) => Err(InvalidRecording::NoSuchSample { sample, len }),
        None => Ok(()),
    }
}

fn check_length(column: &str, found: usize, expected: usize) -> Result<(), InvalidRecording> {
    if found == expected { Ok(()) } else { Err(InvalidRecording::Length { column: column.into(), found, expected }) }
}

pub(super) fn check_extra(extra: &Extra, len: usize) -> Result<(), InvalidRecording> {
    check_length(&extra.name, extra.values.len(), len)?;
    match extra.values.iter().position(|x| !x.is_finite()) {
        Some(sample) => Err(InvalidRecording::NotFinite { column: extra.name.clone(), sample }),
        None => Ok(()),
    }
}
