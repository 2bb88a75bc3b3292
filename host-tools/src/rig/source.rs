//! The supply: what voltage a profile asks for, and how the contact to the motor opens and closes.

use std::f64::consts::{PI, TAU};

/// Shape of the voltage in a segment. Amplitudes change linearly from the segment's begin to its end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// û sin(2π f t), t from the begin of the run, so that the phase runs on through all segments.
    Ac {
        /// Frequency, Hz.
        frequency_hz: f64,
        /// Peak voltage at the segment's begin, V.
        from_v: f64,
        /// Peak voltage at its end, V.
        to_v: f64,
    },
    /// Direct voltage.
    Dc {
        /// Voltage at the segment's begin, V.
        from_v: f64,
        /// Voltage at its end, V.
        to_v: f64,
    },
}

/// How the contact is driven in a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// Connected throughout.
    Closed,
    /// A TRIAC: fires at an angle after each zero of the voltage, conducts until the current is zero.
    Triac {
        /// Firing angle at the segment's begin, rad.
        from_rad: f64,
        /// Firing angle at its end, rad.
        to_rad: f64,
    },
    /// Switched off: on AC the current runs to its next zero, on DC a diode takes it over; then the terminals are open.
    Off,
}

/// A stretch of a run with one shape of voltage and one way of switching.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Length, s; a whole number of samples.
    pub seconds: f64,
    /// The voltage.
    pub shape: Shape,
    /// The contact.
    pub drive: Drive,
    /// Whether the rotor is clamped.
    pub locked: bool,
}

impl Segment {
    /// Largest voltage, V.
    pub fn peak_v(&self) -> f64 {
        let (Shape::Ac { from_v, to_v, .. } | Shape::Dc { from_v, to_v }) = self.shape;
        from_v.abs().max(to_v.abs())
    }

    /// Makes all of its voltage so many times as large.
    pub fn scale(&mut self, factor: f64) {
        let (Shape::Ac { from_v, to_v, .. } | Shape::Dc { from_v, to_v }) = &mut self.shape;
        *from_v *= factor;
        *to_v *= factor;
    }
}

/// Forward drop of the freewheeling diode, V (silicon, at a few amperes).
pub const DIODE_DROP_V: f64 = 0.7;

/// Gate pulses stop this much before the next zero of the voltage, rad: a TRIAC fired later might not latch.
const GATE_MARGIN_RAD: f64 = 10.0 * PI / 180.0;

/// A segment in a run: the voltage as a function of time.
#[derive(Debug, Clone, Copy)]
pub struct Waveform {
    segment: Segment,
    begin_s: f64,
    /// Fifth harmonic as a fraction of the fundamental, in the phase that flattens the top.
    fifth: f64,
    /// Factor of the mains fluctuation, constant within a sample.
    pub level: f64,
}

impl Waveform {
    /// A segment that begins at `begin_s`, on mains with a fifth harmonic.
    pub fn new(segment: Segment, begin_s: f64, fifth: f64) -> Self {
        Self { segment, begin_s, fifth, level: 1.0 }
    }

    fn progress(&self, t: f64) -> f64 {
        (t - self.begin_s) / self.segment.seconds
    }

    /// The voltage at time `t` of the run, V.
    pub fn at(&self, t: f64) -> f64 {
        match self.segment.shape {
            Shape::Ac { frequency_hz, from_v, to_v } => {
                let peak = self.level * (from_v + (to_v - from_v) * self.progress(t));
                peak * self.flattened((TAU * frequency_hz * t).sin())
            }
            Shape::Dc { from_v, to_v } => self.level * (from_v + (to_v - from_v) * self.progress(t)),
        }
    }

    /// sin x − a sin 5x, from sin x alone.
    fn flattened(&self, s: f64) -> f64 {
        if self.fifth == 0.0 {
            return s;
        }
        let q = s * s;
        s - self.fifth * s * (5.0 + q * (16.0 * q - 20.0))
    }

    /// The voltage at equidistant times from `t` on: the same as [`Waveform::at`], by turning a phasor.
    pub fn fill(&self, t: f64, dt: f64, out: &mut [f64]) {
        match self.segment.shape {
            Shape::Ac { frequency_hz, from_v, to_v } => {
                let (mut sin, mut cos) = (TAU * frequency_hz * t).sin_cos();
                let (turn_sin, turn_cos) = (TAU * frequency_hz * dt).sin_cos();
                let mut peak = self.level * (from_v + (to_v - from_v) * self.progress(t));
                let rise = self.level * (to_v - from_v) * dt / self.segment.seconds;
                for u in out {
                    *u = peak * self.flattened(sin);
                    (sin, cos) = (sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin);
                    peak += rise;
                }
            }
            Shape::Dc { .. } => {
                for (n, u) in out.iter_mut().enumerate() {
                    *u = self.at(t + n as f64 * dt);
                }
            }
        }
    }

    /// When the gate of a TRIAC is on in the half-wave that `t` belongs to: begin and end, s. None without a TRIAC.
    pub fn gate(&self, t: f64) -> Option<(f64, f64)> {
        let (Drive::Triac { from_rad, to_rad }, Shape::Ac { frequency_hz, .. }) =
            (self.segment.drive, self.segment.shape)
        else {
            return None;
        };
        let rate = TAU * frequency_hz;
        // The margin keeps a `t` that sits on a zero, but for rounding, in the half-wave that begins there.
        let half_wave = (rate * t / PI + 1e-9).floor() * PI;
        let angle = from_rad + (to_rad - from_rad) * self.progress(half_wave / rate).clamp(0.0, 1.0);
        Some(((half_wave + angle) / rate, (half_wave + PI - GATE_MARGIN_RAD) / rate))
    }

    /// Whether the supply is direct.
    pub fn is_dc(&self) -> bool {
        matches!(self.segment.shape, Shape::Dc { .. })
    }
}
