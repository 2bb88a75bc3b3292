//! The virtual rig at the converter's pins, closed in time: a trigger of the converter lets the motor run on by a sample.

use greyrig::units::{CalibrationSettings, Scale};
use greyrig_host::rig::chain::ChainSetup;
use greyrig_host::rig::running::Running;

use crate::analog::{Analog, INPUTS};

/// The rig; at its end the profile begins again.
pub struct Rig {
    running: Running,
    now: [u16; 3],
}

impl Rig {
    /// A rig at work.
    pub fn new(running: Running) -> Self {
        Self { running, now: [0; 3] }
    }
}

impl Analog for Rig {
    fn begin(&mut self, _seconds: f64) {
        if let Some(sample) = self.running.next_sample() {
            self.now = sample.counts;
        } else {
            self.running.again();
            self.now = self.running.next_sample().map_or(self.now, |sample| sample.counts);
        }
    }

    fn convert(&mut self, input: u8) -> Option<u16> {
        INPUTS.iter().position(|&own| own == input).map(|n| self.now[n])
    }
}

/// The calibration that belongs to a measuring chain.
pub fn calibration(chain: &ChainSetup) -> CalibrationSettings {
    let codes = f64::from(1_u32 << chain.bits.unwrap_or(12));
    let [voltage, current, speed] = chain.channels.map(|channel| {
        let per_count = (channel.highest - channel.lowest) / codes;
        Scale { zero: (-channel.lowest / per_count) as f32, per_count: per_count as f32 }
    });
    CalibrationSettings { voltage, current, speed }
}
