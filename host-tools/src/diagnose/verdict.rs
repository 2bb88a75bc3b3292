//! The verdict, in one word and in a motor engineer's.

use greyrig::effects::{Acts, Effect};
use serde::Serialize;

use super::Size;
use super::classes::{OFFSETS, class_of};
use super::completeness::Completeness;
use super::ladder::{Ladder, Objection};
use super::lead::Lead;
use super::samples::Finding;
use super::screening::Holds;
use crate::model::Kind;
use crate::report::numbers::with_interval;

/// Residual of the current over what does not repeat, above which a constant alone is not the truth: healthy motors have at
/// most 1.04.
const EXACT: f64 = 1.08;

/// What was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum VerdictKind {
    /// Named effects.
    MissingEffect,
    /// The model is as good as the data.
    None,
    /// A set that these data cannot tell apart, but another recording could.
    Ambiguous,
    /// Real structure that no effect of the catalogue explains.
    OutsideCatalogue,
    /// The recordings do not hold what it takes.
    InsufficientData,
}

/// The verdict.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// In one word.
    pub kind: VerdictKind,
    /// The effects, in the order in which they should be added.
    pub effects: Vec<&'static str>,
    /// Sets whose members no recording could separate.
    pub classes: Vec<Vec<&'static str>>,
    /// The parameters of the effects that were fitted, with their intervals.
    pub sizes: Vec<Size>,
    /// In a motor engineer's words.
    pub text: String,
    /// The recording that would tell more.
    pub next_experiment: Option<String>,
}

impl Verdict {
    /// The recordings do not hold what it takes.
    pub fn insufficient(reason: &str) -> Self {
        Self {
            kind: VerdictKind::InsufficientData,
            effects: Vec::new(),
            classes: Vec::new(),
            sizes: Vec::new(),
            text: format!("these recordings cannot tell: {reason}"),
            next_experiment: Some(
                "a ramp, a staircase or a sine of the voltage over the whole range, and a coast-down".to_owned(),
            ),
        }
    }
}

fn description(id: &str) -> Option<&'static greyrig::effects::Description> {
    Effect::<f64>::CATALOGUE.iter().find(|d| d.id == id)
}

fn name(id: &str) -> &str {
    description(id).map_or(id, |d| d.name)
}

/// The default member of the class of an effect, or the effect itself.
fn default_member(kind: Kind, id: &'static str) -> &'static str {
    class_of(kind, id).map_or(id, |class| class[0])
}

/// Judges what a climb has found.
pub fn judge(ladder: &Ladder, findings: &[Finding], lead: &Lead, sizes: Vec<Size>, holds: Holds) -> Verdict {
    let kind = ladder.fit.space.kind();
    let mut effects: Vec<&'static str> = super::ids(findings);
    effects.extend(ladder.found.iter().map(|id| default_member(kind, id)));
    let mut classes: Vec<Vec<&'static str>> =
        ladder.found.iter().filter_map(|id| class_of(kind, id)).map(<[_]>::to_vec).collect();
    classes.dedup();
    let complete = ladder.is_explained();
    let mut rivals: Vec<&'static str> = ladder.rivals.iter().flatten().copied().collect();
    if !holds.motion {
        rivals.extend(fading(&ladder.found));
    }
    let doubt = if holds.standstill { None } else { doubt_of_offsets(ladder) };
    if doubt.is_some() {
        rivals.extend(OFFSETS.iter().filter(|id| !ladder.found.contains(id)));
    }
    let found = !effects.is_empty();
    let mut text: Vec<String> = findings.iter().map(|f| f.text.clone()).collect();
    text.extend(ladder.found.iter().enumerate().map(|(k, id)| {
        let mut line = reasons(id, ladder, k);
        let own: Vec<String> = sizes.iter().filter(|s| is_of(id, s)).map(in_words).collect();
        if !own.is_empty() {
            line += &format!("; {}", own.join(", "));
        }
        line
    }));
    let swallowed = blocked(ladder, Objection::NotIndependent).or_else(|| blocked(ladder, Objection::Implausible));
    match (found, complete) {
        (true, _) if !complete && !ladder.found.is_empty() => outside(ladder, lead, sizes, text),
        (true, _) if !rivals.is_empty() || doubt.is_some() => {
            for id in rivals.iter().map(|id| default_member(kind, id)) {
                if !effects.contains(&id) {
                    effects.push(id);
                }
            }
            let next = ladder
                .found
                .iter()
                .zip(&ladder.rivals)
                .find(|(_, r)| !r.is_empty())
                .and_then(|(id, _)| description(id).map(|d| d.separated_by.to_owned()));
            let otherwise = match holds.motion {
                true => "a locked rotor, and a coast-down with the supply open",
                false => "the same currents with the rotor free to turn",
            };
            let next = next.or_else(|| Some(otherwise.to_owned()));
            text.push(doubt.unwrap_or_else(|| {
                format!(
                    "{} would explain these data as well; another recording would tell",
                    rivals.iter().map(|id| name(id)).collect::<Vec<_>>().join(" or ")
                )
            }));
            Verdict {
                kind: VerdictKind::Ambiguous,
                effects,
                classes,
                sizes,
                text: text.join("\n"),
                next_experiment: next,
            }
        }
        (true, _) => {
            if ladder.floor.is_known() && ladder.after.is_complete() && !ladder.found.is_empty() {
                text.push("with that, nothing is left that repeats from one period to the next".to_owned());
            }
            Verdict {
                kind: VerdictKind::MissingEffect,
                effects,
                classes,
                sizes,
                text: text.join("\n"),
                next_experiment: None,
            }
        }
        (false, _) if swallowed.is_some() => {
            let id = swallowed.unwrap_or_default();
            Verdict {
                kind: VerdictKind::InsufficientData,
                effects: Vec::new(),
                classes: Vec::new(),
                sizes,
                text: format!(
                    "{} would lower the error, but in these recordings its contribution can hardly be told from the supply \
                     or from the base parameters, so it is not named",
                    name(id)
                ),
                next_experiment: Some(format!(
                    "a ramp, a staircase or a sine of the voltage through zero{}",
                    description(id).map_or_else(String::new, |d| format!("; {}", d.separated_by))
                )),
            }
        }
        (false, true) => Verdict {
            kind: VerdictKind::None,
            effects: Vec::new(),
            classes: Vec::new(),
            sizes,
            text: format!(
                "the model is as good as the data: what is left does not repeat from one period to the next, and no effect of the \
                 catalogue lowers the error on data held out. {} never visible in voltage, current and speed",
                match kind {
                    Kind::Universal =>
                        "Gains of the sensors, an impedance of the supply and a resistance that grows with the speed are",
                    Kind::PmDc => "Gains of the sensors and an impedance of the supply are",
                }
            ),
            next_experiment: None,
        },
        (false, false) => outside(ladder, lead, sizes, text),
    }
}

/// Effects that do the same as those found, as long as the rotor stands still.
fn fading(found: &[&'static str]) -> impl Iterator<Item = &'static str> {
    let into = |d: &greyrig::effects::Description| d.turns_into.is_some_and(|turn| found.contains(&turn.into));
    Effect::<f64>::CATALOGUE.iter().filter(move |d| into(d)).map(|d| d.id)
}

/// Why offsets that were found on a closed supply may be others.
fn doubt_of_offsets(ladder: &Ladder) -> Option<String> {
    let offsets = ladder.found.iter().filter(|id| OFFSETS.contains(id)).count();
    if offsets >= 2 {
        return Some(
            "while the motor runs on a closed supply, any two of remanence, current offset and voltage offset can take the \
             part of the third"
                .to_owned(),
        );
    }
    let left = ladder.free_run.map_or(1.0, |(_, after)| after.electrical);
    (offsets == 1 && ladder.found.len() == 1 && left > EXACT).then(|| {
        format!(
            "an offset has no other form, yet {left:.2} times what does not repeat is left of the current's error: remanence, \
             current offset and voltage offset look alike while the motor runs on a closed supply"
        )
    })
}

/// A candidate of the first step that would explain everything, and that only one objection keeps from being named.
fn blocked(ladder: &Ladder, objection: Objection) -> Option<&'static str> {
    let first = ladder.steps.first()?;
    first
        .tried
        .iter()
        .filter(|t| t.objection == Some(objection))
        .find(|t| Completeness::of(&t.fit, &ladder.floor).explains(&ladder.before))
        .map(|t| t.id)
}

/// Where structure can be left.
const BALANCES: [&str; 2] = ["voltage balance", "torque balance"];
const FREE_RUN: [&str; 2] = ["current of the free run", "speed of the free run"];

fn outside(ladder: &Ladder, lead: &Lead, sizes: Vec<Size>, mut text: Vec<String>) -> Verdict {
    let judges = |(without, with): &(Completeness, Completeness)| {
        if ladder.found.is_empty() { ladder.after.is_complete() } else { !with.explains(without) }
    };
    let free_run = ladder.free_run.filter(judges);
    let (names, left) = free_run.map_or((BALANCES, ladder.after), |(_, with)| (FREE_RUN, with));
    let (side, times) =
        if left.electrical > left.mechanical { (names[0], left.electrical) } else { (names[1], left.mechanical) };
    if !text.is_empty() {
        text.insert(0, "part of the error looks like an effect of the catalogue, but not all of it:".to_owned());
    }
    text.push(format!(
        "structure is left in the {side}, {times:.1} times what does not repeat, that no effect of the catalogue explains"
    ));
    if !lead.terms.is_empty() {
        let formula: Vec<String> =
            lead.terms.iter().map(|t| format!("{:+.3e} {} ({})", t.coefficient, t.formula, t.balance)).collect();
        text.push(format!(
            "a formula of generic terms takes {:.0} % of it: {}",
            100.0 * lead.held_out_gain,
            formula.join("  ")
        ));
        let arguments = lead.as_arguments();
        if !arguments.is_empty() {
            let flags: Vec<String> = arguments.iter().map(|a| format!("--term '{a}'")).collect();
            text.push(format!("as a lead: greyrig add {}", flags.join(" ")));
        }
    }
    Verdict {
        kind: VerdictKind::OutsideCatalogue,
        effects: Vec::new(),
        classes: Vec::new(),
        sizes,
        text: text.join("\n"),
        next_experiment: Some(
            "a locked rotor, DC steps and a coast-down: each takes one part of the motor away".to_owned(),
        ),
    }
}

/// Why an effect is named.
fn reasons(id: &str, ladder: &Ladder, place: usize) -> String {
    let Some(d) = description(id) else { return id.to_owned() };
    let step = ladder.steps.iter().find(|s| s.winners.contains(&id));
    let side = match d.acts {
        Acts::Electrical => "in the voltage balance",
        Acts::Mechanical => "in the torque balance",
        Acts::Both => "in the voltage and the torque balance",
        Acts::Measuring => "in the measuring chain",
    };
    let mut text = format!("{}{} {side}: {}", if place == 0 { "" } else { "then " }, d.name, d.signature);
    if let Some(step) = step
        && let Some(own) = step.tried.iter().find(|t| t.id == id)
    {
        let other = step.winners.iter().find(|w| step.together && **w != id);
        let with = other.map_or_else(String::new, |other| format!("with {} ", name(other)));
        text +=
            &format!("; {with}the error on data held out falls by {:.0} %", 100.0 * (1.0 - (-0.5 * own.gain).exp()));
        if let Some(next) = step.tried.iter().find(|t| !step.winners.contains(&t.id)) {
            text += &format!(
                ", with the next best, {}, by {:.0} %",
                name(next.id),
                100.0 * (1.0 - (-0.5 * next.gain).exp()).max(0.0)
            );
        }
    }
    text
}

/// Whether a size is that of an effect.
fn is_of(id: &str, size: &Size) -> bool {
    description(id).is_some_and(|d| d.parameters.iter().any(|p| p.name == size.name))
}

/// A size with its interval.
fn in_words(size: &Size) -> String {
    let (value, interval) = with_interval(size.value, size.ci95);
    let interval = size.ci95.map_or_else(|| "left open by these data".to_owned(), |_| format!("{interval}, 95 %"));
    let unit = if size.unit == "1" { String::new() } else { format!(" {}", size.unit) };
    format!("{} = {value}{unit} ({interval})", size.name)
}
