//! Clipped samples: a measuring range that was too small.
//!
//! A clipped channel rests at one value at the edge of its range while the quantity goes on. Resting there is not
//! enough of a reason: a constant channel, a locked rotor, a commanded voltage and a quantised but unclipped signal
//! rest, too. With *level* the largest (smallest) value, *q* the step of which all differences between values are
//! multiples (at least 10^-6 of the range), and *run* at least [`RUN`] equal samples at the level, any of three
//! observations counts:
//!
//! 1. **The noise vanishes.** Away from the level fewer than [`REPEATS`] of all neighbours are equal, and within
//!    [`WINDOW`] samples of the runs at least [`TURNS`] of the increments change their sign, so the channel is noisy,
//!    and yet there are two runs or more, with at least [`COUNT`] samples at the level. (A run of three at the extreme
//!    of Gaussian noise would need three draws in a row from the outermost quantum; a smooth peak does not change
//!    sign.)
//! 2. **The slope breaks off** (current, speed and torque, twice or more). Let w be the smaller of the run's length and
//!    [`WINDOW`]. On both sides the signal moves by more than [`FLAT_TOP`] q within w samples of the run; no step in it
//!    is more than 3/4 of that (a jump between two constants is a command, not a limit); and the nearer half holds at
//!    least 0.3 of it. A smooth peak quantised in steps of q stays at its top value for L samples if its curvature is 8
//!    q / L², which moves it by at most 8 q within the next L samples, and a decaying exponential puts less than 0.3
//!    into the nearer half.
//!
//! 3. **It rests there as nowhere else** (current, speed and torque). At least [`TURNS`] of all
//!    increments away from the level change their sign, and the longest run, [`LONG`] or more, is at least
//!    [`LONGER`] times the longest one between the two extremes. (The top of a smooth peak in quanta is 2.7 times as
//!    long as the step below it: 2 √1 against √3 − √1. A sensor that is silent at standstill shows zero.)
//!
//! Two things look alike, and are none:
//!
//! - **Rest.** A unipolar channel rests at zero as its motor does. A level within [`NEAR_ZERO`] of the range of zero is
//!   a rail of
//!   rest ([`one_sided`]), unless samples of both signs occur.
//! - **Counts.** Where steps are coarser than the noise (an encoder's edges in a window), any plateau is one value for
//!   long. Runs prove
//!   something only where noise is resolved: in [`RESOLVED`] or more of the stretches of [`WINDOW`] samples with a
//!   turn, the signal moves by more than one step. (Counts of a steady speed alternate between two values; Gaussian
//!   noise of half a step spans three in four of five such stretches.)
//!
//! The voltage is judged by the first observation only, because amplifiers do saturate: the voltage is then really
//! constant, and valid. A position is not judged; it rests at its end stops.

use super::Channel;

/// Shortest run of equal samples at the level.
pub const RUN: usize = 3;
/// Fewest samples at the level for the first observation.
pub const COUNT: usize = 8;
/// Largest share of equal neighbours of a noisy channel.
pub const REPEATS: f64 = 0.2;
/// Smallest share of increments that change their sign in noise. White noise on a constant has two thirds.
pub const TURNS: f64 = 0.1;
/// Samples before and after a run that are looked at.
pub const WINDOW: usize = 8;
/// Shortest run at the level for the third observation.
pub const LONG: usize = 20;
/// How much longer it is than any other.
pub const LONGER: usize = 4;
/// How far, in quanta, the signal moves within that window if its slope broke off.
pub const FLAT_TOP: f64 = 20.0;

/// A level that is this close to zero, as a share of the range, is that of rest: the offset error of a cheap amplifier.
pub const NEAR_ZERO: f64 = 0.01;
/// Share of stretches with a turn that span more than one step where noise is resolved.
pub const RESOLVED: f64 = 0.3;

/// A level at which a channel is clipped.
#[derive(Debug, Clone, PartialEq)]
pub struct Clipped {
    /// The level, in SI units.
    pub level: f64,
    /// The samples that hold it.
    pub samples: Vec<usize>,
}

/// Finds the levels, the upper one first.
pub fn find(channel: Channel, values: &[f64]) -> Vec<Clipped> {
    if channel == Channel::Angle || values.len() < 2 * RUN {
        return Vec::new();
    }
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
    let range = high - low;
    if !(range > 0.0 && range.is_finite()) {
        return Vec::new();
    }
    // Values computed from integer codes differ by rounding where the codes are equal steps apart.
    let quantum = quantum(values, 1e-6 * range);
    let resolved = noise_is_resolved(values, [high, low], quantum);
    [high, low]
        .into_iter()
        .filter(|&level| channel == Channel::Voltage || level.abs() > (NEAR_ZERO * range).max(quantum))
        .filter(|&level| at_level(channel, values, level, [high, low], quantum, resolved))
        .map(|level| Clipped { level, samples: (0..values.len()).filter(|&k| values[k] == level).collect() })
        .collect()
}

/// The level at which a channel rests because it cannot go below (above) it, where that is its rest.
pub fn one_sided(channel: Channel, values: &[f64]) -> Option<f64> {
    if matches!(channel, Channel::Angle | Channel::Voltage) || values.len() < 2 * RUN {
        return None;
    }
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
    let range = high - low;
    let quantum = quantum(values, 1e-6 * range);
    let rest = [low, high].into_iter().find(|level| level.abs() <= (NEAR_ZERO * range).max(quantum))?;
    let resting = values.windows(RUN).filter(|w| w.iter().all(|x| *x == rest)).count();
    let moving = values.windows(3).filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0).count();
    (range > 0.0 && resting >= COUNT && moving >= COUNT).then_some(rest)
}

/// Whether noise moves the channel by more than one step. Without steps it does.
fn noise_is_resolved(values: &[f64], extremes: [f64; 2], quantum: f64) -> bool {
    let (mut turning, mut wide) = (0_usize, 0_usize);
    for w in values.chunks_exact(WINDOW).filter(|w| !w.iter().any(|x| extremes.contains(x))) {
        let turns = w.windows(3).filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0).count();
        let (low, high) = w.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &x| (l.min(x), h.max(x)));
        turning += usize::from(turns > 0);
        wide += usize::from(turns > 0 && high - low > 1.5 * quantum);
    }
    turning == 0 || wide as f64 >= RESOLVED * turning as f64
}

/// The step of which all differences between values are multiples (Euclid), or `resolution` if there is none.
pub fn quantum(values: &[f64], resolution: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut step = 0.0_f64;
    for gap in sorted.windows(2).map(|w| w[1] - w[0]).filter(|&d| d > resolution) {
        let (mut a, mut b) = (step, gap);
        while b > resolution {
            // Rounding leaves a remainder just below the divisor as well as just above zero.
            let rest = (a - b * (a / b).round()).abs();
            (a, b) = (b, rest);
        }
        step = a;
        if step <= 2.0 * resolution {
            return resolution;
        }
    }
    step.max(resolution)
}

fn at_level(channel: Channel, values: &[f64], level: f64, extremes: [f64; 2], quantum: f64, resolved: bool) -> bool {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    let (mut count, mut k) = (0, 0);
    while k < values.len() {
        let start = k;
        while k < values.len() && values[k] == level {
            k += 1;
        }
        count += k - start;
        if k - start >= RUN {
            runs.push((start, k));
        }
        k = k.max(start + 1);
    }
    if channel != Channel::Voltage && resolved && rests_as_nowhere_else(values, extremes, &runs) {
        return true;
    }
    if runs.len() < 2 {
        return false;
    }
    let (mut pairs, mut equal) = (0_usize, 0_usize);
    for w in values.windows(2).filter(|w| w[0] != level || w[1] != level) {
        pairs += 1;
        equal += usize::from(w[0] == w[1]);
    }
    let noisy = (equal as f64) < REPEATS * pairs as f64;
    if noisy && resolved && count >= COUNT && turns_near(values, &runs) {
        return true;
    }
    channel != Channel::Voltage && runs.iter().filter(|&&run| slope_breaks_off(values, run, quantum)).count() >= 2
}

/// Whether a channel that is noisy elsewhere rests at one of its extremes much longer than between them.
fn rests_as_nowhere_else(values: &[f64], extremes: [f64; 2], runs: &[(usize, usize)]) -> bool {
    let longest = runs.iter().map(|(start, end)| end - start).max().unwrap_or(0);
    if longest < LONG {
        return false;
    }
    let between = |x: &f64| !extremes.contains(x);
    let elsewhere = values.chunk_by(|a, b| a == b).filter(|run| between(&run[0])).map(<[f64]>::len).max().unwrap_or(0);
    let away = values.windows(3).filter(|w| w.iter().all(between));
    let (mut triples, mut turns) = (0_usize, 0_usize);
    for w in away {
        triples += 1;
        turns += usize::from((w[1] - w[0]) * (w[2] - w[1]) < 0.0);
    }
    longest >= LONGER * elsewhere && turns as f64 >= TURNS * triples as f64 && turns > 0
}

/// Whether the increments beside the runs change their sign as noise does.
fn turns_near(values: &[f64], runs: &[(usize, usize)]) -> bool {
    let (mut pairs, mut turns) = (0_usize, 0_usize);
    for &(start, end) in runs {
        for side in [&values[start.saturating_sub(WINDOW)..start], &values[end..(end + WINDOW).min(values.len())]] {
            for w in side.windows(3) {
                pairs += 1;
                turns += usize::from((w[1] - w[0]) * (w[2] - w[1]) < 0.0);
            }
        }
    }
    turns as f64 >= TURNS * pairs as f64 && turns > 0
}

fn slope_breaks_off(values: &[f64], (start, end): (usize, usize), quantum: f64) -> bool {
    let w = (end - start).min(WINDOW);
    if start < w || end + w > values.len() {
        return false;
    }
    let level = values[start];
    let steep = |at: &dyn Fn(usize) -> f64| {
        let moved = (level - at(w)).abs();
        let nearer = (level - at(w.div_ceil(2))).abs();
        let largest = (1..=w).map(|k| (at(k) - at(k - 1)).abs()).fold(0.0, f64::max);
        moved > FLAT_TOP * quantum && largest <= 0.75 * moved && nearer >= 0.3 * moved
    };
    steep(&|k| values[start - k]) && steep(&|k| values[end - 1 + k])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise of a fixed sequence (Park and Miller's minimal standard generator, 1988), roughly Gaussian, deviation 1.
    struct Noise(u64);
    impl Noise {
        fn next(&mut self) -> f64 {
            let mut sum = 0.0;
            for _ in 0..12 {
                self.0 = self.0 * 16_807 % 2_147_483_647;
                sum += self.0 as f64 / 2_147_483_647.0;
            }
            sum - 6.0
        }
    }

    fn signal(n: usize, f: impl Fn(f64) -> f64, noise: f64, quantum: f64, limit: f64) -> Vec<f64> {
        let mut source = Noise(42);
        (0..n)
            .map(|k| {
                let x = (f(k as f64) + noise * source.next()).clamp(-limit, limit);
                if quantum > 0.0 { (x / quantum).round() * quantum } else { x }
            })
            .collect()
    }

    fn sine(period: f64, amplitude: f64) -> impl Fn(f64) -> f64 {
        move |k| amplitude * (std::f64::consts::TAU * k / period).sin()
    }

    #[test]
    fn clipped_signals_are_found() {
        // 12 bit over +-10, sine of 12: clipped for about 37 % of the time at each side.
        for (noise, quantum) in [(0.02, 20.0 / 4096.0), (0.0, 20.0 / 4096.0), (0.0, 0.0), (0.05, 0.0)] {
            let x = signal(5000, sine(500.0, 12.0), noise, quantum, 10.0);
            let found = find(Channel::Current, &x);
            assert_eq!(found.len(), 2, "noise {noise}, quantum {quantum}");
            let clipped = x.iter().filter(|v| v.abs() == x.iter().copied().fold(0.0, f64::max)).count();
            assert_eq!(found[0].samples.len() + found[1].samples.len(), clipped);
        }
        // A noisy voltage with one side cut.
        let x: Vec<f64> = signal(4000, sine(300.0, 9.0), 0.05, 0.005, 100.0).into_iter().map(|v| v.min(8.0)).collect();
        let found = find(Channel::Voltage, &x);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].level, 8.0);
    }

    #[test]
    fn a_single_inrush_that_clips_is_found() {
        // A converter of 12 bit whose noise is half a quantum: a third of all neighbours are equal.
        let quantum = 30.0 / 4096.0;
        let inrush = |k: f64| if k < 500.0 { 0.3 } else { 0.3 + 6.0 * (-(k - 500.0) / 170.0).exp() };
        let x: Vec<f64> = signal(8000, inrush, 0.5 * quantum, quantum, 1e9);
        assert_eq!(find(Channel::Current, &x), vec![]);
        let limit = (2.5 / quantum).round() * quantum;
        let clipped: Vec<f64> = x.iter().map(|i| i.min(limit)).collect();
        let found = find(Channel::Current, &clipped);
        assert_eq!(found.len(), 1);
        // 6 A fall to 2.2 A in 170 ln(6/2.2) = 171 samples.
        assert!((165..180).contains(&found[0].samples.len()), "{}", found[0].samples.len());
    }

    #[test]
    fn resting_signals_are_left_alone() {
        let constant = vec![3.0; 1000];
        let locked = vec![0.0; 1000];
        let command = signal(2000, |k| if (k as usize / 250).is_multiple_of(2) { 12.0 } else { -6.0 }, 0.0, 0.0, 100.0);
        let square: Vec<f64> = (0..2000).map(|k| if (k / 5) % 2 == 0 { 1.0 } else { 0.0 }).collect();
        for x in [&constant, &locked, &command, &square] {
            for channel in Channel::ALL {
                assert_eq!(find(channel, x), vec![], "{channel:?}");
            }
        }
        // Quantised, unclipped: coarse encoder speed, slow and fast sines, with and without noise.
        for (period, amplitude, quantum) in [
            (2000.0, 10.0, 0.767),
            (200.0, 100.0, 0.767),
            (50.0, 1.0, 0.005),
            (20.0, 1000.0, 1.0),
            (9000.0, 2000.0, 1.0),
        ] {
            for noise in [0.0, 0.3, 1.0, 3.0] {
                let x = signal(20_000, sine(period, amplitude), noise * quantum, quantum, 1e9);
                assert_eq!(find(Channel::Speed, &x), vec![], "period {period}, quantum {quantum}, noise {noise}");
            }
        }
        // A commanded sine, printed with four decimals.
        let command = signal(20_000, sine(4000.0, 12.0), 0.0, 1e-4, 1e9);
        assert_eq!(find(Channel::Voltage, &command), vec![]);
        // First-order steps that settle on a quantised value, again and again.
        for tau in [0.5, 1.0, 2.0, 5.0, 30.0] {
            let x = signal(
                8000,
                |k| {
                    let (cycle, at) = ((k as usize / 400) % 2, f64::from((k as u32) % 400));
                    let decay = (-at / tau).exp();
                    if cycle == 0 { 100.0 * (1.0 - decay) } else { 100.0 * decay }
                },
                0.0,
                0.1,
                1e9,
            );
            assert_eq!(find(Channel::Speed, &x), vec![], "tau {tau}");
        }
        // An encoder's speed, noisy until the rotor stands.
        let stop = signal(8000, |k| 300.0 * (1.0 - k / 4000.0).max(0.0), 0.0, 0.0, 1e9);
        let mut source = Noise(7);
        let stop: Vec<f64> = stop
            .iter()
            .map(|w| if *w > 0.0 { ((w + 2.0 * source.next()) / 0.77).round() * 0.77 } else { 0.0 })
            .collect();
        assert_eq!(find(Channel::Speed, &stop), vec![]);
        // A sampled voltage saturates because the amplifier does.
        let amplifier = signal(5000, sine(500.0, 30.0), 0.0, 0.0, 24.0);
        assert_eq!(find(Channel::Voltage, &amplifier), vec![]);
    }
}
