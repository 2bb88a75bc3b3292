//! Channels that do not belong together: voltage and current of one run, the speed of another.

use super::evidence::{Evidence, variance};
use super::signals::Signals;
use crate::model::Kind;
use crate::recording::finding::{Code, DataFinding, Severity};

/// Share of the voltage that no motor leaves unexplained: ten times what the largest effects of the catalogue do.
const UNEXPLAINED: f64 = 0.1;

/// What to look for.
pub fn look(s: &Signals<'_>, e: &Evidence, kind: Kind, found: &mut Vec<DataFinding>) {
    // Something that explains it is named already.
    let named = |f: &DataFinding| f.recording == s.path() && !matches!(f.severity, Severity::Info);
    let Some(left) = e.unexplained(e.told.unwrap_or(kind)) else { return };
    let mean_square = e.short.iter().map(|x| x.u * x.u).sum::<f64>() / e.short.len().max(1) as f64;
    if variance(e.short.iter().map(|x| x.u)) < 0.05 * mean_square || found.iter().any(named) {
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
