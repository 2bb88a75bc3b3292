//! The virtual rig at the converter's pins, closed in time: a trigger of the converter lets the motor run on by a
//! sample.

use greyrig::units::{CalibrationSettings, Scale};
use greyrig_host::error::Result;
use greyrig_host::rig::Setup;
use greyrig_host::rig::chain::ChainSetup;
use greyrig_host::rig::running::Running;
use greyrig_host::rig::source::Shape;

use crate::analog::{Analog, INPUTS};

/// The rig. Its profile begins with the motor at rest when the processor starts, and again, with the motor as it is, at
/// its end.
pub struct Rig {
    setup: Setup,
    running: Running,
    now: [u16; 3],
}

impl Rig {
    /// A rig that is ready to run.
    ///
    /// # Errors
    /// What the rig refuses.
    pub fn new(setup: Setup) -> Result<Self> {
        let running = setup.start()?;
        Ok(Self { setup, running, now: [0; 3] })
    }

    /// The calibration that belongs to its measuring chain.
    pub fn calibration(&self) -> CalibrationSettings {
        calibration(&self.running.chain_setup)
    }
}

impl Analog for Rig {
    fn start(&mut self) {
        // It did start before.
        if let Ok(running) = self.setup.start() {
            self.running = running;
        }
    }

    fn begin(&mut self, _seconds: f64) {
        let sample = self.running.next_sample().or_else(|| {
            self.running.again();
            self.running.next_sample()
        });
        self.now = sample.map_or(self.now, |sample| sample.counts);
    }

    fn convert(&mut self, input: u8) -> Option<u16> {
        INPUTS.iter().position(|&own| own == input).map(|n| self.now[n])
    }
}

/// A rig whose supply the board commands: alternating voltage of a peak up to a full scale. A start of the processor
/// leaves the motor as it is.
pub struct Commanded {
    running: Running,
    frequency_hz: f64,
    full_scale_v: f64,
    now: [u16; 3],
}

impl Commanded {
    /// A rig with its motor at rest and its contactor open.
    ///
    /// # Errors
    /// What the rig refuses.
    pub fn new(setup: &Setup, full_scale_v: f64) -> Result<Self> {
        let mut rig = Self { running: setup.start()?, frequency_hz: setup.mains_hz, full_scale_v, now: [0; 3] };
        rig.supply(false, 0.0);
        Ok(rig)
    }

    /// The calibration that belongs to its measuring chain.
    pub fn calibration(&self) -> CalibrationSettings {
        calibration(&self.running.chain_setup)
    }
}

impl Analog for Commanded {
    fn supply(&mut self, closed: bool, fraction: f64) {
        let peak = fraction * self.full_scale_v;
        self.running.command(Shape::Ac { frequency_hz: self.frequency_hz, from_v: peak, to_v: peak }, closed);
    }

    fn begin(&mut self, _seconds: f64) {
        if let Some(sample) = self.running.next_sample() {
            self.now = sample.counts;
        }
    }

    fn convert(&mut self, input: u8) -> Option<u16> {
        INPUTS.iter().position(|&own| own == input).map(|n| self.now[n])
    }
}

fn calibration(chain: &ChainSetup) -> CalibrationSettings {
    let codes = f64::from(1_u32 << chain.bits.unwrap_or(12));
    let [voltage, current, speed] = chain.channels.map(|channel| {
        let per_count = (channel.highest - channel.lowest) / codes;
        Scale { zero: (-channel.lowest / per_count) as f32, per_count: per_count as f32 }
    });
    CalibrationSettings { voltage, current, speed }
}
