//! Arcs between brush and commutator: at random bar passages a drop of at least the minimum arc voltage, for part of
//! the passage. 24 bars; the chance grows with the current, and the number of passages with the speed. In the mean a
//! small drop, in the variance a band that follows |i ω|.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::{Assembly, Instant, VoltageDrop};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "brush_arcing",
    what: "arcs at some of the commutator bars",
    size: "fraction of bar passages that spark at nominal current",
    unit: "",
    forms: &[],
    universal: Sizes::new(0.1, 0.005, 1.0),
    pm_dc: Sizes::new(0.1, 0.005, 1.0),
    install: |size, _, rig| rig.drops.push(Box::new(Arcs::healthy(size, rig))),
};

/// Commutator bars.
const BARS: f64 = 24.0;

/// Random arcs, in operation.
pub struct Arcs {
    /// Chance of an arc at a bar passage, at nominal current.
    chance: f64,
    /// Arc voltage, V.
    voltage: f64,
    /// Part of a bar passage that an arc lasts.
    lasts: f64,
    /// Mean length of the bursts and of the gaps between them, s; none: no bursts.
    burst_s: Option<f64>,
    nominal_a: f64,
    onset_s: f64,
    rng: ChaCha8Rng,
    bursting: bool,
    left_s: f64,
}

impl Arcs {
    /// The light sparking of a motor in good order: 15 V, a third of a passage.
    pub fn healthy(chance: f64, rig: &Assembly) -> Self {
        Self {
            chance,
            voltage: 15.0,
            lasts: 0.33,
            burst_s: None,
            nominal_a: rig.motor.nameplate.rms_current_a,
            onset_s: 0.0,
            rng: rig.rng("brush_arcing"),
            bursting: true,
            left_s: 0.0,
        }
    }

    /// Brushes that bounce: 30 V for most of a passage, in bursts of 5 ms on average.
    pub fn faulty(chance: f64, onset_s: f64, rig: &Assembly) -> Self {
        Self {
            voltage: 30.0,
            lasts: 0.8,
            burst_s: Some(5e-3),
            onset_s,
            rng: rig.rng("sparking"),
            ..Self::healthy(chance, rig)
        }
    }
}

impl VoltageDrop for Arcs {
    fn volts(&self, i: f64, _omega: f64) -> f64 {
        // An arc needs a current; the slope keeps the equation smooth about zero.
        if self.left_s > 0.0 { self.voltage * (i / 0.05).tanh() } else { 0.0 }
    }
    fn tick(&mut self, dt: f64, now: &Instant) {
        self.left_s -= dt;
        if let Some(mean) = self.burst_s
            && self.rng.random::<f64>() < dt / mean
        {
            self.bursting = !self.bursting;
        }
        let passages = BARS * now.omega.abs() / TAU;
        if self.left_s <= 0.0 && self.bursting && now.t >= self.onset_s && self.rng.random::<f64>() < passages * dt {
            // Bursts fill half of the time.
            let chance = if self.burst_s.is_some() { 2.0 * self.chance } else { self.chance };
            if self.rng.random::<f64>() < chance * (now.i.abs() / self.nominal_a).min(1.0) {
                self.left_s = self.lasts / passages;
            }
        }
    }
}
