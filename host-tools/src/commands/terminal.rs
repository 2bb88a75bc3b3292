//! The terminal that the program runs at: Ctrl-C, bars of progress on stderr, and what is said beside the results.

use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

use crate::context::{CancelFlag, Context, Progress};
use crate::recording;

/// Length of a bar whose part is known.
const LENGTH: u64 = 1000;
/// A bar whose part is known, and one whose part is not.
const STYLES: [&str; 2] = ["{msg:32} [{bar:32}] {percent:>3} % {eta}", "{msg:32} {spinner} {elapsed}"];

/// The terminal.
#[derive(Debug, Default)]
pub struct Terminal {
    cancel: CancelFlag,
    /// One below the other.
    bars: MultiProgress,
}

impl Terminal {
    /// Takes Ctrl-C (and a polite kill) as the wish to stop the work at its next look instead of in the middle of a
    /// file, and keeps the messages of other people's decoders to itself that give up on a damaged file: the error says
    /// it.
    pub fn new() -> Self {
        let terminal = Self::default();
        let cancel = terminal.cancel.clone();
        // A second handler can only fail to install when one is there already, which is what is wanted.
        let _ = ctrlc::set_handler(move || cancel.cancel());
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !recording::is_decoding() {
                usual(info);
            }
        }));
        terminal
    }

    /// Work that ends with Ctrl-C, and of which nothing is shown.
    pub fn context(&self) -> Context {
        Context::of(self.cancel.clone())
    }

    /// The wish to stop.
    pub fn cancel_flag(&self) -> &CancelFlag {
        &self.cancel
    }

    /// Does something with a bar on stderr while it lasts, where that is a terminal.
    pub fn watching<T>(&self, what: &'static str, work: impl FnOnce(&Context) -> T) -> T {
        self.watching_with(what, |ctx, _| work(ctx))
    }

    /// The same; lines can be printed above the bar.
    pub fn watching_with<T>(&self, what: &'static str, work: impl FnOnce(&Context, &ProgressBar) -> T) -> T {
        let bar = self.bars.add(ProgressBar::new(LENGTH));
        let shown = Shown { what, bar: bar.clone(), is_known: AtomicBool::new(false) };
        shown.style(false);
        shown.at(what, None);
        let done = work(&self.context().watched(shown), &bar);
        bar.finish_and_clear();
        self.bars.remove(&bar);
        done
    }
}

/// What is shown of a job.
struct Shown {
    what: &'static str,
    bar: ProgressBar,
    /// Whether the part that is done is known.
    is_known: AtomicBool,
}

impl Shown {
    fn style(&self, is_known: bool) {
        if let Ok(style) = ProgressStyle::with_template(STYLES[usize::from(!is_known)]) {
            self.bar.set_style(style.progress_chars("=> "));
        }
    }
}

impl Progress for Shown {
    fn at(&self, doing: &str, fraction: Option<f64>) {
        let is_known = fraction.is_some();
        if self.is_known.swap(is_known, Ordering::Relaxed) != is_known {
            self.style(is_known);
        }
        self.bar.set_message(if doing == self.what { doing.to_owned() } else { format!("{}: {doing}", self.what) });
        match fraction {
            Some(fraction) => self.bar.set_position((fraction * LENGTH as f64) as u64),
            None => self.bar.tick(),
        }
    }

    fn goes_on_after(&self, error: &dyn std::error::Error) {
        self.bar.suspend(|| eprintln!("greyrig: {error}: trying again"));
    }
}
