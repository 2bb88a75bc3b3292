//! A motor engineer's words.

use greyrig::effects::{Acts, EffectId, Sentence};

use crate::diagnose::classes;
use crate::diagnose::completeness::Completeness;
use crate::diagnose::criteria::{SAME_ERROR, SMALLEST_GAIN};
use crate::diagnose::ladder::{Ladder, Step, Tried};
use crate::diagnose::sizes::Size;
use crate::identify::space::Key;
use crate::numbers::{readable_unit, unit, with_interval};

/// The standard name of an effect.
pub fn name(id: EffectId) -> &'static str {
    id.description().name
}

/// Why each effect is named, and how large it is.
pub fn reasons(ladder: &Ladder, sizes: &[Size]) -> impl Iterator<Item = String> {
    ladder.found.iter().enumerate().map(|(place, id)| {
        let own: Vec<String> = sizes.iter().filter(|s| is_of(*id, s)).map(in_words).collect();
        let plain = plainly(*id, sizes).map_or_else(String::new, |plain| format!("\n  {plain}"));
        let all = if own.is_empty() { String::new() } else { format!("\n  {}", own.join(", ")) };
        reason(*id, ladder, place) + &plain + &all
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
    let mut text = format!("{}{} {side}", if place == 0 { "" } else { "then " }, d.name);
    if let Some(step) = step
        && let Some(own) = step.tried.iter().find(|t| t.id == id)
    {
        text += &gained(own, step, ladder.found.len() > 1);
    }
    if let Some((_, sum)) = classes::sums(ladder.fit.space.kind()).find(|(one, _)| *one == id) {
        let two = sum.two.map(name).join(" and ");
        text += &format!("; {two} together would do the same, but one cause is likelier than two");
    }
    text + &format!("\n  a model without it leaves: {}", d.signature)
}

/// What the size of an effect means, and that of its second size: those of them whose intervals leave zero out, or the
/// first.
fn plainly(id: EffectId, sizes: &[Size]) -> Option<String> {
    let d = id.description();
    let sentences = std::iter::once(d.size_in_words).chain(d.second_size_in_words);
    let with_size = |(place, sentence)| {
        let size = sizes.iter().find(|size| size.key == Key::Effect(id, place))?;
        Some((size, Sentence(sentence, in_plain_words(size)).to_string()))
    };
    let all: Vec<(&Size, String)> = sentences.enumerate().filter_map(with_size).collect();
    let there = all.iter().filter(|(size, _)| !size.may_be_zero()).map(|(_, words)| words.as_str());
    let there = there.collect::<Vec<_>>().join("; ");
    if there.is_empty() { all.into_iter().next().map(|(_, words)| words) } else { Some(there) }
}

/// A size in a unit that leaves no zeros in front: shares in per cent. What may be less than minus one is none.
fn in_plain_words(size: &Size) -> String {
    let is_share = size.key.of_effect().is_none_or(|p| p.range.0 >= -1.0);
    let (scale, unit) = match size.unit.as_str() {
        "1" if !is_share => (1.0, String::new()),
        "1" => (0.01, " %".to_owned()),
        unit => {
            let (scale, unit) = readable_unit(size.value, unit);
            (scale, format!(" {unit}"))
        }
    };
    let (value, _) = with_interval(size.value / scale, size.ci95.map(|ends| ends.map(|end| end / scale)));
    format!("{value}{unit}")
}

/// What an effect has gained at its step, and what the next best one would have.
fn gained(own: &Tried, step: &Step, has_company: bool) -> String {
    // An exchange or a look back takes what gains nothing by itself, and the free run what the balances hardly show.
    if own.gain < SMALLEST_GAIN {
        let where_it_does = if has_company { "beside the other effects it does" } else { "in the free run it does" };
        return format!(": by itself it hardly lowers the error of the balances, {where_it_does}");
    }
    let other = step.winners.iter().find(|w| step.together && **w != own.id);
    let with = other.map_or_else(String::new, |other| format!("with {} ", name(*other)));
    let text = format!(": {with}the error on data held out falls by {:.0} %", share(own.gain));
    let Some(next) = step.tried.iter().find(|t| !step.winners.contains(&t.id)) else { return text };
    let (other, taken) = (name(next.id), share(next.gain).max(0.0));
    text + &match next.objection {
        _ if next.gain <= own.gain + SAME_ERROR => format!(", with the next best, {other}, by {taken:.0} %"),
        Some(objection) => format!("; {other} would take {taken:.0} %, but {}", objection.words()),
        None => {
            let but = if has_company { "more beside the other effects" } else { "the free run comes closer" };
            format!(", less than with {other} at first ({taken:.0} %), but {but}")
        }
    }
}

/// A gain as the share of the error that it takes, %.
fn share(gain: f64) -> f64 {
    100.0 * (1.0 - (-0.5 * gain).exp())
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
    format!("{} = {value} {}", size.name, unit(&size.unit)).trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, OnceLock};

    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::diagnose::ladder::Objection;
    use crate::identify::minimise::Fit;
    use crate::identify::space::Space;
    use crate::model::{Base, Kind};

    /// Gains as falls of both balances: 2 ln 2 takes a half of each, 2 ln 4 three quarters, 2 ln 10 nine tenths.
    #[test]
    fn each_figure_of_a_reason_is_the_one_that_decided() {
        let fit = Arc::new(Fit {
            space: Space::new(Kind::Universal, Base::usual(Kind::Universal), &[]),
            residuals: DVector::zeros(0),
            jacobian: DMatrix::zeros(0, 0),
            rms: [1.0; 2],
            ended: true,
            known_held_out: OnceLock::new(),
        });
        let tried = |id, ratio: f64, objection| Tried {
            id,
            fit: Arc::clone(&fit),
            gain: 2.0 * ratio.ln(),
            p_value: 0.0,
            objection,
        };
        let step = |next: Tried| Step {
            promises: Vec::new(),
            tried: vec![next],
            winners: vec![EffectId::Saturation],
            together: false,
            in_free_run: false,
            as_well: Vec::new(),
            decoy_gain: 0.0,
            decoys: [0, 0],
        };
        let own = |ratio| tried(EffectId::Saturation, ratio, None);
        let said = |ratio, next: Tried| gained(&own(ratio), &step(next), true);
        let half = said(4.0, tried(EffectId::BrushDrop, 2.0, None));
        assert!(half.contains("falls by 75 %, with the next best") && half.ends_with("by 50 %"), "{half}");
        let refused = said(4.0, tried(EffectId::BrushDrop, 10.0, Some(Objection::Implausible)));
        assert!(refused.contains("would take 90 %, but R or K would be those of another motor"), "{refused}");
        let exchanged = said(4.0, tried(EffectId::BrushDrop, 10.0, None));
        assert!(exchanged.contains("(90 %), but more beside"), "{exchanged}");
        // An error that rises is no fall of −100 %.
        let nothing = said(0.5, tried(EffectId::BrushDrop, 2.0, None));
        assert!(!nothing.contains('%'), "{nothing}");
    }
}
