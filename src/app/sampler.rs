//! What the sampling interrupt does with a sample.

use super::fresh::begin;
use super::plausibility::Watch;
use super::ring::Words;
use super::shared::Shared;
use super::telemetry::Window;
use crate::detector::Verdict;
use crate::faults::Fault;
use crate::link::message::Judged;
use crate::motor::Constraints;
use crate::parameters::Active;
use crate::tick::Output;
use crate::units::Counts;

/// A raw sample with its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Raw {
    /// Samples before it since the start.
    pub number: u32,
    /// What the converter gave.
    pub counts: Counts,
}

impl Words<3> for Raw {
    fn to_words(&self) -> [u32; 3] {
        let Counts { voltage, current, speed } = self.counts;
        [self.number, u32::from(voltage) | u32::from(current) << 16, speed.into()]
    }

    fn from_words([number, pair, speed]: [u32; 3]) -> Self {
        Self { number, counts: Counts { voltage: pair as u16, current: (pair >> 16) as u16, speed: speed as u16 } }
    }
}

/// The interrupt's side of the application.
pub struct Sampler<'a> {
    /// As after a start, for the next test.
    fresh: Option<Active>,
    active: Option<Active>,
    test: Test,
    shared: &'a Shared,
    watch: Watch,
    window: Window,
    number: u32,
}

/// The test under way.
#[derive(Debug, Clone, Copy, Default)]
struct Test {
    number: u32,
    /// Its first sample.
    first: u32,
    /// Periods so far.
    periods: u32,
}

impl<'a> Sampler<'a> {
    /// With parameters, or in safe mode without.
    pub fn new(active: Option<Active>, shared: &'a Shared) -> Self {
        let watch = Watch::new(active.as_ref().map(|active| &active.calibration));
        let (fresh, test) = (active.clone(), Test { number: shared.test(), ..Test::default() });
        Self { fresh, active, test, shared, watch, window: Window::default(), number: 0 }
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
        let sample = active.calibration.sample(counts);
        let output = active.tick.process(sample, Constraints::FREE);
        if let Some(detector) = &mut active.detector
            && let Some(period) = detector.process(&sample, &output)
        {
            let verdict = detector.verdict();
            shared.judge(verdict);
            let Test { number: test, first, periods: index } = self.test;
            self.test.periods = index.wrapping_add(1);
            if shared.following()
                && !shared.judged.push(&Judged { test, first, index, sample: number, period, verdict })
            {
                shared.raise(Fault::TelemetryLost);
            }
        }
        let every = shared.report_every();
        if every == 0 {
            self.window = Window::default();
        } else {
            self.window.add(number, sample.voltage, &output);
            if self.window.count >= every {
                let full = core::mem::take(&mut self.window);
                if !shared.reports.push(&full) {
                    shared.raise(Fault::TelemetryLost);
                }
            }
        }
        Some(output)
    }

    /// Begins a test with this sample.
    fn begin(&mut self, counts: Counts, number: u32) {
        self.test = Test { number: self.shared.test(), first: number, periods: 0 };
        begin(&mut self.active, &self.fresh, counts);
        self.shared.judge(Verdict::CannotJudge);
    }
}
