//! Work under way, and how far it is.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use tokio::sync::watch;

use super::api;
use crate::context::{CancelFlag, Context, Progress};

/// Work under way.
pub struct Job {
    what: String,
    cancel: CancelFlag,
    began: Instant,
    at: At,
}

/// How far a job is.
#[derive(Clone)]
struct At {
    doing: Arc<Mutex<Doing>>,
    /// How often something new was begun.
    steps: Arc<AtomicU32>,
    /// Who is told.
    seen: Arc<watch::Sender<()>>,
}

struct Doing {
    what: String,
    fraction: Option<f64>,
    since: Instant,
}

impl At {
    fn present(&self) -> MutexGuard<'_, Doing> {
        // It is only shown, and the next report replaces it: nothing that a panic leaves of it can mislead for long.
        self.doing.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Progress for At {
    fn at(&self, doing: &str, fraction: Option<f64>) {
        {
            let mut present = self.present();
            if fraction.is_none() || present.what != doing {
                self.steps.fetch_add(1, Ordering::Relaxed);
                present.since = Instant::now();
            }
            doing.clone_into(&mut present.what);
            present.fraction = fraction;
        }
        self.seen.send_replace(());
    }
}

impl Job {
    /// Begins one, of which `seen` is told.
    pub fn new(what: String, seen: Arc<watch::Sender<()>>) -> Self {
        let doing = Doing { what: String::new(), fraction: None, since: Instant::now() };
        let at = At { doing: Arc::new(Mutex::new(doing)), steps: Arc::default(), seen };
        Self { what, cancel: CancelFlag::default(), began: Instant::now(), at }
    }

    /// What it is.
    pub fn what(&self) -> &str {
        &self.what
    }

    /// What its work is given.
    pub fn context(&self) -> Context {
        Context::of(self.cancel.clone()).watched(self.at.clone())
    }

    /// Stops it at its next step.
    pub fn stop(&self) {
        self.cancel.cancel();
    }

    /// As the page shows it.
    pub fn told(&self) -> api::Job {
        let present = self.at.present();
        let left = |f: &f64| (*f > 0.0).then(|| present.since.elapsed().as_secs_f64() * (1.0 - f) / f);
        api::Job {
            what: self.what.clone(),
            doing: present.what.clone(),
            fraction: present.fraction,
            step: self.at.steps.load(Ordering::Relaxed),
            seconds: self.began.elapsed().as_secs_f64(),
            left_s: present.fraction.as_ref().and_then(left),
            stopping: self.cancel.is_cancelled(),
        }
    }
}
