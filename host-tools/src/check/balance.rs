//! The two equations of a motor, averaged over windows so that no derivative of noise is taken.
//!
//! | equation | magnet motor | universal motor |
//! | --- | --- | --- |
//! | voltage | u = R i + L di/dt + K ω | u = R i + L di/dt + K i ω |
//! | torque | K i = J dω/dt + μ0 sgn ω + μ1 ω | K i² = J dω/dt + μ0 sgn ω + μ1 ω |
//!
//! With the raised cosine φ(t) = (1 − cos 2πt/T)/T over a window T, ∫φ x' dt = −∫φ' x dt: both equations hold between
//! weighted means of the samples (Shinbrot's modulating functions, 1957), whatever the motor does and however fast. R,
//! L, K, J are positive in any motor; a coefficient that is negative beyond its standard error tells of a channel.

use std::f64::consts::TAU;

use super::regression::{self, Fit};
use super::signals::Signals;

/// Weighted means over a window.
#[derive(Debug, Clone, Copy, Default)]
pub struct Window {
    /// First sample.
    pub at: usize,
    /// u.
    pub u: f64,
    /// du/dt.
    pub du: f64,
    /// i.
    pub i: f64,
    /// di/dt.
    pub di: f64,
    /// ω.
    pub w: f64,
    /// dω/dt.
    pub dw: f64,
    /// i ω.
    pub iw: f64,
    /// i².
    pub ii: f64,
    /// u ω.
    pub uw: f64,
    /// u i.
    pub ui: f64,
    /// sgn ω.
    pub sign: f64,
    /// The rotor is held.
    pub locked: bool,
}

/// More windows than these tell no more.
const MOST: usize = 40_000;

/// Weights of samples over a window: φ for the mean, −φ' h for the mean of the derivative, 1/s.
pub fn weights(length: usize, interval_s: f64) -> [Vec<f64>; 2] {
    let n = length as f64;
    let rate = TAU / (n * n * interval_s);
    let angle = |k: usize| TAU * (k as f64 + 0.5) / n;
    [(0..length).map(|k| (1.0 - angle(k).cos()) / n).collect(), (0..length).map(|k| -rate * angle(k).sin()).collect()]
}

/// The windows of a recording in which every sample counts and the supply is closed.
pub fn windows(s: &Signals<'_>, seconds: f64) -> Vec<Window> {
    windows_where(s, seconds, |n| s.is_valid(n) && !s.is_open(n))
}

/// The windows in which every sample counts, the supply open or not.
pub fn windows_of_all(s: &Signals<'_>, seconds: f64) -> Vec<Window> {
    windows_where(s, seconds, |n| s.is_valid(n))
}

fn windows_where(s: &Signals<'_>, seconds: f64, usable: impl Fn(usize) -> bool) -> Vec<Window> {
    let length = s.window(seconds);
    let n = s.len();
    if n < length {
        return Vec::new();
    }
    let [phi, psi] = weights(length, s.interval_s);
    let hop = (length / 2).max(n / MOST);
    let bad: Vec<bool> = (0..n).map(|k| !usable(k)).collect();
    let mut next_bad = vec![n; n + 1];
    for k in (0..n).rev() {
        next_bad[k] = if bad[k] { k } else { next_bad[k + 1] };
    }
    let quiet = s.speed.as_deref().map_or(0.0, |w| 0.01 * super::signals::largest(w));
    let at = |signal: Option<&[f64]>, k: usize| signal.map_or(0.0, |x| x[k]);
    let speed = s.speed.as_deref();
    (0..=n - length)
        .step_by(hop)
        .filter(|&from| next_bad[from] >= from + length)
        .map(|from| {
            let mut sum = Window { at: from, locked: s.is_locked(from), ..Window::default() };
            for k in 0..length {
                let (u, i, w) = (at(s.voltage, from + k), at(s.current, from + k), at(speed, from + k));
                let (a, d) = (phi[k], psi[k]);
                sum.u += a * u;
                sum.du += d * u;
                sum.i += a * i;
                sum.di += d * i;
                sum.w += a * w;
                sum.dw += d * w;
                sum.iw += a * i * w;
                sum.ii += a * i * i;
                sum.uw += a * u * w;
                sum.ui += a * u * i;
                sum.sign += a * if w.abs() > quiet { w.signum() } else { 0.0 };
            }
            sum
        })
        .collect()
}

/// u on 1, i, di/dt, ω.
pub fn voltage_with_magnet(windows: &[Window]) -> Option<Fit<4>> {
    regression::fit(windows.iter().map(|x| ([1.0, x.i, x.di, x.w], x.u)))
}

/// u on 1, i, di/dt, i ω.
pub fn voltage_of_series(windows: &[Window]) -> Option<Fit<4>> {
    regression::fit(windows.iter().map(|x| ([1.0, x.i, x.di, x.iw], x.u)))
}

/// u on 1, i, di/dt: no motion.
pub fn voltage_at_rest(windows: &[Window]) -> Option<Fit<3>> {
    regression::fit(windows.iter().map(|x| ([1.0, x.i, x.di], x.u)))
}

/// i on 1, dω/dt, ω, sgn ω, while the rotor is free.
pub fn torque_with_magnet(windows: &[Window]) -> Option<Fit<4>> {
    regression::fit(windows.iter().filter(|x| !x.locked).map(|x| ([1.0, x.dw, x.w, x.sign], x.i)))
}

/// i² on 1, dω/dt, ω, sgn ω, while the rotor is free.
pub fn torque_of_series(windows: &[Window]) -> Option<Fit<4>> {
    regression::fit(windows.iter().filter(|x| !x.locked).map(|x| ([1.0, x.dw, x.w, x.sign], x.ii)))
}

/// u on 1, ω, dω/dt, sgn ω: a magnet motor without a current channel.
pub fn voltage_without_current(windows: &[Window]) -> Option<Fit<4>> {
    regression::fit(windows.iter().filter(|x| !x.locked).map(|x| ([1.0, x.w, x.dw, x.sign], x.u)))
}
