//! Hard edges of the voltage: when, between two samples, the supply was switched.
//!
//! The model takes the voltage as straight between samples. A supply that is switched within a sampling interval is
//! not, and the straight line then brings up to half an interval of the step too much or too little, a current of Δu
//! h/(2 L) that decays with L/R: like an inductance that depends on the current, or a late current channel. The samples
//! of the voltage do not tell when it was switched, those of the current do: before the edge it goes on as before,
//! after it bends away, and the two curves meet at the edge.
//!
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | h | sampling interval | s |
//! | Δu | step of the voltage between samples n − 1 and n, its neighbours standing still | V |
//! | f | share of that interval after the edge: 0 a supply that is switched at sample n, 1 at sample n − 1 | 1 |
//! | Δi' | change of the current's slope at the edge | A per interval |
//! | σ | standard deviation of f by the current's noise | 1 |
//!
//! f is where a straight line through the four currents before the edge meets a parabola through the four from sample n
//! on. Edges of one recording teach each other (empirical Bayes): they scatter with a variance v round a mean m, which
//! stand for f as far as σ leaves it open. A switching instant off by more than the interval, as of a late channel,
//! stays in the data.
//!
//! In place of the step the model gets the straight line over the interval that has its mean and its first moment, from
//! u(n − 1) + Δu (f − 3 f (1 − f)) to u(n − 1) + Δu (f + 3 f (1 − f)): what it drives through R and L is right to (h
//! R/L)³. The mean of the current over the interval is f (1 − f) Δi'/2 below that of its samples; the charge that the
//! trapezium rule lacks, over the edge and what decays after it, is h Δi' (1/12 − f (1 − f)/2) (Euler and Maclaurin).
//!
//! An edge that has passed an anti-alias filter bends the samples next to it, and is left as it is.

use crate::averaging;
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
/// Variance of the distance of the two curves half an interval before the edge, in that of the current's noise: 1.05 of
/// the straight line, 2.94 of the parabola.
const EXTRAPOLATION: f64 = 4.0;
/// Variance of a share without any noise.
const ROUNDING: f64 = 1e-6;
/// Farthest meeting that is looked for, in intervals.
const FARTHEST: f64 = 3.0;
/// Rounds of iterations that converge within three.
const ROUNDS: usize = 8;
/// Variance of a share of which nothing is known: evenly between 0 and 1.
pub(crate) const UNKNOWN: f64 = 1.0 / 12.0;

/// A sampling interval within which the voltage is not straight between its samples: the straight line over the
/// interval with its mean and first moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// The sample at its end.
    pub n: usize,
    /// Where the line begins, above the voltage of sample n − 1, V.
    pub begins: f64,
    /// Where it ends, above the voltage of sample n, V.
    pub ends: f64,
    /// Mean of the current over the interval, above that of its two samples, A.
    pub current: f64,
    /// What the trapezium rule lacks of the current's integral, over the edge and what decays after it, A intervals.
    pub charge: f64,
}

impl Edge {
    /// Of a voltage that steps (V) a `share` of the interval before sample `n`; the current's slope changes by `bend`
    /// (A per interval).
    pub(crate) fn switched(n: usize, share: f64, step: f64, bend: f64) -> Self {
        let both = share * (1.0 - share);
        Self {
            n,
            begins: step * (share - 3.0 * both),
            ends: step * (share + 3.0 * both - 1.0),
            current: -0.5 * both * bend,
            charge: bend * (1.0 / 12.0 - 0.5 * both),
        }
    }

    /// Mean of voltage (V) and current (A) over the interval.
    pub fn means(&self, voltage: &[f64], current: &[f64]) -> [f64; 2] {
        let samples = means(voltage, current, self.n);
        [samples[0] + 0.5 * (self.begins + self.ends), samples[1] + self.current]
    }
}

/// Mean of voltage (V) and current (A) over the interval that ends at sample `n`, straight between samples.
pub fn means(voltage: &[f64], current: &[f64], n: usize) -> [f64; 2] {
    [voltage, current].map(|signal| 0.5 * (signal[n - 1] + signal[n]))
}

/// The edge of the interval that ends at sample `n`, if there is one; `edges` in their order.
pub fn at(edges: &[Edge], n: usize) -> Option<&Edge> {
    edges.binary_search_by_key(&n, |e| e.n).ok().map(|k| &edges[k])
}

/// Share of an interval after an edge, as that edge alone tells it, and its variance.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Share {
    pub value: f64,
    pub variance: f64,
}

/// What the current tells of the instant of an edge.
#[derive(Debug, Clone, Copy)]
struct Meeting {
    /// The sample after the edge.
    n: usize,
    /// Share of the interval after the edge.
    share: Share,
    /// Change of the current's slope, A per interval.
    bend: f64,
}

/// Edges of a voltage, where the current saw them, in their order. `steady` tells at which samples the voltage drives a
/// current that was measured.
pub fn find(voltage: &[f64], current: &[f64], steady: impl Fn(usize) -> bool) -> Vec<Edge> {
    let meetings = meetings(voltage, current, steady);
    let shares: Vec<Share> = meetings.iter().map(|m| m.share).collect();
    let Some(common) = Common::of(&shares) else { return Vec::new() };
    let edge = |m: &Meeting| {
        let share = common.with(m.share).clamp(0.0, 1.0);
        Edge::switched(m.n, share, voltage[m.n] - voltage[m.n - 1], m.bend)
    };
    meetings.iter().map(edge).collect()
}

/// The edges after signals have been averaged by [`averaging::average`]: the intervals into which an edge was spread.
pub fn coarser(edges: &[Edge], voltage: &[f64], current: &[f64], factor: usize) -> Vec<Edge> {
    let (last, width) = (voltage.len() - 1, factor as f64);
    let sample = |signal: &[f64], n: isize| signal[n.clamp(0, last as isize) as usize];
    let kernel = averaging::kernel(factor);
    let reach = averaging::reach(factor);
    let averaged = |of: &dyn Fn(isize) -> f64, n: isize| -> f64 {
        kernel.iter().zip(n - reach as isize..).map(|(w, k)| w * of(k)).sum()
    };
    let excess = |n: isize| usize::try_from(n).ok().and_then(|n| at(edges, n));
    let begin = |n: isize| sample(voltage, n - 1) + excess(n).map_or(0.0, |e| e.begins);
    let end = |n: isize| sample(voltage, n) + excess(n).map_or(0.0, |e| e.ends);
    let middle = |n: isize| 0.5 * (sample(current, n - 1) + sample(current, n)) + excess(n).map_or(0.0, |e| e.current);
    let over = |n: usize| {
        let (from, to) = (((n - 1) * factor) as isize, (n * factor) as isize);
        let (mut mean, mut moment, mut mean_current) = (0.0, 0.0, 0.0);
        for fine in from + 1..=to {
            let [begins, ends] = [averaged(&begin, fine), averaged(&end, fine)];
            let centre = ((fine - from) as f64 - 0.5) / width - 0.5;
            mean += 0.5 * (begins + ends) / width;
            moment += (0.5 * (begins + ends) * centre + (ends - begins) / (12.0 * width)) / width;
            mean_current += averaged(&middle, fine) / width;
        }
        let kept = |signal: &[f64], n: isize| averaged(&|k| sample(signal, k), n);
        Edge {
            n,
            begins: mean - 6.0 * moment - kept(voltage, from),
            ends: mean + 6.0 * moment - kept(voltage, to),
            current: mean_current - 0.5 * (kept(current, from) + kept(current, to)),
            // Every sample weighs in the sum of the averages what it weighed before.
            charge: (from + 1..=to).filter_map(excess).map(|e| e.charge / width).sum(),
        }
    };
    let kept = last / factor;
    let mut spread: Vec<usize> = edges
        .iter()
        .flat_map(|e| e.n.saturating_sub(reach).div_ceil(factor).max(1)..=((e.n + reach - 1) / factor + 1).min(kept))
        .collect();
    spread.sort_unstable();
    spread.dedup();
    spread.into_iter().map(over).collect()
}

fn meetings(voltage: &[f64], current: &[f64], steady: impl Fn(usize) -> bool) -> Vec<Meeting> {
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
fn meeting(current: &[f64], n: usize, noise: f64) -> Option<Meeting> {
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
    let bend = bend(meeting);
    let variance = EXTRAPOLATION * (noise / bend).powi(2) + ROUNDING;
    variance.is_finite().then_some(Meeting { n, share: Share { value: -meeting, variance }, bend })
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

/// What the edges of a recording have in common: mean and variance of their shares.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Common {
    pub mean: f64,
    pub scatter: f64,
    /// Standard deviation of the mean.
    pub uncertain: f64,
}

impl Common {
    /// Of the shares of all edges; `None` without any.
    pub fn of(shares: &[Share]) -> Option<Self> {
        if shares.is_empty() {
            return None;
        }
        let (mut mean, mut scatter, mut weights) = (0.5, UNKNOWN, 0.0);
        for _ in 0..ROUNDS {
            let weight = |s: &Share| 1.0 / (s.variance + scatter);
            let sum = |of: &dyn Fn(&Share) -> f64| shares.iter().map(of).sum::<f64>();
            weights = sum(&|s| weight(s)) + 1.0 / UNKNOWN;
            mean = (sum(&|s| weight(s) * s.value) + 0.5 / UNKNOWN) / weights;
            let excess = sum(&|s| weight(s).powi(2) * ((s.value - mean).powi(2) - s.variance));
            scatter = (excess / sum(&|s| weight(s).powi(2))).clamp(0.0, UNKNOWN);
        }
        Some(Self { mean, scatter, uncertain: weights.recip().sqrt() })
    }

    /// An edge's share with what the others tell.
    pub fn with(&self, share: Share) -> f64 {
        (share.value * self.scatter + self.mean * share.variance) / (self.scatter + share.variance)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use greyrig::motor::{FluxLaw, Motor, Parameters};

    use super::*;
    use crate::experiment::{Experiment, Imposed};
    use crate::model::Filter;
    use crate::recording::{Channel, Recording};

    const INTERVAL_S: f64 = 1e-4;
    const RESISTANCE: f64 = 0.6;
    const NOISE_A: f64 = 0.01;

    /// Voltage and current of a resistance and an inductance; the supply steps every 20 ms, a share before the sample.
    /// Between its steps the current is known exactly: `i = u/R + (i₀ − u/R) e^(−t R/L)`.
    fn switched(inductance: f64, shares: &[f64], noise: f64) -> (Vec<f64>, Vec<f64>) {
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
        current.iter_mut().for_each(|i| *i += noise * normal());
        (voltage, current)
    }

    /// Largest excess of the voltage's mean over an edge, as a share of an interval times the step, over what it truly
    /// is.
    fn largest_error(inductance: f64, shares: &[f64]) -> f64 {
        let (sampled, current) = switched(inductance, shares, NOISE_A);
        let edges = find(&sampled, &current, |_| true);
        let error = |(k, share): (usize, &f64)| {
            let n = 100 + 200 * k;
            let [mean, _] = at(&edges, n).unwrap().means(&sampled, &current);
            ((mean - sampled[n - 1]) / (sampled[n] - sampled[n - 1]) - share).abs()
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
        let (sampled, current) = switched(5.0, &[0.0], NOISE_A);
        let edges = find(&sampled, &current, |_| true);
        assert!(edges.iter().all(|e| (e.begins + e.ends).abs() < 0.05 * 2.0 * 12.0));
    }

    #[test]
    fn the_free_run_follows_a_switched_supply() {
        let shares = [0.0, 0.2, 0.5, 0.7, 1.0];
        for (factor, inductance) in [(1, 6e-4), (2, 6e-4), (3, 6e-4), (2, 1.2e-3)] {
            let (e, motor) = locked(inductance, &shares);
            let e = e.coarser(factor);
            // A line with the step's mean and first moment leaves the second, (h R/L)³/6 of Δu/R at most; the stepper's
            // own error and what coarse samples take of an exponential are of that order, too.
            let steps = factor as f64 * INTERVAL_S * RESISTANCE / inductance;
            let within = 24.0 / RESISTANCE * steps.powi(3) / 6.0;
            let current = e.current.clone().unwrap();
            let mut largest = 0.0f64;
            e.run(&motor, e.substeps(&motor).unwrap(), Imposed::Nothing, |n, state| {
                largest = largest.max((state.current - current[n]).abs());
            })
            .unwrap();
            assert!(largest < within, "{factor} {inductance}: {largest} A, {within} A");
        }
    }

    #[test]
    fn the_free_run_follows_an_alternating_supply() {
        // i = 10 A sin ωt from rest and u = R i + L di/dt, 60 Hz at 5 kHz: straight lines lose (ωh)²/12 of the voltage,
        // 4.7e-4.
        let (omega, h, inductance) = (377.0, 2e-4, 6e-3);
        let (mut e, motor) = locked(inductance, &[0.0; 5]);
        let at = |n: usize| omega * h * n as f64;
        let current: Vec<f64> = (0..e.len()).map(|n| 10.0 * at(n).sin()).collect();
        e.input = (0..e.len()).map(|n| RESISTANCE * current[n] + inductance * omega * 10.0 * at(n).cos()).collect();
        (e.interval_s, e.start.current) = (h, 0.0);
        e.edges.clear();
        let mut largest = 0.0f64;
        e.run(&motor, 1, Imposed::Nothing, |n, state| largest = largest.max((state.current - current[n]).abs()))
            .unwrap();
        // A cubic leaves (ωh)⁴ · 11/720, 5e-7 of the voltage; the first interval, which has no cubic, (ωh)²/12 of L
        // di/dt h, 4e-4 A.
        assert!(largest < 5e-4, "{largest} A");
    }

    #[test]
    fn the_trapezium_rule_lacks_what_the_edges_say() {
        let (inductance, shares) = (6e-4, [0.0, 0.2, 0.5, 0.7, 1.0]);
        for factor in [1, 2, 4] {
            let (fine, _) = locked(inductance, &shares);
            let e = fine.coarser(factor);
            let current = e.current.clone().unwrap();
            // ∫i = (∫u − L i)/R; five time constants and more after the last edge the current rests.
            let end = (e.len() - 1) as f64 * e.interval_s;
            let mut volt_seconds = 0.0;
            for (k, share) in shares.iter().enumerate() {
                let n = 100 + 200 * k;
                volt_seconds += (fine.input[n] - fine.input[n - 1]) * (end - (n as f64 - share) * INTERVAL_S);
            }
            let exact = (volt_seconds - inductance * current[e.len() - 1]) / RESISTANCE;
            let inner: f64 = current.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).sum();
            let charge: f64 = e.edges.iter().map(|edge| edge.charge).sum();
            // The next term of Euler and Maclaurin is (h R/L)²/60 of this one, 2e-4; shares at which this one is small
            // have more.
            let lacking: f64 = e.edges.iter().map(|edge| edge.charge.abs()).sum();
            let left = exact / e.interval_s - inner - charge;
            assert!(left.abs() < 1e-3 * lacking, "{factor}: {left} of {lacking}");
        }
    }

    fn shares(values: &[f64], deviation: f64) -> Vec<Share> {
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let mut told = |value: f64| -> f64 {
            let z: f64 = StandardNormal.sample(&mut random);
            value + deviation * z
        };
        values.iter().map(|v| Share { value: told(*v), variance: deviation * deviation }).collect()
    }

    #[test]
    fn edges_that_are_one_instant_stand_for_each_other() {
        // Forty shares known to 0.05 tell their mean to 0.008; the prior of 1/2 takes a 1/1300 of the way.
        let all = shares(&[0.9; 40], 0.05);
        let common = Common::of(&all).unwrap();
        assert!((common.mean - 0.9).abs() < 0.025 && (common.uncertain - 0.008).abs() < 0.003, "{common:?}");
        // What is left as their own scatter is by chance: its variance is known to a fifth of 0.0025.
        assert!(common.scatter < 0.6 * 0.0025, "{common:?}");
        // One that alone tells 0.8 is taken for where the others are, but for what chance may be theirs.
        let odd = common.with(Share { value: 0.8, variance: 0.0025 });
        assert!((odd - common.mean).abs() < 0.04, "{odd}");
    }

    #[test]
    fn edges_that_have_nothing_in_common_keep_their_instants() {
        let values: Vec<f64> = (0..50).map(|k| (0.5 + f64::from(k)) / 50.0).collect();
        let common = Common::of(&shares(&values, 0.02)).unwrap();
        // Evenly over an interval: a variance of 1/12.
        assert!((common.scatter - 1.0 / 12.0).abs() < 0.015 && (common.mean - 0.5).abs() < 0.05, "{common:?}");
        // The prior of 1/12 takes 0.0004/(0.0004 + 1/12) of the distance of 0.4: 0.002.
        let own = common.with(Share { value: 0.1, variance: 4e-4 });
        assert!((own - 0.1).abs() < 0.004, "{own}");
    }

    #[test]
    fn smooth_voltages_have_no_edges() {
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
            assert!(find(&signal, &signal, |_| true).is_empty());
        }
    }

    /// A locked magnet motor whose supply was switched so long before the samples, without noise, with its edges as
    /// they were.
    fn locked(inductance: f64, shares: &[f64]) -> (Experiment, Motor<f64>) {
        let (voltage, current) = switched(inductance, shares, 0.0);
        let samples = voltage.len();
        let recording = Recording::builder(INTERVAL_S)
            .path("closed form")
            .channel(Channel::Voltage, voltage.clone())
            .channel(Channel::Current, current)
            .rotor_locked(vec![true; samples])
            .build()
            .unwrap();
        let mut e = Experiment::new(&recording, &Filter::default()).unwrap();
        e.edges = (0..shares.len())
            .map(|k| {
                let n = 100 + 200 * k;
                let step = voltage[n] - voltage[n - 1];
                Edge::switched(n, shares[k], step, step / inductance * INTERVAL_S)
            })
            .collect();
        let values = [RESISTANCE, inductance, 0.05, 1e-5, 0.0, 0.0, 0.0];
        let motor = Motor::build(Parameters::from_values(FluxLaw::PermanentMagnet, values), &[]).unwrap();
        (e, motor)
    }
}
