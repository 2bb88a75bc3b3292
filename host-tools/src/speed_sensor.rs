//! How a speed is measured, where that is more than a sample of it: counts of an encoder's pulses in windows, means
//! over windows, values that are held, the time from pulse to pulse.
//!
//! A recording tells it in its metadata (`# speed_sensor: counts:120:0.01`), a model file in `[chain]`, a user of the
//! virtual rig with `--speed-sensor`. What nobody tells is estimated from the values ([`counts`]).

use std::f64::consts::TAU;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::counts::{self, Window};
use crate::error::{Error, Place, Result};
use crate::recording::Recording;

/// Key of a recording's metadata.
pub const KEY: &str = "speed_sensor";
/// Distance of a window from a whole number of samples, as a share of an interval, that is a matter of digits.
const ROUNDED: f64 = 0.05;

/// What a value of the speed is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum SpeedSensor {
    /// Pulses of an encoder since the value before, at the end of each window: steps of 2π/(pulses · window), rad/s.
    Counts {
        /// Pulses a turn, all edges that are counted.
        pulses: u32,
        /// Time from one value to the next, s.
        window_s: f64,
    },
    /// An angle by the time that the shaft took for it, from pulse to pulse: shown from a pulse to the next, the mean
    /// speed since the one before.
    Period {
        /// Pulses a turn.
        pulses: u32,
    },
    /// The mean over the window that ends with it, shown until the next.
    Mean {
        /// Time from one value to the next, s.
        window_s: f64,
    },
    /// The speed at the end of each window, held until the next.
    Held {
        /// Time from one value to the next, s.
        window_s: f64,
    },
}

impl SpeedSensor {
    /// What a recording's metadata tell.
    ///
    /// # Errors
    /// A sensor that there is not.
    pub fn told(recording: &Recording) -> Result<Option<Self>> {
        let Some(text) = recording.metadata().get(KEY) else { return Ok(None) };
        text.parse().map(Some).map_err(|error: Unknown| {
            Error::input(Place::file(recording.path()), format!("{KEY} in the metadata: {error}"), Unknown::REMEDY)
        })
    }

    /// What the values of a speed tell of themselves: counts by their quantum, timed pulses by how long each value is
    /// shown. A speed that is held may be counted or not, a mean or an instant: that takes a model.
    pub fn by_values(speed: &[f64], interval_s: f64) -> Option<Self> {
        let window_s = interval_s * Window::of(speed).map_or(1.0, |window| window.samples as f64);
        let counted = counts::pulses_a_turn(speed, window_s).map(|pulses| Self::Counts { pulses, window_s });
        let timed = || {
            let pulses = (TAU / counts::angle_a_pulse(speed, interval_s)?).round().max(1.0);
            Some(Self::Period { pulses: pulses as u32 })
        };
        counted.or_else(timed)
    }

    /// Time from one value to the next, s, where it is always the same.
    pub fn window_s(self) -> Option<f64> {
        match self {
            Self::Counts { window_s, .. } | Self::Mean { window_s } | Self::Held { window_s } => Some(window_s),
            Self::Period { .. } => None,
        }
    }

    /// Begin and end, in samples, of the stretch that each value is the mean over, where the values alone tell them: it
    /// is shown from the end on. A timed pulse tells how long the shaft took, which is less than the time since the
    /// last value where the motor has turned round in between.
    pub fn stretches(self, speed: &[f64], interval_s: f64) -> Vec<[usize; 2]> {
        let Self::Period { pulses } = self else { return Vec::new() };
        let angle = TAU / f64::from(pulses);
        let mut last = 0;
        let changes = (1..speed.len()).filter(|n| speed[*n] != speed[n - 1]);
        changes
            .map(|n| {
                let taken = (angle / (speed[n].abs() * interval_s)).round();
                // Both ends of a stretch are known to a sample.
                let from = if taken + 1.0 < (n - last) as f64 { n - taken.max(1.0) as usize } else { last };
                last = n;
                [from, n]
            })
            .collect()
    }

    /// The same stretches between the samples, in samples: a pulse comes at some instant of the interval before its
    /// value is shown, and as long after the pulse before it as the value tells, which leaves little to choose.
    pub fn between_pulses(self, speed: &[f64], stretches: &[[usize; 2]], interval_s: f64) -> Vec<[f64; 2]> {
        let as_shown = |stretch: &[usize; 2]| stretch.map(|n| n as f64);
        let Self::Period { pulses } = self else { return stretches.iter().map(as_shown).collect() };
        let angle = TAU / f64::from(pulses);
        // The sample that a pulse is shown at, and the instants between which it has come.
        let mut last: Option<(usize, [f64; 2])> = None;
        let of = |[begin, end]: &[usize; 2]| {
            let shown = *end as f64;
            let taken = angle / (speed[*end].abs() * interval_s);
            let since = |[from, to]: [f64; 2]| [(from + taken).max(shown - 1.0), (to + taken).min(shown)];
            let told = last.filter(|(before, _)| before == begin).map(|(_, before)| since(before));
            // Values of few digits add up to more than an interval in the end.
            let [from, to] = told.filter(|[from, to]| from <= to).unwrap_or([shown - 1.0, shown]);
            last = Some((*end, [from, to]));
            let pulse = 0.5 * (from + to);
            [pulse - taken.min((end - begin) as f64 + 1.0), pulse]
        };
        stretches.iter().map(of).collect()
    }

    /// Whether a value is a mean over its window.
    pub fn is_mean(self) -> bool {
        !matches!(self, Self::Held { .. })
    }

    /// What was done to the speed, in words.
    pub fn in_words(self) -> String {
        match self {
            Self::Counts { pulses, window_s } => {
                format!("counted by an encoder of {pulses} pulses a turn, in windows of {:.3} ms", 1e3 * window_s)
            }
            Self::Period { pulses } => format!("timed from pulse to pulse, {pulses} a turn"),
            Self::Mean { window_s } => format!("averaged over {:.3} ms", 1e3 * window_s),
            Self::Held { window_s } => format!("held for {:.3} ms", 1e3 * window_s),
        }
    }

    /// Its windows in a speed that is sampled every so many seconds; `None` where they are no whole number of samples,
    /// or one that shows each sample as it is.
    pub fn window(self, speed: &[f64], interval_s: f64) -> Option<Window> {
        let samples = self.window_s()? / interval_s;
        let is_whole = samples.round() >= 1.0 && (samples - samples.round()).abs() < ROUNDED;
        let shows_samples = samples.round() == 1.0 && !self.is_mean();
        (is_whole && !shows_samples)
            .then(|| Window { is_mean: self.is_mean(), ..Window::in_step_with(speed, samples.round() as usize) })
    }
}

impl fmt::Display for SpeedSensor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Counts { pulses, window_s } => write!(f, "counts:{pulses}:{window_s}"),
            Self::Period { pulses } => write!(f, "period:{pulses}"),
            Self::Mean { window_s } => write!(f, "mean:{window_s}"),
            Self::Held { window_s } => write!(f, "held:{window_s}"),
        }
    }
}

/// A text that names no speed sensor.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unknown(String);

impl Unknown {
    /// What to do about it.
    pub const REMEDY: &str = "give counts:PULSES:WINDOW, period:PULSES, mean:WINDOW or held:WINDOW, windows in seconds";
}

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?} is no speed sensor", self.0)
    }
}

impl std::error::Error for Unknown {}

impl FromStr for SpeedSensor {
    type Err = Unknown;

    fn from_str(text: &str) -> std::result::Result<Self, Unknown> {
        let unknown = || Unknown(text.to_owned());
        let parts: Vec<&str> = text.trim().split(':').map(str::trim).collect();
        let number = |text: &str| text.parse().ok().filter(|n| *n > 0).ok_or_else(unknown);
        let seconds = |text: &str| text.parse().ok().filter(|s: &f64| s.is_finite() && *s > 0.0).ok_or_else(unknown);
        match parts.as_slice() {
            ["counts", pulses, window] => Ok(Self::Counts { pulses: number(pulses)?, window_s: seconds(window)? }),
            ["period", pulses] => Ok(Self::Period { pulses: number(pulses)? }),
            ["mean", window] => Ok(Self::Mean { window_s: seconds(window)? }),
            ["held", window] => Ok(Self::Held { window_s: seconds(window)? }),
            _ => Err(unknown()),
        }
    }
}

impl TryFrom<String> for SpeedSensor {
    type Error = String;

    fn try_from(text: String) -> std::result::Result<Self, String> {
        text.parse().map_err(|error: Unknown| format!("{error}; {}", Unknown::REMEDY))
    }
}

impl From<SpeedSensor> for String {
    fn from(sensor: SpeedSensor) -> Self {
        sensor.to_string()
    }
}

/// The measuring chain that recordings of a model have passed, where they do not tell it themselves: `[chain]`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chain {
    /// How the speed was measured, if it was not sampled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed: Option<SpeedSensor>,
}

impl Chain {
    /// Whether it does nothing that is known.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// The chain that recordings have in common, by the sensor of each.
    pub fn common(sensors: impl Iterator<Item = Option<SpeedSensor>>) -> Self {
        let mut sensors: Vec<_> = sensors.collect();
        sensors.dedup();
        Self { speed: if let [one] = sensors.as_slice() { *one } else { None } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_is_what_its_text_says() {
        let counts = SpeedSensor::Counts { pulses: 120, window_s: 0.01 };
        assert_eq!("counts:120:0.01".parse(), Ok(counts));
        assert_eq!(" held : 5e-3 ".parse(), Ok(SpeedSensor::Held { window_s: 0.005 }));
        assert_eq!(SpeedSensor::Mean { window_s: 0.02 }.to_string(), "mean:0.02");
        assert_eq!("period:12".parse(), Ok(SpeedSensor::Period { pulses: 12 }));
        for wrong in ["period:0.5", "counts:0:0.01", "counts:120", "mean:-1", "mean:nan", "tacho", ""] {
            assert_eq!(wrong.parse::<SpeedSensor>(), Err(Unknown(wrong.to_owned())), "{wrong}");
        }
    }

    #[test]
    fn pulses_come_when_the_shaft_is_there() {
        // ω = 40 t rad/s in samples of 0.1 ms, 12 pulses a turn: pulse k at t = √(2 k (2π/12)/40).
        let (h, step, rate) = (1e-4, TAU / 12.0, 40.0);
        let pulse_s = |k: usize| (2.0 * k as f64 * step / rate).sqrt();
        let mut speed = vec![0.0; 20_000];
        for k in 2.. {
            let from = (pulse_s(k) / h).ceil() as usize;
            if from >= speed.len() {
                break;
            }
            speed[from..].fill(step / (pulse_s(k) - pulse_s(k - 1)));
        }
        let sensor = SpeedSensor::Period { pulses: 12 };
        let between = sensor.between_pulses(&speed, &sensor.stretches(&speed, h), h);
        assert!(between.len() > 100, "{}", between.len());
        for (k, [begin, end]) in between.iter().enumerate().skip(20) {
            // Twenty ends that are known to a sample each, at any part of it, leave about a twentieth.
            let off = [end - pulse_s(k + 2) / h, begin - pulse_s(k + 1) / h].map(f64::abs);
            assert!(off.iter().all(|off| *off < 0.15), "pulse {}: {off:?}", k + 2);
        }
    }

    #[test]
    fn windows_are_whole_numbers_of_samples() {
        let speed = [0.0; 8];
        let window =
            |sensor: SpeedSensor, interval_s: f64| sensor.window(&speed, interval_s).map(|w| (w.samples, w.is_mean));
        assert_eq!(window(SpeedSensor::Counts { pulses: 1, window_s: 0.02 }, 0.005), Some((4, true)));
        assert_eq!(window(SpeedSensor::Held { window_s: 0.02 }, 0.01), Some((2, false)));
        assert_eq!(window(SpeedSensor::Mean { window_s: 0.01 }, 0.01), Some((1, true)));
        assert_eq!(window(SpeedSensor::Held { window_s: 0.01 }, 0.01), None, "each sample is shown");
        assert_eq!(window(SpeedSensor::Mean { window_s: 0.015 }, 0.01), None, "one and a half");
    }
}
