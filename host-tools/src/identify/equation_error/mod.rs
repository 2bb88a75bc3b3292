//! Equation error: what the voltage balance and the torque balance leave over at the measured state.
//!
//! Nothing is simulated, so the error is nearly linear in the parameters, a fit converges from anywhere in a few steps,
//! and every effect of the catalogue can be tried within a second. The noise of the regressors biases it slightly: what
//! is found here is refined by [`super::output_error`].
//!
//! # Electrical side
//! `L di/dt + R i + K φ ω + v − u` on the raw samples, then through the Butterworth filter. (The product of filtered
//! signals is not the filtered product.) The current's rate is its central difference, and the rest the mean over the
//! same two intervals.
//!
//! # Mechanical side
//! In integral (weak) form over windows of whole mains periods, `∫ (K φ i − friction) dt − J (ω₂ − ω₁)`, so that
//! nothing is differentiated and the pulsation of the torque at twice the mains frequency cancels.
//!
//! # Slow samples
//! Where a current settles between two samples, both balances are taken over whole intervals, as short runs of the
//! model from measured states.
//!
//! # Other recordings
//! Torque (or force) and motion alone give the torque balance directly, `J dω/dt + friction − T`; voltage and speed
//! alone, of a motor with magnets, the voltage balance with the current that the motion needs, `i = (J dω/dt +
//! friction)/K`. Both go through a zero-phase low-pass whose cut-off is found from the data, as in
//! [`super::inverse_dynamics`].
//!
//! # Measuring chain
//! Effects of the chain are undone to first order: true ≈ measured − (chain(measured) − measured).
//!
//! Source: weak form after the modulating functions of M. Shinbrot: On the analysis of linear and nonlinear systems,
//! Trans. ASME 79 (1957) 547–552.

mod balance_rows;
mod motion;
mod short_runs;
mod signals;
mod whole_motor;

use greyrig::effects::Effect;
use greyrig::motor::Motor;
use nalgebra::DVector;
use rayon::prelude::*;

use super::minimise::{Residuals, rms_of};
use super::space::Space;
use crate::experiment::{Drive, Experiment};
use crate::lockstep::LANES;
use motion::Motion;
use short_runs::ShortRuns;

pub use whole_motor::{Left, WholeMotor};

/// Stands for a residual that cannot be computed.
const HOPELESS: f64 = 1e6;

/// One of the two equations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Balance {
    /// The voltage balance, V.
    Voltage,
    /// The torque balance, N m s over a window.
    Torque,
}

/// The balances of all recordings.
#[derive(Debug)]
pub struct EquationError<'a> {
    parts: Vec<Part<'a>>,
    whole_motor: bool,
    groups: Vec<u8>,
    sizes: [f64; 2],
    times: Vec<(usize, f64)>,
}

/// What a recording holds.
#[derive(Debug)]
enum Part<'a> {
    Motor(WholeMotor<'a>),
    Slow(ShortRuns<'a>),
    Motion(Motion<'a>),
}

impl<'a> EquationError<'a> {
    /// Prepares the recordings from which a balance can be formed; `None` without any.
    pub fn new(experiments: &'a [Experiment]) -> Option<Self> {
        let mut parts = Vec::new();
        let mut times = Vec::new();
        let mut groups = Vec::new();
        for (recording, e) in experiments.iter().enumerate() {
            let Some(part) = Part::new(e) else { continue };
            for (group, samples) in part.rows() {
                times.extend(samples.iter().map(|n| (recording, *n as f64 * e.interval_s)));
                groups.extend(samples.iter().map(|_| group));
            }
            parts.push(part);
        }
        let whole_motor = parts.iter().all(|p| matches!(p, Part::Motor(_) | Part::Slow(_)));
        let sizes = rms_of(&DVector::from_vec(parts.iter().flat_map(Part::signals).collect()), &groups);
        (!groups.is_empty()).then_some(Self { parts, whole_motor, groups, sizes, times })
    }

    /// Whether all recordings hold voltage, current and speed.
    pub fn is_of_whole_motor(&self) -> bool {
        self.whole_motor
    }

    /// Whether all recordings were sampled slowly: the inertia that weighs an impulse is not the model's then.
    pub fn is_of_slow_samples(&self) -> bool {
        self.parts.iter().all(|p| matches!(p, Part::Slow(_)))
    }

    /// The rows of a term on the side of R i or, braking, on the side of the friction: its value at current (A), speed
    /// (rad/s) and di/dt (A/s), filtered or integrated as the balances are. Zero in the rows of the other balance.
    pub fn column(&self, balance: Balance, term: &(impl Fn(f64, f64, f64) -> f64 + Sync)) -> DVector<f64> {
        let parts: Vec<Vec<f64>> = self.parts.par_iter().map(|part| part.column(balance, term)).collect();
        DVector::from_vec(parts.concat())
    }

    /// Recording and time, s, of each row.
    pub fn times(&self) -> &[(usize, f64)] {
        &self.times
    }
}

impl Residuals for EquationError<'_> {
    fn at(&self, space: &Space, theta: &[f64]) -> DVector<f64> {
        let Ok(motor) = space.motor_at(theta) else {
            return DVector::from_element(self.groups.len(), HOPELESS);
        };
        finite(self.parts.par_iter().map(|part| part.residuals(&motor)).collect())
    }
    fn at_each(&self, space: &Space, thetas: &[Vec<f64>]) -> Vec<DVector<f64>> {
        let motors: Result<Vec<_>, _> = thetas.iter().map(|theta| space.motor_at(theta)).collect();
        let Ok(motors) = motors else { return thetas.par_iter().map(|theta| self.at(space, theta)).collect() };
        let together = |places: &[usize]| {
            let motors: Vec<_> = places.iter().map(|k| &motors[*k]).collect();
            let mut parts: Vec<_> = self.parts.par_iter().map(|part| part.residuals_of_each(&motors)).collect();
            let of = |k: usize| finite(parts.iter_mut().map(|part| std::mem::take(&mut part[k])).collect());
            (0..motors.len()).map(of).collect::<Vec<_>>()
        };
        let alike = by_chain(&motors);
        let places: Vec<&[usize]> = alike.iter().flat_map(|places| places.chunks(LANES)).collect();
        let mut all: Vec<_> =
            places.par_iter().flat_map_iter(|places| places.iter().copied().zip(together(places))).collect();
        all.sort_by_key(|(place, _)| *place);
        all.into_iter().map(|(_, residuals)| residuals).collect()
    }
    fn groups(&self) -> &[u8] {
        &self.groups
    }
    fn sizes(&self) -> [f64; 2] {
        self.sizes
    }
}

/// Places of motors that share their measuring chain.
fn by_chain(motors: &[Motor<f64>]) -> Vec<Vec<usize>> {
    let mut alike: Vec<(Vec<Effect<f64>>, Vec<usize>)> = Vec::new();
    for (place, motor) in motors.iter().enumerate() {
        let chain = whole_motor::chain_of(motor);
        match alike.iter_mut().find(|(other, _)| *other == chain) {
            Some((_, places)) => places.push(place),
            None => alike.push((chain, vec![place])),
        }
    }
    alike.into_iter().map(|(_, places)| places).collect()
}

/// The rows of all recordings, one below the other.
fn finite(parts: Vec<Vec<f64>>) -> DVector<f64> {
    let mut all = DVector::from_vec(parts.concat());
    for x in all.iter_mut().filter(|x| !x.is_finite()) {
        *x = HOPELESS;
    }
    all
}

impl<'a> Part<'a> {
    fn new(e: &'a Experiment) -> Option<Self> {
        if e.drive == Drive::Voltage && e.current.is_some() && (e.is_slow(None) || !e.is_as_sampled()) {
            ShortRuns::new(e).map(Self::Slow)
        } else if e.drive == Drive::Voltage && e.current.is_some() {
            WholeMotor::new(e).map(Self::Motor)
        } else {
            Motion::new(e).map(Self::Motion)
        }
    }

    /// Group and sample of each row.
    fn rows(&self) -> Vec<(u8, Vec<usize>)> {
        match self {
            Self::Motor(part) => part.rows().to_vec(),
            Self::Slow(part) => part.rows().to_vec(),
            Self::Motion(part) => vec![part.rows()],
        }
    }

    /// What the rows are compared with.
    fn signals(&self) -> Vec<f64> {
        match self {
            Self::Motor(part) => part.signals(),
            Self::Slow(part) => part.signals(),
            Self::Motion(part) => part.signals(),
        }
    }

    fn residuals(&self, motor: &Motor<f64>) -> Vec<f64> {
        match self {
            Self::Motor(part) => part.residuals(motor),
            Self::Slow(part) => part.residuals(motor),
            Self::Motion(part) => part.residuals(motor),
        }
    }

    /// The same of motors that share their measuring chain.
    fn residuals_of_each(&self, motors: &[&Motor<f64>]) -> Vec<Vec<f64>> {
        match self {
            Self::Motor(part) => part.residuals_of_each(motors),
            Self::Slow(part) => part.residuals_of_each(motors),
            Self::Motion(part) => motors.iter().map(|motor| part.residuals(motor)).collect(),
        }
    }

    fn column(&self, balance: Balance, term: &impl Fn(f64, f64, f64) -> f64) -> Vec<f64> {
        match self {
            Self::Motor(part) => part.column(balance, term),
            Self::Slow(part) => part.column(balance, term),
            Self::Motion(part) => part.column(balance, term),
        }
    }
}
