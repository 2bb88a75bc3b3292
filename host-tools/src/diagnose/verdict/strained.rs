//! An effect that explains its part only as what it no longer is.
//!
//! Every law can be bent until it looks like another one: a warm-up of the bearings within half a second takes the part
//! of friction that falls with the speed, a transformer EMF that does not fade that of eddy currents which nobody
//! tried. Where a fit leaves a shape at such an end of its physical range, the name would be wrong, however well the
//! curve fits.

use greyrig::effects::EffectId;

use super::doubt::Doubt;
use super::words::{name, without_interval};
use crate::diagnose::holds::Holds;
use crate::diagnose::ladder::Ladder;
use crate::diagnose::sizes::Size;
use crate::identify::space::{Key, Space};

/// The effect, and where it rests.
#[derive(Debug, Clone, PartialEq)]
pub struct Strained {
    /// The effect.
    pub effect: EffectId,
    shape: Key,
    /// What it would be there.
    instead: Option<EffectId>,
}

impl Strained {
    /// Among what was found, where it would be named without a doubt; `space` are its parameters, `explained` whether
    /// it explains all.
    pub fn among(ladder: &Ladder, holds: Holds, space: &Space, explained: bool) -> Option<Self> {
        if !explained || Doubt::about(ladder, holds).is_some() {
            return None;
        }
        let tried = |id: &EffectId| ladder.steps.iter().any(|s| s.promises.iter().any(|(other, _)| other == id));
        let strained = |effect: &EffectId| {
            // What was tried, and fitted less well, it is not.
            let instead = space.turned(*effect).filter(|other| !tried(other));
            let turn = || effect.description().turns_into.filter(|_| instead.is_some());
            let shape =
                turn().map(|turn| Key::Effect(*effect, turn.parameter)).or_else(|| space.at_its_shortest(*effect))?;
            Some(Self { effect: *effect, shape, instead })
        };
        ladder.found.iter().find_map(strained)
    }

    /// In words.
    pub(super) fn in_words(&self, sizes: &[Size]) -> String {
        let size = sizes.iter().find(|size| size.key == self.shape);
        let with = size
            .map(without_interval)
            .or_else(|| self.shape.of_effect().map(|p| p.name.to_owned()))
            .unwrap_or_default();
        let instead = self.instead.map_or_else(
            || "what acts so is another effect than that".to_owned(),
            |other| format!("it would be {} there", name(other)),
        );
        format!("but {} does so only at an end of its range, with {with}: {instead}", name(self.effect))
    }
}
