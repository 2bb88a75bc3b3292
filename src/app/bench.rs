//! A motor in place of the converter: what the emulated board samples.
//!
//! A universal motor on 50 Hz mains that is switched on softly, runs, and is switched off, again and again, as counts
//! of the usual calibration. It is the core's own model, so the host computes the same counts bit by bit, and a test
//! can tell whether a recording has every sample in its place. For tests of the link and the application; it says
//! nothing about the model.

use crate::hardware::NUCLEO_G474RE;
use crate::motor::{Constraints, FluxLaw, Motor, ParameterError, Parameters, Stepper};
use crate::scalar::Scalar;
use crate::units::{CalibrationSettings, Counts, Scale};

/// A vacuum-cleaner motor of 1.4 kW.
pub const MOTOR: Parameters<f32> = Parameters {
    flux_law: FluxLaw::Series,
    resistance: 2.2,
    inductance: 20e-3,
    flux_coefficient: 9.45e-3,
    inertia: 1.8e-4,
    dry_friction: 0.015,
    viscous_friction: 8e-6,
    turbulent_friction: 2.98e-8,
};

/// Peak of the supply, V; what it gives at full command.
pub const PEAK: f32 = 325.0;
/// Samples in a period of the mains.
const PERIOD: u32 = 200;
/// Samples in which the amplitude rises; as many in which it falls, and for which it is off then.
const RISE: u32 = 20_000;
/// Samples for which it is there.
const HOLD: u32 = 40_000;
/// Sample of a cycle, while the voltage is there, at which a planned trouble begins.
pub const MIDDLE: u32 = RISE + HOLD / 4;
/// Samples from one start to the next.
pub const CYCLE: u32 = 3 * RISE + HOLD;

/// What can be wrong with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Trouble {
    /// Nothing.
    #[default]
    None,
    /// [`SERIES_RESISTANCE`] in the supply's line.
    Resistance,
    /// [`MORE_LOAD`] times the fan's load.
    Load,
    /// A current sensor that shows [`MORE_CURRENT`] times the current.
    CurrentSensor,
}

impl Trouble {
    /// By its letter, as the emulated board is told: `-`, `r`, `l`, `c`.
    pub const fn from_letter(letter: u8) -> Option<Self> {
        match letter {
            b'-' => Some(Self::None),
            b'r' => Some(Self::Resistance),
            b'l' => Some(Self::Load),
            b'c' => Some(Self::CurrentSensor),
            _ => None,
        }
    }
}

/// Resistance of a bad contact, Ω: three tenths of the motor's.
pub const SERIES_RESISTANCE: f32 = 0.66;
/// A blocked duct, as a factor of the fan's load.
pub const MORE_LOAD: f32 = 1.3;
/// A wrong gain of the current sensor.
pub const MORE_CURRENT: f32 = 1.05;

/// The motor with its supply.
#[derive(Debug, Clone)]
pub struct Bench {
    stepper: Stepper<f32>,
    /// The motor under more load, which takes over where the other one is.
    loaded: Stepper<f32>,
    trouble: Trouble,
    /// What begins at [`MIDDLE`] of each cycle.
    planned: Trouble,
    sample: u32,
    last_voltage: f32,
}

impl Bench {
    /// At rest.
    ///
    /// # Errors
    /// Never, as far as [`MOTOR`] is a motor.
    pub fn new() -> Result<Self, ParameterError> {
        let stepper = |parameters| Stepper::build(Motor::build(parameters, &[])?, 1e-4);
        let load = Parameters { turbulent_friction: MORE_LOAD * MOTOR.turbulent_friction, ..MOTOR };
        Ok(Self {
            stepper: stepper(MOTOR)?,
            loaded: stepper(load)?,
            trouble: Trouble::None,
            planned: Trouble::None,
            sample: 0,
            last_voltage: 0.0,
        })
    }

    /// Something goes wrong from [`MIDDLE`] on in each cycle, until something else is planned: whoever asks need not be
    /// quick.
    pub fn plan_trouble(&mut self, trouble: Trouble) {
        self.planned = trouble;
    }

    /// Something goes wrong from the next sample until the end of the cycle, or no longer.
    pub fn set_trouble(&mut self, trouble: Trouble) {
        if (trouble == Trouble::Load) != (self.trouble == Trouble::Load) {
            let state = self.stepper.state();
            core::mem::swap(&mut self.stepper, &mut self.loaded);
            self.stepper.set_state(state);
        }
        self.trouble = trouble;
    }

    /// The next sample. Not a part of whoever asks: the interrupt's own code is what is to be fast.
    #[inline(never)]
    pub fn counts(&mut self) -> Counts {
        let now = self.sample % CYCLE;
        let amplitude = PEAK * now.min((2 * RISE + HOLD).saturating_sub(now)).min(RISE) as f32 / RISE as f32;
        self.counts_at(amplitude)
    }

    /// The next sample on a supply that is commanded: the peak of its voltage, V. Troubles begin as they do without.
    #[inline(never)]
    pub fn counts_at(&mut self, amplitude: f32) -> Counts {
        let phase = (self.sample % PERIOD) as f32 / PERIOD as f32;
        let now = self.sample % CYCLE;
        if now == 0 && self.sample > 0 {
            self.set_trouble(Trouble::None);
        }
        if now == MIDDLE && self.planned != Trouble::None {
            self.set_trouble(self.planned);
        }
        let voltage = amplitude * Scalar::sin(core::f32::consts::TAU * phase);
        let lost =
            if self.trouble == Trouble::Resistance { SERIES_RESISTANCE * self.stepper.state().current } else { 0.0 };
        self.stepper.step(self.last_voltage, voltage - lost, Constraints::FREE);
        self.last_voltage = voltage - lost;
        self.sample = self.sample.wrapping_add(1);
        let scales = CalibrationSettings::default();
        let state = self.stepper.reading();
        let gain = if self.trouble == Trouble::CurrentSensor { MORE_CURRENT } else { 1.0 };
        Counts {
            voltage: to_counts(&scales.voltage, voltage),
            current: to_counts(&scales.current, gain * state.current),
            speed: to_counts(&scales.speed, state.speed),
        }
    }
}

/// The nearest count, within the converter's range.
fn to_counts(scale: &Scale, quantity: f32) -> u16 {
    let counts = Scalar::round(quantity / scale.per_count + scale.zero);
    counts.clamp(0.0, f32::from(NUCLEO_G474RE.full_scale)) as u16
}
