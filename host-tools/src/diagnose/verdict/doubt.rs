//! What else would explain the data as well.

use greyrig::effects::EffectId;

use super::words::{in_words, name};
use crate::diagnose::classes;
use crate::diagnose::criteria::BEYOND_DOUBT;
use crate::diagnose::holds::Holds;
use crate::diagnose::ladder::Ladder;
use crate::diagnose::sizes::{Size, parameters_of};
use crate::identify::space::Key;

/// Residual of the current over what does not repeat, above which a constant alone is not the truth: healthy motors
/// have at most 1.04.
const EXACT: f64 = 1.08;

/// Why what was found may be something else.
pub struct Doubt {
    /// The effects that it may be.
    pub rivals: Vec<EffectId>,
    /// In words.
    pub reason: String,
    /// The recording that would tell.
    pub experiment: String,
}

impl Doubt {
    /// About what a climb has found.
    pub fn about(ladder: &Ladder, holds: Holds) -> Option<Self> {
        let mut rivals: Vec<EffectId> = ladder.rivals.iter().flatten().copied().collect();
        if !holds.motion {
            rivals.extend(alike_at_standstill(ladder));
        }
        let of_offsets = if holds.takes_a_part_away() { None } else { of_offsets(ladder) };
        if of_offsets.is_some() {
            let others = ladder.found.iter().filter_map(|id| id.description().two_make_it).flatten();
            for id in others.filter(|id| !ladder.found.contains(id)) {
                if !rivals.contains(&id) {
                    rivals.push(id);
                }
            }
        }
        if rivals.is_empty() && of_offsets.is_none() {
            return None;
        }
        let reason = of_offsets.unwrap_or_else(|| {
            format!(
                "{} would explain these data as well; another recording would tell",
                rivals.iter().map(|id| name(*id)).collect::<Vec<_>>().join(" or ")
            )
        });
        Some(Self { rivals, reason, experiment: experiment(ladder, holds) })
    }

    /// About an effect that explains the error all by itself, and not much of an error, with a size that may as well be
    /// zero: what acts so may then be something else. Several effects lend each other width, so nothing is said about
    /// these; and where the error falls to a third, it is the shape that leaves the size open, if there is one, as a
    /// knee beyond the data does.
    pub fn about_size(ladder: &Ladder, sizes: &[Size], holds: Holds) -> Option<Self> {
        let [id] = ladder.found[..] else { return None };
        let by_its_shape = ladder.fall() > BEYOND_DOUBT && parameters_of(id) > 1;
        if ladder.fit.space.effects().len() > 1 || by_its_shape {
            return None;
        }
        let size = sizes.iter().find(|s| s.key == Key::size_of(id) && s.may_be_zero())?;
        let reason = format!(
            "yet its size may as well be zero, {}: what acts so may be something else; another recording would tell",
            in_words(size)
        );
        let experiment = format!("less noise, or larger currents and speeds; {}", holds.each_part_alone());
        Some(Self { rivals: Vec::new(), reason, experiment })
    }
}

fn experiment(ladder: &Ladder, holds: Holds) -> String {
    let with_rivals = ladder.found.iter().zip(&ladder.rivals).find(|(_, rivals)| !rivals.is_empty());
    let separating = with_rivals.map(|(id, _)| holds.what_else_tells(id.description()));
    match separating {
        Some(told) => told.unwrap_or_else(|| holds.each_part_alone()),
        None if holds.motion => "a locked rotor, and a coast-down with the supply open".to_owned(),
        None => "the same currents with the rotor free to turn".to_owned(),
    }
}

/// Effects that do the same as those found, as long as the rotor stands still.
fn alike_at_standstill(ladder: &Ladder) -> impl Iterator<Item = EffectId> {
    let law = ladder.fit.space.kind().flux_law();
    let alike = ladder.found.iter().flat_map(|id| classes::at_standstill(*id));
    alike.filter(move |id| !ladder.found.contains(id) && id.description().is_tried(law))
}

/// Why offsets that were found on a closed supply may be others.
fn of_offsets(ladder: &Ladder) -> Option<String> {
    let offsets = ladder.found.iter().filter(|id| id.description().two_make_it.is_some()).count();
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
            "an offset alone should leave only noise, but the current error is {left:.2} times the noise level: remanence, current \
             offset and voltage offset look alike while the motor runs on a closed supply"
        )
    })
}
