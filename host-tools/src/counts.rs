//! A speed that was counted, pulses of an encoder in windows of one sampling interval or of several; or timed, from one
//! pulse to the next.
//!
//! Such a speed is the mean over the window that ended last, (θ(n) − θ(n − m))/(m h), in steps of one pulse a window,
//! `q = 2π/(N m h)` with N pulses a turn. The quantum tells it: m h q goes into a turn a whole number of times. m is
//! told by the samples at which the value changes, which lie a multiple of it apart.

use std::f64::consts::TAU;

/// Distance of a speed from a whole number of quanta, in quanta, that writing it down in few digits makes.
const ROUNDED: f64 = 0.02;
/// Share of the samples that have to be whole numbers of quanta, and of the changes that have to be at a window's ends.
const ALL_BUT_FEW: f64 = 0.99;
/// Least quantum, as a share of the largest speed: finer ones are those of a number with few digits.
const COARSE: f64 = 2e-3;
/// Most pulses a turn that are told by being a whole number: beyond, any number is whole within [`ROUNDED`].
const MOST_PULSES: f64 = 10_000.0;

/// Changes of a speed by timed pulses that are judged, and the share of them that has to be explained.
const PULSES: usize = 30;
const EXPLAINED: f64 = 0.9;
/// Chance of a coincidence that is not believed to be one.
pub const CHANCE: f64 = 1e-6;

/// Fewest changes that are judged: that all of them lie a multiple of two samples apart has a chance of less than one
/// in a million.
const FEWEST_CHANGES: usize = 21;
/// Share of the changes that lie a multiple of so many samples apart: a few rows may be lost or doubled.
const REGULAR: f64 = 0.95;

/// The quantum of a coarse speed, rad/s.
pub fn quantum(speed: &[f64]) -> Option<f64> {
    let largest = speed.iter().fold(0.0f64, |m, w| m.max(w.abs()));
    let changes = speed.windows(2).map(|w| (w[1] - w[0]).abs());
    let least = changes.filter(|d| *d > 0.5 * COARSE * largest).fold(f64::INFINITY, f64::min);
    let whole = |x: f64| ((x / least).round() - x / least).abs() < ROUNDED;
    let count = speed.iter().filter(|w| whole(**w)).count();
    (least.is_finite() && least > COARSE * largest && count as f64 >= ALL_BUT_FEW * speed.len() as f64).then_some(least)
}

/// A speed that is renewed every so many samples, and shown until then.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Samples from one value to the next.
    pub samples: usize,
    /// The first sample with a new value.
    pub first: usize,
    /// Whether a value is the mean over the window that it ends, or the speed at its end.
    pub is_mean: bool,
}

impl Window {
    /// From one sample to the next.
    pub const ONE: Self = Self { samples: 1, first: 0, is_mean: true };

    /// Of values that change only every so many samples; `None` if there are not enough changes to tell.
    pub fn of(values: &[f64]) -> Option<Self> {
        let window = Self::in_step_with(values, held_for(values)?);
        window.holds(values).then_some(window)
    }

    /// Of so many samples, in step with where most changes of a speed are.
    pub fn in_step_with(speed: &[f64], samples: usize) -> Self {
        let mut changes = vec![0usize; samples];
        (1..speed.len()).filter(|n| speed[*n] != speed[n - 1]).for_each(|n| changes[n % samples] += 1);
        let most = changes.iter().copied().max().unwrap_or(0);
        let first = changes.iter().position(|count| *count == most).unwrap_or(0);
        Self { samples, first, is_mean: true }
    }

    /// Whether a speed changes at its ends, and hardly elsewhere.
    pub fn holds(&self, speed: &[f64]) -> bool {
        let (mut changes, mut inside) = (0, 0);
        for n in (1..speed.len()).filter(|n| speed[*n] != speed[n - 1]) {
            changes += 1;
            inside += usize::from(!self.ends_at(n));
        }
        (inside as f64) <= (1.0 - ALL_BUT_FEW) * f64::from(changes)
    }

    /// Whether a new value is shown at a sample.
    pub fn ends_at(&self, n: usize) -> bool {
        n % self.samples == self.first
    }

    /// The same for a signal without its first samples.
    #[must_use]
    pub fn without_first(self, samples: usize) -> Self {
        let first = (self.first + self.samples - samples % self.samples) % self.samples;
        Self { first, ..self }
    }
}

/// The angle between two pulses, rad: as long as a value v is shown, L samples, the shaft turns by v L h. All but a few
/// changes come when that angle is through, to a sample on either side; by chance one of L/3 would.
pub fn angle_a_pulse(w: &[f64], interval_s: f64) -> Option<f64> {
    let changes: Vec<usize> = (1..w.len()).filter(|&n| w[n] != w[n - 1]).collect();
    // (samples that the value lasts, the value after: it is the mean speed over them)
    let runs: Vec<(f64, f64)> = changes
        .windows(2)
        .filter(|c| c[1] - c[0] >= 3)
        .map(|c| ((c[1] - c[0]) as f64, w[c[1]].abs()))
        .filter(|(_, v)| *v > 0.0)
        .collect();
    if runs.len() < PULSES || runs.len() * 2 < changes.len() {
        return None;
    }
    let mut angles: Vec<f64> = runs.iter().map(|(length, v)| length * v).collect();
    angles.sort_by(f64::total_cmp);
    let angle = angles[angles.len() / 2];
    let right = runs.iter().filter(|(length, v)| (angle / v - length).abs() <= 1.1).count() as f64;
    let (shortest, longest) = runs.iter().fold((f64::INFINITY, 0.0f64), |(a, b), r| (a.min(r.0), b.max(r.0)));
    let chance = (3.0 / (longest - shortest + 1.0)).powf(right.min(60.0));
    (right >= EXPLAINED * runs.len() as f64 && longest > shortest + 2.0 && chance < CHANCE)
        .then_some(angle * interval_s)
}

/// Samples for which each value is held: nearly all changes are a multiple of that many apart, which by chance has the
/// probability of one in that number each.
pub fn held_for(values: &[f64]) -> Option<usize> {
    let changes: Vec<usize> = (1..values.len()).filter(|&n| values[n] != values[n - 1]).collect();
    if changes.len() < FEWEST_CHANGES {
        return None;
    }
    let mut apart: Vec<usize> = changes.windows(2).map(|c| c[1] - c[0]).collect();
    apart.sort_unstable();
    let most = apart[apart.len() / 20];
    let is_regular = |samples: &usize| {
        let fits = apart.iter().filter(|d| *d % samples == 0).count() as f64;
        let surplus = fits - (1.0 - REGULAR) * apart.len() as f64;
        fits >= REGULAR * apart.len() as f64 && most as f64 * (*samples as f64).powf(-surplus) < CHANCE
    };
    (2..=most).rev().find(is_regular)
}

/// Pulses a turn of an encoder that is counted over windows of `interval_s`.
pub fn pulses_a_turn(speed: &[f64], interval_s: f64) -> Option<u32> {
    let pulses = TAU / (quantum(speed)? * interval_s);
    let is_whole = (pulses.round() - pulses).abs() < ROUNDED * pulses.sqrt().max(1.0);
    (is_whole && (1.0..MOST_PULSES).contains(&pulses.round())).then(|| pulses.round() as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_encoder_of_120_pulses_is_told_by_its_quantum() {
        // 50 rpm is one pulse of 120 a turn in 10 ms.
        let q = 50.0 * TAU / 60.0;
        let counted: Vec<f64> = (0..500).map(|n| q * (20.0 * (1.0 - (-0.02 * f64::from(n)).exp())).floor()).collect();
        assert_eq!(pulses_a_turn(&counted, 0.01), Some(120));
        let smooth: Vec<f64> = (0..500).map(|n| 100.0 * (1.0 - (-0.02 * f64::from(n)).exp())).collect();
        assert_eq!(pulses_a_turn(&smooth, 0.01), None);
    }

    #[test]
    fn a_window_is_told_by_when_the_values_change() {
        // A value every four samples, from the third on; some of them as the one before.
        let value = |n: i32| f64::from((n + 1) / 4 * ((n + 1) / 4) % 7);
        let held: Vec<f64> = (0..400).map(value).collect();
        let window = Window::of(&held).unwrap();
        assert_eq!((window.samples, window.first), (4, 3));
        assert!(window.ends_at(3) && window.ends_at(7) && !window.ends_at(8));
        let later = window.without_first(5);
        assert!(later.ends_at(7 - 5) && !later.ends_at(3), "{later:?}");
        assert_eq!(Window::of(&(0..400).map(f64::from).collect::<Vec<_>>()), None);
        assert_eq!(Window::of(&held[..60]), None, "too few changes");
    }

    #[test]
    fn a_row_that_is_lost_does_not_hide_a_hold_and_chance_makes_none() {
        let held: Vec<f64> = (0..2000).map(|n| f64::from(n / 5 * (n / 5) % 11)).collect();
        let mut lossy = held.clone();
        lossy.remove(1001);
        assert_eq!([held_for(&held), held_for(&lossy)], [Some(5); 2]);
        assert!(Window::of(&lossy).is_none(), "the second half has another phase");
        // Changes by chance: squares modulo a prime decide.
        let mut value = 0.0;
        let random: Vec<f64> = (0..2000_u32)
            .map(|n| {
                value += f64::from(u8::from(n * n % 1009 < 300));
                value
            })
            .collect();
        assert_eq!(held_for(&random), None);
    }

    #[test]
    fn pulses_of_sixty_a_turn_are_told_by_how_long_each_value_lasts() {
        // A run-up in 2 s to 30 rad/s: ω = 15 t, θ = 7.5 t². A pulse each 2π/60.
        let (h, step) = (1e-4, std::f64::consts::TAU / 60.0);
        let instants: Vec<f64> = (1..280).map(|k| (f64::from(k) * step / 7.5).sqrt()).collect();
        let mut speed = vec![0.0; 20_000];
        for pair in instants.windows(3) {
            let v = step / (pair[1] - pair[0]);
            let (from, to) = ((pair[1] / h).ceil() as usize, (pair[2] / h).ceil() as usize);
            speed[from.min(20_000)..to.min(20_000)].fill(v);
        }
        let angle = angle_a_pulse(&speed, h).unwrap();
        assert!((angle / step - 1.0).abs() < 0.02, "{angle}");
        let smooth: Vec<f64> = (0..20_000).map(|n| 15.0 * h * f64::from(n)).collect();
        assert_eq!(angle_a_pulse(&smooth, h), None);
    }
}
