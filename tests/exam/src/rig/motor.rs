//! What is said of the motor behind a damaged recording.
//!
//! What a recording suffers from is no effect of its motor. The oracle, which knows the true chain, is the diagnosis of
//! the recording before the damage: an effect that this one names alone can be seen.

use std::fmt;

use greyrig::effects::EffectId;
use greyrig_host::check::{self, Purpose};
use greyrig_host::context::Context;
use greyrig_host::diagnose::classes::same;
use greyrig_host::diagnose::{Options, VerdictKind, diagnose};
use greyrig_host::error::{Error, Result};
use greyrig_host::identify::Settings;
use greyrig_host::model::{Kind as MotorKind, catalogue};
use greyrig_host::recording::Recording;

use super::{Kind, draw};

/// What a diagnosis says of a motor whose truth is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Said {
    /// The recording tells nothing.
    Refused,
    /// The truth and nothing else.
    Right,
    /// The truth among rivals.
    Among,
    /// Nothing is missing, where something is.
    Nothing,
    /// What is missing is outside the catalogue.
    Outside,
    /// An effect that is not there.
    Wrong,
}

/// A motor, and what is said of it.
pub struct Verdict {
    /// What it is.
    pub title: String,
    /// The damage, with its size.
    pub damage: String,
    /// Whether it is healthy.
    pub healthy: bool,
    /// What is said of the recording before the damage.
    pub before: Said,
    /// What is said of the damaged recording.
    pub behind: Said,
    /// In its own words.
    pub words: String,
}

impl Verdict {
    /// Whether the oracle sees its effect, and nothing else.
    pub fn is_seen(&self) -> bool {
        !self.healthy && self.before == Said::Right
    }

    /// Whether a healthy motor is said to lack something.
    pub fn is_accused(&self) -> bool {
        self.healthy && !matches!(self.behind, Said::Right | Said::Refused)
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}: {:?}, {:?} before: {}", self.title, self.damage, self.behind, self.before, self.words)
    }
}

/// Asks `diagnose` about the motor of a case of a kind of damage.
///
/// # Errors
/// None but a fault of the rig.
pub fn diagnosed(kind: &Kind, seed: u64) -> Result<Verdict> {
    let (sound, damaged) = draw(kind, seed)?;
    let truth = match sound.effect.as_deref().and_then(|effect| effect.split(['=', ':']).next()) {
        None => None,
        Some(name) => {
            Some(name.parse::<EffectId>().map_err(|_| Error::usage(format!("{name}: no effect"), "mend the rig"))?)
        }
    };
    let of = |mut recordings: Vec<Recording>, motor: MotorKind, besides: &[EffectId]| -> Result<(Said, String)> {
        let found = check::question(&mut recordings, motor, Purpose::Fit);
        if recordings.is_empty() {
            return Ok((Said::Refused, "not read".to_owned()));
        }
        if let Some(stop) = check::stop(&found) {
            return Ok((Said::Refused, stop.code.to_string()));
        }
        let options = Options { settings: Settings::new(motor), exclude: Vec::new(), candidates_refined: false };
        let verdict = match diagnose(&recordings, &options, &Context::quiet()) {
            Ok(diagnosis) => diagnosis.verdict,
            Err(error) => return Ok((Said::Refused, error.to_string())),
        };
        let is_truth = |id: &EffectId| truth.is_some_and(|t| same(motor, *id, t));
        let named = verdict.effects.iter().any(is_truth);
        let strange = verdict.effects.iter().any(|id| !is_truth(id) && !besides.contains(id));
        let said = match verdict.kind {
            VerdictKind::InsufficientData => Said::Refused,
            VerdictKind::OutsideCatalogue => Said::Outside,
            VerdictKind::Ambiguous if named || truth.is_none() && !strange => Said::Among,
            _ if strange => Said::Wrong,
            _ if named || truth.is_none() => Said::Right,
            _ => Said::Nothing,
        };
        Ok((said, format!("{:?} {}", verdict.kind, catalogue::joined(&verdict.effects, " + "))))
    };
    let title = sound.title();
    let (before, _) = of(vec![sound.recording.clone()], sound.motor, &[])?;
    let channels: Vec<&str> = damaged.channels.iter().flatten().map(|channel| channel.column()).collect();
    let damage = format!("{} {}", channels.join(" or "), damaged.what).trim().to_owned();
    let (behind, words) = of(damaged.recordings, (kind.taken_for)(sound.motor), kind.effects)?;
    Ok(Verdict { title, damage, healthy: truth.is_none(), before, behind, words })
}
