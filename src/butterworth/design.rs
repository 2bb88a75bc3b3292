//! From order and cut-off to the numbers that the recurrences need; equations in the [module above](super).

use core::f64::consts::PI;

use super::{MAX_ORDER, MAX_SECTIONS};

/// A checked filter, in `f64`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Design {
    order: u8,
    /// Pre-warped cut-off tan(π fc/fs).
    g: f64,
}

/// The coefficients of a second-order section.
#[derive(Debug, Clone, Copy)]
pub(super) struct Section {
    pub alpha: f64,
    pub beta: f64,
    pub gamma: f64,
}

impl Design {
    /// The caller has checked that the order and the ratio of cut-off to sampling rate are within their ranges.
    pub fn new(order: u8, cutoff_ratio: f64) -> Self {
        debug_assert!((1..=MAX_ORDER).contains(&order) && cutoff_ratio > 0.0 && cutoff_ratio < 0.5);
        Self { order, g: libm::tan(PI * cutoff_ratio) }
    }

    /// α of the first-order section, which odd orders have.
    pub fn first_order(&self) -> Option<f64> {
        (self.order % 2 == 1).then_some(self.g / (1.0 + self.g))
    }

    /// The second-order sections, the most damped first.
    pub fn second_order(&self) -> impl Iterator<Item = Section> {
        let g = self.g;
        self.dampings().map(move |k| {
            let d = 1.0 + g * k + g * g;
            Section { alpha: g / d, beta: g * g / d, gamma: (g * k + g * g) / d }
        })
    }

    pub fn second_order_sections(&self) -> heapless::Vec<[f64; 6], MAX_SECTIONS> {
        let g = self.g;
        let first = self.first_order().map(|alpha| [alpha, alpha, 0.0, 1.0, 2.0 * alpha - 1.0, 0.0]);
        let second = self.dampings().map(|k| {
            let d = 1.0 + g * k + g * g;
            let b = g * g / d;
            [b, 2.0 * b, b, 1.0, 2.0 * (g * g - 1.0) / d, (1.0 - g * k + g * g) / d]
        });
        first.into_iter().chain(second).collect()
    }

    /// Samples until the slowest pole's contribution has fallen to `level` of its start.
    pub fn decayed_after(&self, level: f64) -> u32 {
        let g = self.g;
        let first = (self.order % 2 == 1).then_some((1.0 - g) / (1.0 + g));
        let second = self.dampings().map(|k| libm::sqrt((1.0 - g * k + g * g) / (1.0 + g * k + g * g)));
        let slowest = first.into_iter().chain(second).fold(0.0, |radius: f64, pole| radius.max(pole.abs()));
        // A pole at zero decays at once; the delay of the cascade itself is at most its order.
        u32::from(self.order) + (libm::log(level) / libm::log(slowest)) as u32
    }

    /// Dampings k = 2 cos θ of the pairs of poles, falling.
    fn dampings(&self) -> impl Iterator<Item = f64> {
        let (order, odd) = (f64::from(self.order), self.order % 2);
        (0..self.order / 2).map(move |i| 2.0 * libm::cos(PI * f64::from(2 * i + 1 + odd) / (2.0 * order)))
    }
}
