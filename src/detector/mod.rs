//! The detector: from the residuals of a tick to an alarm and a verdict.
//!
//! ```text
//! Output of a tick ──► sums over a period of the mains ──► features ─┬─► fast: error of current, speed; sparking
//! raw current ─► above 1 kHz ─┘                                      ├─► fast: abrupt change of the deviations
//!                                                                    └─► cumulative: deviation of current, speed
//! ```
//! A period's end takes a step of its judgement with each of the next [`STEPS`] samples, so that no sample takes much
//! longer than another; where the tick itself took longer, that step waits for the next sample.
//!
//! All thresholds are learnt from healthy motors. Nothing is judged during the start, while the supply is off, or where
//! the correction is used outside what it has been trained on; a run in which too little could be judged has no
//! verdict.

mod cumulative;
mod fast;
mod features;
mod isolation;
mod judge;
mod jump;
mod period;

use core::fmt;

pub use cumulative::{Cumulative, THRESHOLD, Tolerance};
pub use fast::{CONFIRM, Fast, RELEASE};
pub use features::{Features, Point, Sums};
pub use isolation::{Kind, locate};
pub use judge::{MOST_WAITS, STEPS};
pub use jump::{Jump, PAST};
pub use period::PeriodClock;

use crate::butterworth::HighPass;
use crate::tick::Output;
use judge::Judge;

/// Lower end of the band in which sparks are looked for, Hz.
pub const SPARKS_ABOVE_HZ: f32 = 1000.0;

/// The sampling rate, Hz, has to be above this.
pub const LEAST_SAMPLE_RATE_HZ: f32 = 2.5 * SPARKS_ABOVE_HZ;

/// What is healthy, learnt from healthy motors; a limit of 0 is not watched.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Limits {
    /// Largest error of the current, 1.
    pub current: f32,
    /// Largest error of the speed, 1.
    pub speed: f32,
    /// Largest current above 1 kHz, A.
    pub sparking: f32,
    /// Largest abrupt change of the current's deviation, 1.
    pub current_jump: f32,
    /// Largest abrupt change of the speed's deviation, 1.
    pub speed_jump: f32,
    /// Mean and half-width of the current's deviation, 1.
    pub current_deviation: [f32; 2],
    /// Mean and half-width of the speed's deviation, 1.
    pub speed_deviation: [f32; 2],
}

/// The detector as an engineer sets it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// Sampling rate, Hz.
    pub sample_rate_hz: f32,
    /// Nominal voltage, RMS, V: a period below [`Settings::least_voltage`] of it is not judged.
    pub nominal_voltage: f32,
    /// Least voltage that is judged, as a share of the nominal one.
    pub least_voltage: f32,
    /// Highest voltage that is judged, as a share of the nominal one.
    pub most_voltage: f32,
    /// Least speed that is judged, rad/s.
    pub least_speed: f32,
    /// Time after the start that is not judged, s.
    pub blanking_s: f32,
    /// Periods that have to be judged for a verdict.
    pub fewest_periods: u32,
    /// What is healthy.
    pub limits: Limits,
}

/// Why settings make no detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SettingsError {
    /// The sampling rate is too low to see sparks, or no number.
    SampleRate,
    /// The nominal voltage is not positive.
    Voltage,
    /// A share, a time or a speed is negative or no number.
    Negative,
    /// A limit is negative or no number.
    Limit,
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::SampleRate => "the sampling rate has to be above 2500 Hz, or sparks cannot be seen",
            Self::Voltage => "the nominal voltage has to be positive",
            Self::Negative => "shares, times and speeds have to be numbers from zero on",
            Self::Limit => "limits have to be numbers from zero on",
        })
    }
}

impl core::error::Error for SettingsError {}

/// What called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Cause {
    /// The error of the current.
    CurrentError,
    /// The error of the speed.
    SpeedError,
    /// Noise of the current above 1 kHz.
    Sparking,
    /// The current has changed abruptly against the model.
    CurrentJump,
    /// The speed has changed abruptly against the model.
    SpeedJump,
    /// The current deviates for a long time.
    CurrentDeviation,
    /// The speed deviates for a long time.
    SpeedDeviation,
}

impl Cause {
    /// All of them, in order of declaration.
    pub const ALL: [Self; 7] = [
        Self::CurrentError,
        Self::SpeedError,
        Self::Sparking,
        Self::CurrentJump,
        Self::SpeedJump,
        Self::CurrentDeviation,
        Self::SpeedDeviation,
    ];

    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::CurrentError => "error of the current",
            Self::SpeedError => "error of the speed",
            Self::Sparking => "current above 1 kHz",
            Self::CurrentJump => "abrupt change of the current",
            Self::SpeedJump => "abrupt change of the speed",
            Self::CurrentDeviation => "steady deviation of the current",
            Self::SpeedDeviation => "steady deviation of the speed",
        }
    }
}

/// An alarm.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Alarm {
    /// What called, the strongest first.
    pub cause: Cause,
    /// Where the fault sits.
    pub kind: Kind,
    /// By how much the limit is exceeded.
    pub ratio: f32,
}

/// What a period brought.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Period {
    /// Its features.
    pub features: Features,
    /// Abrupt changes of the deviations of current and speed.
    pub jumps: [f32; 2],
    /// Whether it was judged.
    pub judged: bool,
    /// What calls at its end.
    pub alarm: Option<Alarm>,
}

/// Outcome of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Verdict {
    /// Nothing called.
    Pass,
    /// An alarm has been raised.
    Fail,
    /// Too little could be judged.
    CannotJudge,
}

/// What the detector has done with a sample besides adding it to its sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// Nothing: there is time for something else.
    Idle,
    /// A step of the judgement of a period, or no time for one.
    Step,
    /// The last of them: [`Detector::period`] is what the period brought.
    Told,
}

/// The detector's state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detector {
    clock: PeriodClock,
    high_pass: HighPass,
    sums: Sums,
    judge: Judge,
    started: bool,
    /// Samples at the begin of the sums that belong to the start.
    blank: u32,
}

impl Settings {
    /// Validates the settings.
    ///
    /// # Errors
    /// Numbers that make no detector.
    pub fn build(self) -> Result<Detector, SettingsError> {
        let high_pass = HighPass::new(f64::from(SPARKS_ABOVE_HZ) / f64::from(self.sample_rate_hz))
            .filter(|_| self.sample_rate_hz > LEAST_SAMPLE_RATE_HZ)
            .ok_or(SettingsError::SampleRate)?;
        let from_zero = |x: f32| x.is_finite() && x >= 0.0;
        if !(self.nominal_voltage.is_finite() && self.nominal_voltage > 0.0) {
            return Err(SettingsError::Voltage);
        }
        if ![self.least_voltage, self.most_voltage, self.least_speed, self.blanking_s].into_iter().all(from_zero) {
            return Err(SettingsError::Negative);
        }
        let l = self.limits;
        let widths = [
            l.current,
            l.speed,
            l.sparking,
            l.current_jump,
            l.speed_jump,
            l.current_deviation[1],
            l.speed_deviation[1],
        ];
        if !widths.into_iter().all(from_zero)
            || !l.current_deviation[0].is_finite()
            || !l.speed_deviation[0].is_finite()
        {
            return Err(SettingsError::Limit);
        }
        Ok(Detector {
            clock: PeriodClock::new(self.sample_rate_hz, self.nominal_voltage),
            high_pass,
            sums: Sums::default(),
            judge: Judge::new(self),
            started: false,
            blank: (self.blanking_s * self.sample_rate_hz) as u32,
        })
    }
}

impl Detector {
    /// As [`Detector::advance`]; [`STEPS`] samples after the end of a period, or up to [`MOST_WAITS`] later, gives what
    /// that period brought.
    pub fn process(&mut self, output: &Output) -> Option<Period> {
        (self.advance(output) == Progress::Told).then_some(*self.period())
    }

    /// Takes what a tick gives.
    #[inline]
    pub fn advance(&mut self, output: &Output) -> Progress {
        let [voltage, current] = output.raw;
        if !self.started {
            self.start(current);
        }
        let point = Point {
            voltage,
            measured: output.measured,
            modelled: output.modelled,
            high: self.high_pass.process(current),
            validity: output.validity,
        };
        if self.clock.process(voltage).is_some() {
            self.blank = self.blank.saturating_sub(self.sums.count());
            self.judge.begin(self.sums, self.blank > 0);
            self.sums = Sums::of(&point);
            Progress::Step
        } else {
            self.sums.add(&point);
            self.judge.step(output.crossed_zero)
        }
    }

    #[cold]
    #[inline(never)]
    fn start(&mut self, current: f32) {
        self.high_pass.reset_to(current);
        self.started = true;
    }

    /// The period that was judged last.
    #[inline]
    pub fn period(&self) -> &Period {
        self.judge.period()
    }

    /// The verdict so far; once a motor has failed it stays so.
    pub fn verdict(&self) -> Verdict {
        self.judge.verdict()
    }
}
