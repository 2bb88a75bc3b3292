//! Whether told chances hold: of verdicts told at 90 to 97 %, 90 to 97 % are to be right.

use std::fmt;

use greyrig_host::report::panels::{Panel, Scale, panels};

use crate::score::Outcome;
use crate::share::Share;

/// Ends of the ranges of a told chance.
const RANGES: [f64; 5] = [0.5, 0.8, 0.9, 0.97, 1.0];

/// Verdicts whose chance was told in one range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Where it begins, and where it ends, 1.
    pub ends: [f64; 2],
    /// The told chance on average, 1.
    pub told: f64,
    /// How many hold.
    pub holds: Share,
}

/// How told chances agree with what holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Reliability {
    /// Ranges in which there are verdicts, from the lowest.
    pub ranges: Vec<Range>,
    /// Verdicts without a chance.
    pub silent: usize,
    /// Mean square of told chance less what holds, 1: 0 of an oracle, 0.25 of a coin (G. W. Brier, Verification of
    /// forecasts expressed in terms of probability, Monthly Weather Review 78 (1950) 1–3).
    pub brier: f64,
}

impl Reliability {
    /// Of chances and whether each verdict held.
    pub fn of(verdicts: &[(Option<f64>, bool)]) -> Self {
        let told: Vec<(f64, bool)> = verdicts.iter().filter_map(|(p, holds)| Some(((*p)?, *holds))).collect();
        let from = std::iter::once(0.0).chain(RANGES);
        let ranges = from.zip(RANGES).filter_map(|(from, to)| {
            let inside: Vec<(f64, bool)> = told.iter().filter(|(p, _)| *p > from && *p <= to).copied().collect();
            let mean = inside.iter().map(|(p, _)| p).sum::<f64>() / inside.len() as f64;
            let holds = Share::of(&inside, |(_, holds)| *holds);
            (!inside.is_empty()).then_some(Range { ends: [from, to], told: mean, holds })
        });
        let square = |(p, holds): &(f64, bool)| (p - f64::from(u8::from(*holds))).powi(2);
        Self {
            ranges: ranges.collect(),
            silent: verdicts.len() - told.len(),
            brier: told.iter().map(square).sum::<f64>() / told.len().max(1) as f64,
        }
    }

    /// Of the verdicts of an examination.
    pub fn of_outcomes<'a>(outcomes: impl IntoIterator<Item = &'a Outcome>) -> Self {
        Self::of(&outcomes.into_iter().map(|o| (o.probability, o.holds())).collect::<Vec<_>>())
    }

    /// The reliability diagram, as the text of an SVG file: what holds over what was told, with Wilson's intervals.
    pub fn figure(&self) -> String {
        let at = |of: &dyn Fn(&Range) -> f64| self.ranges.iter().map(|r| (r.told, of(r))).collect::<Vec<_>>();
        let mut band = at(&|r| r.holds.wilson()[0]);
        band.extend(at(&|r| r.holds.wilson()[1]).into_iter().rev());
        band.extend(band.first().copied());
        let panel = Panel {
            title: "Verdicts that hold".to_owned(),
            x: Scale::Linear("chance that was told".to_owned(), 0.0, 1.0),
            y: Scale::Linear("share that holds".to_owned(), 0.0, 1.0),
            curves: vec![at(&|r| r.holds.value()), vec![(0.0, 0.0), (1.0, 1.0)], band],
            marks: false,
        };
        panels(
            "Share of verdicts that hold over the chance that was told with them",
            &["share that holds", "as told", "95 % interval"],
            &[panel],
            1,
        )
    }
}

impl fmt::Display for Reliability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for Range { ends: [from, to], told, holds } in &self.ranges {
            writeln!(f, "told {from} … {to}, {told:.3} on average: holds {holds}")?;
        }
        write!(f, "Brier score {:.3}; {} without odds", self.brier, self.silent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: (0.4² + 0.05² + 0.95² + 0.01²)/4; one verdict without a chance counts nowhere.
    #[test]
    fn ranges_and_score_are_those_by_hand() {
        let verdicts = [(Some(0.6), true), (Some(0.95), true), (Some(0.95), false), (Some(0.99), true), (None, false)];
        let reliability = Reliability::of(&verdicts);
        let counted: Vec<_> = reliability.ranges.iter().map(|r| (r.ends, r.holds.hits, r.holds.cases)).collect();
        assert_eq!(counted, [([0.5, 0.8], 1, 1), ([0.9, 0.97], 1, 2), ([0.97, 1.0], 1, 1)]);
        assert!((reliability.brier - (0.16 + 0.0025 + 0.9025 + 0.0001) / 4.0).abs() < 1e-12);
        assert_eq!(reliability.silent, 1);
    }
}
