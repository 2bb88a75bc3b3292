//! What may be broken: each physical parameter is estimated once more from the time of the alarm on.
//!
//! A cause (a resistance, a load, a sensor's gain) is put into the model at the time of the alarm, and the deviations
//! of current and speed that it would make, period by period, are compared with those that were measured, both against
//! what they were before. Its size is found by Gauss–Newton steps; the cause that explains most is suspected first.
//! What differs from motor to motor is there before and after, and drops out.
//!
//! Source: A. Rakar, Đ. Juričić, 2004, conclusion (isolation by parameter estimation).

use greyrig::anfis::Anfis3x3;
use greyrig::motor::{BaseParameter, Constraints, State, Stepper};
use serde::Serialize;

use super::replay::{Replay, Row, replay};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::experiment::Experiment;
use crate::model::{DetectorEntry, Model};
use crate::recording::{Channel, Recording};

/// Size at which a cause is tried first.
const FIRST: f64 = 0.05;
/// Gauss–Newton steps.
const STEPS: usize = 3;
/// Largest relative size of a cause.
const LARGEST: f64 = 3.0;
/// Periods before the alarm that tell what was before.
const BEFORE: usize = 50;
/// Periods between the onset and the alarm, at most: a call needs three, and the filter settles.
const LATENCY: usize = 6;
/// Causes within this share of the best one's explanation are as likely.
const AS_LIKELY: f64 = 0.02;

/// How a cause changes what is recorded.
enum Change {
    /// A parameter by its relative change.
    Parameter(BaseParameter),
    /// Dry friction, by its part of the load torque at the largest speed.
    Friction,
    /// A sensor's gain.
    Gain(Channel),
}

struct Cause {
    name: &'static str,
    kind: &'static str,
    change: Change,
}

/// The frequent ones first.
const CAUSES: &[Cause] = &[
    Cause { name: "resistance", kind: "electrical", change: Change::Parameter(BaseParameter::R) },
    Cause { name: "inductance", kind: "electrical", change: Change::Parameter(BaseParameter::L) },
    Cause { name: "flux", kind: "electrical", change: Change::Parameter(BaseParameter::K) },
    Cause { name: "friction, as part of the load,", kind: "mechanical", change: Change::Friction },
    Cause { name: "fan load", kind: "mechanical", change: Change::Parameter(BaseParameter::Mu2) },
    Cause { name: "gain of the current sensor", kind: "sensor", change: Change::Gain(Channel::Current) },
    Cause { name: "gain of the speed sensor", kind: "sensor", change: Change::Gain(Channel::Speed) },
    Cause { name: "gain of the voltage sensor", kind: "sensor", change: Change::Gain(Channel::Voltage) },
];

/// A cause with its size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Suspect {
    /// In words, such as `resistance +10 %`.
    pub text: String,
    /// `electrical`, `mechanical` or `sensor`.
    pub kind: &'static str,
    /// Relative change.
    pub change: f64,
    /// Share of the deviations' squares that it explains.
    pub explains: f64,
}

/// Deviations of current and speed, period by period, in units in which both count alike.
type Deviations = Vec<[f64; 2]>;

/// The causes of an alarm, the likeliest first. Empty where the deviations tell nothing.
///
/// # Errors
/// A recording that cannot be replayed, an interrupt.
pub fn suspects(
    model: &Model,
    detector: &DetectorEntry,
    recording: &Recording,
    run: &Replay,
    alarm_s: f64,
    ctx: &Context,
) -> Result<Vec<Suspect>> {
    let judged: Vec<usize> = (0..run.rows.len()).filter(|k| run.rows[*k].judged).collect();
    let Some(called) = judged.iter().position(|k| run.rows[*k].t_s >= alarm_s) else { return Ok(Vec::new()) };
    let onset = called.saturating_sub(LATENCY);
    // Without enough of a past the cause is taken to be there from the start on.
    let abrupt = onset >= BEFORE / 2;
    let before = if abrupt {
        let past: Vec<&Row> = judged[onset.saturating_sub(BEFORE)..onset].iter().map(|k| &run.rows[*k]).collect();
        let n = past.len() as f64;
        let mean = |get: &dyn Fn(&Row) -> f32| past.iter().map(|r| f64::from(get(r))).sum::<f64>() / n;
        [mean(&|r| r.features.current_deviation), mean(&|r| r.features.speed_deviation)]
    } else {
        [detector.current_deviation[0], detector.speed_deviation[0]]
    };
    let compared: Vec<usize> = judged[if abrupt { called } else { 0 }..].to_vec();
    let scales = if abrupt {
        [detector.current_jump, detector.speed_jump]
    } else {
        [detector.current_deviation[1], detector.speed_deviation[1]]
    };
    let deviations = |rows: &[Row], before: [f64; 2]| -> Deviations {
        compared
            .iter()
            .filter_map(|k| rows.get(*k))
            .map(|r| {
                let f = r.features;
                let d = [f64::from(f.current_deviation) - before[0], f64::from(f.speed_deviation) - before[1]];
                [d[0] / scales[0].max(1e-6), d[1] / scales[1].max(1e-6)]
            })
            .collect()
    };
    let measured = deviations(&run.rows, before);
    let whole = square(&measured);
    if whole <= 0.0 {
        return Ok(Vec::new());
    }
    let begin = if abrupt { run.rows[judged[onset]].t_s } else { f64::NEG_INFINITY };
    let station = Station {
        model,
        detector,
        recording,
        experiment: Experiment::new(recording, &model.filter)?,
        correction: model.correction()?,
    };
    let mut all = Vec::new();
    for cause in CAUSES {
        ctx.check()?;
        let mut size = 0.0;
        let mut made: Deviations = vec![[0.0; 2]; measured.len()];
        for step in 0..STEPS {
            let trial = if step == 0 { FIRST } else { size };
            let Some(there) = response(&station, cause, trial, begin, ctx)? else { break };
            made = deviations(&there.rows, [0.0; 2]);
            let product: f64 = measured.iter().zip(&made).map(|(m, d)| m[0] * d[0] + m[1] * d[1]).sum();
            let length = square(&made);
            if length <= 0.0 {
                break;
            }
            size = (trial * product / length).clamp(-0.9, LARGEST);
        }
        let product: f64 = measured.iter().zip(&made).map(|(m, d)| m[0] * d[0] + m[1] * d[1]).sum();
        let length = square(&made);
        if length > 0.0 && product > 0.0 {
            all.push(Suspect {
                text: format!("{} {}", cause.name, percent(size)),
                kind: cause.kind,
                change: size,
                explains: (product * product / length / whole).min(1.0),
            });
        }
    }
    Ok(likeliest_first(all))
}

/// Suspects that explain as much as the best one in the order in which they are frequent, which is theirs, then the
/// others.
pub(super) fn likeliest_first(all: Vec<Suspect>) -> Vec<Suspect> {
    let best = all.iter().map(|s| s.explains).fold(0.0, f64::max);
    let (mut likely, mut others): (Vec<Suspect>, Vec<Suspect>) =
        all.into_iter().partition(|s| s.explains > best - AS_LIKELY);
    others.sort_by(|a, b| b.explains.total_cmp(&a.explains));
    likely.append(&mut others);
    likely
}

/// A relative change in words, `+10 %`, small ones with decimals.
pub(super) fn percent(change: f64) -> String {
    let decimals = match change.abs() {
        0.02.. => 0,
        0.002.. => 1,
        _ => 2,
    };
    format!("{:+.decimals$} %", 100.0 * change)
}

fn square(deviations: &[[f64; 2]]) -> f64 {
    deviations.iter().map(|d| d[0] * d[0] + d[1] * d[1]).sum()
}

/// What a cause is put into.
struct Station<'a> {
    model: &'a Model,
    detector: &'a DetectorEntry,
    recording: &'a Recording,
    experiment: Experiment,
    correction: Option<Anfis3x3>,
}

/// What the detector would see of the model itself with a cause in it from `begin_s` on. `None` where the cause is
/// nothing to this motor.
fn response(station: &Station<'_>, cause: &Cause, size: f64, begin_s: f64, ctx: &Context) -> Result<Option<Replay>> {
    let Station { model, detector, recording, experiment: e, correction } = station;
    let onset = (0..e.len()).find(|n| recording.start_s() + *n as f64 * e.interval_s >= begin_s).unwrap_or(e.len());
    let mut changed: Model = (*model).clone();
    match &cause.change {
        Change::Parameter(parameter) => {
            let Some(p) = changed.base_parameter_mut(*parameter).filter(|p| p.value != 0.0) else { return Ok(None) };
            p.value *= 1.0 + size;
        }
        Change::Friction => {
            let fastest = e.speed.iter().flatten().fold(0.0f64, |m, w| m.max(w.abs()));
            let load = model.value(BaseParameter::Mu0)
                + fastest * (model.value(BaseParameter::Mu1) + fastest * model.value(BaseParameter::Mu2));
            let Some(p) = changed.base_parameter_mut(BaseParameter::Mu0) else { return Ok(None) };
            p.value += size * load;
        }
        Change::Gain(_) => {}
    }
    let refused = |x| Error::usage(format!("{}: {x}", e.name), "check the model's parameters");
    let interval = e.interval_s as f32;
    let mut stepper = Stepper::build(model.motor::<f32>().map_err(refused)?, interval).map_err(refused)?;
    let Ok(other) = changed.motor::<f32>() else { return Ok(None) };
    let mut next = Some(Stepper::build(other, interval).map_err(refused)?);
    stepper.set_state(State { current: e.start.current as f32, speed: e.start.speed as f32 });
    let gain = |channel: Channel, n: usize| match cause.change {
        Change::Gain(c) if c == channel && n >= onset => 1.0 + size as f32,
        _ => 1.0,
    };
    let (mut current, mut speed) = (Vec::with_capacity(e.len()), Vec::with_capacity(e.len()));
    for n in 0..e.len() {
        if n == onset
            && let Some(mut changed) = next.take()
        {
            changed.set_state(stepper.state());
            stepper = changed;
        }
        let constraints = Constraints { speed: e.is_locked(n).then_some(0.0), current: e.is_open(n).then_some(0.0) };
        // A voltage sensor that shows too much: the motor gets less than what is recorded.
        let volts = |n: usize| e.input[n] as f32 / gain(Channel::Voltage, n);
        if n > 0 {
            stepper.step(volts(n - 1), volts(n), constraints);
        }
        let mut shown = stepper.reading();
        if let Some(correction) = correction {
            shown = greyrig::hybrid::corrected(correction, volts(n), shown, constraints).0;
        }
        current.push(f64::from(shown.current * gain(Channel::Current, n)));
        speed.push(f64::from(shown.speed * gain(Channel::Speed, n)));
    }
    let mut made: Recording = (*recording).clone();
    made.metadata_mut().retain(|key, _| !key.starts_with("skew_"));
    if made.set_channel(Channel::Current, current).and(made.set_channel(Channel::Speed, speed)).is_err() {
        return Ok(None);
    }
    replay(model, &made, &|interval| detector.settings(interval), ctx).map(Some)
}
