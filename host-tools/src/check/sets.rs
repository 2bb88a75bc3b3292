//! Recordings of one set against each other: the same one twice, and motors that cannot be one.

use super::balance::voltage_without_current;
use super::criteria::T_SIGN;
use super::evidence::Evidence;
use super::signals::{Signals, short};
use crate::mains;
use crate::model::Kind;
use crate::recording::Recording;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};

/// Whether two recordings hold the same samples: whole, or the shorter one as a part of the longer one's beginning or
/// end.
pub fn same(a: &Recording, b: &Recording) -> bool {
    let shorter = a.len().min(b.len());
    if shorter < 2 {
        return false;
    }
    let equal = |x: &[f64], y: &[f64]| x[..shorter] == y[..shorter] || x[x.len() - shorter..] == y[y.len() - shorter..];
    let mut moving = false;
    let alike = crate::recording::Channel::ALL.into_iter().all(|c| match (a.channel(c), b.channel(c)) {
        (Some(x), Some(y)) => {
            moving |= x.windows(2).any(|w| w[0] != w[1]);
            equal(x, y)
        }
        (None, None) => true,
        _ => false,
    });
    alike && moving
}

/// The same recording twice.
pub fn duplicates(recordings: &[Recording]) -> Vec<DataFinding> {
    let mut found = Vec::new();
    for (k, b) in recordings.iter().enumerate() {
        if let Some(a) = recordings[..k].iter().find(|a| same(a, b)) {
            found.push(
                DataFinding::new(
                    Code::DuplicateRecording,
                    Severity::Warning,
                    b.path(),
                    format!(
                        "it holds the same samples as {}: as data held out it would prove nothing",
                        a.path().display()
                    ),
                )
                .handled(Handled::None),
            );
        }
    }
    found
}

/// Factor between the constants of two motors of one type: windings scatter by a few per cent, warm by 40 %.
const SAME_MOTOR: f64 = 1.6;
/// Factor from which on no model is of both: neither heat nor another winding of the type makes it.
const NO_MODEL_OF_BOTH: f64 = 3.0;

/// Recordings whose motors have constants further apart than motors of one type. `kind`: what motor they are of, if
/// that is known.
pub fn different(all: &[(&Signals<'_>, &Evidence)], kind: Option<Kind>) -> Vec<DataFinding> {
    let constants: Vec<Option<(f64, f64)>> = all.iter().map(|(s, e)| constant(s, e, kind)).collect();
    let mut found = Vec::new();
    let Some(first) = constants.iter().position(Option::is_some) else { return found };
    let (reference, error) = constants[first].unwrap_or_default();
    for k in first + 1..all.len() {
        let Some((value, its_error)) = constants[k] else { continue };
        let ratio = (value / reference).abs().ln();
        let scatter = error.hypot(its_error);
        if ratio.abs() > SAME_MOTOR.ln() && ratio.abs() > T_SIGN * scatter {
            let stops = ratio.abs() > NO_MODEL_OF_BOTH.ln();
            let (severity, handled) =
                if stops { (Severity::Stop, Handled::Refused) } else { (Severity::Warning, Handled::None) };
            found.push(
                all[k]
                    .0
                    .finding(
                        Code::DifferentMotors,
                        severity,
                        format!(
                            "its back-EMF constant is {} times that of {}: {}",
                            short(ratio.exp()),
                            all[first].0.path().display(),
                            match kind {
                                Some(_) => "other motors, or another unit of a channel",
                                None => "other motors, another unit of a channel, or no magnets (--kind universal)",
                            }
                        ),
                    )
                    .value(ratio.exp(), "")
                    .handled(handled),
            );
        }
    }
    found
}

/// K, or volts per speed, with its relative standard error.
fn constant(s: &Signals<'_>, e: &Evidence, kind: Option<Kind>) -> Option<(f64, f64)> {
    let kind = e.told.or(kind);
    if let Some(fit) = e.voltage(kind.unwrap_or_default()) {
        let sound = fit.t[3] > T_SIGN && e.unexplained(kind.unwrap_or_default())? < 0.2;
        return sound.then(|| (fit.b[3], 1.0 / fit.t[3]));
    }
    // Without a current nothing tells the kind. On alternating voltage it is no magnet motor.
    let alternates = s.voltage.is_some_and(|u| mains::period_s(u, s.interval_s).is_some());
    if s.voltage.is_none() || s.current.is_some() || kind == Some(Kind::Universal) || alternates {
        return None;
    }
    let fit = voltage_without_current(&e.long)?;
    (fit.t[1] > T_SIGN && fit.unexplained < 0.2).then(|| (fit.b[1], 1.0 / fit.t[1]))
}
