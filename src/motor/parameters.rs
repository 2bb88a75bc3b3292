//! The physical parameters of the base model and what values they may have.

use core::fmt;

use crate::scalar::Scalar;

/// How many effects a model can combine.
pub const MAX_EFFECTS: usize = 8;

/// How the magnetic flux depends on the current.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum FluxLaw {
    /// Universal (series) motor: field and armature carry the same current, flux ∝ i. K in V s/(rad A).
    #[default]
    Series,
    /// Permanent-magnet motor: constant flux. K in V s/rad.
    PermanentMagnet,
}

/// Parameters of the base model, in SI units.
///
/// | field | symbol | unit |
/// |---|---|---|
/// | `resistance` | R | Ω (field and armature together) |
/// | `inductance` | L | H (field and armature together) |
/// | `flux_coefficient` | K | V s/(rad A) series, V s/rad permanent magnet |
/// | `inertia` | J | kg m² (kg of a linear drive) |
/// | `dry_friction` | μ0 | N m |
/// | `viscous_friction` | μ1 | N m s/rad |
/// | `turbulent_friction` | μ2 | N m s²/rad² |
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Parameters<S> {
    /// How the flux depends on the current.
    pub flux_law: FluxLaw,
    /// R, Ω.
    pub resistance: S,
    /// L, H.
    pub inductance: S,
    /// K, V s/(rad A) or V s/rad.
    pub flux_coefficient: S,
    /// J, kg m².
    pub inertia: S,
    /// μ0, N m.
    pub dry_friction: S,
    /// μ1, N m s/rad.
    pub viscous_friction: S,
    /// μ2, N m s²/rad².
    pub turbulent_friction: S,
}

/// A parameter that no motor can have, named by its symbol.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParameterError {
    /// NaN or infinite.
    NotFinite(&'static str),
    /// Outside the admitted range.
    OutOfRange {
        /// The symbol.
        name: &'static str,
        /// Smallest admitted value.
        least: f64,
        /// Largest admitted value.
        greatest: f64,
    },
    /// More effects than the model has room for.
    TooManyEffects,
    /// The motor would change its speed or current beyond all bounds within one sampling interval.
    FasterThanSampling,
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite(name) => write!(f, "{name} is not a finite number"),
            Self::OutOfRange { name, least, greatest } => {
                write!(f, "{name} must lie between {least:e} and {greatest:e}")
            }
            Self::FasterThanSampling => {
                write!(f, "the motor is faster than the sampling: J is too small for K, mu2 and this sampling rate")
            }
            Self::TooManyEffects => {
                write!(f, "at most {} effects can be combined", MAX_EFFECTS)
            }
        }
    }
}

impl core::error::Error for ParameterError {}

/// Admitted ranges. They span watch motors to traction drives; within them no intermediate result of the stepper
/// leaves the range of `f32`. Friction may be slightly negative: a fit that wants that tells of missing physics, and
/// the model must still run so that the fit can be looked at.
pub(crate) const RANGES: [(&str, f64, f64); 7] = [
    ("R", 1e-4, 1e5),
    ("L", 1e-7, 1e2),
    ("K", 1e-7, 1e4),
    ("J", 1e-10, 1e5),
    ("mu0", -1e4, 1e5),
    ("mu1", -1e4, 1e5),
    ("mu2", -1e2, 1e4),
];

impl<S: Scalar<Base = S>> Parameters<S> {
    /// The values in the order R, L, K, J, μ0, μ1, μ2.
    pub fn values(&self) -> [S; 7] {
        [
            self.resistance,
            self.inductance,
            self.flux_coefficient,
            self.inertia,
            self.dry_friction,
            self.viscous_friction,
            self.turbulent_friction,
        ]
    }

    /// Sets the values in the order R, L, K, J, μ0, μ1, μ2.
    pub fn from_values(flux_law: FluxLaw, values: [S; 7]) -> Self {
        let [resistance, inductance, flux_coefficient, inertia, dry_friction, viscous_friction, turbulent_friction] =
            values;
        Self {
            flux_law,
            resistance,
            inductance,
            flux_coefficient,
            inertia,
            dry_friction,
            viscous_friction,
            turbulent_friction,
        }
    }

    /// Checks every value against its admitted range.
    ///
    /// # Errors
    /// The first parameter that is not finite or out of range.
    pub fn validate(&self) -> Result<(), ParameterError> {
        for (value, (name, least, greatest)) in self.values().into_iter().zip(RANGES) {
            if !value.is_finite() {
                return Err(ParameterError::NotFinite(name));
            }
            if value < S::constant(least) || value > S::constant(greatest) {
                return Err(ParameterError::OutOfRange { name, least, greatest });
            }
        }
        Ok(())
    }
}
