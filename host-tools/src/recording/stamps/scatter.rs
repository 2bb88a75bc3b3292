//! Whether samples were taken when their scattered stamps say, or uniformly.
//!
//! Let e be a sample's height above the cubic through its two neighbours on either side, all taken at uniform instants,
//! and g the same of the stamps' deviations δ from these instants, in intervals. If the samples were taken at the
//! stamps, e = g dx/dn + noise; if not, e is noise alone. With β in e = β g dx/dn, the log-likelihood of the first over
//! that of the second is Λ = Σ(e² − (e − g dx/dn)²)/2σ² = (β − ½)/s², s the standard error of β. Beyond
//! [`DECIDED`] to either side the samples have decided.
//!
//! The slope dx/dn is taken twice, over one and over three samples to either side: their noises are independent of each
//! other and of e, so that β = Σ w g e s₃ / Σ w g² s₁ s₃ is biased neither by noise nor by its size (instrumental
//! variables, e.g. T. Söderström, P. Stoica: System Identification, 1989, ch. 8). The weights w are the inverse mean
//! squares of e around each sample, so that edges, where no cubic fits, count for nothing.

use super::placement::Placement;
/// Log-likelihood ratio from which samples have decided: odds of e¹⁰ = 22,000 to one.
pub const DECIDED: f64 = 10.0;
/// Samples to either side whose heights give a sample its weight.
const AROUND: usize = 8;
/// Samples to either side over which the slope is taken.
const REACH: usize = 3;

/// What the samples say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Taken {
    /// They were taken at their stamps.
    AsStamped,
    /// They were taken uniformly, and only printed then.
    Uniformly,
    /// Nothing: they do not change fast enough.
    Untold,
}

#[derive(Default)]
struct Sums {
    product: f64,
    square: f64,
    /// Of product and square, with residuals: Σ(w g s₃)² e², Σ(w g s₃)² e g s₁, Σ(w g s₃)² (g s₁)².
    errors: [f64; 3],
}

/// Judges by channels as they stand in the file.
pub fn judge<'a>(placement: &Placement, channels: impl Iterator<Item = &'a [f64]>) -> Taken {
    let Some(beside) = placement.beside.as_ref().filter(|b| b.scatter.is_some()) else { return Taken::Untold };
    let late: Vec<f64> = beside.stamps.iter().zip(&beside.smooth).map(|(a, b)| a - b).collect();
    let mut sums = Sums::default();
    for channel in channels {
        for stretch in &beside.stretches {
            add(&mut sums, &channel[stretch.clone()], &late[stretch.clone()]);
        }
    }
    if sums.square <= 0.0 {
        return Taken::Untold;
    }
    let share = sums.product / sums.square;
    let [e, cross, square] = sums.errors;
    let variance = (e - 2.0 * share * cross + share * share * square) / sums.square.powi(2);
    match (share - 0.5) / variance.max(f64::MIN_POSITIVE) {
        ratio if ratio > DECIDED => Taken::AsStamped,
        ratio if ratio < -DECIDED => Taken::Uniformly,
        _ => Taken::Untold,
    }
}

/// Height above the cubic through two neighbours on either side.
fn height(x: &[f64], n: usize) -> f64 {
    x[n] - (4.0 * (x[n - 1] + x[n + 1]) - x[n - 2] - x[n + 2]) / 6.0
}

fn add(sums: &mut Sums, x: &[f64], late: &[f64]) {
    if x.len() <= 2 * REACH {
        return;
    }
    let inside = REACH..x.len() - REACH;
    let heights: Vec<f64> = inside.clone().map(|n| height(x, n)).collect();
    let mut squares = vec![0.0];
    for e in &heights {
        squares.push(squares[squares.len() - 1] + if e.is_finite() { e * e } else { 0.0 });
    }
    for (k, (n, e)) in inside.zip(&heights).enumerate() {
        let (from, to) = (k.saturating_sub(AROUND), (k + AROUND + 1).min(heights.len()));
        let usual = ((squares[to] - squares[from]) / (to - from) as f64).max(0.0).sqrt();
        let (e, g) = (e / usual, height(late, n));
        let [near, far] = [1, REACH].map(|k| (x[n + k] - x[n - k]) / (2 * k) as f64 / usual);
        if ![e, near, far].iter().all(|x| x.is_finite()) {
            continue;
        }
        let (told, weight) = (g * near, g * far);
        sums.product += weight * e;
        sums.square += weight * told;
        let squared = weight * weight;
        [e * e, e * told, told * told].into_iter().zip(&mut sums.errors).for_each(|(x, sum)| *sum += squared * x);
    }
}
