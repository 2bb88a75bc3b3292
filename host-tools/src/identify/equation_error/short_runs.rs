//! Voltage, current and speed in slow samples: both balances over a whole interval.
//!
//! Where a current settles within an interval its rate cannot be told from samples, nor its mean from two of them.
//! There the equations are asked over the interval itself: the model runs for a few samples along the voltage as it
//! goes between them ([`crate::between`]), is corrected by a share of what it is off by, as an observer is, and runs
//! on. The share is what predicts best: all of it where the model lacks something, little where it is right and the
//! samples are noise or counts. What the current is off by, times what an ampere is worth to the voltage that is there
//! for one interval, is the voltage that the balance leaves over, `R/(1 − e^(−h R/L)) (i − î)`: the algebraic equation
//! u − K φ ω − R i where h R/L is large, and L (Δi − Δî)/h where it is small. Times J, what the speed is off by at the
//! end of a run is the impulse that the torque balance leaves over. R, L and J in these factors are those of one motor
//! ([`Experiment::response`]): what is fitted is the prediction.

use std::array;

use greyrig::effects::{Acts, Effect};
use greyrig::motor::{Motor, State, Stepper};
use greyrig::scalar::Scalar;

use super::Balance;
use super::whole_motor::chain_of;
use crate::experiment::{Experiment, Stepped, derivative};
use crate::lockstep::{self, LANES, Lanes, Lockstep};

/// A run lasts this long at least, s, …
const RUN_S: f64 = 0.05;
/// … and has so many samples.
const SAMPLES: (f64, f64) = (4.0, 32.0);

/// Voltage, current and speed in slow samples.
#[derive(Debug)]
pub struct ShortRuns<'a> {
    experiment: &'a Experiment,
    /// Current, A, and speed, rad/s, as measured.
    measured: [Vec<f64>; 2],
    /// Samples of a run.
    length: usize,
    /// Samples at which the voltage balance is looked at.
    samples: Vec<usize>,
    /// The same, sample by sample.
    is_row: Vec<bool>,
    /// First and last sample of each run whose end tells of the torque balance.
    runs: Vec<(usize, usize)>,
}

impl<'a> ShortRuns<'a> {
    /// Prepares a recording; `None` where it lacks a channel.
    pub fn new(e: &'a Experiment) -> Option<Self> {
        let current = e.current.as_deref()?;
        // Without a supply there is no current, whatever the sensor shows.
        let current: Vec<f64> = current.iter().enumerate().map(|(n, i)| if e.is_open(n) { 0.0 } else { *i }).collect();
        let speed = e.speed_itself().map_or_else(|| vec![0.0; current.len()], |speed| speed.into_owned());
        if e.speed.is_none() && !e.is_locked(0) {
            return None;
        }
        let length = (RUN_S / e.interval_s).ceil().clamp(SAMPLES.0, SAMPLES.1) as usize;
        let is_row: Vec<bool> = (0..e.len())
            .map(|n| n > 0 && ((n - 1) / length * length..=n).all(|k| e.counted[k]) && !e.is_open(n))
            .collect();
        let whole = |first: usize| {
            let mut samples = first..=first + length;
            samples.all(|n| e.counted[n] && !e.is_locked(n))
        };
        let runs = (0..e.len().saturating_sub(length))
            .step_by(length)
            .filter(|first| e.speed.is_some() && whole(*first))
            .map(|first| (first, first + length))
            .collect();
        let samples = (0..e.len()).filter(|n| is_row[*n]).collect();
        Some(Self { experiment: e, measured: [current, speed], length, samples, is_row, runs })
    }

    /// Group and samples of the rows.
    pub fn rows(&self) -> [(u8, Vec<usize>); 2] {
        [(0, self.samples.clone()), (1, self.runs.iter().map(|(first, _)| *first).collect())]
    }

    /// What the rows are compared with: the voltage, and the change of speed (of unknown inertia, so of a typical one).
    pub fn signals(&self) -> Vec<f64> {
        let voltage = self.samples.iter().map(|n| self.experiment.input[*n]);
        voltage.chain(self.runs.iter().map(|_| 1.0)).collect()
    }

    /// What both balances leave over.
    pub fn residuals(&self, motor: &Motor<f64>) -> Vec<f64> {
        let signals = self.before(&chain_of(motor));
        let stepper =
            without_chain(motor).and_then(|motor| Stepper::with_substeps(motor, self.experiment.step_s(), 1).ok());
        match stepper {
            Some(stepper) => {
                let [rows] = self.left_over(stepper, &signals, |x| [x]);
                rows
            }
            None => vec![f64::NAN; self.samples.len() + self.runs.len()],
        }
    }

    /// The same of several motors that share their measuring chain.
    pub fn residuals_of_each(&self, motors: &[&Motor<f64>]) -> Vec<Vec<f64>> {
        let together = || {
            let signals = self.before(&chain_of(motors.first()?));
            let bare = motors.iter().map(|motor| without_chain(motor)).collect::<Option<Vec<_>>>()?;
            let lanes = lockstep::as_many_as_lanes(&bare)?;
            let stepper = Lockstep::build(&lanes, self.experiment.step_s(), 1)?;
            let rows: [_; LANES] = self.left_over(stepper, &signals, |x: Lanes| x.0);
            Some(rows.into_iter().take(motors.len()).collect())
        };
        together().unwrap_or_else(|| motors.iter().map(|motor| self.residuals(motor)).collect())
    }

    fn left_over<S: Scalar<Base = S>, const MOTORS: usize>(
        &self,
        stepper: impl Stepped<S>,
        [current, speed]: &[Vec<f64>; 2],
        each: impl Fn(S) -> [f64; MOTORS],
    ) -> [Vec<f64>; MOTORS] {
        let mut voltages: [Vec<f64>; MOTORS] =
            array::from_fn(|_| Vec::with_capacity(self.samples.len() + self.runs.len()));
        let mut impulses: [Vec<f64>; MOTORS] = array::from_fn(|_| Vec::with_capacity(self.runs.len()));
        let [volts, inertia] = self.experiment.response;
        let mut runs = self.runs.iter().peekable();
        let mut sums = [0.0; MOTORS];
        self.experiment.short_runs(stepper, self.length, [current, speed], |n, state: State<S>| {
            if self.is_row[n] {
                for (rows, i) in voltages.iter_mut().zip(each(state.current)) {
                    rows.push(volts * (current[n] - i));
                }
            }
            let Some((first, last)) = runs.peek() else { return };
            if n > first + self.length / 2 {
                for (sum, w) in sums.iter_mut().zip(each(state.speed)) {
                    *sum += w - speed[n];
                }
            }
            if n == *last {
                for (rows, sum) in impulses.iter_mut().zip(&mut sums) {
                    rows.push(inertia * *sum / self.averaged() as f64);
                    *sum = 0.0;
                }
                runs.next();
            }
        });
        for (rows, impulses) in voltages.iter_mut().zip(impulses) {
            rows.extend(impulses);
        }
        voltages
    }

    /// Samples at the end of a run over which the speed is averaged.
    fn averaged(&self) -> usize {
        self.length - self.length / 2
    }

    /// The rows of a term of current (A), speed (rad/s) and di/dt (A/s).
    pub fn column(&self, balance: Balance, term: &impl Fn(f64, f64, f64) -> f64) -> Vec<f64> {
        let e = self.experiment;
        let [current, speed] = &self.measured;
        let rate = derivative(current, e.interval_s);
        let values: Vec<f64> = (0..e.len()).map(|n| term(current[n], speed[n], rate[n])).collect();
        let mean = |n: usize| 0.5 * (values[n - 1] + values[n]);
        let mut integral = 0.0;
        let mut before = 0;
        let impulse = |(first, last): &(usize, usize)| {
            // What a run leaves at its end the next one keeps but for its correction.
            integral *= if *first == before { 1.0 - e.gain } else { 0.0 };
            before = *last;
            let mut sum = 0.0;
            for n in first + 1..=*last {
                integral -= mean(n) * e.interval_s;
                if n > first + self.length / 2 {
                    sum += integral;
                }
            }
            sum / self.averaged() as f64
        };
        match balance {
            Balance::Voltage => self.samples.iter().map(|n| mean(*n)).chain(self.runs.iter().map(|_| 0.0)).collect(),
            Balance::Torque => self.samples.iter().map(|_| 0.0).chain(self.runs.iter().map(impulse)).collect(),
        }
    }

    /// The signals as they were before a measuring chain.
    fn before(&self, chain: &[Effect<f64>]) -> [Vec<f64>; 2] {
        if chain.is_empty() {
            return self.measured.clone();
        }
        let [current, speed] = &self.measured;
        super::whole_motor::undone(self.experiment, current, speed, chain)
    }
}

/// A motor as it is before its measuring chain.
fn without_chain(motor: &Motor<f64>) -> Option<Motor<f64>> {
    let effects: Vec<_> =
        motor.effects().iter().filter(|effect| effect.description().acts != Acts::Measuring).copied().collect();
    Motor::build(*motor.parameters(), &effects).ok()?.with_terms(motor.terms()).ok()
}
