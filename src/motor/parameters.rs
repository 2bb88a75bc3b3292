//! The physical parameters of the base model and what values they may have.

use core::fmt;

use crate::scalar::Scalar;

/// How many effects a model can combine.
pub const MAX_EFFECTS: usize = 8;

/// How the magnetic flux depends on the current.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum FluxLaw {
    /// Universal (series) motor: field and armature carry the same current, flux ∝ i. K in V s/(rad A).
    #[default]
    Series,
    /// Permanent-magnet motor: constant flux. K in V s/rad.
    PermanentMagnet,
}

/// A parameter of the base model, by its symbol.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum BaseParameter {
    /// Resistance.
    R,
    /// Inductance.
    L,
    /// Flux coefficient.
    K,
    /// Inertia.
    J,
    /// Dry friction.
    Mu0,
    /// Viscous friction.
    Mu1,
    /// Turbulent friction.
    Mu2,
}

impl BaseParameter {
    /// All, in the order of [`Parameters::values`].
    pub const ALL: [Self; 7] = [Self::R, Self::L, Self::K, Self::J, Self::Mu0, Self::Mu1, Self::Mu2];
    /// Those of the voltage balance.
    pub const ELECTRICAL: [Self; 3] = [Self::R, Self::L, Self::K];
    /// Those that every motor has.
    pub const POSITIVE: [Self; 4] = [Self::R, Self::L, Self::K, Self::J];
    /// The friction terms, in the order of the powers of the speed that they go with.
    pub const FRICTIONS: [Self; 3] = [Self::Mu0, Self::Mu1, Self::Mu2];

    /// Name in files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::R => "R",
            Self::L => "L",
            Self::K => "K",
            Self::J => "J",
            Self::Mu0 => "mu0",
            Self::Mu1 => "mu1",
            Self::Mu2 => "mu2",
        }
    }

    /// The parameter with a name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|parameter| parameter.name() == name)
    }

    /// The power of the speed that a friction term goes with; none for what is no friction.
    pub const fn power_of_speed(self) -> Option<u8> {
        match self {
            Self::Mu0 => Some(0),
            Self::Mu1 => Some(1),
            Self::Mu2 => Some(2),
            Self::R | Self::L | Self::K | Self::J => None,
        }
    }

    /// Whether it is a friction term, which a motor can do without.
    pub const fn is_friction(self) -> bool {
        self.power_of_speed().is_some()
    }

    /// Whether it belongs to the voltage balance. (K stands in both; without a voltage it is a unit of torque.)
    pub const fn is_electrical(self) -> bool {
        matches!(self, Self::R | Self::L | Self::K)
    }

    /// Whether it is positive by nature: what is no friction.
    pub const fn is_positive(self) -> bool {
        !self.is_friction()
    }

    /// Unit of a rotary drive.
    pub const fn unit(self, flux_law: FluxLaw) -> &'static str {
        match (self, flux_law) {
            (Self::R, _) => "ohm",
            (Self::L, _) => "H",
            (Self::K, FluxLaw::Series) => "V s/(rad A)",
            (Self::K, FluxLaw::PermanentMagnet) => "V s/rad",
            (Self::J, _) => "kg m2",
            (Self::Mu0, _) => "N m",
            (Self::Mu1, _) => "N m s/rad",
            (Self::Mu2, _) => "N m s2/rad2",
        }
    }

    /// Smallest and largest value that a motor may have. They span watch motors to traction drives; within them no
    /// intermediate result of the stepper leaves the range of `f32`. Friction may be slightly negative: a fit that
    /// wants that tells of missing physics, and the model must still run so that the fit can be looked at.
    pub const fn range(self) -> (f64, f64) {
        match self {
            Self::R => (1e-4, 1e5),
            Self::L => (1e-7, 1e2),
            Self::K => (1e-7, 1e4),
            Self::J => (1e-10, 1e5),
            Self::Mu0 | Self::Mu1 => (-1e4, 1e5),
            Self::Mu2 => (-1e2, 1e4),
        }
    }
}

impl fmt::Display for BaseParameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
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
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
        for (value, parameter) in self.values().into_iter().zip(BaseParameter::ALL) {
            let (name, (least, greatest)) = (parameter.name(), parameter.range());
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
