//! A speed that was counted: pulses of an encoder in the window from one sample to the next.
//!
//! Such a speed is the mean over the window, (θ(n) − θ(n − 1))/h, in steps of one pulse a window, `q = 2π/(N h)` with N
//! pulses a turn. The quantum tells it: h q goes into a turn a whole number of times.

use std::f64::consts::TAU;

/// Distance of a speed from a whole number of quanta, in quanta, that writing it down in few digits makes.
const ROUNDED: f64 = 0.02;
/// Share of the samples that have to be whole numbers of quanta.
const ALL_BUT_FEW: f64 = 0.99;
/// Least quantum, as a share of the largest speed: finer ones are those of a number with few digits.
const COARSE: f64 = 2e-3;
/// Most pulses a turn that are told by being a whole number: beyond, any number is whole within [`ROUNDED`].
const MOST_PULSES: f64 = 10_000.0;

/// The quantum of a coarse speed, rad/s.
pub fn quantum(speed: &[f64]) -> Option<f64> {
    let largest = speed.iter().fold(0.0f64, |m, w| m.max(w.abs()));
    let changes = speed.windows(2).map(|w| (w[1] - w[0]).abs());
    let least = changes.filter(|d| *d > 0.5 * COARSE * largest).fold(f64::INFINITY, f64::min);
    let whole = |x: f64| ((x / least).round() - x / least).abs() < ROUNDED;
    let count = speed.iter().filter(|w| whole(**w)).count();
    (least.is_finite() && least > COARSE * largest && count as f64 >= ALL_BUT_FEW * speed.len() as f64).then_some(least)
}

/// Pulses a turn of an encoder that is counted from sample to sample.
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
}
