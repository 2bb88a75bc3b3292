//! Fewer samples, each the mean of its neighbours.
//!
//! All signals of a recording pass the same linear filter, so that the linear part of a model stays exact. What is not
//! linear does not: torque in proportion to i² would be smaller on alternating current, by the filter's gain squared,
//! than on direct current. So the filter has a gain of 1 − O((ωh)⁴): triangular weights over F intervals, whose second
//! moment (F² − 1)/6 is taken back by c = (F² − 1)/(12 F²) of the second difference of samples F apart.

/// How far the weights reach, in samples.
pub fn reach(factor: usize) -> usize {
    2 * factor - 1
}

/// Weights from −[`reach`] to [`reach`] for every `factor`-th sample; their sum is 1.
pub fn kernel(factor: usize) -> Vec<f64> {
    let (width, far) = (factor as f64, factor as isize);
    let triangle = |k: isize| (width - k.abs() as f64).max(0.0) / (width * width);
    let back = (width * width - 1.0) / (12.0 * width * width);
    let reach = reach(factor) as isize;
    (-reach..=reach)
        .map(|k| (1.0 + 2.0 * back) * triangle(k) - back * (triangle(k - far) + triangle(k + far)))
        .collect()
}

/// Every `factor`-th sample, averaged; beyond its ends a signal stays as it is.
pub fn average(signal: &[f64], factor: usize) -> Vec<f64> {
    let (kernel, reach, last) = (kernel(factor), reach(factor), signal.len() - 1);
    let at = |n: usize| {
        let sample = |k: usize| signal[(n + k).saturating_sub(reach).min(last)];
        kernel.iter().enumerate().map(|(k, w)| w * sample(k)).sum()
    };
    (0..signal.len()).step_by(factor).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gain_is_flat() {
        for factor in [2, 3, 4, 10] {
            // ωh of 50 Hz at 5 kHz; the fourth moment of the weights is below (2 F)⁴/12, which leaves (ωh)⁴/…, 1e-6.
            let omega = 0.0628 / factor as f64;
            let gain: f64 = kernel(factor)
                .iter()
                .enumerate()
                .map(|(k, w)| w * (omega * (k as f64 - reach(factor) as f64)).cos())
                .sum();
            assert!((gain - 1.0).abs() < 1e-5, "{factor}: {gain}");
        }
    }

    #[test]
    fn straight_lines_stay() {
        let line: Vec<f64> = (0..100).map(|n| 3.0 + 0.5 * f64::from(n)).collect();
        let averaged = average(&line, 4);
        assert_eq!(averaged.len(), 25);
        for (k, x) in averaged.iter().enumerate().filter(|(k, _)| (2..23).contains(k)) {
            assert!((x - line[4 * k]).abs() < 1e-12);
        }
    }
}
