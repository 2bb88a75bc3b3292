//! What a model makes of a voltage: its free run, the band that holds what the motor does, and where both go beyond
//! what the fit has seen.
//!
//! The free run is that of [`free_run`](crate::free_run), as in a comparison: the same recording gives the same bits.
//! What is predicted is what the measuring chain would show of current and speed, before any filter.
//!
//! ```
//! use greyrig_host::{context::Context, forecast, identify::{Settings, identify}, model::Kind, rig::Setup};
//! use greyrig_host::recording::{Channel, Recording};
//!
//! let recorded = Setup::new(Kind::PmDc).seconds(4.0).seed(1).run()?.recording;
//! let model = identify(&[recorded], &Settings::new(Kind::PmDc), &Context::quiet())?.model;
//! // 6 V for a second, from rest.
//! let input = Recording::builder(1e-4).channel(Channel::Voltage, vec![6.0; 10_000]).build()?;
//! let settings = forecast::Settings { band: Some(0.95), ..Default::default() };
//! let run = forecast::predict(&model, &input, &settings, &Context::quiet())?;
//! let [low, high] = run.band.and_then(|band| band.speed).ok_or("a band")?;
//! assert!(low[9_999] < run.speed[9_999] && run.speed[9_999] < high[9_999]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod band;
pub mod extrapolation;
mod remembered;
pub mod scatter;
mod series;

use std::ops::Range;

use greyrig::motor::{BaseParameter, State};
use rayon::prelude::*;
use serde::Serialize;

pub use extrapolation::Stretch;
pub use remembered::{remembered, remembered_with_correction};
pub use series::MEASURED;

use crate::between::{Between, Course};
use crate::compare::{require, same_type};
use crate::context::Context;
use crate::error::{Error, Place, Result};
use crate::experiment::{Experiment, Imposed};
use crate::free_run::{DIVERGED, free_run};
use crate::model::Model;
use crate::prediction;
use crate::recording::{Channel, Recording};
use crate::speed_sensor::SpeedSensor;

/// What the voltage is taken to do between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Supply {
    /// Held from each sample to the next (zero order)
    Held,
    /// A straight line from sample to sample
    Linear,
    /// As where the model was identified; where the file has a measured current, that tells, as in compare
    #[default]
    AsFitted,
}

/// How a prediction is made.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Settings {
    /// The voltage between its samples.
    pub input: Supply,
    /// Current at the first sample, A; else the measured one, or none.
    pub current: Option<f64>,
    /// Speed at the first sample, rad/s; else the measured one, or rest.
    pub speed: Option<f64>,
    /// Share of what the motor does that the band is to hold, between 0 and 1.
    pub band: Option<f64>,
}

/// Where the state at a begin comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// The user has given it.
    Given,
    /// It was measured.
    Measured,
    /// Nobody tells: zero.
    AtRest,
}

/// The state at the first sample, and where it comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Begin {
    /// A.
    pub i_a: f64,
    /// rad/s.
    pub omega_rad_s: f64,
    /// Source of the current.
    pub i_a_from: Source,
    /// Source of the speed.
    pub omega_rad_s_from: Source,
}

/// Least and greatest values of the band at each sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// Share of what the motor does that it is to hold.
    pub share: f64,
    /// A; `None`: the model was not fitted to a current.
    pub current: Option<[Vec<f64>; 2]>,
    /// rad/s; `None`: the model was not fitted to a speed.
    pub speed: Option<[Vec<f64>; 2]>,
}

/// Where a prediction leaves what the fit has seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Extrapolation {
    /// Whether it does at each sample.
    pub samples: Vec<bool>,
    /// When, of what, and how far.
    pub stretches: Vec<Stretch>,
}

/// What a model makes of a voltage. Between samples of which nobody knows the voltage, those of a gap, there is NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Sampling interval, s.
    pub interval_s: f64,
    /// Current, A.
    pub current: Vec<f64>,
    /// Speed, rad/s.
    pub speed: Vec<f64>,
    /// The band, if it was asked for.
    pub band: Option<Band>,
    /// Where it is extrapolated; `None`: the model file does not remember what was seen.
    pub extrapolation: Option<Extrapolation>,
    /// The state at the first sample.
    pub begin: Begin,
    /// What the voltage was taken to do between its samples.
    pub course: Course,
    /// How the speed is shown, if that is more than a sample of it: as the measured one.
    pub speed_sensor: Option<SpeedSensor>,
    /// Samples that nobody recorded, in their order.
    pub gaps: Vec<Range<usize>>,
}

/// Runs a model freely along the voltage of a recording, from the measured state at its begin if there is one and
/// nobody gives another. Locked rotors and open supplies are obeyed. Behind a gap the run begins anew from what was
/// measured there.
///
/// # Errors
/// A recording without a voltage, of another motor, or with a gap behind which nobody knows the motor's state; a model
/// that lacks a parameter, diverges, or remembers too little for a band; an interrupt.
pub fn predict(model: &Model, recording: &Recording, settings: &Settings, ctx: &Context) -> Result<Prediction> {
    ctx.install(|| predicted(model, recording, settings, ctx))
}

fn predicted(model: &Model, recording: &Recording, settings: &Settings, ctx: &Context) -> Result<Prediction> {
    same_type(model, recording)?;
    if settings.band.is_some() {
        check_band(model, settings)?;
    }
    let recording = with_voltage_alone_driving(recording)?;
    let ranges = recording.between_gaps();
    let parts = if recording.gaps().is_empty() { vec![recording.clone()] } else { recording.segments() };
    let mut later_parts = parts.iter().skip(1);
    if later_parts.any(begins_blindly) {
        let gap = recording.gaps().iter().find(|gap| gap.start > 0).cloned().unwrap_or_default();
        let at = |n: usize| recording.start_s() + n as f64 * recording.sample_time_s();
        return Err(Error::input(
            Place::file(recording.path()),
            format!(
                "the voltage is missing from {:.4} s to {:.4} s, and nothing tells how the motor turns behind that",
                at(gap.start),
                at(gap.end)
            ),
            "predict the parts by themselves, each with --initial, or fill the gap",
        ));
    }
    let made: Vec<(Experiment, Begin, [Vec<f64>; 2])> = parts
        .par_iter()
        .enumerate()
        .map(|(k, part)| {
            ctx.check()?;
            run(model, part, if k == 0 { *settings } else { Settings { current: None, speed: None, ..*settings } })
        })
        .collect::<Result<_>>()?;
    let whole = |of: &dyn Fn(usize) -> Vec<f64>| {
        let mut whole = vec![f64::NAN; recording.len()];
        for (k, range) in ranges.iter().enumerate() {
            whole[range.clone()].copy_from_slice(&of(k));
        }
        whole
    };
    let [current, speed] = [0, 1].map(|signal| whole(&|k| made[k].2[signal].clone()));
    let band = match (settings.band, &model.fitted) {
        (Some(share), Some(fitted)) => {
            let half = |(e, _, [i, w]): &(Experiment, Begin, [Vec<f64>; 2])| {
                band::half_widths(model, fitted, e, [i, w], share, ctx)
            };
            let halves = made.iter().map(half).collect::<Result<Vec<_>>>()?;
            for ((e, ..), halves) in made.iter().zip(&halves) {
                let bounds = bounds(model, e);
                let is_wide = |k: usize| halves[k].iter().flatten().any(|half| !half.is_finite() || *half > bounds[k]);
                if is_wide(0) || is_wide(1) {
                    return Err(Error::input(
                        e.place(),
                        "the band has no bounds: what the fit leaves open of the parameters makes the free run diverge",
                        "leave out --band, or identify the model from recordings that tell its parameters",
                    ));
                }
            }
            let of = |signal: usize, values: &[f64]| {
                halves.iter().all(|half| half[signal].is_some()).then(|| {
                    let half = whole(&|k| halves[k][signal].clone().unwrap_or_default());
                    [-1.0, 1.0].map(|side| values.iter().zip(&half).map(|(x, half)| x + side * half).collect())
                })
            };
            Some(Band { share, current: of(0, &current), speed: of(1, &speed) })
        }
        _ => None,
    };
    let voltage = recording.channel(Channel::Voltage).unwrap_or_default();
    let (start_s, interval_s) = (recording.start_s(), recording.sample_time_s());
    let extrapolation = model.fitted.as_ref().map(|fitted| {
        let signals = [voltage, &current, &speed];
        let (samples, stretches) = extrapolation::beyond(&fitted.range, signals, start_s, interval_s);
        Extrapolation { samples, stretches }
    });
    let (first, begin, _) = &made[0];
    Ok(Prediction {
        start_s,
        interval_s,
        band,
        extrapolation,
        begin: *begin,
        course: first.between.into(),
        speed_sensor: if first.is_windowed() { first.sensor } else { None },
        gaps: recording.gaps().to_vec(),
        current,
        speed,
    })
}

/// Whether nothing tells how the motor turns where a part begins.
fn begins_blindly(part: &Recording) -> bool {
    [Channel::Speed, Channel::Angle].iter().all(|channel| part.channel(*channel).is_none())
        && !part.rotor_locked().first().is_some_and(|locked| *locked)
}

/// The recording without a torque, which would drive the model in place of the voltage.
fn with_voltage_alone_driving(recording: &Recording) -> Result<Recording> {
    if recording.channel(Channel::Voltage).is_none() {
        return Err(Error::input(
            Place::file(recording.path()),
            "there is no voltage (u_v), which is what a model predicts from",
            "name its column with --map u_v=COLUMN",
        ));
    }
    let mut driven = recording.clone();
    driven.remove_channel(Channel::Torque);
    Ok(driven)
}

/// A band needs what the model was fitted with.
fn check_band(model: &Model, settings: &Settings) -> Result<()> {
    let share = settings.band.unwrap_or(f64::NAN);
    if !(share > 0.0 && share < 1.0) {
        return Err(Error::usage(
            format!("a band of {} % cannot be", 100.0 * share),
            "give a percentage between 0 and 100, such as --band 95",
        ));
    }
    match &model.fitted {
        Some(fitted) if fitted.current.is_some() || fitted.speed.is_some() => Ok(()),
        _ => Err(Error::usage(
            "this model file does not tell what its fit has left over, so that there is no band",
            "identify it again with this greyrig, or leave out --band",
        )),
    }
}

/// One run without gaps: how the recording was met, where it began, current and speed.
fn run(model: &Model, recording: &Recording, settings: Settings) -> Result<(Experiment, Begin, [Vec<f64>; 2])> {
    let refused = |error| Error::usage(format!("the model cannot be run: {error}"), "check its parameters");
    let (motor, precise) = (model.motor::<f32>().map_err(refused)?, model.motor::<f64>().map_err(refused)?);
    let correction = model.correction()?;
    let e = Experiment::driven(recording, &model.filter)?.through(&model.chain);
    require(model, &e)?;
    let is_measured = e.current.is_some();
    let fitted = model.fitted.as_ref();
    let mut e = match settings.input {
        Supply::Held => e.with_course(Between::Switched(0.0), &precise),
        Supply::Linear => e.with_course(Between::Linear, &precise),
        Supply::AsFitted if is_measured => prediction::along(e.with_edges_placed(), None, &precise),
        Supply::AsFitted => {
            let course = fitted.and_then(|fitted| fitted.input).unwrap_or(Course::Smooth);
            e.with_course(course.between(fitted.and_then(|fitted| fitted.input_share)), &precise)
        }
    };
    let begin = begin(&e, settings);
    e.start = State { current: begin.i_a, speed: begin.omega_rad_s };
    let mut run = [Vec::with_capacity(e.len()), Vec::with_capacity(e.len())];
    free_run(&motor, correction.as_ref(), &e, Imposed::Nothing, |_, state| {
        run[0].push(f64::from(state.current));
        run[1].push(f64::from(state.speed));
    })?;
    let bounds = bounds(model, &e);
    let is_beyond = |n: usize| (0..2).any(|k| !run[k][n].is_finite() || run[k][n].abs() > bounds[k]);
    if let Some(n) = (0..e.len()).find(|n| is_beyond(*n)) {
        return Err(Error::input(
            e.place(),
            format!("the free run diverges {:.4} s after its begin", n as f64 * e.interval_s),
            "check the voltage's unit; with these parameters the model is not stable on this voltage",
        ));
    }
    Ok((e, begin, run))
}

/// What current (A) and speed (rad/s) of a free run have to exceed to diverge: many times what the fit, the recording
/// and the begin have of them; without any, many times the current at a standstill, and what no number holds.
fn bounds(model: &Model, e: &Experiment) -> [f64; 2] {
    let peak = |signal: &[f64]| signal.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let measured = |signal: &Option<Vec<f64>>| signal.as_deref().map_or(0.0, peak);
    let seen = model.fitted.as_ref().map_or([0.0; 2], |f| [f.range.i_a, f.range.omega_rad_s].map(|range| peak(&range)));
    let standstill = peak(&e.input) / model.value(BaseParameter::R);
    let current = seen[0].max(measured(&e.current)).max(e.start.current.abs()).max(standstill);
    let speed = seen[1].max(measured(&e.speed));
    let speed = if speed > 0.0 { speed.max(e.start.speed.abs()) } else { f64::INFINITY };
    [current, speed].map(|largest| DIVERGED * largest)
}

fn begin(e: &Experiment, settings: Settings) -> Begin {
    let of = |given: Option<f64>, measured: Option<f64>| match (given, measured) {
        (Some(given), _) => (given, Source::Given),
        (None, Some(measured)) => (measured, Source::Measured),
        (None, None) => (0.0, Source::AtRest),
    };
    let (i_a, i_a_from) = of(settings.current, e.current.as_ref().map(|_| e.start.current));
    let (omega_rad_s, omega_rad_s_from) = of(settings.speed, e.speed.as_ref().map(|_| e.start.speed));
    Begin { i_a, omega_rad_s, i_a_from, omega_rad_s_from }
}
