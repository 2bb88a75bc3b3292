//! Physical effects beyond the base model: a file each, listed once in `catalogue!` below.
//!
//! An effect changes the terms of the voltage and torque balance ([`Balance`]); the stepper, the fit and the firmware
//! take it from there. A new effect is one new file and one line here.

mod saturation;
mod torque_offset;

use crate::motor::{Balance, OperatingPoint, ParameterError};
use crate::scalar::Scalar;

pub use saturation::Saturation;
pub use torque_offset::TorqueOffset;

/// How many effects a model can combine.
pub const MAX_EFFECTS: usize = 8;

/// How many parameters an effect has at most.
pub const MAX_EFFECT_PARAMETERS: usize = 4;

/// A parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectParameter {
    /// Name within the effect.
    pub name: &'static str,
    /// Unit of a rotary drive.
    pub unit: &'static str,
    /// Physical range.
    pub range: (f64, f64),
    /// Where a fit starts.
    pub start: f64,
    /// What it is.
    pub meaning: &'static str,
}

/// What an effect is, in words and equations.
#[derive(Debug, Clone, Copy)]
pub struct Description {
    /// Identifier in commands and files.
    pub id: &'static str,
    /// The field's name of it.
    pub name: &'static str,
    /// The equation, with units.
    pub equation: &'static str,
    /// Its parameters.
    pub parameters: &'static [EffectParameter],
    /// What it leaves in the residual of a model without it.
    pub signature: &'static str,
    /// Effects that look alike.
    pub confused_with: &'static [&'static str],
    /// The recording that tells them apart.
    pub separated_by: &'static str,
    /// Where the equation comes from.
    pub source: &'static str,
}

/// A physical effect: its description, its parameters' values, and what it does to the balance.
pub trait PhysicalEffect<S: Scalar<Base = S>>: Copy {
    /// What it is.
    const DESCRIPTION: Description;
    /// From values in the order of [`Description::parameters`]; values that are missing are zero.
    fn from_values(values: &[S]) -> Self;
    /// The values in the order of [`Description::parameters`].
    fn values(&self) -> [S; MAX_EFFECT_PARAMETERS];
    /// Changes the balance at an operating point.
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, balance: &mut Balance<N>);
}

macro_rules! catalogue {
    ($($variant:ident),+ $(,)?) => {
        /// Any effect of the catalogue.
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[allow(missing_docs)]
        pub enum Effect<S> {
            $($variant($variant<S>),)+
        }

        impl<S: Scalar<Base = S>> Effect<S> {
            /// All descriptions, in the catalogue's order.
            pub const CATALOGUE: &'static [Description] =
                &[$(<$variant<S> as PhysicalEffect<S>>::DESCRIPTION,)+];

            /// The effect with an identifier and values in the order of its parameters.
            pub fn from_id(id: &str, values: &[S]) -> Option<Self> {
                $(
                    if id == <$variant<S> as PhysicalEffect<S>>::DESCRIPTION.id {
                        return Some(Self::$variant(PhysicalEffect::from_values(values)));
                    }
                )+
                None
            }

            /// What it is.
            pub fn description(&self) -> &'static Description {
                match self {
                    $(Self::$variant(_) => &<$variant<S> as PhysicalEffect<S>>::DESCRIPTION,)+
                }
            }

            /// The values of its parameters.
            pub fn values(&self) -> [S; MAX_EFFECT_PARAMETERS] {
                match self {
                    $(Self::$variant(effect) => effect.values(),)+
                }
            }

            /// Changes the balance at an operating point.
            #[inline(always)]
            pub fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, balance: &mut Balance<N>) {
                match self {
                    $(Self::$variant(effect) => effect.contribute(at, balance),)+
                }
            }
        }
    };
}

catalogue!(Saturation, TorqueOffset);

impl<S: Scalar<Base = S>> Effect<S> {
    /// Checks that all values are finite and within their physical ranges.
    ///
    /// # Errors
    /// The first value that is not.
    pub fn validate(&self) -> Result<(), ParameterError> {
        for (value, parameter) in self.values().into_iter().zip(self.description().parameters) {
            if !value.is_finite() {
                return Err(ParameterError::NotFinite(parameter.name));
            }
            let (least, greatest) = parameter.range;
            if value < S::constant(least) || value > S::constant(greatest) {
                return Err(ParameterError::OutOfRange { name: parameter.name, least, greatest });
            }
        }
        Ok(())
    }
}
