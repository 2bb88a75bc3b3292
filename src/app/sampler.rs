//! What the sampling interrupt does with a sample.

use super::fresh::begin;
use super::judged::{self, HEAD};
use super::plausibility::Watch;
use super::raw::Raw;
use super::shared::Shared;
use super::telemetry::Window;
use crate::detector::{Detector, Progress, Verdict};
use crate::faults::Fault;
use crate::hardware::Hardware;
use crate::motor::Constraints;
use crate::parameters::Active;
use crate::tick::Output;
use crate::units::Counts;

/// The interrupt's side of the application. In this order, as in [`Tick`](crate::tick::Tick).
#[repr(C)]
pub struct Sampler<'a> {
    shared: &'a Shared,
    number: u32,
    window: Window,
    test: Test,
    watch: Watch,
    active: Option<Active>,
    /// As after a start, for the next test.
    fresh: Option<Active>,
}

/// The test under way.
#[derive(Debug, Clone, Copy, Default)]
struct Test {
    number: u32,
    /// Its first sample.
    first: u32,
    /// Periods so far.
    periods: u32,
    /// The sample with which the last one was judged.
    judged: u32,
    telling: Telling,
}

/// What of a judged period is still to be put into the queue.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
enum Telling {
    #[default]
    Nothing,
    All,
    Features,
}

impl<'a> Sampler<'a> {
    /// With parameters, or in safe mode without.
    pub fn new(active: Option<Active>, shared: &'a Shared, hardware: &Hardware) -> Self {
        let watch = Watch::new(active.as_ref().map(|active| &active.calibration), hardware);
        let (fresh, test) = (active.clone(), Test { number: shared.test(), ..Test::default() });
        Self { shared, number: 0, window: Window::default(), test, watch, active, fresh }
    }

    /// Takes a sample; `skipped` is how many the converter has given since the last call that nobody took: they have a
    /// number, too. Gives measured and modelled signals, but not in safe mode.
    #[inline]
    pub fn sample(&mut self, counts: Counts, skipped: u32) -> Option<Output> {
        let (shared, number) = (self.shared, self.number.wrapping_add(skipped));
        self.number = number.wrapping_add(1);
        shared.count_sample(self.number);
        if skipped > 0 {
            shared.raise(Fault::TickOverrun);
        }
        if shared.capturing() && !shared.raw.push(&Raw { number, counts }) {
            shared.raise(Fault::CaptureLost);
        }
        self.watch.look(counts, |fault| shared.raise(fault));
        if self.test.number != shared.test() {
            self.begin(counts, number);
        }
        let active = self.active.as_mut()?;
        let output = active.tick.process(active.calibration.sample(counts), Constraints::FREE);
        let progress = active.detector.as_mut().map_or(Progress::Idle, |detector| detector.advance(&output));
        let every = shared.report_every();
        let window = self.window.with(number, &output);
        // A report, too, waits where the tick took longer.
        if window.count < every + u32::from(output.crossed_zero) {
            self.window = window;
        } else {
            if every > 0 && !shared.reports.push(&window) {
                shared.raise(Fault::TelemetryLost);
            }
            self.window = Window::default();
        }
        match progress {
            Progress::Told => self.judge(number),
            Progress::Idle if self.test.telling != Telling::Nothing => self.tell(),
            _ => {}
        }
        Some(output)
    }

    /// Begins a test with this sample.
    fn begin(&mut self, counts: Counts, number: u32) {
        self.test = Test { number: self.shared.test(), first: number, ..Test::default() };
        begin(&mut self.active, &self.fresh, counts);
        self.shared.judge(Verdict::CannotJudge);
    }

    /// Shows the verdict with which a period has been judged.
    #[inline]
    fn judge(&mut self, number: u32) {
        let Some(detector) = self.detector() else { return };
        self.shared.judge(detector.verdict());
        self.test.judged = number;
        self.test.periods = self.test.periods.wrapping_add(1);
        self.test.telling = if self.shared.following() { Telling::All } else { Telling::Nothing };
    }

    /// Puts the next part of a judged period into the queue.
    #[inline]
    fn tell(&mut self) {
        let Some(detector) = self.detector() else { return };
        let (Test { number, first, periods, judged, telling }, queue) = (self.test, &self.shared.judged);
        self.test.telling = if telling == Telling::All {
            let numbers = [number, first, periods.wrapping_sub(1), judged];
            if queue.write(0, judged::head(numbers, detector.period(), detector.verdict())) {
                Telling::Features
            } else {
                self.shared.raise(Fault::TelemetryLost);
                Telling::Nothing
            }
        } else {
            if queue.write(HEAD, judged::features(detector.period())) {
                queue.add();
            }
            Telling::Nothing
        };
    }

    fn detector(&self) -> Option<&Detector> {
        self.active.as_ref()?.detector.as_ref()
    }
}
