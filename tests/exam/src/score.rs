//! What one case says, and what all say together.

use greyrig_host::diagnose::classes::same;
use greyrig_host::diagnose::{Diagnosis, Options, VerdictKind, diagnose};
use greyrig_host::error::Result;
use greyrig_host::identify::Settings;
use greyrig_host::model::Kind;
use serde::Serialize;

use crate::cases::{Case, STANDS_OUT};

/// The outcome of a case.
#[derive(Debug, Clone, Serialize)]
pub struct Outcome {
    /// Number of the case.
    pub seed: u64,
    /// Effects that the plant had.
    pub effects: Vec<String>,
    /// Their identifiers.
    pub truth: Vec<&'static str>,
    /// The verdict.
    pub kind: VerdictKind,
    /// The effects that it names.
    pub named: Vec<&'static str>,
    /// Free-run error-to-signal ratios before: current, speed.
    pub before: [f64; 2],
    /// And after.
    pub after: [f64; 2],
    /// Decoys tried, and how many of them would have been accepted.
    pub decoys: [usize; 2],
    /// Time, s.
    pub seconds: f64,
}

/// Diagnoses a case.
///
/// # Errors
/// An interrupt.
pub fn run(case: &Case) -> Result<Outcome> {
    let recordings = case.recordings()?;
    let options =
        Options { settings: Settings::new(Kind::Universal), exclude: case.exclude.clone(), candidates_refined: false };
    let start = std::time::Instant::now();
    let d: Diagnosis = diagnose(&recordings, &options, &mut |_| ())?;
    let pair = |p: greyrig_host::compare::PerSignal| [p.current.unwrap_or(0.0), p.speed.unwrap_or(0.0)];
    Ok(Outcome {
        seed: case.seed,
        effects: case.effects.clone(),
        truth: case.truth.clone(),
        kind: d.verdict.kind,
        named: d.verdict.effects.clone(),
        before: pair(d.esr_before),
        after: pair(d.esr_after),
        decoys: d.decoys,
        seconds: start.elapsed().as_secs_f64(),
    })
}

impl Outcome {
    /// Whether the effects' error stands out: at least three times the error of healthy motors, in current or speed.
    pub fn stands_out(&self, healthy: [f64; 2]) -> bool {
        (0..2).any(|k| self.before[k] >= STANDS_OUT * healthy[k]) || self.truth.contains(&"adc_clipping")
    }

    /// Whether the first effect named is the truth or of its class.
    pub fn first_right(&self) -> bool {
        self.named.first().is_some_and(|n| self.truth.iter().any(|t| same(n, t)))
    }

    /// Whether exactly the true effects are named, classes counting as one.
    pub fn exact(&self) -> bool {
        self.kind == VerdictKind::MissingEffect
            && self.named.len() == self.truth.len()
            && self.truth.iter().all(|t| self.named.iter().any(|n| same(n, t)))
    }

    /// Names that are right.
    pub fn hits(&self) -> usize {
        self.truth.iter().filter(|t| self.named.iter().any(|n| same(n, t))).count()
    }
}

/// A share with its 95 % Wilson interval.
///
/// Source: E. B. Wilson: Probable inference, the law of succession, and statistical inference, J. Am. Stat. Assoc. 22 (1927)
/// 209–212.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Share {
    /// Cases that count.
    pub hits: usize,
    /// Of how many.
    pub cases: usize,
}

impl Share {
    /// Of the items for which something holds.
    pub fn of<'a, T: 'a>(items: impl IntoIterator<Item = &'a T>, holds: impl Fn(&T) -> bool) -> Self {
        items.into_iter().fold(Self { hits: 0, cases: 0 }, |s, item| Self {
            hits: s.hits + usize::from(holds(item)),
            cases: s.cases + 1,
        })
    }

    /// The share itself.
    pub fn value(&self) -> f64 {
        self.hits as f64 / self.cases.max(1) as f64
    }

    /// The interval.
    pub fn wilson(&self) -> [f64; 2] {
        let (n, p, z) = (self.cases.max(1) as f64, self.value(), 1.96f64);
        let centre = p + z * z / (2.0 * n);
        let half = z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        [((centre - half) / (1.0 + z * z / n)).max(0.0), (centre + half) / (1.0 + z * z / n)]
    }
}

impl std::fmt::Display for Share {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [low, high] = self.wilson();
        write!(
            f,
            "{:.1} % ({}/{}; {:.1} … {:.1} %)",
            100.0 * self.value(),
            self.hits,
            self.cases,
            100.0 * low,
            100.0 * high
        )
    }
}
