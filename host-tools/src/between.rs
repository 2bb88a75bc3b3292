//! What the voltage does between its samples.
//!
//! A recording tells the voltage at instants an interval h apart. Where h is short beside the motor's time constants,
//! what happens in between hardly matters; where it is not, a supply that is held, one that is switched just after a
//! sample and one that is led in a straight line make currents that differ by their own size. The samples of current
//! and speed tell which it was: each sample is predicted from the one before, for each course of the voltage, and the
//! course with the smallest error of prediction is taken (the likelihood of the one-step error, both noises of unknown
//! size).
//!
//! | course | voltage over the interval that ends at sample n |
//! | --- | --- |
//! | smooth | a cubic through u(n − 2) … u(n + 1); hard edges as [`crate::edges`] finds them |
//! | linear | straight from u(n − 1) to u(n) |
//! | switched | u(n − 1), and u(n) for the last share f of the interval |
//!
//! f = 0 is a supply that is held from sample to sample, f = 1 one that is switched right after a sample, as of a
//! channel that shows the mean over the interval that ends with it; between the two lie edges at instants of their own.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::edges::Edge;

/// Sampling interval from which the data are asked, s. Below, the error of the smooth course stays below (h/τ)²/12 of a
/// motor whose time constant τ is 4 ms or more, one per mille, and [`crate::edges`] sees to switches.
pub const ASKED_FROM_S: f64 = 4e-4;

/// The same in the motor's own time constant: h R/L from which the current's bend after a switch is over before it can
/// be seen.
pub const ASKED_FROM_RATE: f64 = 0.5;

/// A share within this of 0 or 1 is that: two halvings of the last distance looked at.
const AT_AN_END: f64 = 0.02;

/// What the voltage does between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Between {
    /// A cubic through the neighbouring samples, with hard edges where the current saw them.
    #[default]
    Smooth,
    /// A straight line from sample to sample.
    Linear,
    /// Constant but for a jump, a share of an interval before each sample.
    Switched(f64),
}

/// The same, as users name it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Course {
    /// A cubic through the neighbouring samples, with hard edges where the current shows them
    Smooth,
    /// A straight line from sample to sample
    Linear,
    /// Held from each sample to the next
    Held,
    /// Each sample is the mean over the interval that it ends, or the supply is switched right after a sample
    Mean,
    /// Switched between samples, at a share of the interval that the data tell
    Edges,
}

impl fmt::Display for Course {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Smooth => "smooth",
            Self::Linear => "linear from sample to sample",
            Self::Held => "held from each sample to the next",
            Self::Mean => "switched right after a sample (or each sample the mean of the interval that it ends)",
            Self::Edges => "switched between samples",
        })
    }
}

impl From<Between> for Course {
    fn from(between: Between) -> Self {
        match between {
            Between::Smooth => Self::Smooth,
            Between::Linear => Self::Linear,
            Between::Switched(share) if share < AT_AN_END => Self::Held,
            Between::Switched(share) if share > 1.0 - AT_AN_END => Self::Mean,
            Between::Switched(_) => Self::Edges,
        }
    }
}

impl Course {
    /// As on the command line and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Smooth => "smooth",
            Self::Linear => "linear",
            Self::Held => "held",
            Self::Mean => "mean",
            Self::Edges => "edges",
        }
    }

    /// The same where no data tell more; of edges with the share of the interval by which they lie before a sample, or
    /// else half of it.
    pub fn between(self, share: Option<f64>) -> Between {
        match self {
            Self::Smooth => Between::Smooth,
            Self::Linear => Between::Linear,
            Self::Held => Between::Switched(0.0),
            Self::Mean => Between::Switched(1.0),
            Self::Edges => Between::Switched(share.unwrap_or(0.5).clamp(0.0, 1.0)),
        }
    }
}

impl Between {
    /// Share of the interval by which the supply is switched before a sample.
    pub fn share(self) -> Option<f64> {
        match self {
            Self::Switched(share) => Some(share),
            Self::Smooth | Self::Linear => None,
        }
    }

    /// Begin and end of the straight line that stands for the voltage over a piece of the interval that ends at sample
    /// `n`: where a jump lies within the piece, the line with its mean and its first moment.
    pub fn over(self, voltage: &[f64], n: usize, piece: usize, pieces: usize) -> [f64; 2] {
        let (before, after) = (voltage[n - 1], voltage[n]);
        let [from, to] = [piece, piece + 1].map(|k| k as f64 / pieces as f64);
        match self {
            Self::Smooth => [from, to].map(|s| cubic(voltage, n, s)),
            Self::Linear => [from, to].map(|s| before + s * (after - before)),
            Self::Switched(share) => {
                let since = ((to - (1.0 - share)) * pieces as f64).clamp(0.0, 1.0);
                let edge = Edge::switched(n, since, after - before, 0.0);
                [before + edge.begins, after + edge.ends]
            }
        }
    }
}

/// The cubic through four samples, a share of the interval after sample n − 1; straight at the ends of the signal.
pub fn cubic(voltage: &[f64], n: usize, s: f64) -> f64 {
    let (u1, u2) = (voltage[n - 1], voltage[n]);
    if n < 2 || n + 1 >= voltage.len() {
        return u1 + s * (u2 - u1);
    }
    let (u0, u3) = (voltage[n - 2], voltage[n + 1]);
    -s * (s - 1.0) * (s - 2.0) / 6.0 * u0 + (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0 * u1
        - (s + 1.0) * s * (s - 2.0) / 2.0 * u2
        + (s + 1.0) * s * (s - 1.0) / 6.0 * u3
}
