//! Two jobs in one process: stopped apart, each with the bits that it has alone.

use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use greyrig_host::context::Context;
use greyrig_host::diagnose::{Options, diagnose};
use greyrig_host::error::{Error, Result};
use greyrig_host::identify::Settings;
use greyrig_host::model::Kind;
use greyrig_host::recording::Recording;
use greyrig_host::rig::Setup;

/// A job of its own threads, as many as there are processors.
fn job() -> Context {
    Context::quiet().on(Arc::new(rayon::ThreadPoolBuilder::new().build().expect("threads")))
}

fn diagnosed(recordings: &[Recording], ctx: &Context) -> Result<String> {
    let settings = Settings::new(Kind::Universal);
    let options = Options { settings, exclude: Vec::new(), candidates_refined: true };
    diagnose(recordings, &options, ctx).map(|d| format!("{d:?}"))
}

#[test]
fn of_two_diagnoses_one_is_stopped_and_the_other_ends_as_alone() {
    let setup =
        Setup::new(Kind::Universal).profile("staircase").unwrap().seconds(6.0).effect("saturation=0.4").unwrap();
    let recordings = [setup.run().unwrap().recording];
    let begin = Instant::now();
    let alone = diagnosed(&recordings, &Context::quiet()).unwrap();
    let whole = begin.elapsed();
    let stopped_after = |part: f64, kept: &Context| {
        let stopped = job();
        thread::scope(|scope| {
            let kept = scope.spawn(|| diagnosed(&recordings, kept));
            let other = scope.spawn(|| diagnosed(&recordings, &stopped));
            thread::sleep(whole.mul_f64(part));
            let asked = Instant::now();
            stopped.cancel_flag().cancel();
            let outcome = other.join().unwrap();
            assert!(matches!(outcome, Err(Error::Interrupted)), "{part}");
            // What a user takes for at once.
            assert!(asked.elapsed() < Duration::from_millis(500), "{part}: {:?}", asked.elapsed());
            assert_eq!(kept.join().unwrap().unwrap(), alone, "{part}");
        });
    };
    // Early in the search, and where it is at the free run.
    stopped_after(0.1, &job());
    stopped_after(0.6, &job());
}
