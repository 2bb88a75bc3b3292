//! What a model remembers of the recordings that it was fitted to.

use super::scatter::Doing;
use crate::between::{Between, Course};
use crate::compare::require;
use crate::error::{Error, Result};
use crate::experiment::{Drive, Experiment, Imposed};
use crate::free_run::free_run;
use crate::model::{Fitted, Model, Range, Scatter, Uncertainty};
use crate::prediction;
use crate::recording::Recording;
use crate::segments;

/// What a model's free run leaves of experiments, what these have shown, and how well its parameters are known. `None`
/// where it has no free run that ends: of torque alone, without a parameter, or one that diverges.
pub fn remembered(model: &Model, experiments: &[Experiment], uncertainty: Option<Uncertainty>) -> Option<Fitted> {
    let (motor, correction) = (model.motor::<f32>().ok()?, model.correction().ok()?);
    let mut range = Range { u_v: NOTHING, i_a: NOTHING, omega_rad_s: NOTHING };
    let mut left: [Vec<(f64, Doing)>; 2] = Default::default();
    for e in experiments {
        // A voltage that is predicted from comes without a current that tells its edges.
        let e = &e.clone().by_voltage_alone();
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

/// What a model that has got a learned correction remembers: what is left over of the recordings that taught it, and
/// what was seen by then. `None` of a model that does not remember its fit.
///
/// # Errors
/// Recordings that cannot be compared with the model.
pub fn remembered_with_correction(model: &Model, recordings: &[Recording]) -> Result<Option<Fitted>> {
    let Some(fitted) = &model.fitted else { return Ok(None) };
    let refused = |error| Error::usage(format!("the model cannot be run: {error}"), "check its parameters");
    let precise = model.motor::<f64>().map_err(refused)?;
    let prepared = |recording: &Recording| {
        let e = Experiment::new(recording, &model.filter)?.through(&model.chain).with_edges_placed();
        Ok(prediction::along(e, None, &precise))
    };
    let experiments: Vec<Experiment> =
        segments::apart(recordings, &model.filter).iter().map(prepared).collect::<Result<_>>()?;
    let range = |own: [f64; 2], before: [f64; 2]| [own[0].min(before[0]), own[1].max(before[1])];
    Ok(remembered(model, &experiments, fitted.uncertainty.clone()).map(|own| Fitted {
        range: Range {
            u_v: range(own.range.u_v, fitted.range.u_v),
            i_a: range(own.range.i_a, fitted.range.i_a),
            omega_rad_s: range(own.range.omega_rad_s, fitted.range.omega_rad_s),
        },
        ..own
    }))
}

const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

fn widen(range: &mut [f64; 2], signal: &[f64]) {
    *range = signal.iter().fold(*range, |[low, high], x| [low.min(*x), high.max(*x)]);
}
