//! Candidates of a diagnosis, simulated while nobody waits.

use std::sync::Arc;

use greyrig::effects::EffectId;

use super::{Session, State};
use crate::context::{CancelFlag, Context};
use crate::serve::curves::Of;
use crate::serve::error::Error;
use crate::serve::simulated::Simulated;
use crate::serve::task::{self, Added};
use crate::serve::version::Made;

/// Candidates of a version that are simulated.
const MOST: usize = 10;

/// What was computed ahead, of any version, as long as the recordings stay what they are.
#[derive(Default)]
pub struct Ahead {
    cancel: CancelFlag,
    made: Vec<((u32, EffectId), Made)>,
    left: u32,
}

impl Ahead {
    /// Stops what is under way; what is there stays.
    pub fn stop(&self) {
        self.cancel.cancel();
    }

    /// How many are still to come.
    pub fn left(&self) -> u32 {
        self.left
    }

    /// A version with an effect.
    pub fn made(&self, version: u32, effect: EffectId) -> Option<&Made> {
        self.made.iter().find(|(key, _)| *key == (version, effect)).map(|(_, made)| made)
    }
}

impl Session {
    /// Simulates what a diagnosis of the present version has tried, best first, while nothing else is done.
    pub(super) fn look_ahead(&self, state: &mut State) {
        let Some(version) = state.at_present().cloned() else { return };
        let id = version.told.id;
        state.ahead.stop();
        state.ahead.left = 0;
        let Some(diagnosis) = version.told.diagnosis.as_ref().filter(|d| d.basis == state.recordings.basis()) else {
            return;
        };
        let mut wanted: Vec<(f64, EffectId)> = Vec::new();
        for candidate in diagnosis.candidates.iter().filter(|c| c.step == 1 && c.gain > 0.0) {
            if let Ok(effect) = candidate.effect.parse()
                && state.ahead.made(id, effect).is_none()
            {
                wanted.push((candidate.gain, effect));
            }
        }
        wanted.sort_by(|a, b| b.0.total_cmp(&a.0));
        let known = state.ahead.made.iter().filter(|((version, _), _)| *version == id).count();
        wanted.truncate(MOST.saturating_sub(known));
        if wanted.is_empty() || state.job.is_some() {
            return;
        }
        state.ahead.cancel = CancelFlag::default();
        state.ahead.left = u32::try_from(wanted.len()).unwrap_or(u32::MAX);
        let ctx = Context::of(state.ahead.cancel.clone());
        let (session, recordings) = (self.clone(), Arc::clone(&state.recordings));
        std::thread::spawn(move || {
            for (_, effect) in wanted {
                let added = Added { effects: vec![effect], terms: Vec::new() };
                let make = || task::with(&recordings.usable, &version.model, &added, &ctx);
                let made = std::panic::catch_unwind(std::panic::AssertUnwindSafe(make)).unwrap_or(Err(Error::Panicked));
                if let Ok(made) = &made {
                    for (recording, r) in recordings.ids.iter().zip(&recordings.usable) {
                        let make = || Simulated::new(&made.model, r, &ctx);
                        let _ =
                            session.curves.simulated(Of::Candidate(id, effect), *recording, recordings.samples(), make);
                    }
                }
                let mut state = session.state();
                // Whoever has stopped this has begun something else.
                if ctx.check().is_err() {
                    return;
                }
                state.ahead.left = state.ahead.left.saturating_sub(1);
                if let Ok(made) = made {
                    state.ahead.made.push(((id, effect), made));
                }
                session.show(&mut state);
            }
        });
    }
}
