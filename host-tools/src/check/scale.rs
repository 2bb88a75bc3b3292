//! Factors of a thousand, and speeds in rpm or °/s that were taken for rad/s.
//!
//! The equations of a motor hold in any unit of a channel (K, R, L, J follow it), so a factor shows only where a
//! quantity was recorded twice, as angle and speed, or where a figure is beyond what is built.

use super::criteria::T_SIGN;
use super::evidence::Evidence;
use super::regression;
use super::signals::{self, Signals, largest, short};
use crate::model::Kind;
use crate::recording::Channel;
use crate::recording::finding::{Code, DataFinding, Severity};

/// Factors between units of speed: (its name, what it is multiplied by to give rad/s).
const SPEEDS: [(&str, f64); 6] = [
    ("rpm", 0.104_719_755),
    ("deg/s", 0.017_453_293),
    ("rps", std::f64::consts::TAU),
    ("mrad/s", 1e-3),
    ("krad/s", 1e3),
    ("krpm", 104.719_755),
];

/// How closely angle and speed have to agree, relative: ten times the gain error of a tacho of class 1.
const SAME: f64 = 0.1;

/// What is built, by kind: greatest voltage at least and at most, V; current, A; speed, rad/s; and greatest product of
/// voltage and current, W. Magnet motors from a phone's to a machine tool's, universal motors from a shaver's to a
/// hammer's; a debt, since it is a list.
struct Built {
    voltage_v: (f64, f64),
    current_a: (f64, f64),
    speed_rad_s: (f64, f64),
    power_w: (f64, f64),
}

const MAGNET: Built =
    Built { voltage_v: (0.3, 1000.0), current_a: (5e-3, 500.0), speed_rad_s: (0.3, 7000.0), power_w: (0.1, 50e3) };
const UNIVERSAL: Built =
    Built { voltage_v: (2.0, 800.0), current_a: (0.02, 400.0), speed_rad_s: (3.0, 12_000.0), power_w: (0.3, 100e3) };

/// What to look for.
pub fn look(s: &Signals<'_>, e: &Evidence, kind: Kind, found: &mut Vec<DataFinding>) {
    if let Some(finding) = angle_against_speed(s) {
        found.push(finding);
    }
    let said = |f: &DataFinding| f.recording == s.path() && f.code == Code::UnitSuspect;
    if found.iter().any(said) {
        return;
    }
    let built = match e.told.unwrap_or(kind) {
        Kind::PmDc => MAGNET,
        Kind::Universal => UNIVERSAL,
    };
    let peak = |c: Channel| s.usable(c).map_or(0.0, |x| central(&x));
    let [u, i, w] = [Channel::Voltage, Channel::Current, Channel::Speed].map(peak);
    let ranges = [
        (Channel::Voltage, u, built.voltage_v),
        (Channel::Current, i, built.current_a),
        (Channel::Speed, w, built.speed_rad_s),
    ];
    let has_motion = e.voltage(e.told.unwrap_or(kind)).is_some_and(|f| f.t[3].abs() > T_SIGN);
    for (channel, value, (least, greatest)) in ranges {
        // A channel without a signal is no channel with a wrong factor.
        let small = value < least && value > 0.0 && has_motion;
        if (small || value > greatest) && (channel != Channel::Speed || s.is_rotary()) {
            let factor = if small { 1e3 } else { 1e-3 };
            found.push(suspect(s, channel, value, factor));
        }
    }
    let power = u * i;
    if found.iter().all(|f| f.code != Code::ScaleSuspect) && has_motion && power > 0.0 {
        let (least, greatest) = built.power_w;
        if power < least || power > greatest {
            let factor = if power < least { 1e3 } else { 1e-3 };
            // Of the two the one that is further from the middle of what is built.
            let middle = |(a, b): (f64, f64)| (a.ln() + b.ln()) / 2.0;
            let off = [(u.ln() - middle(built.voltage_v)), (i.ln() - middle(built.current_a))];
            let channel = if (off[0] < off[1]) == (power < least) { Channel::Voltage } else { Channel::Current };
            found.push(suspect(s, channel, if channel == Channel::Voltage { u } else { i }, factor));
        }
    }
}

/// The 99.9th percentile of the magnitudes: a few outliers are no range.
fn central(values: &[f64]) -> f64 {
    let mut magnitudes: Vec<f64> = values.iter().map(|x| x.abs()).collect();
    if magnitudes.is_empty() {
        return 0.0;
    }
    let at = ((magnitudes.len() - 1) as f64 * 0.999) as usize;
    *magnitudes.select_nth_unstable_by(at, f64::total_cmp).1
}

fn suspect(s: &Signals<'_>, channel: Channel, value: f64, factor: f64) -> DataFinding {
    let unit = s.unit(channel);
    let (question, remedy) = match channel {
        Channel::Speed if factor < 1.0 => ("; is it in rpm or deg/s?", s.map_in(channel, "rpm")),
        _ if factor < 1.0 => ("; is it in thousandths?", s.map_times(channel, factor)),
        _ => ("; is it in thousands?", s.map_times(channel, factor)),
    };
    s.finding(
        Code::ScaleSuspect,
        Severity::Warning,
        format!("{} goes up to {} {unit}, which no such motor does{question}", signals::name(channel), short(value)),
    )
    .on(channel)
    .value(value, unit)
    .remedy(remedy)
}

fn angle_against_speed(s: &Signals<'_>) -> Option<DataFinding> {
    let (angle, speed) = (s.recording().channel(Channel::Angle)?, s.recording().channel(Channel::Speed)?);
    let length = s.window(0.05);
    // Mean speed of a stretch against the angle that it covers.
    let rows = (0..s.len().saturating_sub(length))
        .step_by(length)
        .filter(|&a| (a..=a + length).all(|n| s.is_valid(n)))
        .map(|a| {
            let mean =
                (speed[a..=a + length].iter().sum::<f64>() - 0.5 * (speed[a] + speed[a + length])) / length as f64;
            ([mean], (angle[a + length] - angle[a]) / (length as f64 * s.interval_s))
        });
    let fit = regression::fit(rows)?;
    let ratio = fit.b[0];
    // A few beyond: angles that start again at each turn.
    if fit.t[0].abs() < T_SIGN || (ratio - 1.0).abs() < SAME || largest(speed) == 0.0 || fit.unexplained > 0.2 {
        return None;
    }
    let same = |x: f64, y: f64| (x / y - 1.0).abs() < SAME;
    if same(ratio, -1.0) {
        let text = "the sign of the speed is reversed: it is against that of the angle";
        return Some(
            s.finding(Code::SignReversed, Severity::Warning, text)
                .on(Channel::Speed)
                .remedy(s.map_times(Channel::Speed, -1.0)),
        );
    }
    let unit = SPEEDS.iter().find(|(_, factor)| same(ratio, *factor));
    let (text, remedy, code) = match unit {
        Some((unit, _)) => (
            format!("the speed is in {unit}: the angle moves {} times as fast as it says in rad/s", short(ratio)),
            s.map_in(Channel::Speed, unit),
            Code::UnitSuspect,
        ),
        None => {
            let angle = SPEEDS.iter().find(|(_, factor)| same(1.0 / ratio, *factor));
            match angle {
                Some((_, factor)) => (
                    format!("the angle is not in rad: it moves {} times as fast as the speed says", short(ratio)),
                    s.map_times(Channel::Angle, *factor),
                    Code::UnitSuspect,
                ),
                None => (
                    format!(
                        "angle and speed contradict each other: the angle moves {} times as fast as the speed says",
                        short(ratio)
                    ),
                    s.map_times(Channel::Speed, short(ratio).parse().unwrap_or(ratio)),
                    Code::ScaleSuspect,
                ),
            }
        }
    };
    Some(s.finding(code, Severity::Warning, text).on(Channel::Speed).value(ratio, "").remedy(remedy))
}
