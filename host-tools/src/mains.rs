//! The period of an alternating supply, found from the recorded voltage.

/// A supply slower than this is a slow profile, not mains, Hz.
const LOWEST_HZ: f64 = 10.0;
/// Nor is one faster than this, Hz.
const HIGHEST_HZ: f64 = 500.0;
/// Scatter of the periods, relative to their median, up to which the supply counts as periodic.
const LARGEST_SCATTER: f64 = 0.05;

/// The mains period in seconds, or `None` for DC and anything without a steady period.
///
/// Rising zero crossings are counted with a hysteresis of a tenth of the peak voltage, so that neither noise nor the
/// intervals of a phase-angle control without current count.
pub fn period_s(voltage: &[f64], sample_time_s: f64) -> Option<f64> {
    let peak = voltage.iter().fold(0.0f64, |peak, u| peak.max(u.abs()));
    let threshold = 0.1 * peak;
    let mut crossings = Vec::new();
    let mut below = false;
    for (n, u) in voltage.iter().enumerate() {
        if *u < -threshold {
            below = true;
        } else if *u > threshold && below {
            below = false;
            crossings.push(n as f64);
        }
    }
    let mut periods: Vec<f64> = crossings.windows(2).map(|c| c[1] - c[0]).collect();
    if periods.len() < 4 {
        return None;
    }
    periods.sort_by(f64::total_cmp);
    let median = periods[periods.len() / 2];
    let close = periods.iter().filter(|p| (*p - median).abs() <= (LARGEST_SCATTER * median).max(1.0)).count();
    let usual: Vec<f64> =
        periods.iter().copied().filter(|p| (p - median).abs() <= (LARGEST_SCATTER * median).max(1.0)).collect();
    let mean = usual.iter().sum::<f64>() / usual.len() as f64 * sample_time_s;
    let steady = close * 10 >= periods.len() * 9;
    (steady && (1.0 / HIGHEST_HZ..=1.0 / LOWEST_HZ).contains(&mean)).then_some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(hertz: f64, samples: usize) -> Vec<f64> {
        (0..samples).map(|n| (std::f64::consts::TAU * hertz * n as f64 * 1e-4).sin()).collect()
    }

    #[test]
    fn finds_mains_and_rejects_the_rest() {
        // Whole samples per crossing leave half a sample over ten thousand: 50 and 60 Hz to 0.1 %.
        assert!((period_s(&sine(50.0, 10_000), 1e-4).unwrap() - 0.02).abs() < 2e-5);
        assert!((period_s(&sine(60.0, 10_000), 1e-4).unwrap() - 1.0 / 60.0).abs() < 2e-5);
        assert_eq!(period_s(&sine(0.5, 100_000), 1e-4), None, "a slow profile");
        assert_eq!(period_s(&vec![24.0; 10_000], 1e-4), None, "DC");
        assert_eq!(period_s(&[], 1e-4), None);
    }
}
