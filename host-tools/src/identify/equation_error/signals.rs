//! Current and speed at the motor, and what the balances want of them.

use std::borrow::Cow;

use greyrig::scalar::Scalar;

use crate::experiment::derivative;
use crate::identify::regression::SlidingMean;

/// The signals that balances are formed from, as they are before the measuring chain.
#[derive(Debug, Clone)]
pub struct Signals {
    /// Current, A.
    pub current: Vec<f64>,
    /// Speed, rad/s.
    pub speed: Vec<f64>,
    /// Central difference of the current, A/s.
    pub current_rate: Vec<f64>,
    /// The current without its noise's small reversals, A, which would wear a hysteresis loop down: what memories
    /// follow.
    pub turning: Vec<f64>,
    /// Change of the speed over each window, rad/s.
    pub speed_changes: Vec<f64>,
}

/// How signals are looked at.
#[derive(Debug)]
pub struct View {
    /// Sampling interval, s.
    pub interval_s: f64,
    /// Samples on either side over which the current is averaged before its reversals are looked for.
    pub averaged_beside: usize,
    /// Least reversal of that average that is none of noise, A.
    pub least_reversal: f64,
    /// First and last sample of each window of the torque balance.
    pub windows: Vec<(usize, usize)>,
    /// Samples over which the speed at a window's end is averaged.
    pub period: usize,
}

impl View {
    /// What the balances want of a current, A, and a speed, rad/s.
    pub fn of(&self, current: Vec<f64>, speed: Vec<f64>) -> Signals {
        Signals {
            current_rate: derivative(&current, self.interval_s),
            turning: without_small_reversals(&averaged(&current, self.averaged_beside), self.least_reversal),
            speed_changes: self.changes(&speed),
            current,
            speed,
        }
    }

    /// Change of a signal over each window, from the means over a period around its ends. That of the torque's integral
    /// is taken as that of the speed, which is averaged against its noise: where the torque jumps near a window's end
    /// the two would differ.
    pub fn changes(&self, signal: &[f64]) -> Vec<f64> {
        self.changes_of(&SlidingMean::new(signal, self.period))
    }

    /// The same from its means over a period.
    pub fn changes_of<S: Scalar>(&self, smooth: &SlidingMean<S>) -> Vec<S> {
        self.windows.iter().map(|(from, to)| smooth.at(*to) - smooth.at(*from)).collect()
    }
}

/// A signal averaged over so many samples on either side, without a delay.
fn averaged(signal: &[f64], beside: usize) -> Cow<'_, [f64]> {
    if beside == 0 {
        return signal.into();
    }
    let mean = SlidingMean::new(signal, 2 * beside);
    (0..signal.len()).map(|n| 0.5 * (mean.at(n) + mean.at(n + 1))).collect()
}

/// A signal without reversals smaller than `least`: it goes on with the signal, and turns back once that has come back
/// so far. (A play of that width would do the same and lag, as hysteresis does.)
fn without_small_reversals(signal: &[f64], least: f64) -> Vec<f64> {
    let mut held = signal.first().copied().unwrap_or(0.0);
    let mut direction = 0.0;
    signal
        .iter()
        .map(|x| {
            let further = x - held;
            if further * direction > 0.0 || further.abs() > least {
                (held, direction) = (*x, further.signum());
            }
            held
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_average_neither_lags_nor_bends_a_ramp() {
        let ramp: Vec<f64> = (0..20).map(f64::from).collect();
        for (n, mean) in averaged(&ramp, 3).iter().enumerate().take(17).skip(3) {
            assert!((mean - ramp[n]).abs() < 1e-12, "{n}: {mean}");
        }
        assert_eq!(*averaged(&ramp, 0), ramp);
    }

    #[test]
    fn small_reversals_are_left_out_and_nothing_lags() {
        let signal = [0.0, 1.0, 2.0, 1.9, 2.1, 2.0, 1.6, 1.0, 1.1, 0.5];
        assert_eq!(without_small_reversals(&signal, 0.3), [0.0, 1.0, 2.0, 2.0, 2.1, 2.1, 1.6, 1.0, 1.0, 0.5]);
    }
}
