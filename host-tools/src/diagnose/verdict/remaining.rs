//! What is left though the verdict stands.

use greyrig::effects::EffectId;
use serde::Serialize;

use super::VerdictKind;
use super::words::left_over;
use crate::diagnose::completeness::Completeness;
use crate::diagnose::constancy::{Border, Variation, With};
use crate::diagnose::fluctuation::Fluctuation;
use crate::diagnose::remarks::{self, Wandering};
use crate::numbers::figure;

/// What the rest comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// A law that is named, of another form.
    FormOfLaw,
    /// A load that fluctuates, or what acts like one.
    Load,
    /// A parameter that changes in time.
    SlowChange,
    /// Not known.
    Unknown,
}

/// What is left.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Remaining {
    /// What it comes from.
    pub cause: Cause,
    /// The effect whose law it is.
    pub effect: Option<EffectId>,
    /// How many times the error is what it would be without that.
    pub times_floor: f64,
    /// In words.
    pub text: String,
}

impl Remaining {
    /// Of a verdict: a parameter that varies in the balances, with its unit, what exceeds that of any healthy motor in
    /// the free run, a speed that wanders, or what the effects that the model has leave in the balances.
    pub fn beside(
        verdict: VerdictKind,
        varies: Option<(&Variation, &str)>,
        over: Option<&Completeness>,
        wandering: Option<Wandering>,
        left: Option<&Completeness>,
    ) -> Option<Self> {
        if let Some((varies, unit)) = varies {
            let effect = varies.of_law();
            let cause = if effect.is_some() { Cause::FormOfLaw } else { Cause::SlowChange };
            // The balances' error on data held out, in what it is with that.
            let times_floor = (0.5 * varies.gain).exp();
            return Some(Self { cause, effect, times_floor, text: in_words(varies, unit) });
        }
        if let Some(over) = over {
            let times_floor = over.electrical.max(over.mechanical);
            return Some(Self { cause: Cause::Unknown, effect: None, times_floor, text: left_over(over) });
        }
        if let Some(left) = left {
            let times_floor = left.electrical.max(left.mechanical);
            let side = if left.electrical > left.mechanical { "voltage" } else { "torque" };
            let text = format!(
                "what is left in the {side} balance, {times_floor:.1} times what does not repeat, is little of what the model's \
                 effects explain: their laws have another form in this motor, or something small is missing besides"
            );
            return Some(Self { cause: Cause::Unknown, effect: None, times_floor, text });
        }
        let wandering = wandering.filter(|_| verdict == VerdictKind::None)?;
        let text = remarks::wandering(verdict, wandering)?;
        Some(Self { cause: Cause::Load, effect: None, times_floor: wandering.times, text })
    }
}

impl Remaining {
    /// A load that fluctuates, which leaves so many times what does not repeat in the torque balance.
    pub fn load(load: &Fluctuation, times_floor: f64) -> Self {
        let text = format!(
            "what is left in the torque balance, {times_floor:.1} times what does not repeat, goes with nothing in the recording: a load \
             that fluctuates by {} N m within {} s, or what acts like one",
            figure(load.torque, 2),
            figure(load.time_constant_s, 2)
        );
        Self { cause: Cause::Load, effect: None, times_floor, text }
    }

    /// What an acquittal leaves so many times above the noise of the sensors, for which only a load was found.
    pub fn above_the_sensors(times_floor: f64) -> Self {
        let text = format!(
            "but the free run is still {times_floor:.1} times as far off as the noise of the sensors makes it: a load that \
             fluctuates does so. If this one is steady, something is missing that these recordings do not single out: record the \
             same once more, and other voltages"
        );
        Self { cause: Cause::Load, effect: None, times_floor, text }
    }
}

/// A parameter that varies, in words.
pub fn in_words(varies: &Variation, unit: &str) -> String {
    let Variation { name, with, values: [before, after], gain, .. } = varies;
    let ratio = after / before;
    let [before, after] = [*before, *after].map(|value| match unit {
        "1" => figure(value, 3),
        unit => format!("{} {unit}", figure(value, 3)),
    });
    // A friction may pass zero, of which there is no multiple.
    let times = if ratio > 0.1 && ratio < 10.0 { format!(", by × {}", figure(ratio, 3)) } else { String::new() };
    let falls = format!("with that the error on data held out falls by {:.0} %", 100.0 * (1.0 - (-0.5 * gain).exp()));
    match with {
        With::Time(Border { recording, at_s, within_s, .. }) => {
            let number = if *recording == 0 { String::new() } else { format!(" of recording {}", recording + 1) };
            let when = format!("{} s{number}, within {} s", figure(*at_s, 3), figure(*within_s, 2));
            format!("{name} changes at about {when}, from {before} to {after}{times}: {falls}")
        }
        With::Drift(longest) => {
            format!("{name} drifts within {} s, from {before} to {after}{times}: {falls}", figure(*longest, 3))
        }
        With::Current(largest) => format!(
            "what is left is the form of a law: {name} goes with the current, {before} at none and {after} at {} A; {falls}",
            figure(*largest, 3)
        ),
        With::Speed(largest) => format!(
            "what is left is the form of a law: {name} goes with the speed, {before} at rest and {after} at {} rad/s; {falls}",
            figure(*largest, 3)
        ),
    }
}
