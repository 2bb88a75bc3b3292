//! Speed sensors that show nothing below a speed, and those that time the pulses of a turn.

use super::signals::{Signals, largest, short};
use crate::counts;
use crate::recording::Channel;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};

/// Values between the least that is shown and twice that, from which on it is no quantum.
const LEVELS: usize = 8;
/// Transitions between silence and the least value that are judged.
const EDGES: usize = 2;
/// The least value that is shown, as a share of the largest: less is noise about zero.
const LEAST: f64 = 0.01;
/// Share of samples in silence.
const SILENT: f64 = 0.01;

/// What to look for.
pub fn look(s: &Signals<'_>, found: &mut Vec<DataFinding>) {
    let Some(w) = s.recording().channel(Channel::Speed) else { return };
    if let Some(angle) = counts::angle_a_pulse(w, s.interval_s) {
        let text = if s.is_rotary() {
            let pulses = (std::f64::consts::TAU / angle).max(1.0);
            format!(
                "each value of the speed lasts as long as it takes to turn by 1/{} of a turn: pulses are timed",
                short(pulses)
            )
        } else {
            format!("each value of the speed lasts as long as it takes to go on by {}: pulses are timed", short(angle))
        };
        // What is held from pulse to pulse is held by this, and its steps are those of the time.
        found.retain(|f| {
            f.recording != s.path()
                || f.channel != Some(Channel::Speed)
                || !matches!(f.code, Code::HeldValues | Code::EncoderCounts | Code::CoarseSteps | Code::Outliers)
        });
        found.push(s.finding(Code::PulsePeriod, Severity::Info, text).on(Channel::Speed).value(angle, "rad"));
        return;
    }
    if let Some((least, share)) = silent(w) {
        found.retain(|f| f.recording != s.path() || f.channel != Some(Channel::Speed) || f.code != Code::Outliers);
        let text = format!(
            "the speed is 0 in {:.0} % of the samples and else never below {} {}: the sensor is silent there",
            100.0 * share,
            short(least),
            s.unit(Channel::Speed)
        );
        found.push(
            s.finding(Code::SilentBelow, Severity::Warning, text)
                .on(Channel::Speed)
                .value(least, s.unit(Channel::Speed))
                .handled(Handled::None),
        );
    }
}

/// The least speed that is shown beside a speed of zero, and the share of zeros.
fn silent(w: &[f64]) -> Option<(f64, f64)> {
    let least = w.iter().filter(|w| **w != 0.0).fold(f64::INFINITY, |m, w| m.min(w.abs()));
    let zeros = w.iter().filter(|w| **w == 0.0).count() as f64 / w.len().max(1) as f64;
    let edges: Vec<f64> =
        w.windows(2).filter(|w| (w[0] == 0.0) != (w[1] == 0.0)).map(|w| (w[0] + w[1]).abs()).collect();
    let mut near: Vec<f64> = w.iter().map(|w| w.abs()).filter(|w| (least..2.0 * least).contains(w)).collect();
    near.sort_by(f64::total_cmp);
    near.dedup();
    let told = least.is_finite() && least > LEAST * largest(w) && zeros > SILENT && near.len() >= LEVELS;
    let mut sorted = edges.clone();
    sorted.sort_by(f64::total_cmp);
    // A speed that comes out of silence comes out at the least that is shown.
    let out_at_once = sorted.get(sorted.len() / 2).is_some_and(|m| *m < 1.5 * least);
    (told && edges.len() >= EDGES && out_at_once).then_some((least, zeros))
}
