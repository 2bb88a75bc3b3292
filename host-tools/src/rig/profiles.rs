//! Excitation profiles. A profile is a list of segments; its length stretches with the time asked for.
//!
//! A universal motor runs AC profiles at mains frequency. A magnet motor does not turn on mains, so it gets the same
//! amplitudes at 0.5 Hz from the amplifier and runs in both directions; only `locked` keeps the mains frequency, which
//! its electrical time constant needs.

use std::f64::consts::{PI, SQRT_2};

use super::motor::{Kind, Motor};
use super::source::{Drive, Segment, Shape};
use super::{Error, Result, SAMPLE_RATE_HZ};

/// A profile: what it is for, and how it is made.
#[derive(Debug)]
pub struct Profile {
    /// Its name in commands.
    pub id: &'static str,
    /// What it does.
    pub what: &'static str,
    /// What it identifies.
    pub identifies: &'static str,
    /// Usual length, s.
    pub seconds: f64,
    /// Whether a magnet motor can run it.
    pub pm_dc: bool,
    /// Whether the current channel needs its high range.
    pub high_current: bool,
    build: fn(&Motor, f64) -> Vec<Piece>,
}

/// A segment before it has a length: its share of the time.
struct Piece {
    share: f64,
    shape: Shape,
    drive: Drive,
    locked: bool,
}

/// Frequency of AC profiles for a magnet motor, Hz: slow against its mechanical time constant of 17 ms.
const SLOW_HZ: f64 = 0.5;

/// Shortest run, s: below that no segment of a profile would hold a period of the mains.
pub const SHORTEST_S: f64 = 0.2;
/// Longest run, s: an hour, 36 million samples.
pub const LONGEST_S: f64 = 3600.0;

/// All profiles.
pub static PROFILES: [Profile; 9] = [
    Profile {
        id: "staircase",
        what: "AC amplitude in 12 steps, up to nominal voltage and down",
        identifies: "all base parameters; flux effects by their growth with the amplitude",
        seconds: 24.0,
        pm_dc: true,
        high_current: false,
        build: staircase,
    },
    Profile {
        id: "ramp",
        what: "AC amplitude up to nominal voltage and down in a straight line",
        identifies: "all base parameters at every amplitude; slow friction effects against fast ones",
        seconds: 20.0,
        pm_dc: true,
        high_current: false,
        build: ramp,
    },
    Profile {
        id: "dc-steps",
        what: "direct voltage in steps, for a magnet motor in both directions",
        identifies: "R and the flux curve point by point; inductance at the edges; inertia from the run-ups",
        seconds: 16.0,
        pm_dc: true,
        high_current: false,
        build: dc_steps,
    },
    Profile {
        id: "dc-ramp",
        what: "direct voltage up and down slowly, for a magnet motor in both directions",
        identifies: "hysteresis, which stays at DC, against eddy lag and delay, which vanish; dry friction",
        seconds: 20.0,
        pm_dc: true,
        high_current: false,
        build: dc_ramp,
    },
    Profile {
        id: "coast-down",
        what: "run up, then the supply open until standstill",
        identifies: "friction and load by themselves; remanence, as the voltage that is left; current offset",
        seconds: 20.0,
        pm_dc: true,
        high_current: false,
        build: coast_down,
    },
    Profile {
        id: "locked",
        what: "AC at five amplitudes with the rotor held",
        identifies: "R, L and what depends on the current alone: brush drop, L(i), compression; no back-EMF",
        seconds: 6.0,
        pm_dc: true,
        high_current: false,
        build: locked,
    },
    Profile {
        id: "phase-angle",
        what: "TRIAC control at nominal voltage, firing angle from 150 to 30 degrees and back",
        identifies: "inductive effects from rich harmonics; offsets and remanence in the gaps of the current",
        seconds: 20.0,
        pm_dc: false,
        high_current: false,
        build: phase_angle,
    },
    Profile {
        id: "steady",
        what: "soft start, then nominal voltage",
        identifies: "drifts: winding temperature, bearing warm-up; too little else to identify from",
        seconds: 10.0,
        pm_dc: true,
        high_current: false,
        build: steady,
    },
    Profile {
        id: "start",
        what: "direct start at nominal voltage",
        identifies: "deep saturation, and the inertia",
        seconds: 6.0,
        pm_dc: true,
        high_current: true,
        build: start,
    },
];

impl Profile {
    /// The profile of that name.
    ///
    /// # Errors
    /// An unknown name; the message lists the known ones, the nearest first.
    pub fn find(id: &str) -> Result<&'static Self> {
        let known = || PROFILES.iter().map(|p| p.id);
        PROFILES.iter().find(|p| p.id == id).ok_or_else(|| super::Error::unknown("profile", id, known(), "known are"))
    }

    /// The segments for a motor, with whole samples each.
    ///
    /// # Errors
    /// A motor that cannot run the profile; an impossible length.
    pub fn segments(&self, motor: &Motor, mains_hz: f64, seconds: f64) -> Result<Vec<Segment>> {
        if motor.kind == Kind::PmDc && !self.pm_dc {
            return Err(Error::usage(
                format!("profile {} drives a universal motor only", self.id),
                "give --kind universal, or another profile, such as dc-steps",
            ));
        }
        if !(SHORTEST_S..=LONGEST_S).contains(&seconds) {
            return Err(Error::usage(
                format!("a run of {seconds} s is not possible"),
                format!("give --seconds from {SHORTEST_S} to {LONGEST_S}"),
            ));
        }
        let pieces = (self.build)(motor, mains_hz);
        let whole: f64 = pieces.iter().map(|p| p.share).sum();
        let samples = (seconds * SAMPLE_RATE_HZ).round();
        let mut share = 0.0;
        let mut begin = 0.0;
        let segments = pieces.into_iter().map(|piece| {
            share += piece.share;
            let end = (samples * share / whole).round();
            let seconds = (end - begin) / SAMPLE_RATE_HZ;
            begin = end;
            Segment { seconds, shape: piece.shape, drive: piece.drive, locked: piece.locked }
        });
        Ok(segments.filter(|s| s.seconds > 0.0).collect())
    }
}

/// Peak of the nominal voltage, V.
fn peak(motor: &Motor) -> f64 {
    match motor.kind {
        Kind::Universal => SQRT_2 * motor.nameplate.voltage_v,
        Kind::PmDc => motor.nameplate.voltage_v,
    }
}

fn ac(share: f64, frequency_hz: f64, from_v: f64, to_v: f64) -> Piece {
    Piece { share, shape: Shape::Ac { frequency_hz, from_v, to_v }, drive: Drive::Closed, locked: false }
}

fn dc(share: f64, from_v: f64, to_v: f64) -> Piece {
    Piece { share, shape: Shape::Dc { from_v, to_v }, drive: Drive::Closed, locked: false }
}

fn running_frequency(motor: &Motor, mains_hz: f64) -> f64 {
    match motor.kind {
        Kind::Universal => mains_hz,
        Kind::PmDc => SLOW_HZ,
    }
}

/// The first step keeps the standstill current below the nominal peak; the way down has other levels than the way up.
fn staircase(motor: &Motor, mains_hz: f64) -> Vec<Piece> {
    let f = running_frequency(motor, mains_hz);
    [0.12, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0, 0.9, 0.65, 0.45, 0.3, 0.15]
        .map(|level| ac(1.0, f, level * peak(motor), level * peak(motor)))
        .into()
}

fn ramp(motor: &Motor, mains_hz: f64) -> Vec<Piece> {
    let f = running_frequency(motor, mains_hz);
    vec![ac(1.0, f, 0.0, peak(motor)), ac(1.0, f, peak(motor), 0.0)]
}

/// A universal motor gets up to 70 % of its AC voltage: the power of nominal operation with room for the edges.
fn dc_steps(motor: &Motor, _: f64) -> Vec<Piece> {
    let v = motor.nameplate.voltage_v;
    match motor.kind {
        Kind::Universal => {
            [0.06, 0.15, 0.25, 0.4, 0.55, 0.7, 0.6, 0.3].map(|level| dc(1.0, level * v, level * v)).into()
        }
        Kind::PmDc => [0.1, 0.3, 0.6, 1.0, 0.5, 0.2, 0.0, -0.2, -0.5, -1.0, -0.6, -0.3, -0.1, 0.0, 0.8, -0.8]
            .map(|level| dc(1.0, level * v, level * v))
            .into(),
    }
}

fn dc_ramp(motor: &Motor, _: f64) -> Vec<Piece> {
    let v = motor.nameplate.voltage_v;
    match motor.kind {
        Kind::Universal => vec![dc(1.0, 0.0, 0.7 * v), dc(1.0, 0.7 * v, 0.0)],
        Kind::PmDc => vec![dc(1.0, 0.0, v), dc(2.0, v, -v), dc(1.0, -v, 0.0)],
    }
}

/// A magnet motor coasts for a second only, so it does so six times, in both directions.
fn coast_down(motor: &Motor, mains_hz: f64) -> Vec<Piece> {
    let top = peak(motor);
    let off = |piece: Piece| Piece { drive: Drive::Off, ..piece };
    match motor.kind {
        Kind::Universal => {
            vec![ac(3.0, mains_hz, 0.1 * top, top), ac(1.0, mains_hz, top, top), off(ac(16.0, mains_hz, top, top))]
        }
        Kind::PmDc => [1.0, -1.0, 0.6, -0.6, 0.3, -0.3]
            .into_iter()
            .map(|level| level * top)
            .flat_map(|v| [dc(0.5, 0.0, v), dc(0.5, v, v), off(dc(2.0, v, v))])
            .collect(),
    }
}

/// Amplitudes for 6, 15, 35, 70 and 100 % of the nominal peak current through |R + jΩL|.
fn locked(motor: &Motor, mains_hz: f64) -> Vec<Piece> {
    let reactance = 2.0 * PI * mains_hz * motor.l;
    let nominal = motor.nameplate.peak_current_a * motor.r.hypot(reactance);
    [0.06, 0.15, 0.35, 0.7, 1.0]
        .map(|level| Piece { locked: true, ..ac(1.0, mains_hz, level * nominal, level * nominal) })
        .into()
}

fn phase_angle(motor: &Motor, mains_hz: f64) -> Vec<Piece> {
    let piece = |share, from: f64, to: f64| Piece {
        drive: Drive::Triac { from_rad: from.to_radians(), to_rad: to.to_radians() },
        ..ac(share, mains_hz, peak(motor), peak(motor))
    };
    vec![piece(8.0, 150.0, 60.0), piece(3.0, 60.0, 60.0), piece(3.0, 60.0, 30.0), piece(6.0, 30.0, 120.0)]
}

fn steady(motor: &Motor, mains_hz: f64) -> Vec<Piece> {
    let top = peak(motor);
    match motor.kind {
        Kind::Universal => vec![ac(0.15, mains_hz, 0.1 * top, top), ac(0.85, mains_hz, top, top)],
        Kind::PmDc => vec![dc(0.15, 0.0, top), dc(0.85, top, top)],
    }
}

fn start(motor: &Motor, mains_hz: f64) -> Vec<Piece> {
    let top = peak(motor);
    match motor.kind {
        Kind::Universal => vec![ac(1.0, mains_hz, top, top)],
        Kind::PmDc => vec![dc(1.0, top, top)],
    }
}
