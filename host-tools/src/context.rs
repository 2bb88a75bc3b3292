//! What long work is given besides its data: whether to stop, whom to tell how far it is, and the threads to work on.
//!
//! Nothing here is of the whole process: two jobs with a context each run side by side, and one is stopped without the
//! other.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use rayon::ThreadPool;

/// A wish to stop, shared by whoever wishes it and the work that looks at it. Copies are of the same wish.
#[derive(Debug, Clone, Default)]
pub struct CancelFlag(Arc<AtomicBool>);

impl CancelFlag {
    /// Stops the work at its next look.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Takes the wish back: what comes now goes on until it is wished anew.
    pub fn clear(&self) {
        self.0.store(false, Ordering::Relaxed);
    }

    /// Whether the work is to stop.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// The work was to stop, and has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Interrupted;

/// Who is told how far work is, from any of its threads.
pub trait Progress: Send + Sync {
    /// What is being done, in a word or two, and the part of the whole that is done, 0 to 1, where that is known.
    fn at(&self, doing: &str, fraction: Option<f64>);

    /// Something went wrong, and the work tries again.
    fn goes_on_after(&self, _: &dyn std::error::Error) {}
}

/// Nobody.
struct Nobody;

impl Progress for Nobody {
    fn at(&self, _: &str, _: Option<f64>) {}
}

/// Whether to stop, whom to tell, and the threads to work on.
#[derive(Clone)]
pub struct Context {
    cancel: CancelFlag,
    progress: Arc<dyn Progress>,
    pool: Option<Arc<ThreadPool>>,
}

impl fmt::Debug for Context {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Context").field("cancel", &self.cancel).field("pool", &self.pool).finish_non_exhaustive()
    }
}

impl Default for Context {
    fn default() -> Self {
        Self::quiet()
    }
}

impl Context {
    /// Work that nobody stops and nobody watches, on the threads that all share.
    pub fn quiet() -> Self {
        Self::of(CancelFlag::default())
    }

    /// Work that ends with [`Interrupted`] once the flag is set.
    pub fn of(cancel: CancelFlag) -> Self {
        Self { cancel, progress: Arc::new(Nobody), pool: None }
    }

    /// The same work, watched.
    #[must_use]
    pub fn watched(self, progress: impl Progress + 'static) -> Self {
        Self { progress: Arc::new(progress), ..self }
    }

    /// The same work on threads of its own.
    #[must_use]
    pub fn on(self, pool: Arc<ThreadPool>) -> Self {
        Self { pool: Some(pool), ..self }
    }

    /// A part of this work of which nobody is told.
    #[must_use]
    pub fn quietly(&self) -> Self {
        Self { progress: Arc::new(Nobody), ..self.clone() }
    }

    /// The wish to stop.
    pub fn cancel_flag(&self) -> &CancelFlag {
        &self.cancel
    }

    /// Fails once the work is to stop. Long loops call this often.
    ///
    /// # Errors
    /// That.
    pub fn check(&self) -> Result<(), Interrupted> {
        if self.cancel.is_cancelled() { Err(Interrupted) } else { Ok(()) }
    }

    /// Tells what is being done.
    pub fn doing(&self, what: &str) {
        self.progress.at(what, None);
    }

    /// Tells what is being done, and the part of it that is done.
    pub fn at(&self, what: &str, fraction: f64) {
        self.progress.at(what, Some(fraction));
    }

    /// Tells of an error after which the work tries again.
    pub fn goes_on_after(&self, error: &dyn std::error::Error) {
        self.progress.goes_on_after(error);
    }

    /// Tells of a number of equal steps as they are done.
    pub fn steps(&self, what: &'static str, all: u64) -> Steps<'_> {
        Steps { context: self, what, all, done: AtomicU64::new(0) }
    }

    /// Does something on the threads of this work.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }
}

/// A number of equal steps, done from any thread.
pub struct Steps<'a> {
    context: &'a Context,
    what: &'static str,
    all: u64,
    done: AtomicU64,
}

impl Steps<'_> {
    /// One more is done.
    pub fn next(&self) {
        let done = 1 + self.done.fetch_add(1, Ordering::Relaxed);
        self.context.at(self.what, (done as f64 / self.all.max(1) as f64).min(1.0));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    /// What is being done, and the part of it that is done.
    type Told = (String, Option<f64>);

    #[derive(Clone, Default)]
    struct Heard(Arc<Mutex<Vec<Told>>>);

    impl Progress for Heard {
        fn at(&self, doing: &str, fraction: Option<f64>) {
            self.0.lock().unwrap().push((doing.to_owned(), fraction));
        }
    }

    #[test]
    fn one_job_is_stopped_without_the_other() {
        let (one, other) = (Context::quiet(), Context::quiet());
        let part = one.quietly();
        one.cancel_flag().cancel();
        assert_eq!(part.check(), Err(Interrupted), "a part of it stops, too");
        assert!(other.check().is_ok());
    }

    #[test]
    fn steps_are_told_as_a_part_of_the_whole() {
        let heard = Heard::default();
        let context = Context::quiet().watched(heard.clone());
        context.doing("reading");
        let steps = context.steps("runs", 2);
        (0..3).for_each(|_| steps.next());
        context.quietly().doing("unheard");
        let expected = [("reading", None), ("runs", Some(0.5)), ("runs", Some(1.0)), ("runs", Some(1.0))];
        assert_eq!(*heard.0.lock().unwrap(), expected.map(|(what, part)| (what.to_owned(), part)));
    }

    #[test]
    fn work_is_done_on_its_own_threads() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let context = Context::quiet().on(Arc::new(pool));
        assert_eq!(context.install(rayon::current_num_threads), 3);
    }
}
