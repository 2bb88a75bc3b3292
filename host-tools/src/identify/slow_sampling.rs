//! Samples that are slow beside the motor: where a fit starts, what the voltage does between them, and whether L is in
//! reach.
//!
//! The course of the voltage and the parameters are found together: for each course, and from inductances below and
//! above R h, the balances over whole intervals are fitted ([`super::equation_error`]), and the end with the smallest
//! error counts. With the motor that this gives, each recording then tells its own course ([`crate::between`]).
//!
//! Of an electrical time constant L/R shorter than the interval h the samples tell next to nothing that the course of
//! the voltage between them does not do as well: L is said to be out of reach. It is still a delay of the torque, which
//! R and J would make up for, and is fitted with them.
//!
//! Debts, set by sight and tried on two dozen motors of another simulator: `OUT_OF_REACH`, `LEAST_INDUCTANCE` and
//! `GAINS` here; `NOISE_OF_SLOW_SAMPLES` and `WITHOUT_DIRECTION` of the start values ([`regression`]); `GAINS` and
//! `BEYOND` of what is told of an edge ([`prediction`]); the length of [short runs](super::equation_error).

use greyrig::motor::BaseParameter;
use rayon::prelude::*;

use super::equation_error::EquationError;
use super::identifiability::Weakness;
use super::minimise::{Effort, Fit, Residuals as _, have_rows, log_error, minimise, rms_of};
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
/// Inductance out of reach, in R h, from which a fit starts besides where the first has a larger one.
const OUT_OF_REACH: f64 = 0.05;
/// Fall of the error, sum of the logarithms of both balances, for which a supply is taken for switched rather than led:
/// what the mean of both has to fall by, twice, and what a fit that is only estimated is off by.
const FOR_LESS_NOT: f64 = 2.0 * prediction::FOR_LESS_NOT + Effort::ESTIMATE.tolerance;
/// The same for which an inductance is taken that asks for many steps: what fits are off by that can be compared.
const AS_GOOD: f64 = 2.0 * Effort::USUAL.tolerance;
/// Inductance out of reach starts from this or more, in R h: with it a twentieth of a change of the current is left
/// after an eighth of an interval, e^(−0.125/0.04), and a smaller one would only ask for shorter steps.
const LEAST_INDUCTANCE: f64 = 0.04;
/// Ratio of inductances from which one is another: less hardly matters to samples that are slow beside it.
const ANOTHER: f64 = 1.5;
/// The same of gains: one that is not beside it among those that are tried.
const ANOTHER_GAIN: f64 = 2.5;

/// Gains that are tried, the free run last.
const GAINS: [f64; 8] = [1.0, 0.7, 0.5, 0.3, 0.15, 0.07, 0.03, 0.0];

/// Samples of each recording with which courses and inductances are tried.
const TRIED: usize = 3000;

/// Whether any of the recordings is sampled slowly.
pub fn is_slow(experiments: &[Experiment]) -> bool {
    experiments.iter().any(|e| e.is_slow(None))
}

/// Finds start values and the course of the voltage in each recording, if it is not known already; tells whether L is
/// out of reach. Where none is sampled slowly, nothing changes but the voltage, if the user knows its course. `beside`
/// is a whole motor that an earlier fit has ended with, effects and all: from it these fits start, in place of a bare
/// one.
///
/// # Errors
/// An interrupt.
pub fn prepare(
    space: &mut Space,
    experiments: &mut [Experiment],
    course: Option<Course>,
    beside: Option<&Space>,
    ctx: &Context,
) -> Result<Option<Weakness>> {
    if !is_slow(experiments) {
        if let Some(course) = course {
            experiments.iter_mut().for_each(|e| e.take_voltage_as(course));
        }
        return Ok(None);
    }
    let mut bare = beside.cloned().unwrap_or_else(|| space.bare());
    if beside.is_some() {
        bare.take_scales(&bare.scales(experiments));
    } else {
        bare.take_typical_values();
        regression::start_values(&mut bare, experiments);
        let_friction_brake(&mut bare);
    }
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
    let ends = trials.iter().zip(tried).filter_map(|((course, _), tried)| {
        let (error, space) = tried?;
        Some(End { error, space, switched: matches!(course, Between::Switched(_)) })
    });
    let Some(End { space: bare, .. }) = End::best(ends, interval_s) else { return Ok(None) };
    let Some(mut bare) = from_two_inductances(&bare, interval_s, experiments, course, ctx)? else { return Ok(None) };
    let weakness = out_of_reach(&mut bare, interval_s);
    space.take_values(&bare);
    if let Ok(motor) = bare.motor() {
        for e in experiments.iter_mut() {
            *e = prediction::along(e.clone(), course, &motor).with_response_of(&motor);
        }
        set_gain(experiments, &bare);
    }
    Ok(weakness)
}

/// What a whole motor, effects and all, tells otherwise than that with which samples were prepared: what was missing
/// before, as an offset of the current, had hidden it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Otherwise {
    /// Another course of the voltage in any recording, or another inductance.
    pub course_or_inductance: bool,
    /// Another gain: of a model that lacks nothing short runs are best corrected by little.
    pub gain: bool,
}

/// Asks recordings once more with a whole motor. `experiments` are along no course yet, `along` those of the fit.
///
/// # Errors
/// An interrupt.
pub fn tells_otherwise(
    whole: &Space,
    mut experiments: Vec<Experiment>,
    along: &[Experiment],
    ctx: &Context,
) -> Result<Otherwise> {
    let mut space = whole.clone();
    prepare(&mut space, &mut experiments, None, Some(whole), ctx)?;
    let is_another = |before: f64, now: f64, ratio: f64| before.max(now) > ratio * before.min(now);
    let both = || experiments.iter().zip(along);
    let inductance = is_another(whole.value(BaseParameter::L), space.value(BaseParameter::L), ANOTHER);
    let course = both().any(|(now, before)| Course::from(now.between) != Course::from(before.between));
    let gain = both().any(|(now, before)| is_another(before.gain, now.gain, ANOTHER_GAIN));
    Ok(Otherwise { course_or_inductance: course || inductance, gain })
}

/// Keeps frictions from driving. Dry friction, viscous friction and the inertia are told apart by how a motor turns
/// round, of which slow samples show next to nothing: large ones of opposite signs are a valley of their own, in which
/// the edges' instants fit the wrong inertia. What the model lacks may still make a friction negative in the fit that
/// follows.
fn let_friction_brake(space: &mut Space) {
    for parameter in BaseParameter::FRICTIONS {
        if let Some(friction) = space.get_mut(parameter).filter(|e| e.freedom == Freedom::Free(None)) {
            friction.range.0 = 0.0;
            friction.value = friction.value.max(0.0);
        }
    }
}

/// Where a fit has ended.
struct End {
    /// Sum of the logarithms of both balances.
    error: f64,
    space: Space,
    /// Whether the supply was taken for switched in any recording.
    switched: bool,
}

impl End {
    /// The best; one with a switched supply only where it is better by more than chance is, and one with an inductance
    /// out of reach where it is better at all.
    fn best(ends: impl Iterator<Item = Self>, interval_s: f64) -> Option<Self> {
        let handicap = |end: &Self| {
            let out_of_reach = OUT_OF_REACH * end.space.value(BaseParameter::R) * interval_s;
            let asks_for_steps = end.space.value(BaseParameter::L) <= out_of_reach;
            (if end.switched { FOR_LESS_NOT } else { 0.0 }) + (if asks_for_steps { AS_GOOD } else { 0.0 })
        };
        let error = |end: &Self| end.error + handicap(end);
        ends.min_by(|a, b| error(a).total_cmp(&error(b)))
    }
}

/// The better of fits from where a space is and, if its inductance is free, from one that is out of reach, each along
/// the courses that its own motor tells: a delay of the torque by L/R and one of the voltage do nearly the same, and
/// the way from one to the other has a hump. An inductance out of reach asks for many steps, and is not
/// taken where another one does as well.
fn from_two_inductances(
    space: &Space,
    interval_s: f64,
    experiments: &[Experiment],
    course: Option<Course>,
    ctx: &Context,
) -> Result<Option<Space>> {
    let mut starts = vec![space.clone()];
    let is_free = space.get(BaseParameter::L).is_some_and(|l| matches!(l.freedom, Freedom::Free(_)));
    let another = OUT_OF_REACH * space.value(BaseParameter::R) * interval_s;
    if is_free && space.value(BaseParameter::L) > another {
        let mut start = space.clone();
        start.start(BaseParameter::L, another);
        starts.push(start);
    }
    let ends: Vec<Option<End>> = starts
        .into_par_iter()
        .map(|start| alternately(start, interval_s, experiments, course, ctx))
        .collect::<Result<_>>()?;
    Ok(End::best(ends.into_iter().flatten(), interval_s).map(|end| end.space))
}

/// Fits the balances along the courses that the motor tells, and tells these anew, in turn.
fn alternately(
    mut space: Space,
    interval_s: f64,
    experiments: &[Experiment],
    course: Option<Course>,
    ctx: &Context,
) -> Result<Option<End>> {
    limit(&mut space, interval_s);
    let mut end = None;
    for effort in [Effort::ROUGH, Effort::USUAL] {
        let Ok(motor) = space.motor() else { break };
        let mut along: Vec<Experiment> =
            experiments.par_iter().map(|e| prediction::along(e.clone(), course, &motor)).collect();
        set_gain(&mut along, &space);
        let Some((error, refined)) = fit(&space, &along, effort, ctx)? else { break };
        space = refined;
        limit(&mut space, interval_s);
        let switched = along.iter().any(|e| matches!(e.between, Between::Switched(_)));
        end = Some(End { error, space: space.clone(), switched });
    }
    Ok(end)
}

/// Sets the gain with which each recording is predicted best, by a motor as it is.
fn set_gain(experiments: &mut [Experiment], space: &Space) {
    let theta = space.coordinates();
    for e in experiments.iter_mut().filter(|e| e.is_slow(None)) {
        let error = |gain: &f64| {
            let mut with = [e.clone()];
            with[0].gain = *gain;
            let Some(balances) = EquationError::new(&with) else { return f64::INFINITY };
            log_error(rms_of(&balances.at(space, &theta), balances.groups()), have_rows(balances.groups()))
        };
        let errors: Vec<f64> = GAINS.par_iter().map(error).collect();
        let best = GAINS.iter().zip(errors).min_by(|a, b| a.1.total_cmp(&b.1));
        e.gain = best.map_or(1.0, |(gain, _)| *gain);
    }
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

/// Whether the time constant of the inductance is shorter than the interval; it is no smaller than need be then.
fn out_of_reach(space: &mut Space, interval_s: f64) -> Option<Weakness> {
    let limit = space.value(BaseParameter::R) * interval_s;
    let l = space.get_mut(BaseParameter::L)?;
    if !matches!(l.freedom, Freedom::Free(_)) || l.value >= limit {
        return None;
    }
    l.value = l.value.max(LEAST_INDUCTANCE * limit);
    Some(Weakness {
        held: BaseParameter::L.into(),
        text: format!(
            "L cannot be identified: the interval is longer than L/R ({:.3} ms between samples, L/R is {:.3} ms or less), and the \
             current settles between two samples. Record faster, or give L with --fix",
            1e3 * interval_s,
            1e3 * l.value / (limit / interval_s)
        ),
    })
}
