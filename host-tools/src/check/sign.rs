//! Reversed signs, and voltage and current in each other's place.
//!
//! R, K and J are positive. Of the three signs that the balances show (u against i, u against ω, i against dω/dt),
//! reversing one channel of a magnet motor turns two: their product stays positive, and the channel that both have in
//! common is the reversed one. A product that is negative is beyond any reversal: with u and i in each other's place, i
//! = (u − K ω)/R shows a negative K and a positive J/K.
//!
//! A universal motor does not mind which way its voltage goes: only u against i tells of those two, by the energy ∫u i
//! dt, which is positive in a run that begins at rest.

use super::balance::{torque_with_magnet, voltage_at_rest, voltage_without_current};
use super::criteria::T_SIGN;
use super::evidence::Evidence;
use super::regression::{self, Fit};
use super::signals::{self, Signals};
use crate::model::Kind;
use crate::recording::Channel;
use crate::recording::finding::{Code, DataFinding, Severity};

/// A voltage of which the balance leaves more than this share is not that of this motor; its signs mean nothing.
const MOST_UNEXPLAINED: f64 = 0.1;

/// What to look for.
pub fn look(s: &Signals<'_>, e: &Evidence, kind: Kind, found: &mut Vec<DataFinding>) {
    let kind = e.told.unwrap_or(kind);
    let has = |c: Channel| s.recording().channel(c).is_some();
    let told = match (has(Channel::Voltage), s.current.is_some(), s.speed.is_some()) {
        (true, true, true) if s.current_channel == Channel::Current => match kind {
            Kind::PmDc => magnet(s, e),
            Kind::Universal => series(s, e),
        },
        (true, true, false) if s.current_channel == Channel::Current => {
            let negative =
                voltage_at_rest(&e.short).is_some_and(|f| f.t[1] < -T_SIGN && f.unexplained < MOST_UNEXPLAINED);
            (negative && energy(e) < -T_SIGN).then(|| {
                reversed(
                    s,
                    Channel::Current,
                    "the product of voltage and current says that the motor feeds its supply",
                    &[Channel::Voltage],
                )
            })
        }
        (true, false, true) if kind == Kind::PmDc => voltage_without_current(&e.long)
            .filter(|f| f.t[1] < -T_SIGN && f.unexplained < MOST_UNEXPLAINED)
            .map(|_| reversed(s, s.speed_channel, "the motor turns against its voltage", &[Channel::Voltage])),
        (_, true, true) if s.current_channel == Channel::Torque => torque_with_magnet(&e.long)
            .filter(|f| moves_against(f) && f.unexplained < MOST_UNEXPLAINED)
            .map(|_| reversed(s, Channel::Torque, "the drive accelerates against its torque", &[s.speed_channel])),
        _ => None,
    };
    found.extend(told);
}

/// The inertia is negative, and so is the friction where that shows.
fn moves_against(f: &Fit<4>) -> bool {
    f.t[1] < -T_SIGN && f.t[2] < T_SIGN
}

/// t of the mean power.
fn energy(e: &Evidence) -> f64 {
    regression::fit(e.long.iter().map(|x| ([1.0], x.ui))).map_or(0.0, |f| f.t[0])
}

fn significant(t: f64) -> Option<bool> {
    (t.abs() > T_SIGN).then_some(t > 0.0)
}

fn magnet(s: &Signals<'_>, e: &Evidence) -> Option<DataFinding> {
    let fit = e.magnet.as_ref()?;
    if e.unexplained(Kind::PmDc)? > MOST_UNEXPLAINED {
        return None;
    }
    let resistance = significant(fit.t[1]);
    let constant = significant(fit.t[3]);
    let inertia = torque_with_magnet(&e.long).and_then(|f| significant(f.t[1]));
    let text = |channel: Channel| match channel {
        Channel::Voltage => "it opposes the current through the winding and the speed",
        Channel::Current => "it opposes the voltage, and the acceleration that it causes",
        _ => "the back-EMF would drive the motor, and the torque brake it",
    };
    let channel = match (resistance, constant, inertia) {
        (Some(true), Some(false), Some(true)) => return Some(swapped(s)),
        (Some(false), Some(false), _) | (None, Some(false), Some(true)) | (Some(false), None, Some(true)) => {
            Channel::Voltage
        }
        (Some(false), Some(true), _) | (Some(false), None, Some(false)) | (None, Some(true), Some(false)) => {
            Channel::Current
        }
        (Some(true), Some(false), _) | (None, Some(false), Some(false)) | (Some(true), None, Some(false)) => {
            s.speed_channel
        }
        (Some(false), None, None) => {
            return Some(reversed(s, Channel::Current, text(Channel::Current), &[Channel::Voltage]));
        }
        (None, Some(false), None) => {
            return Some(reversed(s, s.speed_channel, text(Channel::Speed), &[Channel::Voltage]));
        }
        (None, None, Some(false)) => {
            return Some(reversed(s, s.speed_channel, text(Channel::Speed), &[Channel::Current]));
        }
        _ => return None,
    };
    Some(reversed(s, channel, text(channel), &[]))
}

fn series(s: &Signals<'_>, e: &Evidence) -> Option<DataFinding> {
    let fit = e.series.as_ref()?;
    if e.unexplained(Kind::Universal)? > MOST_UNEXPLAINED {
        return None;
    }
    let power = significant(energy(e))?;
    if !power {
        let together = fit.t[1] < -T_SIGN || fit.t[2] < -T_SIGN || fit.t[3] < -T_SIGN;
        let text = "the product of voltage and current says that the motor feeds its supply";
        return together.then(|| reversed(s, Channel::Current, text, &[Channel::Voltage]));
    }
    if fit.t[3] > -T_SIGN {
        return None;
    }
    // The torque of i² has one direction, in which the motor turns.
    let forwards = regression::fit(e.long.iter().map(|x| ([1.0], x.w))).and_then(|f| significant(f.t[0]))?;
    Some(if forwards {
        swapped(s)
    } else {
        reversed(s, s.speed_channel, "the back-EMF would drive the motor, and the torque brake it", &[])
    })
}

fn reversed(s: &Signals<'_>, channel: Channel, why: &str, or: &[Channel]) -> DataFinding {
    let or: String = or.iter().map(|c| format!(" (or that of {})", signals::name(*c))).collect();
    s.finding(
        Code::SignReversed,
        Severity::Stop,
        format!("the sign of {}{or} is reversed: {why}", signals::name(channel)),
    )
    .on(channel)
    .remedy(s.map_times(channel, -1.0))
}

fn swapped(s: &Signals<'_>) -> DataFinding {
    let [u, i] = [Channel::Voltage, Channel::Current];
    let remedy = format!("{} {}", s.source(i).map(u.column()), s.source(u).map(i.column()));
    s.finding(
        Code::ChannelsSwapped,
        Severity::Stop,
        "voltage and current stand in each other's place: no reversed sign explains how they go with the speed",
    )
    .on(Channel::Voltage)
    .remedy(remedy)
}
