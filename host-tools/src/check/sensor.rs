//! Speed sensors that show nothing below a speed, and those that time the pulses of a turn.

use super::criteria::CHANCE;
use super::signals::{Signals, largest, short};
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

/// Changes of a speed by pulses that are judged, and the share of them that has to be explained.
const PULSES: usize = 30;
const EXPLAINED: f64 = 0.9;

/// What to look for.
pub fn look(s: &Signals<'_>, found: &mut Vec<DataFinding>) {
    let Some(w) = s.recording().channel(Channel::Speed) else { return };
    if let Some(angle) = by_period(w, s.interval_s) {
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

/// The angle between two pulses, rad: as long as a value v is shown, L samples, the shaft turns by v L h. All but a few
/// changes come when that angle is through, to a sample on either side; by chance one of L/3 would.
fn by_period(w: &[f64], interval_s: f64) -> Option<f64> {
    let changes: Vec<usize> = (1..w.len()).filter(|&n| w[n] != w[n - 1]).collect();
    // (samples that the value lasts, the value after: it is the mean speed over them)
    let runs: Vec<(f64, f64)> = changes
        .windows(2)
        .filter(|c| c[1] - c[0] >= 3)
        .map(|c| ((c[1] - c[0]) as f64, w[c[1]].abs()))
        .filter(|(_, v)| *v > 0.0)
        .collect();
    if runs.len() < PULSES || runs.len() * 2 < changes.len() {
        return None;
    }
    let mut angles: Vec<f64> = runs.iter().map(|(length, v)| length * v).collect();
    angles.sort_by(f64::total_cmp);
    let angle = angles[angles.len() / 2];
    let right = runs.iter().filter(|(length, v)| (angle / v - length).abs() <= 1.1).count() as f64;
    let (shortest, longest) = runs.iter().fold((f64::INFINITY, 0.0f64), |(a, b), r| (a.min(r.0), b.max(r.0)));
    let chance = (3.0 / (longest - shortest + 1.0)).powf(right.min(60.0));
    (right >= EXPLAINED * runs.len() as f64 && longest > shortest + 2.0 && chance < CHANCE)
        .then_some(angle * interval_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulses_of_sixty_a_turn_are_told_by_how_long_each_value_lasts() {
        // A run-up in 2 s to 30 rad/s: ω = 15 t, θ = 7.5 t². A pulse each 2π/60.
        let (h, step) = (1e-4, std::f64::consts::TAU / 60.0);
        let instants: Vec<f64> = (1..280).map(|k| (f64::from(k) * step / 7.5).sqrt()).collect();
        let mut speed = vec![0.0; 20_000];
        for pair in instants.windows(3) {
            let v = step / (pair[1] - pair[0]);
            let (from, to) = ((pair[1] / h).ceil() as usize, (pair[2] / h).ceil() as usize);
            speed[from.min(20_000)..to.min(20_000)].fill(v);
        }
        let angle = by_period(&speed, h).unwrap();
        assert!((angle / step - 1.0).abs() < 0.02, "{angle}");
        let smooth: Vec<f64> = (0..20_000).map(|n| 15.0 * h * f64::from(n)).collect();
        assert_eq!(by_period(&smooth, h), None);
    }
}
