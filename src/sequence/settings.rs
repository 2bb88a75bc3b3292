//! What is set of a sequence: for a motor type its profile and limits, for a rig its supply.

use core::fmt;

use heapless::Vec;

use super::contact::{START_DEBOUNCE_S, STOP_DEBOUNCE_S};
use super::guard::{JUDGING_S, Limits, OVERSPEED_S};
use super::profile::{LONGEST_S, MAX_SEGMENTS, Profile, Segment, Wave};
use super::run::{Parts, Sequence};
use crate::hardware::Hardware;
use crate::scalar::Scalar;
use crate::units::{Calibration, Scale};

/// Most that a supply may give, V: far beyond any motor of this kind, far below what a number may be.
const HIGHEST_V: f32 = 10_000.0;
/// Frequencies of a supply, Hz.
const FREQUENCIES_HZ: [f32; 2] = [1.0, 1000.0];

/// When a rotor counts as stuck.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Stuck {
    /// From this voltage on it has to turn, V; higher: less is noticed, and no motor stopped that merely starts late.
    pub from_v: f32,
    /// At this speed it turns, rad/s.
    pub below_rad_s: f32,
    /// Within this time it has to, s; longer: a winding carries its standstill current for longer.
    pub within_s: f32,
}

/// What belongs to a motor type.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// What kind of voltage the profile is of.
    pub wave: Wave,
    /// The profile.
    pub segments: Vec<Segment, MAX_SEGMENTS>,
    /// The hardware cuts the supply where the current leaves ± this, A.
    pub trip_a: f32,
    /// Speed that must not be exceeded, rad/s.
    pub overspeed_rad_s: f32,
    /// When the rotor counts as stuck.
    pub stuck: Stuck,
    /// Below this speed the rotor is at rest, rad/s.
    pub rest_rad_s: f32,
    /// A run from its start to the rotor's rest may take so long, s.
    pub time_out_s: f32,
}

/// What belongs to a rig: the supply that is commanded.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Supply {
    /// What it gives.
    pub wave: Wave,
    /// What it gives at full command, V; the peak of an alternating voltage.
    pub full_scale_v: f32,
}

/// Why a sequence cannot be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SettingsError {
    /// Not a single segment.
    Empty,
    /// A segment, by its place, is no stretch of time, or its voltage is none from zero on.
    Segment(usize),
    /// The profile is longer than an hour.
    TooLong,
    /// The frequency of an alternating voltage.
    Frequency,
    /// A limit, by its name, is not a positive number.
    Limit(&'static str),
    /// The time-out comes before the end of the profile.
    TimeOut,
    /// What the supply gives at full command.
    FullScale,
    /// The supply gives another kind of voltage than the profile is of.
    OtherWave,
    /// A segment, by its place, asks for more than the supply gives.
    TooHigh(usize),
    /// A limit, by its name, lies outside what the rig can measure: it would never be reached.
    Unmeasurable(&'static str),
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "the profile has no segment"),
            Self::Segment(index) => {
                write!(f, "segment {} needs a positive length and voltages from 0 to {HIGHEST_V} V", index + 1)
            }
            Self::TooLong => write!(f, "the profile is longer than {LONGEST_S} s"),
            Self::Frequency => {
                write!(f, "the frequency is not between {} and {} Hz", FREQUENCIES_HZ[0], FREQUENCIES_HZ[1])
            }
            Self::Limit(name) => write!(f, "{name} has to be a positive number"),
            Self::TimeOut => write!(f, "the time-out comes before the end of the profile"),
            Self::FullScale => write!(f, "the supply's full scale is not between 0 and {HIGHEST_V} V"),
            Self::OtherWave => write!(f, "the rig's supply gives another kind of voltage than the profile is of"),
            Self::TooHigh(index) => write!(f, "segment {} asks for more than the rig's supply gives", index + 1),
            Self::Unmeasurable(name) => write!(f, "{name} lies outside what the rig's channels can measure"),
        }
    }
}

impl core::error::Error for SettingsError {}

fn is_positive(value: f32) -> bool {
    Scalar::is_finite(value) && value > 0.0
}

impl Wave {
    fn validate(self) -> Result<(), SettingsError> {
        let [least, most] = FREQUENCIES_HZ;
        match self {
            Self::Alternating { frequency_hz } if !(least..=most).contains(&frequency_hz) => {
                Err(SettingsError::Frequency)
            }
            _ => Ok(()),
        }
    }
}

impl Supply {
    /// Checks what it gives.
    ///
    /// # Errors
    /// What cannot be.
    pub fn validate(&self) -> Result<(), SettingsError> {
        self.wave.validate()?;
        let possible = is_positive(self.full_scale_v) && self.full_scale_v <= HIGHEST_V;
        if possible { Ok(()) } else { Err(SettingsError::FullScale) }
    }
}

impl Settings {
    /// Length of the profile, s.
    pub fn seconds(&self) -> f64 {
        self.segments.iter().map(|segment| f64::from(segment.seconds)).sum()
    }

    /// Checks every value by itself; whether a rig can do it, [`Settings::build`] says.
    ///
    /// # Errors
    /// The first value that cannot be.
    pub fn validate(&self) -> Result<(), SettingsError> {
        self.wave.validate()?;
        if self.segments.is_empty() {
            return Err(SettingsError::Empty);
        }
        for (index, segment) in self.segments.iter().enumerate() {
            let volts = [segment.from_v, segment.to_v].iter().all(|volts| (0.0..=HIGHEST_V).contains(volts));
            if !is_positive(segment.seconds) || !volts {
                return Err(SettingsError::Segment(index));
            }
        }
        let seconds = self.seconds();
        if seconds > LONGEST_S {
            return Err(SettingsError::TooLong);
        }
        let limits = [
            ("the current that trips", self.trip_a),
            ("the highest speed", self.overspeed_rad_s),
            ("the voltage from which the rotor turns", self.stuck.from_v),
            ("the speed at which the rotor turns", self.stuck.below_rad_s),
            ("the time within which the rotor turns", self.stuck.within_s),
            ("the speed of a rotor at rest", self.rest_rad_s),
            ("the time-out", self.time_out_s),
        ];
        if let Some((name, _)) = limits.into_iter().find(|(_, value)| !is_positive(*value)) {
            return Err(SettingsError::Limit(name));
        }
        let [time_out, judging] = [self.time_out_s, JUDGING_S].map(f64::from);
        if time_out < seconds + judging || time_out > 2.0 * LONGEST_S || f64::from(self.stuck.within_s) > LONGEST_S {
            return Err(SettingsError::TimeOut);
        }
        Ok(())
    }

    /// Makes what runs, for a rig's supply and channels.
    ///
    /// # Errors
    /// The first value that cannot be, or that the rig cannot do.
    pub fn build(
        &self,
        supply: &Supply,
        calibration: &Calibration,
        hardware: &Hardware,
    ) -> Result<Sequence, SettingsError> {
        self.validate()?;
        supply.validate()?;
        if self.wave != supply.wave {
            return Err(SettingsError::OtherWave);
        }
        let full = supply.full_scale_v;
        if let Some(index) = self.segments.iter().position(|segment| segment.from_v.max(segment.to_v) > full) {
            return Err(SettingsError::TooHigh(index));
        }
        let [_, current, speed] = calibration.scales();
        let trip = trip(current, self.trip_a, hardware.full_scale)?;
        // One end of the channel at least has to show a rotor that is too fast.
        let highest = [0, hardware.full_scale].map(|counts| Scalar::abs(speed.quantity(counts)));
        if self.overspeed_rad_s >= highest[0].max(highest[1]) {
            return Err(SettingsError::Unmeasurable("the highest speed"));
        }
        let rate = hardware.sample_rate_hz as f32;
        let samples = |seconds: f32| ((seconds * rate) as u32).max(1);
        let limits = Limits {
            overspeed: self.overspeed_rad_s,
            overspeed_samples: samples(OVERSPEED_S),
            turning: self.stuck.below_rad_s,
            from: self.stuck.from_v / full,
            stuck_samples: samples(self.stuck.within_s),
            rest: self.rest_rad_s,
            time_out: samples(self.time_out_s),
            judging: samples(JUDGING_S),
        };
        Ok(Sequence::new(Parts {
            profile: Profile::new(&self.segments, full, hardware.sample_rate_hz.into()),
            limits,
            trip,
            stop_samples: samples(STOP_DEBOUNCE_S),
            start_samples: samples(START_DEBOUNCE_S),
        }))
    }
}

/// Counts between which the current is allowed, the lower first.
fn trip(current: Scale, trip_a: f32, full_scale: u16) -> Result<[u16; 2], SettingsError> {
    let counts = [-trip_a, trip_a].map(|amperes| Scalar::round(amperes / current.per_count + current.zero));
    let [low, high] = [counts[0].min(counts[1]), counts[0].max(counts[1])];
    // An end of the range is never left.
    if low < 1.0 || high > f32::from(full_scale) - 1.0 {
        return Err(SettingsError::Unmeasurable("the current that trips"));
    }
    Ok([low as u16, high as u16])
}
