//! Hysteresis of the iron: Prandtl–Ishlinskii, a sum of plays.
//!
//! ξ = (1/N) Σ y_k, y_k ← max(x − r_k, min(x + r_k, y_k)), radii spread evenly over 0 … 2 i_c: at large amplitude ξ
//! lags by the coercive current i_c, at small amplitude the loop is Rayleigh's. Independent of rate. Source:
//! Krasnosel'skii and Pokrovskii, Systems with Hysteresis, 1989.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::FluxHistory;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "hysteresis",
    what: "hysteresis of the iron: the flux lags the current by a fixed amount",
    size: "coercive current",
    unit: "A",
    forms: &[],
    universal: Sizes::new(0.15, 0.01, 2.0),
    pm_dc: None,
    install: |size, _, rig| rig.flux_history = Some(Box::new(Plays::new(size))),
};

/// Number of plays; the corners they leave are below 1 % of a coercive current.
const PLAYS: usize = 12;

struct Plays {
    radii: [f64; PLAYS],
    centres: [f64; PLAYS],
}

impl Plays {
    fn new(coercive: f64) -> Self {
        let step = 2.0 * coercive / PLAYS as f64;
        Self { radii: std::array::from_fn(|k| (k as f64 + 0.5) * step), centres: [0.0; PLAYS] }
    }
}

/// Where a play of radius r that was at y is dragged to by x. Comparisons instead of `clamp`, which checks its bounds,
/// and `max`, which treats NaN: this is the innermost loop.
#[inline]
fn play(y: f64, x: f64, r: f64) -> f64 {
    let (low, high) = (x - r, x + r);
    let y = if low > y { low } else { y };
    if high < y { high } else { y }
}

impl FluxHistory for Plays {
    fn value(&self, x: f64) -> f64 {
        let sum: f64 = self.radii.iter().zip(&self.centres).map(|(r, y)| play(*y, x, *r)).sum();
        sum / PLAYS as f64
    }
    fn slope(&self, x: f64, rising: bool) -> f64 {
        let moving = self.radii.iter().zip(&self.centres).fold(0.0, |sum, (r, y)| {
            // A play at its edge moves with x only outwards; rounding must not keep it from that.
            let outwards = if rising { x - y } else { y - x };
            sum + f64::from(u8::from(outwards >= r * (1.0 - 1e-12)))
        });
        moving / PLAYS as f64
    }
    fn commit(&mut self, x: f64) {
        for (y, r) in self.centres.iter_mut().zip(&self.radii) {
            *y = play(*y, x, *r);
        }
    }
}
