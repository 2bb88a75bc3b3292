//! Where a prediction leaves what the fit has seen.

use serde::Serialize;

use crate::model::Range;
use crate::recording::Channel;

/// Share of the width of what was seen by which a value may lie beyond it: within that, each σ of the band grows by no
/// more. Two runs of the same profile differ by less.
const AS_GOOD_AS_INSIDE: f64 = 0.02;
/// Stretches of a quantity that lie closer together than this are one, s: several half-waves of any mains.
const ONE_STRETCH_S: f64 = 0.1;

/// A stretch of time in which a quantity lies beyond what was seen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stretch {
    /// Column of the quantity: `u_v`, `i_a` or `omega_rad_s`.
    pub quantity: &'static str,
    /// From, s.
    pub from_s: f64,
    /// To, s.
    pub to_s: f64,
    /// How far beyond the least or largest value that was seen, in the quantity's unit.
    pub beyond: f64,
    /// What was seen of it.
    pub seen: [f64; 2],
}

/// Where voltage (V), current (A) and speed (rad/s) lie beyond a range: each sample, and the stretches in their order.
/// What is no number is nowhere.
pub fn beyond(range: &Range, signals: [&[f64]; 3], start_s: f64, interval_s: f64) -> (Vec<bool>, Vec<Stretch>) {
    let mut flags = vec![false; signals[0].len()];
    let mut stretches: Vec<Stretch> = Vec::new();
    let ranges = [(Channel::Voltage, range.u_v), (Channel::Current, range.i_a), (Channel::Speed, range.omega_rad_s)];
    for ((channel, seen), signal) in ranges.into_iter().zip(signals) {
        let allowed = AS_GOOD_AS_INSIDE * (seen[1] - seen[0]);
        let mut open: Option<Stretch> = None;
        for (n, x) in signal.iter().enumerate() {
            let by = (seen[0] - x).max(x - seen[1]);
            if by.is_nan() || by <= allowed {
                continue;
            }
            flags[n] = true;
            let t = start_s + n as f64 * interval_s;
            match &mut open {
                Some(stretch) if t - stretch.to_s <= ONE_STRETCH_S => {
                    (stretch.to_s, stretch.beyond) = (t, stretch.beyond.max(by));
                }
                _ => {
                    let next = Stretch { quantity: channel.column(), from_s: t, to_s: t, beyond: by, seen };
                    stretches.extend(open.replace(next));
                }
            }
        }
        stretches.extend(open);
    }
    stretches.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    (flags, stretches)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_beyond_is_told_from_when_to_when_and_how_far() {
        let range = Range { u_v: [-10.0, 10.0], i_a: [0.0, 1.0], omega_rad_s: [0.0, 100.0] };
        // A sine of 50 Hz whose peaks are beyond for 0.1 s, and once more a second later; the current stays a hundredth
        // above what was seen.
        let h = 1e-3;
        let peak = |t: f64| if (1.0..1.1).contains(&t) || (2.0..2.1).contains(&t) { 12.0 } else { 10.0 };
        let times: Vec<f64> = (0..3000).map(|n| f64::from(n) * h).collect();
        let voltage: Vec<f64> = times.iter().map(|t| peak(*t) * (std::f64::consts::TAU * 50.0 * t).sin()).collect();
        let current = vec![1.01; times.len()];
        let mut speed = vec![50.0; times.len()];
        speed[7] = -3.0;
        let (flags, stretches) = beyond(&range, [&voltage, &current, &speed], 5.0, h);
        let found: Vec<(&str, f64)> = stretches.iter().map(|s| (s.quantity, s.from_s)).collect();
        assert_eq!(found.len(), 3, "{stretches:?}");
        assert_eq!(found[0], ("omega_rad_s", 5.0 + 7.0 * h));
        assert!((stretches[0].beyond - 3.0).abs() < 1e-12);
        for (stretch, from) in stretches[1..].iter().zip([6.0, 7.0]) {
            // The peaks of a sine that is sampled twenty times a period: its first one lies a quarter of one later.
            assert!((stretch.from_s - from - 0.005).abs() < 2.5e-3 && stretch.to_s < from + 0.1, "{stretch:?}");
            assert!((stretch.beyond - 2.0).abs() < 1e-9, "{stretch:?}");
        }
        assert!(flags[7] && !flags[8] && flags[1005] && !flags[1500]);
    }
}
