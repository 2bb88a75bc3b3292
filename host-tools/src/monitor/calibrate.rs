//! Limits from healthy motors.
//!
//! From each run the value that just would not have called is taken: of the fast features the largest that lasts as
//! many periods as a call needs, of the deviations the extremes of the mean over as many periods as the cumulative sum
//! needs. Limits are tolerance limits of these values over the motors: lognormal for errors and noise, normal for
//! deviations. Seven values are watched, so each limit holds all but a seventh of the false alarms that are allowed.
//! The parameters that are estimated from a run, on the host alone, have a share of their own.

use std::collections::BTreeMap;

use greyrig::detector::CONFIRM;
use serde::Serialize;

use super::lot::{self, Labels, Learnt, OperatingPoint, Outsider};
use super::replay::{Replay, Row, replay};
use super::tolerance::{FEWEST, upper};
use super::{air, parameters};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::model::{DetectorEntry, Model};
use crate::recording::Recording;

/// Share of healthy motors that may fail, where none is told.
pub const FALSE_ALARMS: f64 = 1e-3;
/// Confidence in that.
pub const CONFIDENCE: f64 = 0.95;
/// Values that are watched.
const WATCHED: f64 = 7.0;
/// Periods over which deviations are averaged: half a second.
const STEADY: usize = 25;
/// Mains level that is judged, of the nominal voltage.
const MOST_VOLTAGE: f64 = 1.1;
/// Speed that is judged, of the largest: what is slower is a start.
const LEAST_SPEED: f64 = 0.2;
/// Voltage that is judged, of the nominal one.
const LEAST_VOLTAGE: f64 = 0.3;
/// Periods that a verdict needs.
const FEWEST_PERIODS: u32 = 50;

/// How limits are set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Begin of each run that is not judged, s.
    pub blanking_s: f64,
    /// Share of healthy motors that may fail by all limits of a kind together, above 0 and at most a half.
    pub false_alarms: f64,
    /// What is known of the motors.
    pub labels: Labels,
}

impl Settings {
    /// For one false alarm in a thousand motors, from healthy ones.
    pub const fn blanking(blanking_s: f64) -> Self {
        Self { blanking_s, false_alarms: FALSE_ALARMS, labels: Labels::Healthy }
    }

    fn check(self) -> Result<()> {
        if self.false_alarms > 0.0 && self.false_alarms <= 0.5 {
            return Ok(());
        }
        Err(Error::usage(
            format!("{} is no share of healthy motors that may fail", self.false_alarms),
            "give a number above 0 and at most 0.5, such as 1e-3",
        ))
    }
}

/// What one run has shown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shown {
    /// Largest lasting error of the current.
    pub current: f64,
    /// Largest lasting error of the speed.
    pub speed: f64,
    /// Largest lasting current above 1 kHz, A.
    pub sparking: f64,
    /// Largest lasting abrupt change of the current.
    pub current_jump: f64,
    /// Largest lasting abrupt change of the speed.
    pub speed_jump: f64,
    /// Smallest and largest steady deviation of the current.
    pub current_deviation: [f64; 2],
    /// Smallest and largest steady deviation of the speed.
    pub speed_deviation: [f64; 2],
    /// Logarithms of the ratios of the motor's own parameters to the model's, of those that the run determines.
    pub parameters: BTreeMap<String, f64>,
}

/// What healthy motors have taught.
#[derive(Debug, Clone)]
pub struct Calibration {
    /// The limits.
    pub detector: DetectorEntry,
    /// What each run that teaches has shown.
    pub shown: Vec<Shown>,
    /// Why the runs do not tell what is usual in the lot, where they do not.
    pub without_lot: Option<String>,
    /// Motors that look like none of the others.
    pub outsiders: Vec<Outsider>,
    /// What more or fewer false alarms would show.
    pub operating_points: Vec<OperatingPoint>,
}

/// The values of a run, but for the parameters. `None` if nothing in it could be judged.
pub fn shown(replay: &Replay) -> Option<Shown> {
    let judged: Vec<&Row> = replay.judged().collect();
    let lasting = |get: &dyn Fn(&Row) -> f32| {
        judged
            .windows(usize::from(CONFIRM))
            .map(|w| w.iter().map(|r| f64::from(get(r))).fold(f64::INFINITY, f64::min))
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let steady = |get: &dyn Fn(&Row) -> f32| {
        let means = judged.windows(STEADY).map(|w| w.iter().map(|r| f64::from(get(r))).sum::<f64>() / STEADY as f64);
        means.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    };
    (judged.len() >= STEADY).then(|| Shown {
        current: lasting(&|r| r.features.current),
        speed: lasting(&|r| r.features.speed),
        sparking: lasting(&|r| r.features.sparking),
        current_jump: lasting(&|r| r.jumps[0].abs()),
        speed_jump: lasting(&|r| r.jumps[1].abs()),
        current_deviation: steady(&|r| r.features.current_deviation),
        speed_deviation: steady(&|r| r.features.speed_deviation),
        parameters: BTreeMap::new(),
    })
}

/// The runs of each motor, by serial number; a run without one is of a motor of its own.
pub fn by_motor<'a>(recordings: impl IntoIterator<Item = &'a Recording>) -> Vec<Vec<usize>> {
    let mut motors: Vec<(Option<&str>, Vec<usize>)> = Vec::new();
    for (k, recording) in recordings.into_iter().enumerate() {
        let serial = recording.metadata().get("serial").map(String::as_str);
        match motors.iter_mut().find(|(other, _)| serial.is_some() && *other == serial) {
            Some((_, runs)) => runs.push(k),
            None => motors.push((serial, vec![k])),
        }
    }
    motors.into_iter().map(|(_, runs)| runs).collect()
}

/// Learns the limits of a model's detector from runs of healthy motors. Runs with the same serial number are of the
/// same motor: what differs between them is the rig's own scatter.
///
/// # Errors
/// Settings out of their range, too few motors, a run in which nothing can be judged, motors of which nothing tells
/// which are bad where some may be, an interrupt.
pub fn calibrate(model: &Model, recordings: &[Recording], settings: Settings, ctx: &Context) -> Result<Calibration> {
    settings.check()?;
    let motors = by_motor(recordings);
    if motors.len() < FEWEST {
        let told = format!("{} runs of {} motors cannot tell what a healthy motor is", recordings.len(), motors.len());
        return Err(Error::usage(told, format!("give runs of at least {FEWEST} healthy motors; ten are usual")));
    }
    let range = |values: &[f64]| -> Option<[f64; 2]> {
        let ends = values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(*x), h.max(*x)]);
        (!values.is_empty()).then_some(ends)
    };
    let air: Vec<f64> = recordings.iter().filter_map(|r| air::density(r).transpose()).collect::<Result<_>>()?;
    if !air.is_empty() && air.len() < recordings.len() {
        return Err(Error::usage(
            format!("{} of {} runs tell the pressure of the air", air.len(), recordings.len()),
            "have all of them tell it (# air_pressure_hpa: 1003), or none",
        ));
    }
    let air_kg_m3 = range(&air);
    let of_air = DetectorEntry { air_kg_m3, ..DetectorEntry::default() };
    let in_its_air = |r: &Recording| Ok(air::compensated(model, &of_air, r)?.into_owned());
    let Learnt { population, outsiders, operating_points } =
        lot::learn(in_its_air, recordings, &motors, settings.labels, settings.false_alarms, ctx)?;
    let teaches = |k: &usize| match settings.labels {
        Labels::Healthy => true,
        Labels::Unknown => outsiders.iter().all(|outsider| !motors[outsider.motor].contains(k)),
    };
    if let (Labels::Unknown, Err(why)) = (settings.labels, &population) {
        return Err(Error::usage(
            format!("nothing tells which of the motors are bad: {why}"),
            "give whole runs of one profile, most of them of healthy motors",
        ));
    }
    let recordings: Vec<&Recording> = (0..recordings.len()).filter(teaches).map(|k| &recordings[k]).collect();
    let motors = by_motor(recordings.iter().copied());
    if motors.len() < FEWEST {
        return Err(Error::usage(format!("only {} motors are left that belong together", motors.len()), "give more"));
    }
    // Without limits it looks and calls nothing; at first at any voltage and speed, to learn which are usual.
    let mut entry = DetectorEntry {
        nominal_voltage: 1.0,
        least_voltage: LEAST_VOLTAGE,
        most_voltage: f64::from(f32::MAX),
        blanking_s: settings.blanking_s,
        fewest_periods: FEWEST_PERIODS,
        runs: recordings.len(),
        motors: motors.len(),
        holds: [1.0 - settings.false_alarms, CONFIDENCE],
        air_kg_m3,
        ..DetectorEntry::default()
    };
    let look = |entry: &DetectorEntry, r: &Recording| {
        let model = air::compensated(model, entry, r)?;
        replay(&model, r, &|interval| entry.settings(interval), ctx)
    };
    let first: Vec<Replay> = recordings.iter().map(|r| look(&entry, r)).collect::<Result<_>>()?;
    let rows = || first.iter().flat_map(|r| &r.rows);
    entry.nominal_voltage = rows().map(|r| f64::from(r.features.voltage_rms)).fold(0.0, f64::max);
    entry.most_voltage = MOST_VOLTAGE;
    entry.least_speed = LEAST_SPEED * rows().map(|r| f64::from(r.features.speed_mean.abs())).fold(0.0, f64::max);
    let steps = ctx.steps("calibration", recordings.len() as u64);
    let (mut all, mut mains) = (Vec::new(), Vec::new());
    for recording in &recordings {
        let run = look(&entry, recording)?;
        mains.extend(run.highest_voltage());
        let values = shown(&run).ok_or_else(|| {
            Error::usage(
                format!("in {} less than half a second can be judged", recording.path().display()),
                "record longer, at nominal voltage and speed",
            )
        })?;
        let own = air::compensated(model, &entry, recording)?;
        all.push(Shown { parameters: parameters::changes(&own, recording, ctx)?, ..values });
        steps.next();
    }
    let upper_of = |values: &[f64], logarithmic, watched: f64| {
        let of_motors: Vec<Vec<f64>> = motors.iter().map(|runs| runs.iter().map(|k| values[*k]).collect()).collect();
        upper(&of_motors, logarithmic, 1.0 - settings.false_alarms / watched, CONFIDENCE).unwrap_or(0.0)
    };
    let limit = |values: Vec<f64>, logarithmic| upper_of(&values, logarithmic, WATCHED);
    let of = |get: &dyn Fn(&Shown) -> f64| all.iter().map(get).collect::<Vec<f64>>();
    let band_of = |get: &dyn Fn(&Shown) -> [f64; 2], watched: f64| {
        let high = upper_of(&of(&|s| get(s)[1]), false, watched);
        let low = -upper_of(&of(&|s| -get(s)[0]), false, watched);
        [0.5 * (low + high), 0.5 * (high - low)]
    };
    let band = |get: &dyn Fn(&Shown) -> [f64; 2]| band_of(get, WATCHED);
    let determined: Vec<&String> =
        all[0].parameters.keys().filter(|name| all.iter().all(|s| s.parameters.contains_key(*name))).collect();
    let of_parameter = |name: &String| (name.clone(), band_of(&|s| [s.parameters[name]; 2], determined.len() as f64));
    let temperatures: Vec<f64> = first.iter().filter_map(|r| r.temperature).collect();
    entry = DetectorEntry {
        current: limit(of(&|s| s.current), true),
        speed: limit(of(&|s| s.speed), true),
        sparking: limit(of(&|s| s.sparking), true),
        current_jump: limit(of(&|s| s.current_jump), true),
        speed_jump: limit(of(&|s| s.speed_jump), true),
        current_deviation: band(&|s| s.current_deviation),
        speed_deviation: band(&|s| s.speed_deviation),
        temperature_c: range(&temperatures),
        mains_v: range(&mains),
        parameters: determined.iter().map(|name| of_parameter(name)).collect(),
        lot: population.as_ref().ok().cloned(),
        ..entry
    };
    Ok(Calibration { detector: entry, shown: all, without_lot: population.err(), outsiders, operating_points })
}
