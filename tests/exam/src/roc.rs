//! From scores to receiver operating characteristics and smallest detectable sizes.

/// The receiver operating characteristic: share of healthy motors called, and of faulty ones, as the threshold falls.
/// Of straight pieces only the ends.
pub fn characteristic(healthy: &[f64], faulty: &[f64]) -> Vec<(f64, f64)> {
    let mut thresholds: Vec<f64> = healthy.iter().chain(faulty).copied().collect();
    thresholds.sort_by(|a, b| b.total_cmp(a));
    let above = |scores: &[f64], t: f64| scores.iter().filter(|s| **s >= t).count() as f64 / scores.len().max(1) as f64;
    let mut curve = vec![(0.0, 0.0)];
    for point in thresholds.into_iter().map(|t| (above(healthy, t), above(faulty, t))) {
        if let [.., a, b] = curve.as_slice()
            && (a.0 == b.0 && b.0 == point.0 || a.1 == b.1 && b.1 == point.1)
        {
            curve.pop();
        }
        curve.push(point);
    }
    curve
}

/// The area below a characteristic: the chance that a faulty motor scores higher than a healthy one.
pub fn area(curve: &[(f64, f64)]) -> f64 {
    curve.windows(2).map(|w| (w[1].0 - w[0].0) * 0.5 * (w[0].1 + w[1].1)).sum()
}

/// The size at which a share of motors is detected, by straight lines in the logarithm of the size between the sizes
/// that were tried; none if not even the largest is. Sizes rise in magnitude; the smallest one, if already that detects
/// enough, is an upper bound.
pub fn size_for(share: f64, tried: &[(f64, f64)]) -> Option<f64> {
    // From the largest size down, so that a small one that was lucky does not count.
    let last_below = tried.iter().rposition(|(_, detected)| *detected < share);
    match last_below {
        None => tried.first().map(|(size, _)| size.abs()),
        Some(k) => {
            let ((a, low), (b, high)) = (*tried.get(k)?, *tried.get(k + 1)?);
            let part = (share - low) / (high - low);
            Some((a.abs().ln() + part * (b.abs() / a.abs()).ln()).exp())
        }
    }
}
