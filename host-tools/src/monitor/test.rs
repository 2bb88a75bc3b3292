//! The test of a motor: one run, one verdict, and why.

use std::collections::BTreeMap;

use greyrig::detector::{Cause, Features, Kind, Verdict};
use serde::Serialize;

use super::lot::{self, Judged};
use super::replay::{Replay, Row, replay};
use super::suspect::{self, Suspect};
use super::{air, parameters};
use crate::context::Context;
use crate::error::Result;
use crate::model::{DetectorEntry, Model};
use crate::recording::Recording;

/// Share of the deviations that a mechanical fault or a sensor's has to explain to be named beside sparking brushes,
/// whose arcs take voltage at random: what they do to current and speed no other electrical cause can be told from.
const BESIDE_SPARKS: f64 = 0.8;
/// Share of the deviations that a cause since the alarm has to explain, or the parameters are looked at over the whole
/// run.
const EXPLAINED: f64 = 0.5;
/// Share of what the balances leave over that a fault has to explain to be named in place of what deviations of current
/// and speed say: the next best explains an eighth less where a model names its effects. By judgement.
const BALANCED: f64 = 0.95;
/// Temperature beyond that of the healthy motors at which a motor can still be judged, K.
const TEMPERATURE_MARGIN: f64 = 10.0;
/// Share beyond the levels at which healthy motors were tested at which a motor can still be judged: what mains may
/// vary (EN 50160).
const MAINS_MARGIN: f64 = 0.1;
/// The same for the density of the air, whose effect on the fan is compensated: a thousand metres of height make 10 %.
const AIR_MARGIN: f64 = 0.15;
/// Alarms closer than this belong together, s.
const TOGETHER_S: f64 = 0.5;

/// The verdict's name in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The motor passes.
    Pass,
    /// It cannot be judged.
    CannotJudge,
    /// The motor fails.
    Fail,
}

impl Outcome {
    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::CannotJudge => "cannot judge",
            Self::Fail => "fail",
        }
    }
}

/// An alarm, from its first period to its last.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alarm {
    /// Begin, s.
    pub t_s: f64,
    /// End, s.
    pub until_s: f64,
    /// `electrical`, `mechanical` or `sensor`.
    pub kind: &'static str,
    /// What called, in words.
    pub cause: &'static str,
    /// What may be broken.
    pub suspect: String,
    /// Largest ratio to the limit.
    pub ratio: f64,
}

/// The test of a motor.
#[derive(Debug, Clone, Serialize)]
pub struct Test {
    /// The recording.
    pub recording: String,
    /// Serial number, if the recording tells it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub serial: Option<String>,
    /// The verdict.
    pub verdict: Outcome,
    /// Why it cannot be judged.
    pub reasons: Vec<String>,
    /// Alarms in time.
    pub alarms: Vec<Alarm>,
    /// What may be broken, by parameters estimated once more from the alarm on.
    pub suspects: Vec<Suspect>,
    /// What its balances say is wrong, the likeliest first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<lot::Finding>,
    /// Its balances beside the lot's.
    #[serde(skip)]
    pub beside: Vec<lot::Beside>,
    /// Logarithms of the ratios of the motor's own parameters to the model's, where nothing else explains what was
    /// seen.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, f64>,
    /// Periods that were judged, and all.
    pub periods: [usize; 2],
    /// Mean of what was watched, over the judged periods.
    pub features: Features,
    /// The periods.
    #[serde(skip)]
    pub replay: Replay,
}

/// Tests a motor.
///
/// # Errors
/// A recording that cannot be replayed, an interrupt.
pub fn test(model: &Model, detector: &DetectorEntry, recording: &Recording, ctx: &Context) -> Result<Test> {
    let model = air::compensated(model, detector, recording)?;
    let run = replay(&model, recording, &|interval| detector.settings(interval), ctx)?;
    judge(&model, detector, recording, run, true, ctx)
}

/// Makes a test of a run that the detector has seen, in a replay or on the microcontroller. Causes can be put into the
/// recording, to find what may be broken, only if it is whole.
///
/// # Errors
/// As [`test()`].
pub fn judge(
    model: &Model,
    detector: &DetectorEntry,
    recording: &Recording,
    run: Replay,
    whole: bool,
    ctx: &Context,
) -> Result<Test> {
    let mut alarms = alarms(&run.rows);
    let (mut suspects, mut own) = (Vec::new(), BTreeMap::new());
    let (mut findings, mut beside, mut incomparable) = (Vec::new(), Vec::new(), None);
    if whole {
        // A cause that is put into a recording with gaps would begin anew behind each.
        if recording.gaps().is_empty()
            && let Some(first) = alarms.first()
        {
            suspects = suspect::suspects(model, detector, recording, &run, first.t_s, ctx)?;
            if alarms.iter().any(|a| !a.suspect.is_empty()) {
                suspects.retain(|s| s.kind != Kind::Electrical.name() && s.explains > BESIDE_SPARKS);
            }
        }
        let unexplained = alarms.is_empty() || suspects.first().is_some_and(|s| s.explains < EXPLAINED);
        if unexplained && run.verdict != Verdict::CannotJudge && !detector.parameters.is_empty() {
            own = parameters::changes(model, recording, ctx)?;
            let ratio = parameters::farthest(&detector.parameters, &own);
            if ratio > 1.0 {
                suspects = parameters::suspects(model.kind, &detector.parameters, &own);
                if alarms.is_empty() {
                    alarms.push(from_the_start(&run, ratio));
                }
            }
        }
        if let Some(population) = &detector.lot {
            match lot::judge(model, population, recording)? {
                Judged::Found(found, rows) => (findings, beside) = (found, rows),
                Judged::Incomparable(why) => incomparable = Some(format!("the lot says nothing of this motor: {why}")),
            }
            if let Some(first) = findings.first() {
                let t_s = first.t_s.unwrap_or(recording.start_s());
                // What began during the test is told best by the balances, if one fault explains what they leave.
                for alarm in alarms.iter_mut().filter(|_| first.t_s.is_some() && first.explains > BALANCED) {
                    alarm.suspect.clone_from(&first.text);
                    alarm.kind = first.kind;
                }
                if alarms.iter().all(|alarm| alarm.until_s < t_s) {
                    alarms.push(Alarm {
                        t_s,
                        until_s: run.rows.last().map_or(0.0, |r| r.t_s),
                        kind: first.kind,
                        cause: "balances of power and torque",
                        suspect: first.text.clone(),
                        ratio: first.ratio,
                    });
                }
            }
        }
        suspects.truncate(3);
        if let Some(likeliest) = suspects.first() {
            for alarm in alarms.iter_mut().filter(|a| a.suspect.is_empty()) {
                alarm.suspect.clone_from(&likeliest.text);
                alarm.kind = likeliest.kind;
            }
        }
    }
    let conditions = conditions(detector, &run, air::density(recording)?);
    let strange = !conditions.is_empty();
    let reasons: Vec<String> = conditions.into_iter().chain(too_little(detector, &run)).chain(incomparable).collect();
    let verdict = match run.verdict {
        // Where the limits do not hold an alarm is no proof either.
        Verdict::Fail if strange => Outcome::CannotJudge,
        Verdict::Fail => Outcome::Fail,
        Verdict::Pass if reasons.is_empty() && alarms.is_empty() => Outcome::Pass,
        Verdict::Pass if reasons.is_empty() => Outcome::Fail,
        _ => Outcome::CannotJudge,
    };
    Ok(Test {
        recording: recording.path().display().to_string(),
        serial: recording.metadata().get("serial").cloned(),
        verdict,
        reasons,
        alarms,
        suspects,
        findings,
        beside,
        parameters: own,
        periods: [run.judged().count(), run.rows.len()],
        features: Features::mean(run.judged().map(|r| &r.features)),
        replay: run,
    })
}

/// The alarm of parameters that healthy motors do not have, over all the time that is judged.
fn from_the_start(run: &Replay, ratio: f64) -> Alarm {
    let times = || run.judged().map(|r| r.t_s);
    let (t_s, until_s) = (times().next().unwrap_or(0.0), times().last().unwrap_or(0.0));
    let kind = Kind::Electrical.name();
    Alarm { t_s, until_s, kind, cause: "estimated parameters", suspect: String::new(), ratio }
}

/// Periods that call, joined where they are close together. Where the fault sits is what most of them say: before the
/// rotor has followed, much looks like a sensor.
fn alarms(rows: &[Row]) -> Vec<Alarm> {
    let mut all: Vec<(Alarm, [usize; Kind::ALL.len()])> = Vec::new();
    for row in rows {
        let Some(a) = row.alarm else { continue };
        let (t, ratio) = (row.t_s, f64::from(a.ratio));
        let fresh = alarm(t, a.kind, a.cause, ratio);
        match all.last_mut().filter(|(last, _)| t - last.until_s < TOGETHER_S) {
            Some((last, kinds)) => {
                kinds[a.kind as usize] += 1;
                // Sparks move current and speed, too, and more: theirs is the cause that is told.
                let (sparked, sparks) = (!last.suspect.is_empty(), a.cause == Cause::Sparking);
                if (sparks && !sparked) || (sparks == sparked && ratio > last.ratio) {
                    *last = Alarm { t_s: last.t_s, ..fresh };
                }
                last.until_s = t;
            }
            None => {
                let mut kinds = [0; Kind::ALL.len()];
                kinds[a.kind as usize] = 1;
                all.push((fresh, kinds));
            }
        }
    }
    let settled = |(mut alarm, kinds): (Alarm, [usize; Kind::ALL.len()])| {
        // Sparks take voltage, and are electrical whatever current and speed do.
        if alarm.suspect.is_empty()
            && let Some((kind, _)) = Kind::ALL.into_iter().zip(kinds).max_by_key(|(_, count)| *count)
        {
            alarm.kind = kind.name();
        }
        alarm
    };
    all.into_iter().map(settled).collect()
}

fn alarm(t: f64, kind: Kind, cause: Cause, ratio: f64) -> Alarm {
    let suspect = if cause == Cause::Sparking { "sparking brushes".to_owned() } else { String::new() };
    Alarm { t_s: t, until_s: t, kind: kind.name(), cause: cause.words(), suspect, ratio }
}

/// Where the motor was tested under conditions for which the limits were not learnt.
fn conditions(detector: &DetectorEntry, run: &Replay, air: Option<f64>) -> Vec<String> {
    let mut reasons = Vec::new();
    if let (Some([low, high]), Some(t)) = (detector.temperature_c, run.temperature)
        && !(low - TEMPERATURE_MARGIN..=high + TEMPERATURE_MARGIN).contains(&t)
    {
        reasons.push(format!("it is at {t:.0} °C, and the limits were learnt from {low:.0} to {high:.0} °C"));
    }
    if let (Some([low, high]), Some(v)) = (detector.mains_v, run.highest_voltage())
        && !((1.0 - MAINS_MARGIN) * low..=(1.0 + MAINS_MARGIN) * high).contains(&v)
    {
        reasons.push(format!("the mains reach {v:.0} V, and the limits were learnt from {low:.0} to {high:.0} V"));
    }
    if let (Some([low, high]), Some(rho)) = (detector.air_kg_m3, air)
        && !((1.0 - AIR_MARGIN) * low..=(1.0 + AIR_MARGIN) * high).contains(&rho)
    {
        reasons.push(format!(
            "the air weighs {rho:.2} kg/m³, and the limits were learnt from {low:.2} to {high:.2} kg/m³"
        ));
    }
    reasons
}

/// Why a run that called nothing is no proof of health.
fn too_little(detector: &DetectorEntry, run: &Replay) -> Option<String> {
    let judged = run.judged().count();
    let seen: Vec<&Row> = run.rows.iter().filter(|r| !r.judged && r.t_s >= detector.blanking_s).collect();
    if judged < detector.fewest_periods as usize {
        let share = |holds: &dyn Fn(&Row) -> bool| seen.iter().filter(|r| holds(r)).count() * 2 > seen.len().max(1);
        let volts = |r: &Row| f64::from(r.features.voltage_rms) / detector.nominal_voltage;
        return Some(if share(&|r| volts(r) < detector.least_voltage) {
            format!("the voltage is below {:.0} % of {:.0} V", 100.0 * detector.least_voltage, detector.nominal_voltage)
        } else if share(&|r| volts(r) > detector.most_voltage) {
            format!("the voltage is above {:.0} % of {:.0} V", 100.0 * detector.most_voltage, detector.nominal_voltage)
        } else if share(&|r| f64::from(r.features.speed_mean.abs()) < detector.least_speed) {
            format!("the speed is below {:.0} rad/s", detector.least_speed)
        } else if share(&|r| r.features.validity < 0.9) {
            "the motor runs where the correction has not been trained".to_owned()
        } else {
            format!("only {judged} of the {} periods that it takes could be judged", detector.fewest_periods)
        });
    }
    None
}
