//! Hard edges of the voltage: when, between two samples, the supply was switched.
//!
//! The model takes the voltage as straight between samples. A supply that is switched within a sampling interval is not, and the
//! straight line then brings up to half an interval of the step too much or too little, a current of Δu h/(2 L) that decays with
//! L/R: like an inductance that depends on the current, or a late current channel. The samples of the voltage do not tell when it
//! was switched, those of the current do: before the edge it goes on as before, after it bends away, and the two curves meet at
//! the edge.
//!
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | h | sampling interval | s |
//! | Δu | step of the voltage between samples n − 1 and n, its neighbours standing still | V |
//! | f | share of that interval after the edge: 0 a supply that is switched at sample n, 1 at sample n − 1, ½ what a straight line does | 1 |
//! | σ | standard deviation of f by the current's noise | 1 |
//!
//! f is where a straight line through the four currents before the edge meets a parabola through the four from sample n
//! on. Edges of one recording teach each other (empirical Bayes): they scatter with a variance v round a mean m, which stand
//! for f as far as σ leaves it open. The voltage keeps its samples but one of the two, which takes (f − ½) Δu: then the mean over
//! the edge is right, and a switching instant off by more than an interval, as of a late channel, stays in the data.
//!
//! An edge that has passed an anti-alias filter bends the samples next to it, and is left as it is.

use crate::noise;

/// Samples of the current that tell its course before an edge.
const BEFORE: usize = 4;
/// And after it.
const AFTER: usize = 4;
/// Largest change of the voltage next to an edge, as a share of its step.
const STILL: f64 = 0.04;
/// Least step, as a share of the largest voltage.
const LEAST: f64 = 0.02;
/// The same in standard deviations of the voltage's noise.
const ABOVE_NOISE: f64 = 20.0;
/// Variance of the distance of the two curves half an interval before the edge, in that of the current's noise: 1.05 of the
/// straight line, 2.94 of the parabola.
const EXTRAPOLATION: f64 = 4.0;
/// Variance of a share without any noise.
const ROUNDING: f64 = 1e-6;
/// Farthest meeting that is looked for, in intervals.
const FARTHEST: f64 = 3.0;
/// Rounds of iterations that converge within three.
const ROUNDS: usize = 8;
/// Variance of a share of which nothing is known: evenly between 0 and 1.
const UNKNOWN: f64 = 1.0 / 12.0;

/// An edge and what the current tells of it.
#[derive(Debug, Clone, Copy)]
struct Edge {
    /// The sample after it.
    n: usize,
    /// Share of the interval after the edge, and its variance.
    share: f64,
    variance: f64,
}

/// Moves the hard edges of a voltage to where the current saw them. `steady` tells at which samples the voltage drives a current
/// that was measured.
pub fn place(voltage: &mut [f64], current: &[f64], steady: impl Fn(usize) -> bool) {
    let edges = find(voltage, current, steady);
    let Some((mean, scatter)) = in_common(&edges) else { return };
    let steps: Vec<f64> = edges.iter().map(|e| voltage[e.n] - voltage[e.n - 1]).collect();
    for (edge, step) in edges.iter().zip(steps) {
        let share = (edge.share * scatter + mean * edge.variance) / (scatter + edge.variance);
        let early = share.clamp(0.0, 1.0) - 0.5;
        voltage[if early > 0.0 { edge.n - 1 } else { edge.n }] += early * step;
    }
}

fn find(voltage: &[f64], current: &[f64], steady: impl Fn(usize) -> bool) -> Vec<Edge> {
    let largest = voltage.iter().fold(0.0f64, |m, u| m.max(u.abs()));
    let noise = noise::of_differences(voltage);
    let current_noise = noise::of_differences(current);
    let least = (LEAST * largest).max(ABOVE_NOISE * noise);
    let change = |n: usize| (voltage[n] - voltage[n - 1]).abs();
    (BEFORE..voltage.len().saturating_sub(AFTER))
        .filter(|n| change(*n) > least)
        .filter(|n| change(n - 1).max(change(n + 1)) < STILL * change(*n) + 4.0 * noise)
        .filter(|n| (n - BEFORE..n + AFTER).all(&steady))
        .filter_map(|n| meeting(current, n, current_noise))
        .collect()
}

/// Where the courses of the current before and after sample `n` meet.
fn meeting(current: &[f64], n: usize, noise: f64) -> Option<Edge> {
    let [a0, a1, _] = polynomial::<BEFORE>(&current[n - BEFORE..n], 1);
    // From the middle of the samples before the edge, and of those after it, to sample n.
    let to_n = 0.5 * (BEFORE + 1) as f64;
    let [b0, b1, b2] = polynomial::<AFTER>(&current[n..n + AFTER], 2);
    let centre = 0.5 * (AFTER - 1) as f64;
    let apart = |x: f64| b0 + (x - centre) * (b1 + (x - centre) * b2) - a0 - a1 * (x + to_n);
    let bend = |x: f64| b1 + 2.0 * b2 * (x - centre) - a1;
    let meeting = (0..ROUNDS).try_fold(0.0, |x: f64, _| {
        let next = x - apart(x) / bend(x);
        next.is_finite().then(|| next.clamp(-FARTHEST, FARTHEST))
    })?;
    let variance = EXTRAPOLATION * (noise / bend(meeting)).powi(2) + ROUNDING;
    variance.is_finite().then_some(Edge { n, share: -meeting, variance })
}

/// Least squares through equidistant values, round their middle: constant, slope and bend, of a degree of one or two.
fn polynomial<const N: usize>(values: &[f64], degree: usize) -> [f64; 3] {
    let at = |k: usize| k as f64 - 0.5 * (N - 1) as f64;
    let moment = |power: i32| (0..N).map(|k| at(k).powi(power)).sum::<f64>();
    let sum = |power: i32| values.iter().enumerate().map(|(k, y)| y * at(k).powi(power)).sum::<f64>();
    let (m0, m2, m4) = (moment(0), moment(2), moment(4));
    let bend = if degree < 2 { 0.0 } else { (m0 * sum(2) - m2 * sum(0)) / (m0 * m4 - m2 * m2) };
    [(sum(0) - bend * m2) / m0, sum(1) / m2, bend]
}

/// Mean and variance of the shares of all edges.
fn in_common(edges: &[Edge]) -> Option<(f64, f64)> {
    if edges.is_empty() {
        return None;
    }
    let (mut mean, mut scatter) = (0.5, UNKNOWN);
    for _ in 0..ROUNDS {
        let weight = |e: &Edge| 1.0 / (e.variance + scatter);
        let sum = |of: &dyn Fn(&Edge) -> f64| edges.iter().map(of).sum::<f64>();
        mean = (sum(&|e| weight(e) * e.share) + 0.5 / UNKNOWN) / (sum(&|e| weight(e)) + 1.0 / UNKNOWN);
        let excess = sum(&|e| weight(e).powi(2) * ((e.share - mean).powi(2) - e.variance));
        scatter = (excess / sum(&|e| weight(e).powi(2))).clamp(0.0, UNKNOWN);
    }
    Some((mean, scatter))
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const INTERVAL_S: f64 = 1e-4;
    const RESISTANCE: f64 = 0.6;
    const NOISE_A: f64 = 0.01;

    /// Voltage and current of a resistance and an inductance; the supply steps every 20 ms, a share before the sample.
    /// Between its steps the current is known exactly: `i = u/R + (i₀ − u/R) e^(−t R/L)`.
    fn switched(inductance: f64, shares: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let after = |from: f64, to: f64, intervals: f64| {
            to + (from - to) * (-intervals * INTERVAL_S * RESISTANCE / inductance).exp()
        };
        let (mut voltage, mut current) = (vec![0.0; 100], vec![0.0; 100]);
        let (mut level, mut i) = (0.0, 0.0);
        for (k, share) in shares.iter().enumerate() {
            let next = [12.0, -6.0, 9.0, -12.0, 3.0][k % 5];
            i = after(after(i, level / RESISTANCE, 1.0 - share), next / RESISTANCE, *share);
            level = next;
            for n in 0..200 {
                voltage.push(level);
                current.push(after(i, level / RESISTANCE, f64::from(n)));
            }
            i = after(i, level / RESISTANCE, 199.0);
        }
        current.iter_mut().for_each(|i| *i += NOISE_A * normal());
        (voltage, current)
    }

    /// Largest excess of the voltage's mean over an edge, as a share of an interval times the step, over what it truly is.
    fn largest_error(inductance: f64, shares: &[f64]) -> f64 {
        let (sampled, current) = switched(inductance, shares);
        let mut voltage = sampled.clone();
        place(&mut voltage, &current, |_| true);
        let error = |(k, share): (usize, &f64)| {
            let n = 100 + 200 * k;
            let step = sampled[n] - sampled[n - 1];
            // Each sample stands for the interval around it in the integral of straight lines.
            let moved = (voltage[n - 1] - sampled[n - 1] + voltage[n] - sampled[n]) / step;
            (0.5 + moved - share).abs()
        };
        shares.iter().enumerate().map(error).fold(0.0, f64::max)
    }

    #[test]
    fn a_supply_that_holds_its_voltage_is_recognised() {
        // Eight edges with σ = 2 · 0.01 A/(Δu h/L = 1 A and more) tell their common share to 0.01; the prior of ½ takes
        // σ²/8/(1/12) of ½, next to nothing; a parabola misses (h R/L)²/… of an exponential, 0.01.
        assert!(largest_error(6e-4, &[0.0; 8]) < 0.03);
        assert!(largest_error(6e-4, &[1.0; 8]) < 0.03);
    }

    #[test]
    fn edges_anywhere_are_found_one_by_one() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let shares: Vec<f64> = (0..20).map(|_| random.random::<f64>()).collect();
        // σ = 0.02 at the smallest step of 9 V, three of them for the worst of twenty.
        assert!(largest_error(6e-4, &shares) < 0.06);
    }

    #[test]
    fn a_current_that_hardly_bends_leaves_the_straight_line() {
        // An inductance so large that the noise hides the bend: nothing is known, and nothing is claimed.
        let (sampled, current) = switched(5.0, &[0.0]);
        let mut voltage = sampled.clone();
        place(&mut voltage, &current, |_| true);
        assert!(sampled.iter().zip(&voltage).all(|(a, b)| (a - b).abs() < 0.05 * 12.0));
    }

    #[test]
    fn smooth_voltages_keep_their_bits() {
        let voltage: Vec<f64> = (0..5000).map(|n| 325.0 * (0.031 * f64::from(n)).sin()).collect();
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let noisy: Vec<f64> = voltage
            .iter()
            .map(|u| {
                let z: f64 = StandardNormal.sample(&mut random);
                u + 0.1 * z
            })
            .collect();
        for signal in [voltage, noisy] {
            let mut placed = signal.clone();
            place(&mut placed, &signal, |_| true);
            assert_eq!(signal, placed);
        }
    }
}
