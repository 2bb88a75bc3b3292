//! Rails: a channel at the end of its range, and one that rests at zero because it has one side.

use super::signals::{self, Signals, short};
use crate::recording::finding::{Code, DataFinding, Handled, Severity};
use crate::recording::{Channel, Recording, clipping};

/// Share of the samples on a rail of rest at which the voltage drives to the other side, from which on the quantity
/// must have gone there.
const DRIVEN: f64 = 0.3;

/// What to look for.
pub fn look(s: &Signals<'_>, found: &mut Vec<DataFinding>) {
    for (channel, all) in s.channels() {
        let at = s.measured(channel);
        let values: Vec<f64> = at.iter().map(|n| all[*n]).collect();
        let values = values.as_slice();
        let unit = s.unit(channel);
        for rail in clipping::find(channel, values) {
            let (first, last) = (at[rail.samples[0]], at[rail.samples[rail.samples.len() - 1]]);
            found.push(
                s.finding(
                    Code::Clipped,
                    Severity::Warning,
                    format!(
                        "{} rests at {} {unit} in {} samples while the quantity goes on: its range ends there",
                        signals::name(channel),
                        short(rail.level),
                        rail.samples.len()
                    ),
                )
                .on(channel)
                .between(s.time_s(first), s.time_s(last))
                .value(rail.level, unit)
                .handled(Handled::Masked),
            );
        }
        let Some(rest) = clipping::one_sided(channel, values) else { continue };
        let (code, severity, handled, text) = if driven_beyond(s, values, &at, rest) {
            let text = "while the voltage drives it to the other side: what happens there is not recorded";
            (Code::Clipped, Severity::Warning, Handled::Masked, text)
        } else {
            (Code::OneSided, Severity::Info, Handled::None, "at rest: it shows nothing of the other side")
        };
        let text = format!("{} never goes beyond {} {unit}, {text}", signals::name(channel), short(rest));
        found.push(s.finding(code, severity, text).on(channel).value(rest, unit).handled(handled));
    }
}

/// Lets samples count no more at which a channel rests at zero because it has one side, where the voltage drives the
/// quantity to the other one.
pub fn mask(recording: &mut Recording) {
    let samples: Vec<usize> = {
        let s = Signals::new(recording);
        let beyond = |(channel, all): (Channel, &[f64])| {
            let at = s.measured(channel);
            let values: Vec<f64> = at.iter().map(|n| all[*n]).collect();
            let rest = clipping::one_sided(channel, &values).filter(|rest| driven_beyond(&s, &values, &at, *rest));
            at.into_iter().filter(move |n| rest == Some(all[*n])).collect::<Vec<_>>()
        };
        s.channels().flat_map(beyond).collect()
    };
    recording.exclude(samples);
}

/// Whether the voltage is against the side that the channel shows for a good part of the time that it rests.
fn driven_beyond(s: &Signals<'_>, values: &[f64], at: &[usize], rest: f64) -> bool {
    let Some(u) = s.voltage else { return false };
    let side = values.iter().map(|x| x - rest).sum::<f64>().signum();
    let limit = 0.2 * signals::largest(u);
    let resting: Vec<usize> = (0..values.len())
        .filter(|&k| values[k] == rest)
        .map(|k| at[k])
        .filter(|&n| !s.is_open(n) && !s.is_locked(n))
        .collect();
    resting.iter().filter(|&&n| u[n] * side < -limit).count() as f64 > DRIVEN * resting.len() as f64
}
