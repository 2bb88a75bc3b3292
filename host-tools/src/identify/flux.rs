//! What the effects of the flux come to, in one number: the linkage `K φ` at the largest current.
//!
//! The parameters of saturation, hysteresis or armature reaction are hard to compare between motors, and each alone may
//! be uncertain where their product is not. `K φ(î)`, V s/rad, is back-EMF per speed and torque per ampere at the tip
//! of the magnetisation loop: after the current has swung between `−î` and `î` and has come to rest, at the recordings'
//! mean speed. Its interval is that of the parameters, carried over by the derivatives (delta method).

use greyrig::effects::Passed;
use greyrig::motor::{FluxLaw, Motor, OperatingPoint, State};
use serde::Serialize;

use super::intervals::Covariance;
use super::intervals::of_fit::half_width;
use super::space::Space;
use crate::experiment::Experiment;

/// Points of a swing from one end of the loop to the other.
const POINTS: usize = 200;

/// Time of one of them, s: a half period of 50 Hz for a swing.
const INTERVAL_S: f64 = 0.01 / POINTS as f64;

/// Time for which the current is held at the end, s, so that flux that lags has come after.
const HELD_S: f64 = 1.0;

/// Step of the derivatives, in standard deviations of a parameter.
const DIFFERENCE: f64 = 0.01;

/// The linkage at the largest current.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FluxAtPeak {
    /// The current, A.
    pub current: f64,
    /// The speed, rad/s.
    pub speed: f64,
    /// `K φ` there, V s/rad.
    pub value: f64,
    /// Its 95 % interval.
    pub ci95: [f64; 2],
}

impl FluxAtPeak {
    /// Of a fit; `None` for a motor with magnets, whose linkage is K, and where the current was not measured.
    pub fn of(space: &Space, covariance: &Covariance, experiments: &[Experiment]) -> Option<Self> {
        if space.kind().flux_law() != FluxLaw::Series {
            return None;
        }
        let current = space.scales(experiments).current;
        let speed = mean_speed(experiments)?;
        let theta = space.coordinates();
        let at = |theta: &[f64]| space.motor_at(theta).ok().map(|motor| linkage(&motor, current, speed));
        let value = at(&theta)?;
        let mut slopes = nalgebra::DVector::zeros(theta.len());
        for k in 0..theta.len() {
            let step = DIFFERENCE * covariance.matrix[(k, k)].sqrt();
            let beside = |sign: f64| {
                let mut there = theta.clone();
                there[k] += sign * step;
                at(&there)
            };
            slopes[k] = (beside(1.0)? - beside(-1.0)?) / (2.0 * step);
        }
        let half = half_width(covariance.half_width_95(&slopes), value);
        half.is_finite().then_some(Self { current, speed, value, ci95: [value - half, value + half] })
    }
}

/// `K φ`, V s/rad, at the tip of the loop.
pub fn linkage(motor: &Motor<f64>, peak: f64, speed: f64) -> f64 {
    let mut memories = motor.memories_at_start(State { current: 0.0, speed });
    let mut before = State { current: 0.0, speed };
    for current in swings(peak) {
        let after = State { current, speed };
        motor.advance(&Passed { interval: INTERVAL_S, before, after }, &mut memories);
        before = after;
    }
    motor.advance(&Passed { interval: HELD_S, before, after: before }, &mut memories);
    let balance = motor.balance(&OperatingPoint::unsupplied(peak, speed), &memories);
    motor.linkage(&balance)
}

/// The currents of two full loops that begin at zero and end at the positive peak.
pub fn swings(peak: f64) -> impl Iterator<Item = f64> {
    [(0.0, peak), (peak, -peak), (-peak, peak), (peak, -peak), (-peak, peak)]
        .into_iter()
        .flat_map(|(from, to)| (1..=POINTS).map(move |k| from + (to - from) * k as f64 / POINTS as f64))
}

fn mean_speed(experiments: &[Experiment]) -> Option<f64> {
    let speeds: Vec<f64> = experiments.iter().filter_map(|e| e.speed.as_deref()).flatten().map(|w| w.abs()).collect();
    (!speeds.is_empty()).then(|| speeds.iter().sum::<f64>() / speeds.len() as f64)
}
