//! Channels that do not belong together: voltage and current of one run, the speed of another.

use super::balance::{self, Window};
use super::evidence::{Evidence, variance};
use super::regression;
use super::signals::{self, Signals};
use crate::model::Kind;
use crate::noise;
use crate::recording::Channel;
use crate::recording::finding::{Code, DataFinding, Severity};

/// Share of the voltage that no motor leaves unexplained: ten times what the largest effects of the catalogue do.
const UNEXPLAINED: f64 = 0.1;

/// Window of the acceleration, s: five periods of the mains.
const WINDOW_S: f64 = 0.1;
/// Share of the acceleration that no current explains: at a half of it other things act on the shaft as strongly.
const BY_ITSELF: f64 = 0.7;
/// Variance of the acceleration in what the noise of the speed makes of it.
const ACCELERATES: f64 = 30.0;

/// A shaft that accelerates without the current: the speed is another motor's, or another run's.
fn torque(s: &Signals<'_>, kind: Kind) -> Option<DataFinding> {
    let whole = s.voltage.is_some() && s.recording().channel(Channel::Current).is_some();
    let speed = s.recording().channel(Channel::Speed).filter(|_| whole)?;
    let windows = balance::windows(s, WINDOW_S);
    let free = || windows.iter().filter(|x| !x.locked);
    let (n, h) = (s.window(WINDOW_S) as f64, s.interval_s);
    // Σψ² of the derivative of a raised cosine: (2π/(n² h))² n/2.
    let noise = noise::of_differences(speed).powi(2) * (std::f64::consts::TAU / (n * n * h)).powi(2) * n / 2.0;
    let accelerates = variance(free().map(|x| x.dw));
    let torque = |x: &Window| if kind == Kind::PmDc { x.i } else { x.ii };
    let fit = regression::fit(free().map(|x| ([1.0, torque(x), x.w, x.sign], x.dw)))?;
    (accelerates > ACCELERATES * noise && fit.unexplained > BY_ITSELF).then(|| {
        let text = format!(
            "{:.0} % of what the shaft accelerates by no current explains: are current and speed of one run, and of one clock?",
            100.0 * fit.unexplained
        );
        s.finding(Code::DifferentMotors, Severity::Warning, text).value(fit.unexplained, "")
    })
}

/// What to look for.
pub fn look(s: &Signals<'_>, e: &Evidence, kind: Kind, found: &mut Vec<DataFinding>) {
    // Something that explains it is named already.
    let explains = |f: &DataFinding| {
        !matches!(f.severity, Severity::Info) || matches!(f.code, Code::ChannelShift | Code::MovingAverage)
    };
    let in_steps = s.channels().any(|(channel, _)| signals::goes_in_steps(s, channel, found));
    if in_steps || found.iter().any(|f| f.recording == s.path() && explains(f)) {
        return;
    }
    if let Some(finding) = torque(s, e.told.unwrap_or(kind)) {
        found.push(finding);
        return;
    }
    let Some(left) = e.unexplained(e.told.unwrap_or(kind)) else { return };
    let mean_square = e.short.iter().map(|x| x.u * x.u).sum::<f64>() / e.short.len().max(1) as f64;
    if variance(e.short.iter().map(|x| x.u)) < 0.05 * mean_square {
        return;
    }
    if left > UNEXPLAINED {
        let text = format!(
            "voltage, current and speed contradict each other: {:.0} % of the voltage is that of no motor; are they of one run, and of one clock?",
            100.0 * left
        );
        found.push(s.finding(Code::DifferentMotors, Severity::Warning, text).value(left, ""));
    }
}
