//! A recording from the virtual rig.

use crate::context::Context;
use crate::error::{Error, Result};
use crate::recording::Recording;
use crate::rig::{Kind, Logger, Motor, Setup};
use crate::speed_sensor;

/// What is simulated, and how it is recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Kind of motor.
    pub kind: Kind,
    /// Effects beyond the base model: `ID[:FORM][=SIZE]`.
    pub effects: Vec<String>,
    /// Faults: `ID[=SIZE][@T]`.
    pub faults: Vec<String>,
    /// Seed of an effect that nothing names.
    pub hidden: Option<u64>,
    /// Excitation; by itself the usual one.
    pub profile: Option<String>,
    /// Seed of all randomness.
    pub seed: u64,
    /// Length, s; by itself the profile's.
    pub seconds: Option<f64>,
    /// Largest voltage, V; by itself the profile's.
    pub peak_voltage_v: Option<f64>,
    /// Mains frequency, Hz, from 10 to 400.
    pub mains_hz: u16,
    /// Scatter of the motor's parameters, relative.
    pub spread: f64,
    /// Factor on the noise of the channels.
    pub noise: f64,
    /// Fluctuation of the load, relative.
    pub turbulence: f64,
    /// Fifth harmonic of the mains, relative.
    pub fifth_harmonic: f64,
    /// Samples a second that are kept; by itself all.
    pub rate_hz: Option<f64>,
    /// How the speed is measured; by itself sampled.
    pub speed_sensor: Option<String>,
    /// Whether the metadata tell the truth.
    pub reveal: bool,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            kind: Kind::Universal,
            effects: Vec::new(),
            faults: Vec::new(),
            hidden: None,
            profile: None,
            seed: 0,
            seconds: None,
            peak_voltage_v: None,
            mains_hz: 50,
            spread: 0.0,
            noise: 1.0,
            turbulence: 0.003,
            fifth_harmonic: 0.0,
            rate_hz: None,
            speed_sensor: None,
            reveal: false,
        }
    }
}

impl Request {
    /// The run in preparation.
    ///
    /// # Errors
    /// Unknown names, impossible sizes.
    pub fn setup(&self) -> Result<Setup> {
        if !(0.0..=0.3).contains(&self.spread) {
            return Err(Error::usage(format!("a spread of {} is not possible", self.spread), "give one from 0 to 0.3"));
        }
        if !(10..=400).contains(&self.mains_hz) {
            return Err(Error::usage(format!("mains of {} Hz cannot be", self.mains_hz), "give 10 to 400 Hz"));
        }
        let mut setup = Setup::new(self.kind).seed(self.seed).noise(self.noise);
        if self.spread > 0.0 {
            setup.motor = Motor::sample_from_population(&setup.motor, self.spread, self.seed);
        }
        setup.seconds = self.seconds;
        setup.peak_voltage_v = self.peak_voltage_v;
        setup.mains_hz = f64::from(self.mains_hz);
        setup.turbulence = self.turbulence;
        setup.fifth_harmonic = self.fifth_harmonic;
        setup.reveal = self.reveal;
        if let Some(profile) = &self.profile {
            setup = setup.profile(profile)?;
        }
        for effect in &self.effects {
            setup = setup.effect(effect)?;
        }
        for fault in &self.faults {
            setup = setup.fault(fault)?;
        }
        if let Some(seed) = self.hidden {
            setup = setup.hidden_effect(seed);
        }
        Ok(setup)
    }

    fn logger(&self) -> Result<Logger> {
        let sensor = |text: &String| {
            text.parse().map_err(|error: speed_sensor::Unknown| {
                Error::usage(format!("--speed-sensor: {error}"), speed_sensor::Unknown::REMEDY)
            })
        };
        Ok(Logger { rate_hz: self.rate_hz, speed_sensor: self.speed_sensor.as_ref().map(sensor).transpose()? })
    }

    /// What the rig records.
    ///
    /// # Errors
    /// As [`Request::setup`]; a speed that cannot be measured so; an interrupt.
    pub fn answer(&self, ctx: &Context) -> Result<Answer> {
        let (setup, logger) = (self.setup()?, self.logger()?);
        let recording = logger.record(&setup.run_in(ctx)?.recording)?;
        Ok(Answer { setup, recording })
    }
}

/// A recording, and what made it.
#[derive(Debug, Clone)]
pub struct Answer {
    /// The run.
    pub setup: Setup,
    /// What was recorded.
    pub recording: Recording,
}
