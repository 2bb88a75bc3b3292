//! A recording as a row of the store.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::exact::Samples;
use super::partition::{self, Partition};
use crate::recording::finding::DataFinding;
use crate::recording::names::Role;
use crate::recording::{Channel, Extra, InvalidRecording, Motion, Recording, SourceColumn};

/// SHA-256 of what a recording holds, whatever file it came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Content(pub [u8; 32]);

impl Content {
    /// Of the digits.
    pub fn parse(text: &str) -> Option<Self> {
        let mut bytes = [0; 32];
        if text.len() != 2 * bytes.len() || !text.is_ascii() {
            return None;
        }
        for (k, byte) in bytes.iter_mut().enumerate() {
            *byte = u8::from_str_radix(&text[2 * k..2 * k + 2], 16).ok()?;
        }
        Some(Self(bytes))
    }
}

impl std::fmt::Display for Content {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// What a recording is beside its samples and marks, and what no question in SQL is about.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Details {
    /// Stretches of samples that nobody recorded: first, and one behind the last.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gaps: Vec<Range<usize>>,
    /// Stretches of rows that hold no value of any channel, gaps included.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub masked_rows: Vec<Range<usize>>,
    /// The columns that channels were taken from, by target of `--map`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub sources: BTreeMap<String, SourceColumn>,
    /// What the reader told.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// What the reader found.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<DataFinding>,
}

/// A row of the store.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// What tells it from others.
    pub content: Content,
    /// Serial number of the motor (`# serial:`).
    pub serial: Option<String>,
    /// Time on the clock (`# date:`), µs since the begin of 1970 there.
    pub time_us: Option<i64>,
    /// Sampling interval, s.
    pub sample_time_s: f64,
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Number of samples.
    pub samples: usize,
    /// Mean temperature of the motor (column `temp_c`, or `# temp_c:`), °C.
    pub temperature_c: Option<f64>,
    /// Pressure of the air (`# air_pressure_hpa:`), hPa.
    pub pressure_hpa: Option<f64>,
    /// Rotary or linear.
    pub motion: Motion,
    /// The file that it came from, as the user named it.
    pub name: String,
    /// SHA-256 of that file.
    pub file_sha256: String,
    /// The channels, in SI units.
    pub channels: BTreeMap<Channel, Samples>,
    /// Columns that are carried along.
    pub others: Vec<(String, Samples)>,
    /// Samples that count; none: all.
    pub valid: Option<Vec<bool>>,
    /// Samples at which the rotor is held; none: never.
    pub rotor_locked: Option<Vec<bool>>,
    /// Samples at which the supply is open; none: never.
    pub supply_open: Option<Vec<bool>>,
    /// `# key: value` lines and their like.
    pub metadata: BTreeMap<String, String>,
    /// The rest.
    pub details: Details,
}

/// Stretches of samples, of their rising numbers.
fn stretches(samples: &[usize]) -> Vec<Range<usize>> {
    let mut ranges: Vec<Range<usize>> = Vec::new();
    for &n in samples {
        match ranges.last_mut().filter(|range| range.end == n) {
            Some(range) => range.end += 1,
            None => ranges.push(n..n + 1),
        }
    }
    ranges
}

impl Entry {
    /// A recording as it was read, as a row.
    pub fn of(recording: &Recording) -> Self {
        let told = |key: &str| recording.metadata().get(key).map(|text| text.trim()).filter(|text| !text.is_empty());
        let number = |key: &str| told(key)?.parse::<f64>().ok().filter(|x| x.is_finite());
        let sources = recording.sources();
        let kept = |values: &[f64], masked: &[usize], column: &str| {
            let mut values: Vec<Option<f64>> = values.iter().copied().map(Some).collect();
            masked.iter().for_each(|&n| values[n] = None);
            Samples::narrowest(&values, sources.get(column))
        };
        let channels = recording
            .channels()
            .iter()
            .map(|(channel, values)| (*channel, kept(values, &recording.masked(*channel), channel.column())));
        let others = recording.extras().iter().map(|e| (e.name.clone(), kept(&e.values, &[], &e.name)));
        let temperatures = recording.extras().iter().find(|e| e.name == Role::Temperature.column());
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let flags = |flags: &[bool]| (!flags.is_empty()).then(|| flags.to_vec());
        let mut entry = Self {
            content: Content([0; 32]),
            serial: told("serial").map(str::to_owned),
            time_us: told("date").and_then(partition::time).and_then(microseconds),
            sample_time_s: recording.sample_time_s(),
            start_s: recording.start_s(),
            samples: recording.len(),
            temperature_c: temperatures.map(|e| mean(&e.values)).or_else(|| number(Role::Temperature.column())),
            pressure_hpa: number("air_pressure_hpa"),
            motion: recording.motion(),
            name: recording.path().display().to_string(),
            file_sha256: recording.sha256().to_owned(),
            channels: channels.collect(),
            others: others.collect(),
            valid: recording.valid().contains(&false).then(|| recording.valid().to_vec()),
            rotor_locked: flags(recording.rotor_locked()),
            supply_open: flags(recording.supply_open()),
            metadata: recording.metadata().clone(),
            details: Details {
                gaps: recording.gaps().to_vec(),
                masked_rows: stretches(recording.masked_rows()),
                sources: sources.iter().map(|(target, source)| ((*target).to_owned(), source.clone())).collect(),
                warnings: recording.warnings().to_vec(),
                findings: recording.findings().to_vec(),
            },
        };
        entry.content = entry.digest();
        entry
    }

    /// Where it belongs: by its `line` (or else `rig`), `motor` and `date`.
    pub fn partition(&self) -> Partition {
        let told = |key: &str| self.metadata.get(key).map(|text| text.trim()).filter(|text| !text.is_empty());
        Partition {
            line: told("line").or_else(|| told("rig")).map(str::to_owned),
            motor: told("motor").map(str::to_owned),
            day: told("date").and_then(partition::time).map(|time| time.date()),
        }
    }

    /// SHA-256 of the sampling interval, the channels, the columns carried along and the marks: not of names, metadata
    /// or the form in which the samples are kept.
    pub fn digest(&self) -> Content {
        let mut hash = Sha256::new();
        hash.update(b"greyrig recording 1\0");
        hash.update(self.sample_time_s.to_le_bytes());
        hash.update([u8::from(self.motion == Motion::Linear)]);
        let mut column = |name: &str, values: &mut dyn Iterator<Item = Option<f64>>, length: usize| {
            hash.update(name.as_bytes());
            hash.update(b"\0");
            hash.update((length as u64).to_le_bytes());
            // Missing samples are one bit pattern, whichever NaN stood for them.
            values.for_each(|x| hash.update(x.map_or(u64::MAX, f64::to_bits).to_le_bytes()));
        };
        for (channel, samples) in &self.channels {
            column(channel.column(), &mut (0..samples.len()).map(|n| samples.value(n)), samples.len());
        }
        for (name, samples) in &self.others {
            column(name, &mut (0..samples.len()).map(|n| samples.value(n)), samples.len());
        }
        for (name, flags) in [("rotor_locked", &self.rotor_locked), ("supply_open", &self.supply_open)] {
            if let Some(flags) = flags {
                column(name, &mut flags.iter().map(|flag| Some(f64::from(u8::from(*flag)))), flags.len());
            }
        }
        Content(hash.finalize().into())
    }

    /// The recording, as it was put in.
    ///
    /// # Errors
    /// A row that holds none.
    pub fn recording(&self) -> Result<Recording, InvalidRecording> {
        let mut usable = vec![true; self.samples];
        for range in &self.details.masked_rows {
            let none = InvalidRecording::NoSuchSample { sample: range.end, len: self.samples };
            usable.get_mut(range.clone()).ok_or(none)?.fill(false);
        }
        let mut builder = Recording::builder(self.sample_time_s)
            .path(PathBuf::from(&self.name))
            .sha256(&self.file_sha256)
            .start_s(self.start_s)
            .motion(self.motion)
            .valid(usable)
            .gaps(self.details.gaps.clone())
            .rotor_locked(self.rotor_locked.clone().unwrap_or_default())
            .supply_open(self.supply_open.clone().unwrap_or_default())
            .metadata(self.metadata.clone())
            .warnings(self.details.warnings.clone())
            .findings(self.details.findings.clone());
        for (channel, samples) in &self.channels {
            builder = builder.channel(*channel, samples.values());
        }
        for (name, samples) in &self.others {
            builder = builder.extra(Extra { name: name.clone(), values: samples.values() });
        }
        for (target, role) in Role::TARGETS {
            if let Some(source) = self.details.sources.get(target).filter(|_| role.column() == target) {
                builder = builder.source(role.column(), source.clone());
            }
        }
        let mut recording = builder.build()?;
        let excluded = self.valid.iter().flatten().enumerate().filter(|(_, valid)| !**valid);
        recording.exclude(excluded.map(|(n, _)| n));
        Ok(recording)
    }

    /// Bytes of its samples in memory.
    pub fn bytes(&self) -> usize {
        self.channels.values().chain(self.others.iter().map(|o| &o.1)).map(Samples::bytes).sum()
    }
}

fn microseconds(time: jiff::civil::DateTime) -> Option<i64> {
    let since = time.since(jiff::civil::date(1970, 1, 1).at(0, 0, 0, 0)).ok()?;
    let days = i64::from(since.get_days());
    let seconds = (days * 24 + i64::from(since.get_hours())) * 3600 + since.get_minutes() * 60 + since.get_seconds();
    Some(seconds * 1_000_000 + since.get_milliseconds() * 1000 + since.get_microseconds())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording() -> Recording {
        let values = |gain: f64| (0..50).map(|k| gain * f64::from(k * 7 % 31)).collect::<Vec<_>>();
        let mut current = values(0.01);
        current[5] = f64::NAN;
        let metadata = [("serial", "S1"), ("motor", "universal"), ("line", "A"), ("date", "2026-11-30T06:15:00.25")];
        let mut made = Recording::builder(1e-4)
            .path("run.csv")
            .sha256("00")
            .start_s(0.5)
            .channel(Channel::Voltage, values(0.1953125))
            .channel(Channel::Current, current)
            .channel(Channel::Speed, values(1.0 / 3.0))
            .valid((0..50).map(|k| !(10..13).contains(&k)).collect())
            .gaps(Vec::from([20..24, 30..31]))
            .rotor_locked((0..50).map(|k| k < 4).collect())
            .extra(Extra { name: "temp_c".into(), values: vec![21.5; 50] })
            .source("u_v", SourceColumn { gain: 0.1953125, ..SourceColumn::new("CH1") })
            .metadata(metadata.map(|(key, value)| (key.to_owned(), value.to_owned())).into())
            .warnings(vec!["a warning".into()])
            .build()
            .unwrap();
        made.exclude([40, 41]);
        made
    }

    #[test]
    fn a_recording_comes_back_as_it_was() {
        let made = recording();
        let entry = Entry::of(&made);
        assert_eq!(entry.recording().unwrap(), made);
        assert_eq!(entry.partition().folder().unwrap(), PathBuf::from("line=A/type=universal/day=2026-11-30"));
        // 20,787 days since 1970, a quarter past six.
        assert_eq!(entry.time_us, Some((20_787 * 86_400 + 6 * 3600 + 15 * 60) * 1_000_000 + 250_000));
        assert_eq!(entry.temperature_c, Some(21.5));
        assert_eq!(Content::parse(&entry.content.to_string()), Some(entry.content));
    }

    #[test]
    fn content_is_of_the_samples_and_marks_alone() {
        let entry = Entry::of(&recording());
        let mut named = recording().named("another.csv");
        named.set_metadata("serial", "S2");
        assert_eq!(Entry::of(&named).content, entry.content);
        let mut other = recording();
        let mut values = other.channel(Channel::Voltage).unwrap().to_vec();
        values[35] = values[35].next_up();
        other.set_channel(Channel::Voltage, values).unwrap();
        assert_ne!(Entry::of(&other).content, entry.content);
        let mut masked = recording();
        masked.mask(Channel::Voltage, &[35]).unwrap();
        assert_ne!(Entry::of(&masked).content, entry.content);
    }
}
