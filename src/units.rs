//! Raw counts of the analogue-to-digital converter and the quantities that they stand for.

use core::fmt;

use crate::hardware::NUCLEO_G474RE;

/// Voltage, V.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct Volts(pub f32);

/// Current, A.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct Amperes(pub f32);

/// Speed, rad/s.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
pub struct RadiansPerSecond(pub f32);

/// One sample of the three channels as the converter gives it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Supply voltage.
    pub voltage: u16,
    /// Current.
    pub current: u16,
    /// Speed.
    pub speed: u16,
}

/// One sample of the three channels in SI units.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sample {
    /// u.
    pub voltage: Volts,
    /// i.
    pub current: Amperes,
    /// ω.
    pub speed: RadiansPerSecond,
}

/// A channel's straight line from counts to its quantity: `value = (counts − zero) · per_count`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Scale {
    /// Counts at which the quantity is zero; a fraction, since it is a mean of many samples.
    pub zero: f32,
    /// Quantity per count.
    pub per_count: f32,
}

impl Scale {
    /// A channel whose whole range of counts, up to the `full_scale` of its converter, spans `from..=to`.
    pub fn spanning(from: f32, to: f32, full_scale: u16) -> Self {
        let per_count = (to - from) / f32::from(full_scale);
        Self { zero: -from / per_count, per_count }
    }

    /// Counts to the quantity.
    #[inline(always)]
    pub fn quantity(&self, counts: u16) -> f32 {
        (f32::from(counts) - self.zero) * self.per_count
    }
}

/// Calibration of the three channels, as an engineer sets it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CalibrationSettings {
    /// Voltage, V.
    pub voltage: Scale,
    /// Current, A.
    pub current: Scale,
    /// Speed, rad/s.
    pub speed: Scale,
}

impl Default for CalibrationSettings {
    /// The usual ranges on [`NUCLEO_G474RE`].
    fn default() -> Self {
        Self::usual(NUCLEO_G474RE.full_scale)
    }
}

/// Least and greatest gain of a channel, V, A or rad/s per count, its sign left aside. With 12 bits the least is a
/// range of 41 µV, µA or µrad/s and the greatest one of 4.1 MV, MA or Mrad/s: no motor of a rig is beyond either.
/// Judgement.
pub const GAINS: [f32; 2] = [1e-8, 1e3];
/// The furthest that a zero may lie from the first count, counts: the range of the widest converter that
/// [`Counts`] can hold. A live zero lies within the converter's range, a suppressed one outside it, but not by more.
pub const FURTHEST_ZERO: f32 = 65_536.0;

/// A scale that cannot be right, named by its channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CalibrationError(pub &'static str);

impl fmt::Display for CalibrationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [least, most] = GAINS;
        write!(
            f,
            "calibration of the {}: zero must lie within ±{FURTHEST_ZERO} counts and the gain between {least:e} and {most} a \
             count, its sign left aside",
            self.0
        )
    }
}

impl core::error::Error for CalibrationError {}

/// A validated calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration(CalibrationSettings);

impl CalibrationSettings {
    /// The usual ranges on a converter: ±400 V (peak of 230 V mains is 325 V), ±40 A (four times the nominal peak, so
    /// that a direct start is seen) and 0 to 5,000 rad/s (nominal 3,455).
    pub fn usual(full_scale: u16) -> Self {
        Self {
            voltage: Scale::spanning(-400.0, 400.0, full_scale),
            current: Scale::spanning(-40.0, 40.0, full_scale),
            speed: Scale::spanning(0.0, 5000.0, full_scale),
        }
    }

    /// Validates the settings.
    ///
    /// # Errors
    /// The channel whose scale no rig has: see [`GAINS`] and [`FURTHEST_ZERO`].
    pub fn build(self) -> Result<Calibration, CalibrationError> {
        let [least, most] = GAINS;
        for (name, scale) in [("voltage", self.voltage), ("current", self.current), ("speed", self.speed)] {
            // What is not a number lies in no range.
            let zero = (-FURTHEST_ZERO..=FURTHEST_ZERO).contains(&scale.zero);
            if !zero || !(least..=most).contains(&scale.per_count.abs()) {
                return Err(CalibrationError(name));
            }
        }
        Ok(Calibration(self))
    }
}

impl Calibration {
    /// The scales of voltage, current and speed.
    pub fn scales(&self) -> [Scale; 3] {
        [self.0.voltage, self.0.current, self.0.speed]
    }

    /// A sample in SI units.
    #[inline(always)]
    pub fn sample(&self, counts: Counts) -> Sample {
        Sample {
            voltage: Volts(self.0.voltage.quantity(counts.voltage)),
            current: Amperes(self.0.current.quantity(counts.current)),
            speed: RadiansPerSecond(self.0.speed.quantity(counts.speed)),
        }
    }
}
