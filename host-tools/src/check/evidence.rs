//! What one recording's balances say, computed once for all checks.

use super::balance::{self, Window};
use super::criteria::{ELECTRICAL_WINDOW_S, MECHANICAL_WINDOW_S};
use super::regression::Fit;
use super::signals::Signals;
use crate::model::Kind;

/// The fits of a recording.
pub struct Evidence {
    /// Windows of the voltage balance.
    pub short: Vec<Window>,
    /// Windows of the torque balance.
    pub long: Vec<Window>,
    /// u on 1, i, di/dt, ω (magnet motor).
    pub magnet: Option<Fit<4>>,
    /// u on 1, i, di/dt, i ω (universal motor).
    pub series: Option<Fit<4>>,
    /// The kind of motor that explains the voltage, where one does and the other does not.
    pub told: Option<Kind>,
}

/// How many times the other kind leaves unexplained. Both have as many coefficients, so that with n windows the ratio
/// of likelihoods is this to the power of n/2: beyond 10^12 from 40 windows on, the fewest that are fitted.
const TIMES_WORSE: f64 = 4.0;

/// Share of the voltage that has to be unexplained by the other kind: what the largest effects of the catalogue leave.
const UNEXPLAINED: f64 = 0.01;

/// Share of its mean square that the voltage has to vary by: at one voltage both kinds slow down as they draw more
/// current.
const VARIES: f64 = 0.005;

impl Evidence {
    /// Of a recording.
    pub fn new(s: &Signals<'_>) -> Self {
        let short = balance::windows(s, ELECTRICAL_WINDOW_S);
        let long = balance::windows(s, MECHANICAL_WINDOW_S);
        let all = s.voltage.is_some()
            && s.recording().channel(crate::recording::Channel::Current).is_some()
            && s.speed.is_some();
        let magnet = all.then(|| balance::voltage_with_magnet(&short)).flatten();
        let series = all.then(|| balance::voltage_of_series(&short)).flatten();
        let driven = variance(short.iter().map(|x| x.u))
            > VARIES * short.iter().map(|x| x.u * x.u).sum::<f64>() / short.len().max(1) as f64;
        let told = match (&magnet, &series) {
            (Some(magnet), Some(series)) if driven => {
                let (m, s) = (share(magnet, &short, |x| x.w), share(series, &short, |x| x.iw));
                match () {
                    () if s > UNEXPLAINED && s > TIMES_WORSE * m => Some(Kind::PmDc),
                    () if m > UNEXPLAINED && m > TIMES_WORSE * s => Some(Kind::Universal),
                    () => None,
                }
            }
            _ => None,
        };
        Self { short, long, magnet, series, told }
    }

    /// The fit of the voltage for a kind of motor.
    pub fn voltage(&self, kind: Kind) -> Option<&Fit<4>> {
        match kind {
            Kind::PmDc => self.magnet.as_ref(),
            Kind::Universal => self.series.as_ref(),
        }
    }

    /// The back-EMF over the drop of the resistance, RMS about their means.
    pub fn motion_over_drop(&self, kind: Kind) -> Option<f64> {
        let fit = self.voltage(kind)?;
        let motion = match kind {
            Kind::PmDc => variance(self.short.iter().map(|x| x.w)),
            Kind::Universal => variance(self.short.iter().map(|x| x.iw)),
        };
        Some((fit.b[3] / fit.b[1]).abs() * (motion / variance(self.short.iter().map(|x| x.i))).sqrt())
    }

    /// What the fit of the voltage leaves, as a share of its largest part: a supply that is constant has no variance of
    /// its own.
    pub fn unexplained(&self, kind: Kind) -> Option<f64> {
        let fit = self.voltage(kind)?;
        Some(match kind {
            Kind::PmDc => share(fit, &self.short, |x| x.w),
            Kind::Universal => share(fit, &self.short, |x| x.iw),
        })
    }
}

fn share(fit: &Fit<4>, windows: &[Window], motion: fn(&Window) -> f64) -> f64 {
    let parts = [
        variance(windows.iter().map(|x| x.u)),
        fit.b[1].powi(2) * variance(windows.iter().map(|x| x.i)),
        fit.b[3].powi(2) * variance(windows.iter().map(motion)),
    ];
    let largest = parts.into_iter().fold(0.0, f64::max);
    if largest > 0.0 { fit.variance / largest } else { 1.0 }
}

/// Variance about the mean.
pub fn variance(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / n;
    values.map(|x| (x - mean).powi(2)).sum::<f64>() / n
}
