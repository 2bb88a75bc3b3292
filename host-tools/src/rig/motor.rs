//! The motors on the rig: base parameters, nameplate, and the spread of a production lot.
//!
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | R, L | resistance and inductance of the whole circuit | Ω, H |
//! | K | flux coefficient: V s/(rad A) of a series motor, V s/rad of a magnet motor | |
//! | J | inertia of rotor and load | kg m² |
//! | μ0, μ1, μ2 | dry, viscous and turbulent load torque | N m, N m s, N m s² |

use std::f64::consts::TAU;

use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;

use super::streams::{Purpose, Streams};
pub use crate::model::Kind;

/// What the nameplate says: the scale of profiles, measuring ranges and effects.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Nameplate {
    /// Supply voltage, V: RMS for a universal motor, DC for a magnet motor.
    pub voltage_v: f64,
    /// Peak current in nominal operation (universal), at stall (magnet motor), A.
    pub peak_current_a: f64,
    /// RMS current in nominal operation, A.
    pub rms_current_a: f64,
    /// Speed in nominal operation, rad/s.
    pub speed_rad_s: f64,
}

/// A motor with its load.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Motor {
    /// How the flux arises.
    pub kind: Kind,
    /// Resistance, Ω.
    pub r: f64,
    /// Inductance, H, below saturation.
    pub l: f64,
    /// Flux coefficient, V s/(rad A) or V s/rad.
    pub k: f64,
    /// Inertia, kg m².
    pub j: f64,
    /// Dry friction, N m.
    pub mu0: f64,
    /// Viscous friction, N m s.
    pub mu1: f64,
    /// Turbulent load, N m s².
    pub mu2: f64,
    /// The part of L that belongs to the main flux, L_m/L: it saturates, has hysteresis and eddy lag; the rest leaks.
    pub main_share: f64,
    /// The nameplate of the type (the same for every unit of it).
    pub nameplate: Nameplate,
}

impl Motor {
    /// A vacuum-cleaner motor of the 1.4 kW class, 230 V 50 Hz, 550 rev/s (the speed that Rakar and Juričić name).
    ///
    /// The operating point fixes most figures; the rest is geometry. At 6.5 A RMS the balance is
    /// 1471 W in = 93 W copper + 1378 W air gap, and |R + Kω + jΩL| = 230/6.5 = 35.4 Ω at Ω = 2π·50 rad/s:
    ///
    /// - R = 2.2 Ω: copper loss of 6 % of the input, usual in this class.
    /// - L = 20 mH: power factor cos φ = 0.984, so ΩL = 35.4 Ω · sin φ = 6.3 Ω.
    /// - K = 9.45 mV s/(rad A): R + Kω = 35.4 Ω · cos φ = 34.85 Ω, at 3455 rad/s.
    /// - J = 1.8e-4 kg m²: steel armature of 40 mm by 35 mm (0.35 kg, 7e-5) and two aluminium impellers of about 105 mm
    ///   (60 g, 5.5e-5 each), an estimate.
    /// - μ0 = 15 mN m: brush and bearing friction, 10–20 and 2–5 mN m, an estimate.
    /// - μ1 = 8e-6 N m s: bearing and laminar leakage, 28 mN m at nominal speed, an estimate.
    /// - μ2 = 2.98e-8 N m s²: what is left of K I² = 0.399 N m for the turbine, at ω².
    /// - L_m/L = 0.6: field winding against leakage of a two-pole series motor, an estimate (0.5–0.7).
    pub const fn universal() -> Self {
        Self {
            kind: Kind::Universal,
            r: 2.2,
            l: 20e-3,
            k: 9.45e-3,
            j: 1.8e-4,
            mu0: 0.015,
            mu1: 8e-6,
            mu2: 2.98e-8,
            main_share: 0.6,
            nameplate: Nameplate {
                voltage_v: 230.0,
                peak_current_a: 9.19,
                rms_current_a: 6.5,
                speed_rad_s: 550.0 * TAU,
            },
        }
    }

    /// A small brushed motor with magnets, 24 V.
    ///
    /// - R = 3.4 Ω, L = 2.85 mH: measured apart on the motor of the public data set FRA233.
    /// - K = 46.2 mV s/rad, J = 1.06e-5 kg m²: fits to that set's voltage and speed (u = kV ω + kA dω/dt with
    ///   kV = 0.0462 V s/rad; kA = 7.8e-4 V s²/rad = R J/K).
    /// - μ1 = 4e-5 N m s: a small eddy-current brake as load, 20 mN m at nominal speed, chosen.
    /// - No dry friction: the base of this kind is viscous alone, and `coulomb_friction` is an effect of it.
    ///
    /// The peak current is that of stall, 24 V/3.4 Ω; the speed is K u/(K² + R μ1) at 24 V.
    pub const fn pm_dc() -> Self {
        Self {
            kind: Kind::PmDc,
            r: 3.4,
            l: 2.85e-3,
            k: 46.2e-3,
            j: 1.06e-5,
            mu0: 0.0,
            mu1: 4e-5,
            mu2: 0.0,
            main_share: 0.0,
            nameplate: Nameplate { voltage_v: 24.0, peak_current_a: 7.06, rms_current_a: 0.423, speed_rad_s: 488.4 },
        }
    }

    /// The nominal motor of a kind.
    pub const fn nominal(kind: Kind) -> Self {
        match kind {
            Kind::Universal => Self::universal(),
            Kind::PmDc => Self::pm_dc(),
        }
    }

    /// One motor of a production lot: each of the seven parameters scatters on its own, lognormally about the nominal
    /// value with relative standard deviation `spread` (0.03 is 3 %), cut at three standard deviations because the
    /// factory sorts out what lies beyond. The nameplate stays that of the type.
    pub fn sample_from_population(nominal: &Self, spread: f64, seed: u64) -> Self {
        let mut rng = Streams::new(seed).stream(Purpose::Population);
        let mut scatter = |value: f64| {
            let z = loop {
                let z: f64 = StandardNormal.sample(&mut rng);
                if z.abs() <= 3.0 {
                    break z;
                }
            };
            value * (spread * z).exp()
        };
        Self {
            r: scatter(nominal.r),
            l: scatter(nominal.l),
            k: scatter(nominal.k),
            j: scatter(nominal.j),
            mu0: scatter(nominal.mu0),
            mu1: scatter(nominal.mu1),
            mu2: scatter(nominal.mu2),
            ..*nominal
        }
    }

    /// The base parameters under the names of the interface.
    pub fn parameters(&self) -> [(&'static str, f64); 7] {
        [
            ("R", self.r),
            ("L", self.l),
            ("K", self.k),
            ("J", self.j),
            ("mu0", self.mu0),
            ("mu1", self.mu1),
            ("mu2", self.mu2),
        ]
    }
}
