//! An interval longer than the electrical time constant, and a time axis in another unit.

use super::balance::torque_with_magnet;
use super::criteria::{INTERVALS_S, LONGEST_ELECTRICAL_S, LONGEST_MECHANICAL_S, T_INFORM, T_SIGN};
use super::evidence::Evidence;
use super::signals::{Signals, short};
use crate::mains;
use crate::model::Kind;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};

/// Mains (and the motor's supplies derived from it), Hz.
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
/// How far public mains stray, relative, with the resolution of a period in samples on top.
const MAINS_TOLERANCE: f64 = 0.03;

/// An edge of the voltage within an interval that the current has not seen yet passes for an inductance of up to R
/// times so many intervals; where the speed follows within an interval, too, and changes along with the current, for
/// one that is larger by the back-EMF.
const LATE: f64 = 1.5;

/// What to look for.
pub fn look(s: &Signals<'_>, e: &Evidence, kind: Kind, found: &mut Vec<DataFinding>) {
    if let Some(finding) = unit(s, e, kind) {
        found.push(finding);
        return;
    }
    let kind = e.told.unwrap_or(kind);
    let (Some(fit), Some(left)) = (e.voltage(kind), e.unexplained(kind)) else { return };
    // Below that interval L/R of any motor that is worth the name is longer.
    const FAST_S: f64 = 1e-4;
    if s.interval_s <= FAST_S || left > 0.2 || fit.t[1] < T_SIGN {
        return;
    }
    let constant_s = fit.b[2] / fit.b[1];
    // The largest that the data allow: three standard errors.
    let most_s = constant_s.abs() * (1.0 + 3.0 / fit.t[2].abs().max(1e-3));
    if constant_s < LATE * s.interval_s && most_s < 2.0 * LATE * s.interval_s {
        let told = if fit.t[2] < T_INFORM { String::new() } else { format!(" (about {} ms)", short(1e3 * constant_s)) };
        found.push(
            s.finding(
                Code::SlowSampling,
                Severity::Info,
                format!(
                    "the interval of {} ms is longer than the electrical time constant L/R{told}: L is out of reach",
                    short(1e3 * s.interval_s)
                ),
            )
            .value(s.interval_s, "s")
            .handled(Handled::None),
        );
    }
}

fn unit(s: &Signals<'_>, e: &Evidence, kind: Kind) -> Option<DataFinding> {
    let by = |factor: f64| factor * s.interval_s;
    let period_s = |factor: f64| mains::period_s(s.voltage?, by(factor));
    let factors = [(1e-3, "ms"), (1e-6, "us"), (1e3, "ks"), (1e6, "Ms"), (1e-9, "ns")];
    let alternates = |t: f64| MAINS_HZ.iter().any(|hz| (t * hz - 1.0).abs() < MAINS_TOLERANCE);
    let told = e.told.unwrap_or(kind);
    let by_a_delay_s = LATE * s.interval_s * (1.0 + e.motion_over_drop(told).unwrap_or(0.0));
    let electrical = e.voltage(told).filter(|f| f.t[1] > T_SIGN && f.t[2] > T_SIGN).map(|f| f.b[2] / f.b[1]);
    let electrical = electrical.filter(|t| *t > by_a_delay_s);
    let mechanical = e
        .voltage(Kind::PmDc)
        .filter(|_| kind == Kind::PmDc)
        .zip(torque_with_magnet(&e.long))
        .filter(|(u, i)| u.t[1] > T_SIGN && u.t[3] > T_SIGN && i.t[1] > T_SIGN)
        .map(|(u, i)| u.b[1] * i.b[1] / u.b[3]);
    let by_mains = || {
        if kind != Kind::Universal || period_s(1.0).is_some() {
            return None;
        }
        let (factor, unit) = factors.iter().find(|(factor, _)| period_s(*factor).is_some_and(alternates))?;
        Some((*factor, *unit, format!("the supply's period would be {} s", short(period_s(*factor)? / factor))))
    };
    let (least, greatest) = INTERVALS_S;
    let implausible = || {
        let why = match electrical {
            Some(t) if t > LONGEST_ELECTRICAL_S => format!("the electrical time constant would be {} s", short(t)),
            _ if mechanical.is_some_and(|t| t > LONGEST_MECHANICAL_S) => {
                format!("the mechanical time constant would be {} s", short(mechanical.unwrap_or(0.0)))
            }
            _ if s.interval_s > greatest => format!("the interval would be {} s", short(s.interval_s)),
            _ if s.interval_s < least => format!("the interval would be {} us", short(1e6 * s.interval_s)),
            _ => return None,
        };
        let usual = |factor: f64| {
            (least..=greatest).contains(&by(factor))
                && electrical.is_none_or(|t| t * factor < LONGEST_ELECTRICAL_S)
                && mechanical.is_none_or(|t| t * factor < LONGEST_MECHANICAL_S)
        };
        let (factor, unit) = factors.iter().find(|(factor, _)| usual(*factor))?;
        Some((*factor, *unit, why))
    };
    let (factor, unit, why) = by_mains().or_else(implausible)?;
    let time = s.recording().source("t_s");
    let remedy = if factor < 1.0 { time.in_unit(unit).map("t_s") } else { time.times(factor).map("t_s") };
    Some(
        s.finding(
            Code::TimeUnit,
            Severity::Stop,
            format!(
                "the time is not in seconds: {why}; with a factor of {factor} it would be {} ms",
                short(1e3 * by(factor))
            ),
        )
        .value(factor, "")
        .remedy(remedy),
    )
}
