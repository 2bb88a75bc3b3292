//! What is wrong, or notable, about recorded data: never a statement about the motor.
//!
//! ```
//! use greyrig_host::recording::Channel;
//! use greyrig_host::recording::finding::{Code, DataFinding, Handled, Severity};
//!
//! let found = DataFinding::new(Code::OneSided, Severity::Info, "run.csv", "the speed never falls below zero")
//!     .on(Channel::Speed)
//!     .value(0.0, "rad/s")
//!     .handled(Handled::None);
//! let json = serde_json::to_value(&found)?;
//! assert_eq!((json["code"].as_str(), json["channel"].as_str()), (Some("one_sided"), Some("omega_rad_s")));
//! # Ok::<(), serde_json::Error>(())
//! ```

use std::borrow::Cow;
use std::fmt;
use std::path::{Path, PathBuf};

use serde::de::{Deserializer, Error as _};
use serde::{Deserialize, Serialize, Serializer};

use super::Channel;

/// What kind of thing was found. The names in JSON are those of the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Code {
    /// A channel's sign contradicts the others.
    SignReversed,
    /// Voltage and current stand in each other's place.
    ChannelsSwapped,
    /// A channel rests at one value while it should move.
    ChannelDead,
    /// A channel is off by a factor that is no unit's.
    ScaleSuspect,
    /// A channel is off by the factor of another unit.
    UnitSuspect,
    /// Effective values stand in the place of samples.
    RmsValues,
    /// The voltage is what a controller asked for, not what the motor had.
    CommandedVoltage,
    /// The voltage is the supply's, ahead of the converter.
    SupplyVoltage,
    /// The time is in another unit.
    TimeUnit,
    /// The time stamps scatter about a uniform raster.
    TimeJitter,
    /// The time stamps leave out a stretch.
    TimeGap,
    /// Samples are missing, though the stamps are uniform.
    SamplesLost,
    /// The clock of one channel runs faster than that of another.
    ClockSkew,
    /// One channel lags behind another.
    ChannelShift,
    /// A logger has interpolated between the samples that it had.
    Resampled,
    /// A channel rests at the end of its range while the quantity goes on.
    Clipped,
    /// A channel cannot go below (above) its value at rest.
    OneSided,
    /// Values that stand for "out of range".
    Overrange,
    /// Single samples far from their neighbours.
    Outliers,
    /// A bit of the converter never changes.
    StuckBits,
    /// The steps of a channel are coarse against what it shows.
    CoarseSteps,
    /// The speed is a count of an encoder's edges in a window.
    EncoderCounts,
    /// The speed is taken from the time between two pulses.
    PulsePeriod,
    /// A channel is renewed more rarely than it is written.
    HeldValues,
    /// A channel is a mean over a window that moves.
    MovingAverage,
    /// The sensor shows nothing below a speed.
    SilentBelow,
    /// A channel shows a magnitude where the quantity changes its sign.
    SignLost,
    /// Mains frequency that the motor does not cause.
    Hum,
    /// The value at rest wanders.
    Drift,
    /// The value at rest is not zero.
    OffsetAtRest,
    /// The noise is not white.
    ColouredNoise,
    /// A line stands where a faster oscillation would be folded to.
    Aliasing,
    /// The motor never moves.
    Standstill,
    /// No current flows.
    NoCurrent,
    /// The recording is shorter than what it should show.
    TooShort,
    /// Nothing changes from which anything could be identified.
    NoExcitation,
    /// The interval is longer than the electrical time constant.
    SlowSampling,
    /// The motor is of the other kind.
    WrongKind,
    /// Recordings contradict one another.
    DifferentMotors,
    /// The same recording twice.
    DuplicateRecording,
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Good to know; results stand.
    Info,
    /// Results may be off.
    Warning,
    /// Results would mean nothing.
    Stop,
}

/// What is done about a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Handled {
    /// Nothing.
    #[default]
    None,
    /// The samples do not count.
    Masked,
    /// An effect, or a part of the measuring chain's model, takes it up.
    Modelled,
    /// The recording is taken as several.
    Split,
    /// The values were put right.
    Corrected,
    /// The recording is not used.
    Refused,
}

/// A finding about the data of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DataFinding {
    /// The kind.
    pub code: Code,
    /// How much it matters.
    pub severity: Severity,
    /// The file, as the user named it.
    pub recording: PathBuf,
    /// The channel, where it is one.
    #[serde(serialize_with = "by_column", deserialize_with = "of_column")]
    pub channel: Option<Channel>,
    /// Where it begins, s; none: it holds throughout.
    pub from_s: Option<f64>,
    /// Where it ends, s.
    pub to_s: Option<f64>,
    /// The figure.
    pub value: Option<f64>,
    /// The figure's unit; none: a pure number.
    pub unit: Option<Cow<'static, str>>,
    /// What is done about it.
    pub handled: Handled,
    /// One sentence.
    pub text: String,
    /// The option that mends it, ready to be pasted.
    pub remedy: Option<String>,
}

fn by_column<S: Serializer>(channel: &Option<Channel>, to: S) -> Result<S::Ok, S::Error> {
    channel.map(Channel::column).serialize(to)
}

fn of_column<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Channel>, D::Error> {
    let Some(column) = Option::<String>::deserialize(from)? else { return Ok(None) };
    let channel = Channel::ALL.into_iter().find(|channel| channel.column() == column);
    channel.map(Some).ok_or_else(|| D::Error::custom(format!("{column} is no channel")))
}

impl DataFinding {
    /// A finding about a whole recording, about which nothing is done.
    pub fn new(code: Code, severity: Severity, recording: impl AsRef<Path>, text: impl Into<String>) -> Self {
        Self {
            code,
            severity,
            recording: recording.as_ref().to_owned(),
            channel: None,
            from_s: None,
            to_s: None,
            value: None,
            unit: None,
            handled: if severity == Severity::Stop { Handled::Refused } else { Handled::None },
            text: text.into(),
            remedy: None,
        }
    }

    /// Of one channel.
    #[must_use]
    pub fn on(mut self, channel: Channel) -> Self {
        self.channel = Some(channel);
        self
    }

    /// Between two times, s.
    #[must_use]
    pub fn between(mut self, from_s: f64, to_s: f64) -> Self {
        (self.from_s, self.to_s) = (Some(from_s).filter(|t| t.is_finite()), Some(to_s).filter(|t| t.is_finite()));
        self
    }

    /// With a figure; an empty unit is that of a pure number, and what is no number is left out.
    #[must_use]
    pub fn value(mut self, value: f64, unit: &'static str) -> Self {
        self.value = Some(value).filter(|x| x.is_finite());
        self.unit = Some(Cow::Borrowed(unit)).filter(|unit| !unit.is_empty());
        self
    }

    /// What is done about it.
    #[must_use]
    pub fn handled(mut self, handled: Handled) -> Self {
        self.handled = handled;
        self
    }

    /// The option that mends it.
    #[must_use]
    pub fn remedy(mut self, option: impl Into<String>) -> Self {
        self.remedy = Some(option.into());
        self
    }

    /// What is wrong, and what mends it.
    pub fn sentence(&self) -> String {
        match &self.remedy {
            Some(remedy) => format!("{}; {remedy}", self.text),
            None => self.text.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_is_that_of_the_interface() {
        let found = DataFinding::new(Code::SignReversed, Severity::Stop, "run.csv", "the sign is reversed")
            .on(Channel::Speed)
            .between(0.5, 2.0)
            .value(f64::NAN, "")
            .remedy("--map omega_rad_s=w*-1");
        let json = r#"{"code":"sign_reversed","severity":"stop","recording":"run.csv","channel":"omega_rad_s","from_s":0.5,"to_s":2.0,"value":null,"unit":null,"handled":"refused","text":"the sign is reversed","remedy":"--map omega_rad_s=w*-1"}"#;
        assert_eq!(serde_json::to_string(&found).unwrap(), json);
        assert_eq!(Code::DuplicateRecording.to_string(), "duplicate_recording");
    }
}
