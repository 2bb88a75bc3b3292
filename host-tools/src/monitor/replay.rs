//! A recording through the rig's tick and detector, sample by sample, in the microcontroller's own arithmetic.

use greyrig::detector::{self, Alarm, Detector, Features, Verdict};
use greyrig::motor::{Constraints, State, Stepper};
use greyrig::tick::Tick;
use greyrig::units::{Amperes, RadiansPerSecond, Sample, Volts};

use crate::context::Context;
use crate::error::{Error, Place, Result};
use crate::experiment::{Drive, Experiment};
use crate::model::Model;
use crate::recording::Recording;
use crate::segments;

/// Samples after which it is looked whether the work is to stop.
const LOOK_EVERY: usize = 1 << 16;

/// A period of the mains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Its end, s.
    pub t_s: f64,
    /// What it tells.
    pub features: Features,
    /// Abrupt changes of the deviations of current and speed.
    pub jumps: [f32; 2],
    /// Whether it was judged.
    pub judged: bool,
    /// What calls at its end.
    pub alarm: Option<Alarm>,
}

/// A run.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    /// Period by period.
    pub rows: Vec<Row>,
    /// The verdict.
    pub verdict: Verdict,
    /// Highest temperature that the recording tells, °C.
    pub temperature: Option<f64>,
}

impl Replay {
    /// Highest voltage of a judged period, RMS, V: the level of the mains.
    pub fn highest_voltage(&self) -> Option<f64> {
        self.judged().map(|r| f64::from(r.features.voltage_rms)).reduce(f64::max)
    }

    /// The rows that were judged.
    pub fn judged(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|r| r.judged)
    }
}

/// Runs a recording through the tick and a detector; each part of one with gaps anew, and an alarm of one of them is
/// one of the whole.
///
/// # Errors
/// A recording without voltage, current and speed, or a model that cannot be run at its sampling rate; an interrupt.
pub fn replay(
    model: &Model,
    recording: &Recording,
    settings: &dyn Fn(f64) -> detector::Settings,
    ctx: &Context,
) -> Result<Replay> {
    let whole = std::slice::from_ref(recording);
    let mut all = Replay { rows: Vec::new(), verdict: Verdict::CannotJudge, temperature: None };
    for part in segments::apart(whole, &model.filter).iter() {
        let run = of_one(model, part, settings, ctx)?;
        all.rows.extend(run.rows);
        all.verdict = match (all.verdict, run.verdict) {
            (Verdict::Fail, _) | (_, Verdict::Fail) => Verdict::Fail,
            (Verdict::Pass, _) | (_, Verdict::Pass) => Verdict::Pass,
            _ => Verdict::CannotJudge,
        };
        all.temperature = all.temperature.into_iter().chain(run.temperature).reduce(f64::max);
    }
    Ok(all)
}

fn of_one(
    model: &Model,
    recording: &Recording,
    settings: &dyn Fn(f64) -> detector::Settings,
    ctx: &Context,
) -> Result<Replay> {
    let e = Experiment::new(recording, &model.filter)?;
    let (Drive::Voltage, Some(current), Some(speed)) = (e.drive, &e.current, &e.speed) else {
        return Err(Error::input(
            Place::file(recording.path()),
            "there is no voltage, current or speed",
            "the detector needs all three: u_v, i_a and omega_rad_s",
        ));
    };
    let refused =
        |error: &dyn std::fmt::Display| Error::usage(format!("{}: {error}", e.name), "check the model's parameters");
    let motor = model.motor::<f32>().map_err(|x| refused(&x))?;
    let stepper = Stepper::build(motor, e.interval_s as f32).map_err(|x| refused(&x))?;
    let mut tick = Tick::new(stepper, e.coefficients::<f32>()).with_correction(model.correction()?);
    tick.start_from(State { current: e.start.current as f32, speed: e.start.speed as f32 });
    let mut detector: Detector = settings(e.interval_s).build().map_err(|x| refused(&x))?;
    let mut rows = Vec::new();
    for n in 0..e.len() {
        if n % LOOK_EVERY == 0 {
            ctx.check()?;
        }
        let sample = Sample {
            voltage: Volts(e.input[n] as f32),
            current: Amperes(current[n] as f32),
            speed: RadiansPerSecond(speed[n] as f32),
        };
        let constraints = Constraints { speed: e.is_locked(n).then_some(0.0), current: e.is_open(n).then_some(0.0) };
        let output = tick.process(sample, constraints);
        if let Some(period) = detector.process(&output) {
            rows.push(Row {
                t_s: recording.start_s() + n as f64 * e.interval_s,
                features: period.features,
                jumps: period.jumps,
                judged: period.judged,
                alarm: period.alarm,
            });
        }
    }
    let temperature = recording
        .extras()
        .iter()
        .find(|o| o.name == "temp_c")
        .map(|o| o.values.iter().copied().filter(|x| x.is_finite()).fold(f64::NEG_INFINITY, f64::max));
    Ok(Replay { rows, verdict: detector.verdict(), temperature })
}
