//! Work that takes time: without the interpreter's lock, watched, and stopped by Ctrl-C.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use greyrig_host::context::{CancelFlag, Context, Progress};
use greyrig_host::error::{Error, Result};
use pyo3::prelude::*;
use rayon::ThreadPoolBuilder;

use crate::trouble::{exception, fault, raised};

/// How often it is looked for Ctrl-C, and told how far the work is.
const LOOK: Duration = Duration::from_millis(50);
/// How long work that is to stop is waited for; it ends by itself, and what it would have answered is dropped.
const PATIENCE: Duration = Duration::from_millis(400);

/// Who watches, and how many threads work.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Watch {
    /// Called with what is being done and the part of it that is done, 0 to 1 or none.
    pub progress: Option<Py<PyAny>>,
    /// Threads; none: as many as there are processors.
    pub threads: Option<usize>,
}

/// How far the work is.
#[derive(Clone, Default)]
struct At(Arc<Mutex<(String, Option<f64>)>>);

impl At {
    fn present(&self) -> (String, Option<f64>) {
        // It is only shown.
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Progress for At {
    fn at(&self, doing: &str, fraction: Option<f64>) {
        let mut present = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        doing.clone_into(&mut present.0);
        present.1 = fraction;
    }
}

/// Does something on threads of its own while the interpreter does what else it has to. Signals and the watcher are
/// looked after by the thread that asks.
///
/// # Errors
/// Those of the work; what the watcher raises; Ctrl-C, for which the work has stopped or stops at its next look.
pub fn work<T: Send + 'static>(
    py: Python<'_>,
    watch: &Watch,
    job: impl FnOnce(&Context) -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let threads = watch.threads.unwrap_or(0);
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|e| Error::usage(format!("threads cannot be had: {e}"), "free some memory"));
    let pool = Arc::new(raised(py, pool)?);
    let (cancel, at) = (CancelFlag::default(), At::default());
    let context = Context::of(cancel.clone()).watched(at.clone()).on(Arc::clone(&pool));
    let (done, outcome) = channel();
    pool.spawn(move || {
        // Who has stopped waiting does not want it.
        let _ = done.send(catch_unwind(AssertUnwindSafe(|| job(&context))));
    });
    let outcome = Mutex::new(outcome);
    let wait = |time: Duration| py.detach(|| outcome.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(time));
    let mut told = (String::new(), None);
    loop {
        match wait(LOOK) {
            Ok(Ok(Ok(answer))) => return Ok(answer),
            Ok(Ok(Err(error))) => return Err(exception(py, &error)),
            Ok(Err(panic)) => return Err(fault(panic.as_ref())),
            Err(RecvTimeoutError::Disconnected) => return Err(fault(&"the work has vanished")),
            Err(RecvTimeoutError::Timeout) => {}
        }
        let present = at.present();
        let mut looked = py.check_signals();
        if let Some(progress) = watch.progress.as_ref().filter(|_| looked.is_ok() && present != told) {
            looked = progress.call1(py, (&present.0, present.1)).map(|_| ());
            told = present;
        }
        if let Err(stop) = looked {
            cancel.cancel();
            let _ = wait(PATIENCE);
            return Err(stop);
        }
    }
}
