//! A motor engineer's words.

use greyrig::effects::{Acts, EffectId};

use crate::diagnose::classes;
use crate::diagnose::completeness::Completeness;
use crate::diagnose::criteria::SAME_ERROR;
use crate::diagnose::ladder::Ladder;
use crate::diagnose::sizes::Size;
use crate::identify::space::Key;
use crate::numbers::with_interval;

/// The standard name of an effect.
pub fn name(id: EffectId) -> &'static str {
    id.description().name
}

/// Why each effect is named, and how large it is.
pub fn reasons(ladder: &Ladder, sizes: &[Size]) -> impl Iterator<Item = String> {
    ladder.found.iter().enumerate().map(|(place, id)| {
        let own: Vec<String> = sizes.iter().filter(|s| is_of(*id, s)).map(in_words).collect();
        let size = if own.is_empty() { String::new() } else { format!("; {}", own.join(", ")) };
        reason(*id, ladder, place) + &size
    })
}

/// Why an effect is named.
fn reason(id: EffectId, ladder: &Ladder, place: usize) -> String {
    let d = id.description();
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
        let with = other.map_or_else(String::new, |other| format!("with {} ", name(*other)));
        text +=
            &format!("; {with}the error on data held out falls by {:.0} %", 100.0 * (1.0 - (-0.5 * own.gain).exp()));
        if let Some(next) = step.tried.iter().find(|t| !step.winners.contains(&t.id)) {
            let (other, share) = (name(next.id), 100.0 * (1.0 - (-0.5 * next.gain).exp()).max(0.0));
            // Only an exchange takes what gained less.
            text += &match next.objection.is_none() && next.gain > own.gain + SAME_ERROR {
                true => format!(", less than with {other} at first ({share:.0} %), but more beside the other effects"),
                false => format!(", with the next best, {other}, by {share:.0} %"),
            };
        }
    }
    if let Some((_, sum)) = classes::sums(ladder.fit.space.kind()).find(|(one, _)| *one == id) {
        let two = sum.two.map(name).join(" and ");
        text += &format!("; {two} together would do the same, but one cause is likelier than two");
    }
    text
}

/// What effects that explain nearly all leave in the free run.
pub fn left_over(left: &Completeness) -> String {
    let (signal, times) = match left.electrical > left.mechanical {
        true => ("current", left.electrical),
        false => ("speed", left.mechanical),
    };
    format!(
        "the free run's error of the {signal} is still {times:.1} times what does not repeat, more than that of any healthy motor: \
         the laws of this motor have another form, or something small is missing besides"
    )
}

/// Whether a size is that of an effect.
fn is_of(id: EffectId, size: &Size) -> bool {
    matches!(size.key, Key::Effect(other, _) if other == id)
}

/// A size with its interval.
pub fn in_words(size: &Size) -> String {
    let (_, interval) = with_interval(size.value, size.ci95);
    let interval = size.ci95.map_or_else(|| "left open by these data".to_owned(), |_| format!("{interval}, 95 %"));
    format!("{} ({interval})", without_interval(size))
}

/// A size to as many digits as its interval tells.
pub fn without_interval(size: &Size) -> String {
    let (value, _) = with_interval(size.value, size.ci95);
    let unit = if size.unit == "1" { String::new() } else { format!(" {}", size.unit) };
    format!("{} = {value}{unit}", size.name)
}
