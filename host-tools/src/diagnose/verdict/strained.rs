//! An effect that explains its part only as what it no longer is.
//!
//! Every law can be bent until it looks like another one: a warm-up of the bearings within half a second takes the part of friction
//! that falls with the speed, a transformer EMF that does not fade that of eddy currents. Where a fit leaves a shape at an end of its
//! physical range, the name would be wrong, however well the curve fits.

use super::doubt::Doubt;
use super::words::{in_words, name};
use crate::diagnose::ladder::Ladder;
use crate::diagnose::screening::Holds;
use crate::diagnose::sizes::Size;
use crate::identify::space::Space;

/// The effect, and where it rests.
#[derive(Debug, Clone, PartialEq)]
pub struct Strained {
    /// The effect.
    pub effect: &'static str,
    shape: String,
    /// What it would be there.
    instead: Option<&'static str>,
}

impl Strained {
    /// Among what was found, where it would be named without a doubt; `space` are its parameters.
    pub fn among(ladder: &Ladder, holds: Holds, space: &Space) -> Option<Self> {
        if !ladder.is_explained() || Doubt::about(ladder, holds).is_some() {
            return None;
        }
        let strained = |effect: &&'static str| {
            let shape = space.at_an_end(effect)?.name.clone();
            Some(Self { effect, shape, instead: space.turned(effect) })
        };
        ladder.found.iter().find_map(strained)
    }

    /// In words.
    pub(super) fn in_words(&self, sizes: &[Size]) -> String {
        let size = sizes.iter().find(|size| size.name == self.shape);
        let with = size.map_or_else(|| self.shape.clone(), in_words);
        let instead = self.instead.map_or_else(
            || "what acts so is another effect than that".to_owned(),
            |other| format!("it would be {} there", name(other)),
        );
        format!("but {} does so only at an end of its range, with {with}: {instead}", name(self.effect))
    }
}
