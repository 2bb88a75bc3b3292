//! What a model remembers of the recordings that it was fitted to.

use super::scatter::Doing;
use crate::between::{Between, Course};
use crate::compare::require;
use crate::experiment::{Drive, Experiment, Imposed};
use crate::free_run::free_run;
use crate::model::{Fitted, Model, Range, Scatter, Uncertainty};

/// What a model's free run leaves of experiments, what these have shown, and how well its parameters are known. `None`
/// where it has no free run that ends: of torque alone, without a parameter, or one that diverges.
pub fn remembered(model: &Model, experiments: &[Experiment], uncertainty: Option<Uncertainty>) -> Option<Fitted> {
    let (motor, correction) = (model.motor::<f32>().ok()?, model.correction().ok()?);
    let mut range = Range { u_v: NOTHING, i_a: NOTHING, omega_rad_s: NOTHING };
    let mut left: [Vec<(f64, Doing)>; 2] = Default::default();
    for e in experiments {
        if e.drive != Drive::Voltage || require(model, e).is_err() {
            return None;
        }
        let mut run = [Vec::with_capacity(e.len()), Vec::with_capacity(e.len())];
        free_run(&motor, correction.as_ref(), e, Imposed::Nothing, |_, state| {
            run[0].push(f64::from(state.current));
            run[1].push(f64::from(state.speed));
        })
        .ok()?;
        if run.iter().flatten().any(|x| !x.is_finite()) {
            return None;
        }
        let counted = |signal: &Option<Vec<f64>>| -> Vec<f64> {
            signal.iter().flatten().zip(&e.counted).filter(|(_, counted)| **counted).map(|(x, _)| *x).collect()
        };
        widen(&mut range.u_v, &e.input);
        widen(&mut range.i_a, &run[0]);
        widen(&mut range.i_a, &counted(&e.current));
        widen(&mut range.omega_rad_s, &run[1]);
        widen(&mut range.omega_rad_s, &counted(&e.speed));
        let doing = Doing::of(&run[0], &run[1], e.interval_s);
        for n in (0..e.len()).filter(|n| e.counted[*n]) {
            if let Some(current) = e.current.as_ref().filter(|_| !e.is_open(n)) {
                left[0].push((current[n] - run[0][n], doing[n]));
            }
            if let Some(speed) = e.speed.as_ref().filter(|_| !e.is_locked(n)) {
                left[1].push((speed[n] - run[1][n], doing[n]));
            }
        }
    }
    let mut courses: Vec<Between> = experiments.iter().map(|e| e.between).collect();
    courses.dedup_by_key(|between| Course::from(*between));
    let common = if let [one] = courses[..] { Some(one) } else { None };
    Some(Fitted {
        input: common.map(Course::from),
        input_share: common.and_then(Between::share),
        range,
        current: Scatter::of(&left[0]),
        speed: Scatter::of(&left[1]),
        uncertainty,
    })
}

const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

fn widen(range: &mut [f64; 2], signal: &[f64]) {
    *range = signal.iter().fold(*range, |[low, high], x| [low.min(*x), high.max(*x)]);
}
