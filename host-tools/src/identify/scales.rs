//! Typical sizes of the quantities in a set of recordings: what start values and step sizes are relative to.

use greyrig::effects::Relative;

use crate::experiment::{Drive, Experiment};
use crate::model::Kind;

/// The largest values in a set of recordings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// V.
    pub voltage: f64,
    /// A.
    pub current: f64,
    /// The largest integral of the squared current over a recording, A² s.
    pub heat: f64,
    /// rad/s.
    pub speed: f64,
    /// A tenth of the largest driving torque, N m: the size that friction has.
    pub friction: f64,
}

impl Scales {
    /// From recordings of a kind of motor, with K (V s/(rad A) or V s/rad) for the torque and R (Ω) for a current that
    /// was not recorded.
    pub fn of(kind: Kind, k: f64, r: f64, experiments: &[Experiment]) -> Self {
        let [mut voltage, mut current, mut heat, mut torque, mut speed] = [0.0f64; 5];
        let largest = |signal: &[f64]| signal.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let flux = |i: f64| if kind == Kind::Universal { i } else { 1.0 };
        for e in experiments {
            if let Some(w) = &e.speed {
                speed = speed.max(largest(w));
            }
            match (e.drive, &e.current) {
                (Drive::Torque, _) => torque = torque.max(largest(&e.input)),
                (Drive::Voltage, Some(i)) => {
                    voltage = voltage.max(largest(&e.input));
                    current = current.max(largest(i));
                    heat = heat.max(i.iter().map(|i| i * i).sum::<f64>() * e.interval_s);
                    if !(0..e.len()).all(|n| e.is_locked(n)) {
                        torque = torque.max((k * flux(largest(i)) * largest(i)).abs());
                    }
                }
                (Drive::Voltage, None) => {
                    voltage = voltage.max(largest(&e.input));
                    let i = voltage / r.max(1e-6);
                    current = current.max(i);
                    heat = heat.max(i * i * e.len() as f64 * e.interval_s);
                    torque = torque.max((k * i).abs());
                }
            }
        }
        Self {
            voltage: voltage.max(1e-9),
            current: current.max(1e-9),
            heat: heat.max(1e-18),
            speed: speed.max(1e-9),
            friction: 0.1 * torque.max(1e-12),
        }
    }

    /// The size of a friction term that goes with a power of the speed.
    pub fn friction_per_speed(&self, power: u8) -> f64 {
        match power {
            0 => self.friction,
            1 => self.friction / self.speed,
            _ => self.friction / (self.speed * self.speed),
        }
    }

    /// The size that a relative start value of one stands for.
    pub fn size(&self, relative: Relative) -> f64 {
        let Self { voltage: u, current: i, heat: q, speed: w, friction: t } = *self;
        match relative {
            Relative::Absolute => 1.0,
            Relative::Current => i,
            Relative::InverseCurrentSquared => 1.0 / (i * i),
            Relative::InverseHeat => 1.0 / q,
            Relative::Voltage => u,
            Relative::Impedance => u / i,
            Relative::ImpedancePerSpeed => u / (i * w),
            Relative::Speed => w,
            Relative::SpeedRootCurrent => w * i.sqrt(),
            Relative::InverseSpeed => 1.0 / w,
            Relative::InverseSpeedSquared => 1.0 / (w * w),
            Relative::Friction => t,
            Relative::FrictionPerSpeed => t / w,
            Relative::FrictionPerSpeedSquared => t / (w * w),
            Relative::FrictionPerCurrentSquaredSpeed => t / (i * i * w),
            Relative::FrictionPerCurrentSquaredSpeedSquared => t / (i * i * w * w),
        }
    }
}
