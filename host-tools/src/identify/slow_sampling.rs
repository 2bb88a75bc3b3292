//! Samples that are slow beside the motor: where a fit starts, what the voltage does between them, and whether L is in
//! reach.
//!
//! The course of the voltage and the parameters are found together: for each course, and from inductances below and
//! above R h, the balances over whole intervals are fitted ([`super::equation_error`]), and the end with the smallest
//! error counts. With the motor that this gives, each recording then tells its own course ([`crate::between`]).
//!
//! Of an electrical time constant L/R shorter than the interval h the samples tell next to nothing that the course of
//! the voltage between them does not do as well: L is held where the fit has it, and said to be out of reach.

use greyrig::motor::BaseParameter;
use rayon::prelude::*;

use super::equation_error::EquationError;
use super::identifiability::Weakness;
use super::minimise::{Effort, Fit, Residuals as _, minimise};
use super::regression;
use super::space::{Freedom, Space};
use crate::between::{Between, Course};
use crate::context::Context;
use crate::error::Result;
use crate::experiment::Experiment;
use crate::prediction;

/// Inductances from which fits start, in R h.
const INDUCTANCES: [f64; 3] = [0.1, 1.0, 10.0];
/// Courses that are tried with them.
const COURSES: [Between; 5] =
    [Between::Linear, Between::Switched(0.0), Between::Switched(0.5), Between::Switched(1.0), Between::Smooth];
/// Inductance out of reach is held at this or more, in R h: beyond, the current is settled within the first fiftieth of
/// an interval, and a smaller one would only ask for shorter steps.
const LEAST_INDUCTANCE: f64 = 0.02;

/// Samples of each recording with which courses and inductances are tried.
const TRIED: usize = 3000;

/// Whether any of the recordings is sampled slowly.
pub fn is_slow(experiments: &[Experiment]) -> bool {
    experiments.iter().any(|e| e.is_slow(None))
}

/// Finds start values and the course of the voltage in each recording, if it is not known already; tells whether L is
/// out of reach, and holds it then. Nothing changes where no recording is sampled slowly.
///
/// # Errors
/// An interrupt.
pub fn prepare(
    space: &mut Space,
    experiments: &mut [Experiment],
    course: Option<Course>,
    ctx: &Context,
) -> Result<Option<Weakness>> {
    if !is_slow(experiments) {
        return Ok(None);
    }
    let mut bare = space.bare();
    bare.take_typical_values();
    regression::start_values(&mut bare, experiments);
    let interval_s = experiments.iter().map(|e| e.interval_s).fold(f64::INFINITY, f64::min);
    let is_free = |space: &Space| space.get(BaseParameter::L).is_some_and(|l| matches!(l.freedom, Freedom::Free(_)));
    let courses: Vec<Between> = match course {
        None | Some(Course::Edges) => COURSES.to_vec(),
        Some(Course::Smooth) => vec![Between::Smooth],
        Some(Course::Linear) => vec![Between::Linear],
        Some(Course::Held) => vec![Between::Switched(0.0)],
        Some(Course::Mean) => vec![Between::Switched(1.0)],
    };
    let trials: Vec<(Between, Space)> = courses
        .iter()
        .flat_map(|course| INDUCTANCES.map(|share| (*course, share)))
        .filter(|(_, share)| is_free(&bare) || *share == 1.0)
        .map(|(course, share)| {
            let mut start = bare.clone();
            start.start(BaseParameter::L, share * bare.value(BaseParameter::R) * interval_s);
            (course, start)
        })
        .collect();
    let tried: Vec<Option<(f64, Space)>> = trials
        .par_iter()
        .map(|(course, start)| {
            let Ok(motor) = start.motor() else { return Ok(None) };
            let along: Vec<Experiment> =
                experiments.iter().map(|e| e.head(TRIED).along_if_slow(*course, &motor)).collect();
            fit(start, &along, Effort::ESTIMATE, ctx)
        })
        .collect::<Result<_>>()?;
    let best = tried.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, best)) = best else { return Ok(None) };
    bare = best;
    limit(&mut bare, interval_s);
    for effort in [Effort::ROUGH, Effort::USUAL] {
        let Ok(motor) = bare.motor() else { break };
        for e in experiments.iter_mut() {
            *e = prediction::along(e.clone(), course, &motor);
        }
        if let Some((_, refined)) = fit(&bare, experiments, effort, ctx)? {
            bare = refined;
            limit(&mut bare, interval_s);
        }
    }
    let weakness = out_of_reach(&mut bare, interval_s);
    space.take_values(&bare);
    if weakness.is_some() {
        space.hold([BaseParameter::L], Freedom::Pinned);
    }
    if let Ok(motor) = bare.motor() {
        for e in experiments.iter_mut() {
            *e = prediction::along(e.clone(), course, &motor);
        }
    }
    Ok(weakness)
}

/// Start values from where a space is, by the balances over whole intervals.
///
/// # Errors
/// An interrupt.
pub fn start_values(space: &mut Space, experiments: &[Experiment], ctx: &Context) -> Result<()> {
    space.take_scales(&space.scales(experiments));
    if let Some((_, fitted)) = fit(space, experiments, Effort::ROUGH, ctx)? {
        space.take_values(&fitted);
    }
    space.take_scales(&space.scales(experiments));
    Ok(())
}

/// A fit of the balances and its error; `None` without a balance, or where it comes to no number.
fn fit(start: &Space, experiments: &[Experiment], effort: Effort, ctx: &Context) -> Result<Option<(f64, Space)>> {
    let Some(balances) = EquationError::new(experiments) else { return Ok(None) };
    let fit: Fit = minimise(start, &balances, effort, None, ctx)?;
    let error = fit.log_error(balances.groups());
    Ok(error.is_finite().then_some((error, fit.space)))
}

/// Keeps an inductance that is out of reach from asking for ever shorter steps.
fn limit(space: &mut Space, interval_s: f64) {
    let least = LEAST_INDUCTANCE * space.value(BaseParameter::R) * interval_s;
    if space.value(BaseParameter::L) < least {
        space.start(BaseParameter::L, least);
    }
}

/// Holds an inductance whose time constant is shorter than the interval.
fn out_of_reach(space: &mut Space, interval_s: f64) -> Option<Weakness> {
    let limit = space.value(BaseParameter::R) * interval_s;
    let l = space.get_mut(BaseParameter::L)?;
    if !matches!(l.freedom, Freedom::Free(_)) || l.value >= limit {
        return None;
    }
    l.value = l.value.max(LEAST_INDUCTANCE * limit);
    l.freedom = Freedom::Pinned;
    Some(Weakness {
        held: BaseParameter::L.into(),
        text: format!(
            "L cannot be identified: the interval is longer than L/R ({:.3} ms between samples, L/R is {:.3} ms or less), and the \
             current settles between two samples; L is held at {:.2e} H. Record faster, or give L with --fix",
            1e3 * interval_s,
            1e3 * l.value / (limit / interval_s),
            l.value
        ),
    })
}
