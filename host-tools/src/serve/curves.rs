//! Curves that were computed once, by model and recording, for as long as there is room.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use greyrig::effects::EffectId;

use super::error::{Error, Result};
use super::pyramid::Curve;
use super::simulated::Simulated;
use crate::recording::Channel;

/// Samples of simulations that are kept at least: some 40 bytes each.
const ROOM: usize = 4_000_000;
/// And for each sample of the project: the present version, its ghost, and a third one.
const FOR_EACH: usize = 3;

/// Which model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Of {
    /// A version.
    Version(u32),
    /// A version with an effect that a diagnosis has tried.
    Candidate(u32, EffectId),
}

/// One computation, which those wait for who ask meanwhile.
type Cell = Arc<OnceLock<std::result::Result<Arc<Simulated>, String>>>;

/// A channel as recorded, by the number of its recording.
type Raw = ((u32, Channel), Arc<Curve>);

/// Curves by model and recording, those asked for last at the end.
#[derive(Default)]
pub struct Curves {
    simulated: Mutex<Vec<((Of, u32), Cell)>>,
    raw: Mutex<Vec<Raw>>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // What is under it is a list to which nothing is ever half added.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Curves {
    /// A model's free run over a recording: the one that is there, or that is made now. `samples` is the size of the
    /// project.
    ///
    /// # Errors
    /// A model that cannot be run on this recording.
    pub fn simulated(
        &self,
        of: Of,
        recording: u32,
        samples: usize,
        make: impl FnOnce() -> crate::error::Result<Simulated>,
    ) -> Result<Arc<Simulated>> {
        let cell = {
            let mut all = locked(&self.simulated);
            let known = all.iter().position(|(key, _)| *key == (of, recording));
            let entry = known.map_or_else(|| ((of, recording), Cell::default()), |place| all.remove(place));
            let cell = Arc::clone(&entry.1);
            all.push(entry);
            cell
        };
        let made = cell.get_or_init(|| make().map(Arc::new).map_err(|e| e.to_string())).clone();
        let mut all = locked(&self.simulated);
        if made.is_err() {
            // Stopped, maybe: the next one may have more luck.
            all.retain(|(key, _)| *key != (of, recording));
        }
        let size = |cell: &Cell| cell.get().and_then(|made| made.as_ref().ok()).map_or(0, |s| s.counted.len());
        let mut sum: usize = all.iter().map(|(_, cell)| size(cell)).sum();
        while sum > ROOM.max(FOR_EACH * samples) && all.len() > 1 {
            sum -= size(&all.remove(0).1);
        }
        drop(all);
        made.map_err(|what| Error::Work(crate::error::Error::usage(what, "try again")))
    }

    /// What is known of one model is that of another one, too.
    pub fn adopt(&self, from: Of, to: Of) {
        let mut all = locked(&self.simulated);
        let own = all.iter().filter(|((of, _), _)| *of == from);
        let own: Vec<_> = own.map(|((_, recording), cell)| ((to, *recording), Arc::clone(cell))).collect();
        all.extend(own);
    }

    /// A channel as recorded.
    pub fn raw(&self, recording: u32, channel: Channel, make: impl FnOnce() -> Option<Curve>) -> Option<Arc<Curve>> {
        if let Some((_, curve)) = locked(&self.raw).iter().find(|(key, _)| *key == (recording, channel)) {
            return Some(Arc::clone(curve));
        }
        let made = Arc::new(make()?);
        locked(&self.raw).push(((recording, channel), Arc::clone(&made)));
        Some(made)
    }

    /// Forgets what belongs to a recording that is gone.
    pub fn forget(&self, recording: u32) {
        locked(&self.simulated).retain(|((_, other), _)| *other != recording);
        locked(&self.raw).retain(|((other, _), _)| *other != recording);
    }

    /// Forgets all candidates.
    pub fn forget_candidates(&self) {
        locked(&self.simulated).retain(|((of, _), _)| matches!(of, Of::Version(_)));
    }
}
