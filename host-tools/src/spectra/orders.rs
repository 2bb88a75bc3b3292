//! A signal over the angle of the rotor in place of time: what turns with it stands still there.

use std::f64::consts::TAU;

/// Share of the largest speed below which the rotor counts as standing: there a turn takes so long that no number of
/// samples a turn would do for both.
const STANDS: f64 = 0.1;
/// Samples of a turn, as powers of two: 16 and 1024.
const OF_A_TURN: (f64, f64) = (4.0, 10.0);

/// A signal at equal steps of the rotor's angle, and how many a turn: a power of two that leaves out no sample at the
/// lowest speed that counts. `speed` in rad/s, either direction; linear in between. Where the rotor stands, or where
/// there is no sample, a NaN separates what is before and behind. None: it never turns.
pub fn at_angles(values: &[f32], speed: &[f32], interval_s: f64) -> Option<(Vec<f32>, f64)> {
    let largest = speed.iter().filter(|w| w.is_finite()).fold(0.0f32, |most, w| most.max(w.abs()));
    let slowest = STANDS * f64::from(largest);
    if slowest <= 0.0 {
        return None;
    }
    let wanted = (TAU / (slowest * interval_s)).log2().ceil().clamp(OF_A_TURN.0, OF_A_TURN.1);
    let per_turn = wanted.exp2();
    let mut out = Vec::new();
    // Angle since the last step that was written, in steps.
    let mut since = 0.0;
    for n in 1..values.len().min(speed.len()) {
        let turned = 0.5 * f64::from(speed[n - 1].abs() + speed[n].abs()) * interval_s * per_turn / TAU;
        let [from, to] = [values[n - 1], values[n]];
        let counts = f64::from(speed[n].abs()) >= slowest && from.is_finite() && to.is_finite() && turned.is_finite();
        if !counts {
            if out.last().is_some_and(|last: &f32| last.is_finite()) {
                out.push(f32::NAN);
            }
            since = 0.0;
            continue;
        }
        let begin = since;
        since += turned;
        let mut next = begin.floor() + 1.0;
        while next <= since {
            let share = (next - begin) / turned;
            out.push(from + ((f64::from(to) - f64::from(from)) * share) as f32);
            next += 1.0;
        }
    }
    Some((out, per_turn))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectra::density;

    #[test]
    fn what_turns_with_the_rotor_stands_still_while_it_runs_up() {
        // From 100 to 300 rad/s within 20 s, with a wave of three periods a turn.
        let (interval, count) = (1e-4, 200_000);
        let speed: Vec<f32> = (0..count).map(|n| 100.0 + 200.0 * n as f32 / count as f32).collect();
        let angle = |n: usize| {
            let t = n as f64 * interval;
            100.0 * t + 0.5 * 200.0 / (count as f64 * interval) * t * t
        };
        let wave: Vec<f32> = (0..count).map(|n| (3.0 * angle(n)).sin() as f32).collect();
        let (at, per_turn) = at_angles(&wave, &speed, interval).unwrap();
        // 4000 rad over 2π are 636.6 turns.
        assert!((at.len() as f64 / per_turn - 4000.0 / TAU).abs() < 0.1, "{} steps", at.len());
        let d = density(&at, per_turn).unwrap();
        let near = |order: f64| {
            let k = (order / d.step).round() as usize;
            d.power[k - 3..=k + 3].iter().sum::<f64>() * d.step
        };
        // All of its power, 1/2, stands at the third order; the same wave over time is spread over 96 Hz.
        assert!((near(3.0) - 0.5).abs() < 0.01, "{}", near(3.0));
        assert!(near(2.0) < 1e-6 && near(4.0) < 1e-6);
    }

    #[test]
    fn a_rotor_that_stands_has_no_angle() {
        assert_eq!(at_angles(&[1.0; 100], &[0.0; 100], 1e-4), None);
        let mut speed = vec![200.0; 1000];
        speed[400..600].fill(0.0);
        let (at, _) = at_angles(&vec![1.0; 1000], &speed, 1e-3).unwrap();
        assert_eq!(at.iter().filter(|x| x.is_nan()).count(), 1, "one gap, where it stood");
    }
}
