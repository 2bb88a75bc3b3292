//! The detector on the host: recordings through the rig's own tick and detector, tests over the link, limits learnt
//! from healthy motors, and what may be broken.

pub mod air;
pub mod bands;
pub mod calibrate;
pub mod drift;
pub mod gauge;
pub mod golden;
pub mod live;
pub mod lot;
pub mod parameters;
pub mod replay;
pub mod suspect;
pub mod test;
pub mod tolerance;

use greyrig::detector::{self, Limits};

use crate::model::DetectorEntry;

impl DetectorEntry {
    /// The core's settings at a sampling interval, s.
    pub fn settings(&self, interval_s: f64) -> detector::Settings {
        let pair = |[a, b]: [f64; 2]| [a as f32, b as f32];
        detector::Settings {
            sample_rate_hz: (1.0 / interval_s) as f32,
            nominal_voltage: self.nominal_voltage as f32,
            least_voltage: self.least_voltage as f32,
            most_voltage: self.most_voltage as f32,
            least_speed: self.least_speed as f32,
            blanking_s: self.blanking_s as f32,
            fewest_periods: self.fewest_periods,
            limits: Limits {
                current: self.current as f32,
                speed: self.speed as f32,
                sparking: self.sparking as f32,
                current_jump: self.current_jump as f32,
                speed_jump: self.speed_jump as f32,
                current_deviation: pair(self.current_deviation),
                speed_deviation: pair(self.speed_deviation),
            },
        }
    }
}
