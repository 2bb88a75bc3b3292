//! The fourth-order Butterworth high-pass: what lies above the band of the model.
//!
//! Each of its two sections is a state-variable filter with trapezoidal integrators, of which the high-pass output is
//! taken: with g = tan(π fc/fs), damping k and states s1, s2,
//!
//! ```text
//! v3 = x − s2      v1 = a1 s1 + a2 v3      v2 = s2 + a2 s1 + a3 v3      y = x − k v1 − v2
//! s1 ← 2 v1 − s1   s2 ← 2 v2 − s2          a1 = 1/(1 + g k + g²), a2 = g a1, a3 = g² a1
//! ```
//!
//! so that |H(f)|² = 1 / (1 + (tan(π fc/fs)/tan(π f/fs))⁸).

use core::f64::consts::PI;

/// Dampings 2 cos θ of the poles at ±22.5° and ±67.5°, the more damped pair first.
const DAMPINGS: [f64; 2] = [1.847_759_065_022_573_5, 0.765_366_864_730_179_6];

/// One section's coefficients.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Section {
    k: f32,
    a1: f32,
    a2: f32,
    a3: f32,
}

/// A high-pass with its state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HighPass {
    sections: [Section; 2],
    states: [[f32; 2]; 2],
}

impl HighPass {
    /// With a cut-off (−3.01 dB) as a fraction of the sampling rate. `None` unless 0 < fraction < 0.5.
    pub fn new(cutoff_ratio: f64) -> Option<Self> {
        if !(cutoff_ratio > 0.0 && cutoff_ratio < 0.5) {
            return None;
        }
        let g = libm::tan(PI * cutoff_ratio);
        let sections = DAMPINGS.map(|k| {
            let a1 = 1.0 / (1.0 + g * k + g * g);
            Section { k: k as f32, a1: a1 as f32, a2: (g * a1) as f32, a3: (g * g * a1) as f32 }
        });
        Some(Self { sections, states: [[0.0; 2]; 2] })
    }

    /// The steady state of a constant input, whose output is zero.
    pub fn reset_to(&mut self, value: f32) {
        self.states = [[0.0, value], [0.0, 0.0]];
    }

    /// Takes a sample, gives what is above the cut-off. The sample has to be finite.
    #[inline]
    pub fn process(&mut self, sample: f32) -> f32 {
        let mut x = sample;
        for (c, [s1, s2]) in self.sections.iter().zip(&mut self.states) {
            let v3 = x - *s2;
            let v1 = c.a1 * *s1 + c.a2 * v3;
            let v2 = *s2 + c.a2 * *s1 + c.a3 * v3;
            *s1 = v1 + v1 - *s1;
            *s2 = v2 + v2 - *s2;
            x = x - c.k * v1 - v2;
        }
        x
    }
}
