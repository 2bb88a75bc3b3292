//! Recordings: one run of one motor, uniformly sampled, in SI units.
//!
//! Each file format has a reader of its own below; all of them deliver a table of named columns, and one
//! path ([`load`]) turns a table into a [`Recording`]: names and units are recognised or mapped, time is checked,
//! invalid samples are masked. What a [`Recording`] promises is checked once, when it is built.

pub mod clipping;
mod expression;
pub mod finding;
pub mod mapping;
pub mod names;
pub mod table;
pub mod time_axis;
pub mod units;

mod arrays;
mod assemble;
mod build;
mod cf;
mod channel;
mod damage;
mod gaps;
mod part;
mod read;
pub mod series;
mod source;
mod stamps;
mod write;

#[cfg(feature = "arrow")]
mod arrow;
mod hdf5;
mod mat;
mod mdf;
mod netcdf;
mod npz;
#[cfg(feature = "parquet")]
mod parquet;
mod tdms;
mod text;
mod wav;

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

pub use build::{Builder, InvalidRecording};
pub use channel::{Channel, Motion};
pub use mapping::{MapArgs, Mapping};
pub use part::Part;
#[cfg(feature = "parquet")]
pub(crate) use read::fence;
#[cfg(feature = "arrow")]
pub use read::take_batches;
pub use read::{is_decoding, load, load_all, take};
pub use source::SourceColumn;
pub use write::{check_extension, columns, write};
pub(crate) use write::{recorded, say_metadata, state_channels};

use finding::DataFinding;

/// A further column that is carried along, in the units of its file.
#[derive(Debug, Clone, PartialEq)]
pub struct Extra {
    /// Its name in the file.
    pub name: String,
    /// One value per sample.
    pub values: Vec<f64>,
}

/// One run of one motor.
///
/// It promises: all columns have the same length, of at least one sample; time is uniform; every value is finite; and a
/// masked sample holds no measured value but the straight line between the usable ones around it, so that a fill value
/// of the file reaches no filter, no fit and no finding.
///
/// ```
/// use greyrig_host::recording::{Channel, Recording};
///
/// let run = Recording::builder(1e-3)
///     .channel(Channel::Voltage, vec![12.0, -999.0, 14.0])
///     .channel(Channel::Current, vec![1.0, -999.0, 1.0])
///     .valid(vec![true, false, true])
///     .build()?;
/// assert_eq!(run.channel(Channel::Voltage), Some(&[12.0, 13.0, 14.0][..]));
/// assert_eq!(run.valid(), [true, false, true]);
/// # Ok::<(), greyrig_host::recording::InvalidRecording>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    path: PathBuf,
    sha256: String,
    start_s: f64,
    /// Time from the begin of the run to the first sample, s.
    elapsed_s: f64,
    sample_time_s: f64,
    channels: BTreeMap<Channel, Vec<f64>>,
    motion: Motion,
    /// Samples that count.
    valid: Vec<bool>,
    /// Samples that the whole row lacks.
    masked_rows: Vec<usize>,
    /// Samples that a channel alone lacks.
    masked: BTreeMap<Channel, Vec<usize>>,
    rotor_locked: Vec<bool>,
    supply_open: Vec<bool>,
    extras: Vec<Extra>,
    metadata: BTreeMap<String, String>,
    warnings: Vec<String>,
    findings: Vec<DataFinding>,
    /// Stretches of samples that nobody recorded, in their order.
    gaps: Vec<Range<usize>>,
    /// Which one it is among those between the gaps of a recording.
    part: Option<Part>,
    /// By target of `--map`.
    sources: BTreeMap<&'static str, SourceColumn>,
}

impl Recording {
    /// Begins a recording with a sampling interval, s.
    pub fn builder(sample_time_s: f64) -> Builder {
        Builder::new(sample_time_s)
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.valid.len()
    }

    /// Whether there is no sample; a part can be empty.
    pub fn is_empty(&self) -> bool {
        self.valid.is_empty()
    }

    /// Duration, s.
    pub fn duration_s(&self) -> f64 {
        self.len() as f64 * self.sample_time_s
    }

    /// Where it came from, as the user named it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// SHA-256 of the file, in hexadecimal; empty for data that were never in a file.
    pub fn sha256(&self) -> &str {
        &self.sha256
    }

    /// Time of the first sample, s.
    pub fn start_s(&self) -> f64 {
        self.start_s
    }

    /// Time from the begin of the run to the first sample, s: zero but of a part.
    pub fn elapsed_s(&self) -> f64 {
        self.elapsed_s
    }

    /// Sampling interval, s.
    pub fn sample_time_s(&self) -> f64 {
        self.sample_time_s
    }

    /// Rotary or linear.
    pub fn motion(&self) -> Motion {
        self.motion
    }

    /// A channel's samples in SI units, if the recording has it.
    pub fn channel(&self, channel: Channel) -> Option<&[f64]> {
        self.channels.get(&channel).map(Vec::as_slice)
    }

    /// The measured channels, in SI units.
    pub fn channels(&self) -> &BTreeMap<Channel, Vec<f64>> {
        &self.channels
    }

    /// Samples that count (false: missing, clipped, or marked invalid in the file).
    pub fn valid(&self) -> &[bool] {
        &self.valid
    }

    /// Samples of a channel that were replaced by the line between their neighbours, in their order.
    pub fn masked(&self, channel: Channel) -> Vec<usize> {
        let mut all = [self.masked_rows(), self.masked_alone(channel)].concat();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// The values of a channel, and NaN at the samples that it alone lacks.
    pub(crate) fn measured(&self, channel: Channel) -> Option<Vec<f64>> {
        let mut values = self.channel(channel)?.to_vec();
        self.masked_alone(channel).iter().for_each(|&k| values[k] = f64::NAN);
        Some(values)
    }

    /// Samples of which no channel has a usable value.
    pub(crate) fn masked_rows(&self) -> &[usize] {
        &self.masked_rows
    }

    /// Samples that a channel alone lacks.
    pub(crate) fn masked_alone(&self, channel: Channel) -> &[usize] {
        self.masked.get(&channel).map_or(&[], Vec::as_slice)
    }

    /// Samples at which the rotor is held (speed imposed as zero); empty: never.
    pub fn rotor_locked(&self) -> &[bool] {
        &self.rotor_locked
    }

    /// Samples at which the supply is open (current zero, the voltage is what the terminals show); empty: never.
    pub fn supply_open(&self) -> &[bool] {
        &self.supply_open
    }

    /// Columns that the models do not use.
    pub fn extras(&self) -> &[Extra] {
        &self.extras
    }

    /// `# key: value` lines and their like.
    pub fn metadata(&self) -> &BTreeMap<String, String> {
        &self.metadata
    }

    /// What the user should know about these data (clipping, gaps …), in words.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// What was found about these data while they were read.
    pub fn findings(&self) -> &[DataFinding] {
        &self.findings
    }

    /// Stretches of samples that nobody recorded, in their order: their rows are masked, and what the motor did
    /// meanwhile is not known.
    pub fn gaps(&self) -> &[Range<usize>] {
        &self.gaps
    }

    /// Which one it is among those between the gaps of a recording; none: it is whole.
    pub fn part_of(&self) -> Option<Part> {
        self.part
    }

    /// Its file as the user named it, with the number of a part: `run.csv (2 of 3)`.
    pub fn name(&self) -> String {
        let path = self.path.display();
        self.part.map_or_else(|| path.to_string(), |part| format!("{path} ({part})"))
    }

    /// The stretches between its gaps, each a recording of its own.
    pub fn segments(&self) -> Vec<Self> {
        let ranges = self.between_gaps();
        let of = ranges.len();
        let numbered = |(k, range)| Self { part: Some(Part { number: k + 1, of }), ..self.part(range) };
        ranges.into_iter().enumerate().map(numbered).collect()
    }

    /// Samples between its gaps.
    pub fn between_gaps(&self) -> Vec<Range<usize>> {
        let begins = [0].into_iter().chain(self.gaps.iter().map(|gap| gap.end));
        let ends = self.gaps.iter().map(|gap| gap.start).chain([self.len()]);
        begins.zip(ends).map(|(from, to)| from..to).filter(|range| !range.is_empty()).collect()
    }

    /// The columns that targets of `--map` were taken from, where that is known.
    pub fn sources(&self) -> &BTreeMap<&'static str, SourceColumn> {
        &self.sources
    }

    /// The column that a target of `--map` was taken from; one of its own name where none is known.
    pub fn source(&self, target: &str) -> SourceColumn {
        self.sources.get(target).cloned().unwrap_or_else(|| SourceColumn::new(target))
    }

    /// Gives it the name of a file.
    #[must_use]
    pub fn named(mut self, path: impl Into<PathBuf>) -> Self {
        self.path = path.into();
        self.findings.iter_mut().for_each(|found| found.recording.clone_from(&self.path));
        self
    }

    /// Replaces what the user should know about these data.
    #[must_use]
    pub fn with_warnings(mut self, warnings: Vec<String>) -> Self {
        self.warnings = warnings;
        self
    }

    /// Sets a metadata entry.
    pub fn set_metadata(&mut self, key: impl Into<String>, value: impl Into<String>) {
        self.metadata.insert(key.into(), value.into());
    }

    /// The metadata, to be changed; what they say is not looked at again.
    pub fn metadata_mut(&mut self) -> &mut BTreeMap<String, String> {
        &mut self.metadata
    }

    /// Adds a column that is carried along.
    ///
    /// # Errors
    /// Another length, or a value that is not finite.
    pub fn add_extra(&mut self, name: impl Into<String>, values: Vec<f64>) -> Result<(), InvalidRecording> {
        let extra = Extra { name: name.into(), values };
        build::check_extra(&extra, self.len())?;
        self.extras.push(extra);
        Ok(())
    }

    /// Puts other values into a channel, or adds the channel. Samples that are masked stay so.
    ///
    /// # Errors
    /// Another length, an infinite value, or no usable sample. A NaN is a missing sample.
    pub fn set_channel(&mut self, channel: Channel, values: Vec<f64>) -> Result<(), InvalidRecording> {
        let len = self.len();
        let missing = build::take_channel(channel, values, &self.masked(channel), len, &mut self.channels)?;
        self.note_missing(channel, &missing);
        Ok(())
    }

    /// Leaves a channel out.
    pub fn remove_channel(&mut self, channel: Channel) {
        self.channels.remove(&channel);
        self.masked.remove(&channel);
    }

    /// Masks samples of one channel: they do not count, and the line between their neighbours takes their place.
    ///
    /// # Errors
    /// No usable sample would be left, or there is no such sample.
    pub fn mask(&mut self, channel: Channel, samples: &[usize]) -> Result<(), InvalidRecording> {
        let Some(values) = self.channels.get_mut(&channel) else { return Ok(()) };
        build::check_samples(samples, self.valid.len())?;
        let mut lacking = values.clone();
        samples.iter().for_each(|&k| lacking[k] = f64::NAN);
        self.set_channel(channel, lacking)
    }

    /// Lets samples count no more in any comparison, while their values stay: the model still runs through them.
    pub fn exclude(&mut self, samples: impl IntoIterator<Item = usize>) {
        for k in samples {
            if let Some(valid) = self.valid.get_mut(k) {
                *valid = false;
            }
        }
    }

    fn note_missing(&mut self, channel: Channel, missing: &[usize]) {
        if missing.is_empty() {
            return;
        }
        let own = self.masked.entry(channel).or_default();
        own.extend(missing);
        own.sort_unstable();
        own.dedup();
        self.exclude(missing.iter().copied());
    }

    /// One row of every so many, from the first one on, as a recording of its own; `None`: nothing usable is left.
    #[must_use]
    pub fn one_row_in(&self, every: usize, first: usize) -> Option<Self> {
        Some(self.rows(first..self.len(), every)).filter(|rows| rows.valid.contains(&true))
    }

    /// A stretch of samples as a recording of its own.
    #[must_use]
    pub fn part(&self, range: Range<usize>) -> Self {
        self.rows(range, 1)
    }

    /// One row of every so many in a range.
    fn rows(&self, range: Range<usize>, every: usize) -> Self {
        fn kept<T: Copy>(values: &[T], range: &Range<usize>, every: usize) -> Vec<T> {
            values.get(range.clone()).unwrap_or_default().iter().copied().step_by(every).collect()
        }
        let of = |values: &[f64]| kept(values, &range, every);
        let flags = |flags: &[bool]| kept(flags, &range, every);
        let among = |samples: &[usize]| -> Vec<usize> {
            let inside = samples.iter().filter(|n| range.contains(n)).map(|n| n - range.start);
            inside.filter(|n| n.is_multiple_of(every)).map(|n| n / every).collect()
        };
        let gaps = gaps::within(&self.gaps, &range).into_iter();
        let gaps = gaps.map(|gap| gap.start.div_ceil(every)..gap.end.div_ceil(every));
        Self {
            start_s: self.start_s + range.start as f64 * self.sample_time_s,
            elapsed_s: self.elapsed_s + range.start as f64 * self.sample_time_s,
            sample_time_s: self.sample_time_s * every as f64,
            channels: self.channels.iter().map(|(c, values)| (*c, of(values))).collect(),
            valid: flags(&self.valid),
            masked_rows: among(&self.masked_rows),
            masked: self.masked.iter().map(|(c, samples)| (*c, among(samples))).collect(),
            rotor_locked: flags(&self.rotor_locked),
            supply_open: flags(&self.supply_open),
            extras: self.extras.iter().map(|e| Extra { name: e.name.clone(), values: of(&e.values) }).collect(),
            gaps: gaps.filter(|gap| !gap.is_empty()).collect(),
            path: self.path.clone(),
            sha256: self.sha256.clone(),
            motion: self.motion,
            metadata: self.metadata.clone(),
            warnings: self.warnings.clone(),
            findings: self.findings.clone(),
            part: self.part,
            sources: self.sources.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_row_in_three_keeps_its_flags_masks_and_gaps() {
        let numbers: Vec<f64> = (0..20).map(f64::from).collect();
        let mut recording = Recording::builder(1e-3)
            .channel(Channel::Voltage, numbers.clone())
            .channel(Channel::Current, numbers)
            .rotor_locked((0..20).map(|n| n < 7).collect())
            .gaps(vec![3..4, 8..13])
            .build()
            .unwrap();
        recording.mask(Channel::Current, &[5, 6, 14]).unwrap();
        // Rows 2, 5, 8, 11, 14, 17.
        let kept = recording.one_row_in(3, 2).unwrap();
        assert_eq!(kept.channel(Channel::Voltage).unwrap(), [2.0, 5.0, 8.0, 11.0, 14.0, 17.0]);
        assert_eq!(kept.masked(Channel::Current), [1, 2, 3, 4], "5 and 14, and those of the gap");
        assert_eq!(kept.masked(Channel::Voltage), [2, 3]);
        assert_eq!(kept.rotor_locked(), [true, true, false, false, false, false]);
        assert_eq!(kept.gaps(), std::slice::from_ref(&(2..4)), "rows 8 and 11; none of 3");
        assert!((kept.sample_time_s() - 3e-3).abs() < 1e-12);
    }
}
