//! A speed sensor that shows the magnitude where a magnet motor turns both ways.
//!
//! The voltage of a motor that turns backwards is K ω + R i with a negative ω. Two regressions of the voltage, one on
//! the speed as it is, one on the speed with the sign of the voltage (which leads the speed by less than it takes the
//! motor to reverse), tell which of them it is.

use super::balance::Window;
use super::evidence::Evidence;
use super::regression;
use super::signals::{self, Signals};
use crate::model::Kind;
use crate::recording::Channel;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};

/// A speed that never goes further to the other side than this share of its largest value has no sign.
const NO_SIGN: f64 = 0.02;
/// How many times as much the speed as it is leaves. With 40 windows and more the ratio of likelihoods is beyond 10^6.
const TIMES: f64 = 2.0;

/// What to look for.
pub fn look(s: &Signals<'_>, e: &Evidence, kind: Kind, found: &mut Vec<DataFinding>) {
    if e.told.unwrap_or(kind) != Kind::PmDc || s.voltage.is_none() {
        return;
    }
    let Some(speed) = s.usable(s.speed_channel) else { return };
    let (low, high) = signals::extremes(&speed);
    if !(low >= -NO_SIGN * high || high <= -NO_SIGN * low) {
        return;
    }
    let peak = e.long.iter().fold(0.0_f64, |m, x| m.max(x.u.abs()));
    let share =
        |of: fn(f64) -> bool| e.long.iter().filter(|x| of(x.u / peak)).count() as f64 / e.long.len().max(1) as f64;
    if share(|u| u > 0.2).min(share(|u| u < -0.2)) < 0.05 {
        return;
    }
    let has_current = s.recording().channel(Channel::Current).is_some();
    let left = |w: fn(&Window) -> f64| {
        let fit = if has_current {
            regression::fit(e.long.iter().map(|x| ([1.0, x.i, x.di, w(x)], x.u)))
        } else {
            regression::fit(e.long.iter().map(|x| ([1.0, x.dw, 0.0, w(x)], x.u)))
        };
        fit.map(|f| f.unexplained)
    };
    let (Some(as_it_is), Some(signed)) = (left(|x| x.w), left(|x| x.w * x.u.signum())) else { return };
    if as_it_is > TIMES * signed {
        found.push(
            s.finding(
                Code::SignLost,
                Severity::Warning,
                "the voltage changes its sign for longer than the motor takes to follow, and the speed never does: its sensor gives the magnitude",
            )
            .on(s.speed_channel)
            .handled(Handled::Modelled),
        );
    }
}
