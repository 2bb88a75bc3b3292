//! Voltage or torque, and motion, without a current: one balance.

use greyrig::butterworth;
use greyrig::motor::{Motor, OperatingPoint, State};

use super::Balance;
use crate::experiment::{Drive, Experiment, derivative};
use crate::filtering::{directions_by_quantum, zero_phase};
use crate::identify::inverse_dynamics::automatic_cutoff_hz;

/// The low-pass of a motion has at least this many periods of its cut-off in the recording.
const FEWEST_PERIODS: f64 = 40.0;

/// Voltage or torque, and motion: no current.
#[derive(Debug)]
pub struct Motion<'a> {
    experiment: &'a Experiment,
    speed: &'a [f64],
    acceleration: Vec<f64>,
    directions: Vec<f64>,
    low_pass: butterworth::Settings,
    samples: Vec<usize>,
}

impl<'a> Motion<'a> {
    /// Prepares a recording; `None` without a motion.
    pub fn new(e: &'a Experiment) -> Option<Self> {
        let speed = e.speed.as_deref()?;
        let (motion, derivatives) = e.position.as_deref().map_or((speed, 1), |angle| (angle, 2));
        let slowest = FEWEST_PERIODS / (e.len() as f64 * e.interval_s);
        let cutoff_hz = automatic_cutoff_hz(motion, derivatives, e.interval_s).max(slowest).min(e.filter.cutoff_hz);
        let trim = ((2.0 / cutoff_hz) / e.interval_s) as usize;
        let stride = ((1.0 / (4.0 * cutoff_hz * e.interval_s)) as usize).max(1);
        Some(Self {
            experiment: e,
            speed,
            acceleration: derivative(speed, e.interval_s),
            directions: directions_by_quantum(speed),
            low_pass: butterworth::Settings { order: 4, cutoff_hz, sample_rate_hz: 1.0 / e.interval_s },
            samples: (trim..e.len().saturating_sub(trim)).step_by(stride).filter(|n| e.counted[*n]).collect(),
        })
    }

    /// Group and samples of the rows.
    pub fn rows(&self) -> (u8, Vec<usize>) {
        (u8::from(self.experiment.drive == Drive::Torque), self.samples.clone())
    }

    /// What the rows are compared with: the voltage, or the torque.
    pub fn signals(&self) -> Vec<f64> {
        self.rows_of(&self.experiment.input)
    }

    fn rows_of(&self, signal: &[f64]) -> Vec<f64> {
        let filtered = zero_phase(signal, self.low_pass).unwrap_or_else(|| signal.to_vec());
        self.samples.iter().map(|n| filtered[*n]).collect()
    }

    /// What the balance leaves over.
    pub fn residuals(&self, motor: &Motor<f64>) -> Vec<f64> {
        let e = self.experiment;
        let memories = motor.memories_at_start(State::default());
        let p = motor.parameters();
        let left: Vec<f64> = (0..e.len())
            .map(|n| {
                let (speed, direction) = (self.speed[n], self.directions[n]);
                let torque = p.inertia * self.acceleration[n] + motor.load_torque(speed, direction);
                if e.drive == Drive::Torque {
                    return torque - e.input[n];
                }
                let current = torque / p.flux_coefficient;
                let at = OperatingPoint { current, speed, voltage: e.input[n] };
                let b = motor.balance(&at, &memories);
                b.resistance * current + motor.linkage(&b) * speed + b.voltage - b.supply
            })
            .collect();
        self.rows_of(&left)
    }

    /// The rows of a term, of speed (rad/s) alone.
    pub fn column(&self, balance: Balance, term: &impl Fn(f64, f64, f64) -> f64) -> Vec<f64> {
        if (balance == Balance::Torque) != (self.experiment.drive == Drive::Torque) {
            return vec![0.0; self.samples.len()];
        }
        let values: Vec<f64> = self.speed.iter().map(|w| term(0.0, *w, 0.0)).collect();
        self.rows_of(&values)
    }
}
