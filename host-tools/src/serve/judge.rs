//! Motors judged by a station: a model with limits, from a file or learnt from recordings of healthy motors.

use std::path::PathBuf;

use super::api;
use super::error::{Error, Result};
use super::recordings::Recordings;
use crate::answers::{calibrate, monitor};
use crate::context::Context;
use crate::error::Error as WorkError;
use crate::model::Model;
use crate::monitor::bands::{self, Band};
use crate::monitor::test::Test;
use crate::recording::Recording;

/// What motors are judged by.
#[derive(Debug, Clone)]
pub struct Station {
    /// As the user knows it.
    pub name: String,
    /// Its file.
    pub path: PathBuf,
    /// The model with its limits.
    pub model: Model,
}

impl Station {
    /// Of a model.
    ///
    /// # Errors
    /// One without limits.
    pub fn new(name: String, path: PathBuf, model: Model) -> Result<Self> {
        model.limits(std::path::Path::new(&name))?;
        Ok(Self { name, path, model })
    }

    /// As the page shows it.
    pub fn told(&self) -> api::Station {
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let detector = self.model.detector.as_ref();
        api::Station {
            name: self.name.clone(),
            path: self.path.display().to_string(),
            motor: self.model.motor.clone(),
            motors: detector.map_or(0, |d| count(d.motors)),
            runs: detector.map_or(0, |d| count(d.runs)),
            holds: detector.map_or([0.0; 2], |d| d.holds),
            knows_lot: detector.is_some_and(|d| d.lot.is_some()),
        }
    }
}

/// The recordings of some numbers as they were read, whatever they are for.
fn chosen(recordings: &Recordings, ids: &[u32]) -> Result<Vec<Recording>> {
    let of = |id: &u32| {
        let read = recordings.entry(*id).and_then(|e| e.read.as_deref().ok());
        read.cloned().ok_or(Error::NoRecordingAt(*id))
    };
    match ids {
        [] => Err(Error::NoRecording),
        ids => ids.iter().map(of).collect(),
    }
}

/// Limits from recordings of healthy motors.
///
/// # Errors
/// A model or recordings that cannot be used, an interrupt.
pub fn learnt(model: &Model, recordings: &Recordings, ids: &[u32], ctx: &Context) -> Result<Model> {
    let request = calibrate::Request::default();
    let given = request.question(model, chosen(recordings, ids)?);
    Ok(ctx.install(|| request.answer(model, given, ctx))?.model)
}

/// Judges motors.
///
/// # Errors
/// Recordings that cannot be used, an interrupt.
pub fn judged(station: &Station, recordings: &Recordings, ids: &[u32], ctx: &Context) -> Result<api::Judged> {
    let request = monitor::Request::default();
    let given = request.question(&station.model, chosen(recordings, ids)?)?;
    let steps = ctx.steps("motors", ids.len() as u64);
    let mut each = |_: &Test| -> std::result::Result<(), WorkError> {
        steps.next();
        Ok(())
    };
    let answer = ctx.install(|| request.answer(&station.model, &station.path, given, ctx, &mut each))?;
    let tests = ids.iter().zip(&answer.tests).map(|(id, test)| told(*id, test, &answer)).collect();
    Ok(api::Judged { number: 0, station: station.name.clone(), tests, command: String::new() })
}

fn told(id: u32, test: &Test, answer: &monitor::Answer) -> api::Test {
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let alarm = |a: &crate::monitor::test::Alarm| api::Alarm {
        from_s: a.t_s,
        to_s: a.until_s,
        kind: a.kind.to_owned(),
        cause: a.cause.to_owned(),
        suspect: a.suspect.clone(),
        ratio: a.ratio,
    };
    let course = |c: bands::Course| api::Course {
        name: c.name.to_owned(),
        unit: unit(c.unit),
        band: Some(band(c.band)),
        t_s: c.points.iter().map(|[t, _]| *t).collect(),
        values: c.points.iter().map(|[_, x]| *x).collect(),
    };
    let place = |p: bands::Place| api::Place {
        unit: unit(p.unit),
        value: p.value,
        band: band(p.band),
        ratio: p.band.ratio(p.value),
        name: p.name,
    };
    let courses = bands::courses(test, &answer.detector).into_iter().map(course);
    api::Test {
        recording: id,
        name: test.recording.clone(),
        serial: test.serial.clone(),
        verdict: test.verdict.words().to_owned(),
        reasons: test.reasons.clone(),
        alarms: test.alarms.iter().map(alarm).collect(),
        hypotheses: hypotheses(test),
        places: bands::places(test, &answer.detector).into_iter().map(place).collect(),
        courses: courses.chain(balances(test)).collect(),
        periods: test.periods.map(count),
    }
}

/// What the balances say, and what parameters estimated from the alarm on say.
fn hypotheses(test: &Test) -> Vec<api::Hypothesis> {
    let findings = test.findings.iter().map(|f| api::Hypothesis {
        text: f.text.clone(),
        kind: f.kind.to_owned(),
        ratio: Some(f.ratio),
        odds: f.odds,
        explains: f.explains,
        as_likely: f.as_likely,
        look_at: f.look_at.to_owned(),
    });
    let suspects = test.suspects.iter().enumerate().map(|(k, s)| api::Hypothesis {
        text: s.text.clone(),
        kind: s.kind.to_owned(),
        ratio: None,
        odds: None,
        explains: s.explains,
        as_likely: k == 0,
        look_at: String::new(),
    });
    findings.chain(suspects).collect()
}

/// What the balances of power and torque leave over, in standard deviations of the healthy motors that taught it.
fn balances(test: &Test) -> impl Iterator<Item = api::Course> {
    let of = |name: &str, get: fn(&crate::monitor::lot::Beside) -> Option<f64>| {
        let points: Vec<(f64, f64)> = test.beside.iter().filter_map(|b| Some((b.t_s, get(b)?))).collect();
        let (t_s, values) = points.into_iter().unzip();
        api::Course { name: name.to_owned(), unit: "σ of the lot".to_owned(), band: None, t_s, values }
    };
    let both =
        [of("balance of power beside the lot's", |b| b.power), of("balance of torque beside the lot's", |b| b.torque)];
    both.into_iter().filter(|course| !course.values.is_empty())
}

/// A unit as the page shows it.
fn unit(of: &str) -> String {
    crate::numbers::unit(of)
}

const fn band(of: Band) -> api::Band {
    match of {
        Band::Below(limit) => api::Band { low: None, high: limit },
        Band::Within { centre, half } => api::Band { low: Some(centre - half), high: centre + half },
    }
}
