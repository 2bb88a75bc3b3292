//! A signal at any zoom: its least and largest value in each of a number of equal stretches.
//!
//! Level k holds the extremes of 16ᵏ samples each, so that a stretch of any length takes a few look-ups and no spike
//! is ever lost.

/// Samples of a level that make one of the next.
const FACTOR: usize = 16;

/// A signal with its extremes.
#[derive(Debug, Clone, Default)]
pub struct Pyramid {
    base: Vec<f32>,
    levels: Vec<Vec<[f32; 2]>>,
}

/// Nothing yet: the least and the largest of no samples.
const NOTHING: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

/// NaN, which stands for no sample, changes nothing.
fn joined(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

impl Pyramid {
    /// Of samples; NaN where there is none.
    pub fn new(base: Vec<f32>) -> Self {
        let mut levels: Vec<Vec<[f32; 2]>> = Vec::new();
        let joined_all = |part: &[[f32; 2]]| part.iter().fold(NOTHING, |all, one| joined(all, *one));
        if base.len() > FACTOR {
            let of_samples = |part: &[f32]| part.iter().fold(NOTHING, |all, x| joined(all, [*x, *x]));
            levels.push(base.chunks(FACTOR).map(of_samples).collect());
        }
        while let Some(below) = levels.last().filter(|level| level.len() > FACTOR) {
            let next = below.chunks(FACTOR).map(joined_all).collect();
            levels.push(next);
        }
        Self { base, levels }
    }

    /// The samples.
    pub fn samples(&self) -> &[f32] {
        &self.base
    }

    fn at(&self, level: usize, place: usize) -> [f32; 2] {
        match level.checked_sub(1) {
            None => [self.base[place]; 2],
            Some(level) => self.levels[level][place],
        }
    }

    /// Least and largest of the samples from one to before another; NaN where there is none.
    pub fn extremes(&self, from: usize, to: usize) -> [f32; 2] {
        let (mut low, mut high) = (from, to.min(self.base.len()));
        let (mut level, mut found) = (0, NOTHING);
        while low < high {
            let is_top = level == self.levels.len();
            while low < high && (is_top || low % FACTOR != 0) {
                found = joined(found, self.at(level, low));
                low += 1;
            }
            while low < high && high % FACTOR != 0 {
                high -= 1;
                found = joined(found, self.at(level, high));
            }
            (low, high, level) = (low / FACTOR, high / FACTOR, level + 1);
        }
        if found[0] > found[1] { [f32::NAN; 2] } else { found }
    }
}

/// A signal over time.
#[derive(Debug, Clone, Default)]
pub struct Curve {
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Sampling interval, s.
    pub step_s: f64,
    /// The samples.
    pub pyramid: Pyramid,
}

/// A stretch of a signal as it is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// Time of the first sample of the first stretch, s.
    pub from_s: f64,
    /// Time from one to the next, s.
    pub step_s: f64,
    /// Samples in each.
    pub samples: u32,
    /// Least value in each.
    pub least: Vec<f32>,
    /// Largest value in each.
    pub largest: Vec<f32>,
}

/// The most stretches that are given at once.
const MOST: usize = 16_384;

impl Curve {
    /// Its RMS over each of the periods that follow one another, which are taken as whole numbers of samples, at their
    /// middles; NaN where there is no sample.
    pub fn rms(&self, period_s: f64) -> Self {
        let each = ((period_s / self.step_s).round().max(1.0) as usize).clamp(1, self.pyramid.base.len().max(1));
        let of = |part: &[f32]| {
            let usable = || part.iter().filter(|x| !x.is_nan()).map(|x| f64::from(*x));
            let (sum, count) = usable().fold((0.0, 0u32), |(sum, count), x| (sum + x * x, count + 1));
            (sum / f64::from(count)).sqrt() as f32
        };
        let step_s = each as f64 * self.step_s;
        let pyramid = Pyramid::new(self.pyramid.base.chunks_exact(each).map(of).collect());
        Self { start_s: self.start_s + step_s / 2.0, step_s, pyramid }
    }

    /// What is between two times, in at most so many stretches and one at each end, whose bounds do not move as one
    /// pans.
    pub fn window(&self, from_s: f64, to_s: f64, stretches: usize) -> Window {
        let all = self.pyramid.base.len();
        let place = |t: f64| (((t - self.start_s) / self.step_s).floor().max(0.0) as usize).min(all);
        let (from, to) = (place(from_s), (place(to_s) + 2).min(all));
        let each = to.saturating_sub(from).div_ceil(stretches.clamp(1, MOST)).max(1);
        let from = from / each * each;
        let starts = (from..to.max(from)).step_by(each);
        let (least, largest) = starts.map(|k| self.pyramid.extremes(k, k + each)).map(|[a, b]| (a, b)).unzip();
        Window {
            from_s: self.start_s + from as f64 * self.step_s,
            step_s: each as f64 * self.step_s,
            samples: u32::try_from(each).unwrap_or(u32::MAX),
            least,
            largest,
        }
    }
}

impl Window {
    /// Little-endian: layout 1 and count as u32, first time and step as f64, samples in each as u32, four bytes of
    /// nothing, then the least and after them the largest values as f32.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(32 + 8 * self.least.len());
        let count = u32::try_from(self.least.len()).unwrap_or(u32::MAX);
        bytes.extend([1, count].iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([self.from_s, self.step_s].iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend([self.samples, 0].iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend(self.least.iter().chain(&self.largest).flat_map(|x| x.to_le_bytes()));
        bytes
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn extremes_are_those_of_the_samples(
            samples in prop::collection::vec(prop_oneof![9 => -1e3f32..1e3, 1 => Just(f32::NAN)], 1..5000),
            ends in (0usize..5000, 0usize..5000),
        ) {
            let (from, to) = (ends.0.min(ends.1).min(samples.len()), ends.0.max(ends.1).min(samples.len()));
            let usable = || samples[from..to].iter().copied().filter(|x| !x.is_nan());
            let found = Pyramid::new(samples.clone()).extremes(from, to);
            match usable().reduce(f32::min) {
                None => prop_assert!(found[0].is_nan() && found[1].is_nan()),
                Some(least) => prop_assert_eq!(found, [least, usable().reduce(f32::max).expect("there is one")]),
            }
        }
    }

    #[test]
    fn the_rms_of_a_sine_is_its_amplitude_over_the_root_of_two() {
        let sine = (0..10_000).map(|n| 325.0 * (n as f32 * 1e-4 * 50.0 * std::f32::consts::TAU).sin());
        let mut samples: Vec<f32> = sine.collect();
        samples[..200].fill(f32::NAN);
        let curve = Curve { start_s: 2.0, step_s: 1e-4, pyramid: Pyramid::new(samples) }.rms(0.02);
        let (first, rest) = curve.pyramid.samples().split_first().expect("periods");
        assert!(first.is_nan() && rest.len() == 49, "a period without samples has none");
        // Single precision of 200 squares.
        assert!(rest.iter().all(|x| (x / 229.81 - 1.0).abs() < 1e-4), "{rest:?}");
        assert!((curve.start_s - 2.01).abs() < 1e-9 && (curve.step_s - 0.02).abs() < 1e-9);
    }

    #[test]
    fn a_spike_is_in_every_window_that_holds_it() {
        let mut samples = vec![0.0; 600_000];
        samples[123_457] = 40.0;
        let curve = Curve { start_s: 0.0, step_s: 1e-4, pyramid: Pyramid::new(samples) };
        for (from_s, to_s) in [(0.0, 60.0), (12.0, 13.0), (12.345, 12.346)] {
            let window = curve.window(from_s, to_s, 1000);
            assert!(window.least.len() <= 1002 && window.largest.contains(&40.0), "{from_s} to {to_s}");
            assert_eq!(window.bytes().len(), 32 + 8 * window.least.len());
            let k = window.largest.iter().position(|x| *x == 40.0).expect("it is there") as f64;
            let at = window.from_s + k * window.step_s;
            assert!((at..at + window.step_s + 1e-9).contains(&12.345_7), "{at}");
        }
        assert!(curve.window(70.0, 80.0, 100).least.len() <= 1, "there is nothing beyond the end");
    }
}
