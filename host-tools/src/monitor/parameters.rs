//! The physical parameters of one motor, estimated from its test.
//!
//! A fault that is there from the start has to exceed what healthy motors differ by. Current and speed of a running
//! motor hardly tell: a resistance that takes three hundredths of the voltage may nearly double before they leave the
//! scatter of the lot. The parameters themselves scatter by a few per cent, and a run with its run-up determines them:
//! resistance, inductance, flux, inertia and the friction that takes most of the torque are fitted by output error,
//! from the type's model, whose effects and smaller frictions stay as they are. Healthy motors tell how far each may be
//! from the type's.
//!
//! Source: A. Rakar, Đ. Juričić, 2004, conclusion (isolation by parameter estimation).

use std::collections::BTreeMap;

use greyrig::motor::BaseParameter;

use super::suspect::{self, Suspect};
use crate::context::Context;
use crate::error::Result;
use crate::experiment::Experiment;
use crate::identify::minimise::{Effort, minimise};
use crate::identify::output_error::{OutputError, Rows};
use crate::identify::space::Freedom;
use crate::identify::{Settings, build_space, intervals_of_fit, prepare};
use crate::model::{Kind, Model};
use crate::recording::Recording;

/// Relative half-width of the 95 % interval from which on a run does not determine a parameter.
pub const PRECISION: f64 = 0.2;

/// Base parameters that are estimated, with their names. Of the frictions the one that takes most.
const ESTIMATED: [(BaseParameter, &str); PARAMETERS] = [
    (BaseParameter::R, "resistance"),
    (BaseParameter::L, "inductance"),
    (BaseParameter::K, "flux"),
    (BaseParameter::J, "inertia"),
    (BaseParameter::Mu0, "dry friction"),
    (BaseParameter::Mu1, "viscous friction"),
    (BaseParameter::Mu2, "fan load"),
];
const PARAMETERS: usize = 7;

/// What may be wrong from the start, and the powers of its gain by which it multiplies the estimates, in the order of
/// [`ESTIMATED`]. With a sensor's gain g the voltage balance u = R i + L di/dt + K φ(i) ω and the torque balance K φ(i)
/// i = J dω/dt + M hold for what is measured with other parameters: a current that shows g i takes g from R and L, and
/// from K of a series motor, whose torque then seems g times as large.
struct Cause {
    name: &'static str,
    kind: &'static str,
    series: [f64; PARAMETERS],
    magnet: [f64; PARAMETERS],
}

/// The frequent ones first.
const CAUSES: [Cause; 10] = [
    Cause::of("resistance", "electrical", [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    Cause::of("inductance", "electrical", [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
    Cause::of("flux", "electrical", [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
    Cause::of("dry friction", "mechanical", [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
    Cause::of("viscous friction", "mechanical", [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]),
    Cause::of("fan load", "mechanical", [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
    Cause {
        magnet: [-1.0, -1.0, 0.0, 1.0, 1.0, 1.0, 1.0],
        ..Cause::of("gain of the current sensor", "sensor", [-1.0, -1.0, -1.0, 1.0, 1.0, 1.0, 1.0])
    },
    Cause::of("gain of the speed sensor", "sensor", [0.0, 0.0, -1.0, -2.0, -1.0, -2.0, -3.0]),
    Cause::of("gain of the voltage sensor", "sensor", [1.0; PARAMETERS]),
    Cause::of("inertia", "mechanical", [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
];

impl Cause {
    const fn of(name: &'static str, kind: &'static str, powers: [f64; PARAMETERS]) -> Self {
        Self { name, kind, series: powers, magnet: powers }
    }
}

/// Name of a parameter in words.
pub fn described(parameter: BaseParameter) -> Option<&'static str> {
    ESTIMATED.iter().find(|(id, _)| *id == parameter).map(|(_, name)| *name)
}

/// How far the farthest of a motor's parameters is from what healthy motors have, over the limit.
pub fn farthest(limits: &BTreeMap<String, [f64; 2]>, own: &BTreeMap<String, f64>) -> f64 {
    let ratio = |(name, [centre, half]): (&String, &[f64; 2])| Some((own.get(name)? - centre).abs() / half);
    limits.iter().filter_map(ratio).fold(0.0, f64::max)
}

/// What may be wrong, the likeliest first: each cause by the share of the differences from a healthy motor's
/// parameters, in units of the limits, that it explains at its best size.
pub fn suspects(kind: Kind, limits: &BTreeMap<String, [f64; 2]>, own: &BTreeMap<String, f64>) -> Vec<Suspect> {
    let watched: Vec<(usize, f64, f64)> = ESTIMATED
        .iter()
        .enumerate()
        .filter_map(|(k, (id, _))| {
            let [centre, half] = limits.get(id.name())?;
            Some((k, (own.get(id.name())? - centre) / half, *half))
        })
        .collect();
    let whole: f64 = watched.iter().map(|(_, d, _)| d * d).sum();
    let explained = |cause: &Cause| {
        let powers = if kind == Kind::Universal { cause.series } else { cause.magnet };
        let product: f64 = watched.iter().map(|(k, d, half)| d * powers[*k] / half).sum();
        let length: f64 = watched.iter().map(|(k, _, half)| (powers[*k] / half).powi(2)).sum();
        (length > 0.0 && whole > 0.0).then(|| {
            let change = (product / length).exp() - 1.0;
            let text = format!("{} {}", cause.name, suspect::percent(change));
            Suspect { text, kind: cause.kind, change, explains: product * product / length / whole }
        })
    };
    suspect::likeliest_first(CAUSES.iter().filter_map(explained).collect())
}

/// Logarithms of the ratios of a tested motor's parameters to the type's, of those that its run determines.
///
/// # Errors
/// A recording that cannot be used, an interrupt.
pub fn changes(model: &Model, recording: &Recording, ctx: &Context) -> Result<BTreeMap<String, f64>> {
    let full = prepare(std::slice::from_ref(recording), &model.filter, &model.chain)?;
    let coarse: Vec<Experiment> = full.iter().map(Experiment::coarse).collect();
    let mut space = build_space(&Settings::of_model(model))?;
    space.take_scales(&space.scales(&coarse));
    space.take_model(model);
    let fastest = coarse[0].speed.iter().flatten().fold(0.0f64, |m, w| m.max(w.abs()));
    let factors = [1.0, fastest, fastest * fastest];
    let torque = |(friction, factor): &(BaseParameter, f64)| model.value(*friction) * factor;
    let frictions = BaseParameter::FRICTIONS.into_iter().zip(factors);
    let largest = frictions.max_by(|a, b| torque(a).total_cmp(&torque(b))).map(|f| f.0);
    for entry in &mut space.entries {
        let free = entry.key.base().is_some_and(|p| p.is_positive() || Some(p) == largest);
        if matches!(entry.freedom, Freedom::Free(_)) && !(free && entry.value > 0.0) {
            entry.freedom = Freedom::Fixed;
        }
    }
    let Ok(motor) = space.motor() else { return Ok(BTreeMap::new()) };
    let rows = coarse.iter().map(|e| Rows::new(e, e.substeps(&motor).unwrap_or(1))).collect();
    let problem = OutputError::new(rows)?;
    let fit = minimise(&space, &problem, Effort::USUAL, None, &ctx.quietly())?;
    let determined = intervals_of_fit(&problem, &fit).into_iter().filter_map(|(key, [low, high])| {
        let parameter = key.base()?;
        let (value, of_type) = (fit.space.value(key), model.value(parameter));
        let is_determined = 0.5 * (high - low) < PRECISION * of_type && value > 0.0;
        is_determined.then(|| (parameter.name().to_owned(), (value / of_type).ln()))
    });
    Ok(determined.collect())
}
