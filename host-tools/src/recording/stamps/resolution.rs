//! How finely stamps are printed, and whether that alone makes them scatter.

/// Share of the resolution by which rounding moves a stamp to either side, with a margin for the straight line through
/// them.
const HALF: f64 = 0.5 * 1.2;

/// What the last digit of stamps is worth, s: a decimal one, or that of the numbers themselves (seconds since 1970 in
/// double precision tell 0.24 µs).
pub fn of(t: &[f64]) -> f64 {
    let largest = t.iter().fold(0.0f64, |m, t| m.max(t.abs()));
    let decimal = |digits: i32| {
        let scale = 10f64.powi(digits);
        // A product with a power of ten is off by a few units in the last place.
        let rounding = 1e-3_f64.max(4.0 * f64::EPSILON * largest * scale);
        rounding < 0.1 && t.iter().all(|t| (t * scale - (t * scale).round()).abs() <= rounding)
    };
    if let Some(digits) = (0..=12).find(|digits| decimal(*digits)) {
        return 10f64.powi(-digits);
    }
    // Single precision, of seconds or of milliseconds.
    let single = |unit: f64| t.iter().all(|t| ((f64::from((t * unit) as f32) / unit) - t).abs() <= 1e-12 * t.abs());
    if single(1.0) || single(1e3) { largest * f64::from(f32::EPSILON) } else { largest * f64::EPSILON }
}

/// Whether the digits explain how stamps stray from a straight line, s.
pub fn explains(t: &[f64], start_s: f64, interval_s: f64) -> bool {
    let rows: Vec<f64> = (0..t.len()).map(|n| n as f64).collect();
    explains_about(t, &rows, start_s, interval_s)
}

/// Whether they explain how stamps, s, stray from smooth instants, in rows.
pub fn explains_about(t: &[f64], smooth: &[f64], start_s: f64, interval_s: f64) -> bool {
    let worth = of(t);
    let beside = |n: usize| t[n] - start_s - interval_s * smooth[n];
    let (low, high) =
        (0..t.len()).map(beside).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    high - low <= 2.0 * HALF * worth
}
