//! Reports: sums that the interrupt gathers, and the RMS values that the thread makes of them.

use micromath::F32Ext;

use super::ring::Words;
use crate::link::message::Report;
use crate::motor::State;
use crate::tick::Output;

/// Sums over a stretch of samples.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Window {
    /// Number of the last sample.
    pub sample: u32,
    /// Samples so far.
    pub count: u32,
    voltage_squared: f32,
    current_squared: f32,
    speed: f32,
    residual_squared: State<f32>,
}

impl Window {
    /// With a further sample.
    #[inline]
    #[must_use]
    pub fn with(&self, sample: u32, output: &Output) -> Self {
        let ([voltage, _], State { current, speed }, residual) = (output.raw, output.measured, output.residual());
        Self {
            sample,
            count: self.count + 1,
            voltage_squared: self.voltage_squared + voltage * voltage,
            current_squared: self.current_squared + current * current,
            speed: self.speed + speed,
            residual_squared: State {
                current: self.residual_squared.current + residual.current * residual.current,
                speed: self.residual_squared.speed + residual.speed * residual.speed,
            },
        }
    }

    /// The report on it.
    pub fn report(&self) -> Report {
        let share = 1.0 / self.count.max(1) as f32;
        Report {
            sample: self.sample,
            count: self.count.min(u16::MAX.into()) as u16,
            voltage_rms: displayed_root(self.voltage_squared * share),
            current_rms: displayed_root(self.current_squared * share),
            speed: self.speed * share,
            residual_current_rms: displayed_root(self.residual_squared.current * share),
            residual_speed_rms: displayed_root(self.residual_squared.speed * share),
        }
    }
}

impl Words<7> for Window {
    fn to_words(&self) -> [u32; 7] {
        let State { current, speed } = self.residual_squared;
        let [a, b, c, d, e] =
            [self.voltage_squared, self.current_squared, self.speed, current, speed].map(f32::to_bits);
        [self.sample, self.count, a, b, c, d, e]
    }

    fn from_words([sample, count, sums @ ..]: [u32; 7]) -> Self {
        let [voltage_squared, current_squared, speed, residual_current, residual_speed] = sums.map(f32::from_bits);
        let residual_squared = State { current: residual_current, speed: residual_speed };
        Self { sample, count, voltage_squared, current_squared, speed, residual_squared }
    }
}

/// √x to within 0.2 % (`tests/core/app.rs`), for display: the shift of micromath, which is off by up to 6.1 %, and one
/// step of Newton's, which makes e²/2 of an error e. Models and filters take [`crate::scalar`]'s square root instead.
pub fn displayed_root(x: f32) -> f32 {
    if x <= 0.0 {
        return 0.0;
    }
    let root = F32Ext::sqrt(x);
    0.5 * (root + x / root)
}
