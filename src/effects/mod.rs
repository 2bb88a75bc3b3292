//! Physical effects beyond the base model: a file each, listed once in `catalogue!` below.
//!
//! An effect changes the terms of the voltage and torque balance ([`Balance`]), or what the measuring chain shows of
//! the true state, and may remember ([`Memory`]); the stepper, the fit and the firmware take it from there. A new
//! effect is one new file and one line here. What few motors have is not inlined: the microcontroller leaves it in its
//! slower memory. The list is in the order in which effects act: what magnetises first, then what the flux does, the
//! circuit, the rotor, and at last the measuring chain.
//! # Example
//! ```
//! use greyrig::effects::{Effect, EffectId, UnknownEffect};
//!
//! let id: EffectId = "brush_drop".parse()?;
//! assert_eq!((id, id.description().size().unit), (EffectId::BrushDrop, "V"));
//!
//! // 2 V over both brushes, built up over 0.1 A.
//! let effect = Effect::<f32>::new(id, &[2.0, 0.1]);
//! assert!(effect.validate().is_ok());
//! assert!("brush drop".parse::<EffectId>().is_err());
//! # Ok::<(), UnknownEffect>(())
//! ```

/// The two conversions between an effect's named fields and the values in the order of its parameters.
macro_rules! fields {
    ($($field:ident),* $(,)?) => {
        fn from_values(values: &[S]) -> Self {
            let mut values = values.iter().copied();
            Self { $($field: values.next().unwrap_or_default()),* }
        }
        fn values(&self) -> [S; $crate::effects::MAX_EFFECT_PARAMETERS] {
            let mut all = [S::ZERO; $crate::effects::MAX_EFFECT_PARAMETERS];
            for (slot, value) in all.iter_mut().zip([$(self.$field),*]) {
                *slot = value;
            }
            all
        }
    };
}

mod description;
mod id;
mod knowledge;
mod memory;
mod separation;

use crate::motor::{Balance, OperatingPoint, ParameterError, State};
use crate::scalar::Scalar;

pub use crate::motor::MAX_EFFECTS;
pub use description::{Acts, Description, EffectParameter, Limits, Motors, Relative, Role, Seen, Traits, Turn};
pub use id::{Identifiers, UnknownEffect};
pub use knowledge::{Excitation, Prior, Representative, Sentence, Sum};
pub use separation::{InWords, Recording, Separation};

/// How many parameters an effect has at most.
pub const MAX_EFFECT_PARAMETERS: usize = 4;

/// What an effect remembers from step to step.
pub type Memory<S> = [S; 4];

/// A step that has been made.
#[derive(Debug, Clone, Copy)]
pub struct Passed<S> {
    /// Its length, s.
    pub interval: S,
    /// True current and speed at its begin.
    pub before: State<S>,
    /// True current and speed at its end.
    pub after: State<S>,
}

/// A physical effect: its description, its parameters' values, and what it does.
pub trait PhysicalEffect<S: Scalar<Base = S>>: Copy {
    /// What it is.
    const DESCRIPTION: Description;
    /// From values in the order of [`Description::parameters`]; values that are missing are zero.
    fn from_values(values: &[S]) -> Self;
    /// The values in the order of [`Description::parameters`].
    fn values(&self) -> [S; MAX_EFFECT_PARAMETERS];
    /// Changes the balance at an operating point.
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _at: &OperatingPoint<N>, _memory: &Memory<S>, _balance: &mut Balance<N>) {
    }
    /// What it remembers where a run goes on in a state, so long after it began, s: a part of a recording begins warm.
    #[inline(always)]
    fn at_start(&self, _state: State<S>, _elapsed: S) -> Memory<S> {
        Memory::default()
    }
    /// Moves the memory on over a step.
    #[inline(always)]
    fn advance(&self, _passed: &Passed<S>, _memory: &mut Memory<S>) {}
    /// What it remembers at a point that stands for the half step before and after it, instead of for the step that
    /// begins there.
    #[inline(always)]
    fn around_point(&self, memory: &Memory<S>) -> Memory<S> {
        *memory
    }
    /// Changes what the measuring chain shows.
    #[inline(always)]
    fn measure(&self, _memory: &Memory<S>, _reading: &mut State<S>) {}
}

macro_rules! catalogue {
    ($($module:ident :: $variant:ident),+ $(,)?) => {
        $(mod $module; pub use $module::$variant;)+

        /// An effect of the catalogue, by name; in the order in which effects act.
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[allow(missing_docs)]
        pub enum EffectId {
            $($variant,)+
        }

        impl EffectId {
            /// The catalogue.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)+];

            /// Identifier in commands and files.
            pub const fn id(self) -> &'static str {
                match self {
                    $(Self::$variant => stringify!($module),)+
                }
            }

            /// What a motor has to know of it.
            pub const fn traits(self) -> Traits {
                match self {
                    $(Self::$variant => const { <$variant<f64> as PhysicalEffect<f64>>::DESCRIPTION.traits() },)+
                }
            }

            /// Names and physical ranges of its parameters, and of none beyond the last one.
            pub const fn limits(self) -> &'static [Limits; MAX_EFFECT_PARAMETERS] {
                match self {
                    $(Self::$variant => const { &<$variant<f64> as PhysicalEffect<f64>>::DESCRIPTION.limits() },)+
                }
            }

            /// What it is.
            pub const fn description(self) -> &'static Description {
                match self {
                    $(Self::$variant => &<$variant<f64> as PhysicalEffect<f64>>::DESCRIPTION,)+
                }
            }
        }

        /// Any effect of the catalogue.
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[allow(missing_docs)]
        pub enum Effect<S> {
            $($variant($variant<S>),)+
        }

        impl<S: Scalar<Base = S>> Effect<S> {
            /// An effect with values in the order of its parameters; values that are missing are zero.
            pub fn new(id: EffectId, values: &[S]) -> Self {
                match id {
                    $(EffectId::$variant => Self::$variant(PhysicalEffect::from_values(values)),)+
                }
            }

            /// Its name.
            pub const fn id(&self) -> EffectId {
                match self {
                    $(Self::$variant(_) => EffectId::$variant,)+
                }
            }

            /// What it is.
            pub const fn description(&self) -> &'static Description {
                self.id().description()
            }

            /// The values of its parameters.
            pub fn values(&self) -> [S; MAX_EFFECT_PARAMETERS] {
                match self {
                    $(Self::$variant(effect) => effect.values(),)+
                }
            }

            /// Changes the balance at an operating point.
            #[inline(never)]
            pub fn contribute<N: Scalar<Base = S>>(
                &self,
                at: &OperatingPoint<N>,
                memory: &Memory<S>,
                balance: &mut Balance<N>,
            ) {
                match self {
                    $(Self::$variant(effect) => effect.contribute(at, memory, balance),)+
                }
            }

            /// Changes the balances at many operating points, each with what the effect remembers there.
            #[inline(never)]
            pub fn contribute_to_each<const PLACES: usize>(
                &self,
                points: &[(OperatingPoint<S>, S); PLACES],
                memories: &[Memory<S>; PLACES],
                balances: &mut [Balance<S>; PLACES],
            ) {
                match self {
                    $(Self::$variant(effect) => {
                        for n in 0..PLACES {
                            effect.contribute(&points[n].0, &memories[n], &mut balances[n]);
                        }
                    })+
                }
            }

            /// What it remembers where a run goes on in a state, so long after it began, s.
            pub fn at_start(&self, state: State<S>, elapsed: S) -> Memory<S> {
                match self {
                    $(Self::$variant(effect) => effect.at_start(state, elapsed),)+
                }
            }

            /// Moves the memory on over a step.
            #[inline(never)]
            pub fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
                match self {
                    $(Self::$variant(effect) => effect.advance(passed, memory),)+
                }
            }

            /// What it remembers at a point that stands for the half step before and after it.
            pub fn around_point(&self, memory: &Memory<S>) -> Memory<S> {
                match self {
                    $(Self::$variant(effect) => effect.around_point(memory),)+
                }
            }

            /// Moves the memory on over many steps, and tells what it was around the end of each; a step that is none
            /// leaves it.
            #[inline(never)]
            pub fn advance_over_each(
                &self,
                passed: impl Fn(usize) -> Option<Passed<S>>,
                memory: &mut Memory<S>,
                remembered: &mut [Memory<S>],
            ) {
                match self {
                    $(Self::$variant(effect) => {
                        for (n, after) in remembered.iter_mut().enumerate() {
                            if let Some(passed) = passed(n) {
                                effect.advance(&passed, memory);
                            }
                            *after = effect.around_point(memory);
                        }
                    })+
                }
            }

            /// Changes what the measuring chain shows.
            #[inline(never)]
            pub fn measure(&self, memory: &Memory<S>, reading: &mut State<S>) {
                match self {
                    $(Self::$variant(effect) => effect.measure(memory, reading),)+
                }
            }
        }
    };
}

catalogue!(
    remanence::Remanence,
    hysteresis::Hysteresis,
    saturation::Saturation,
    armature_reaction::ArmatureReaction,
    inductance_saturation::InductanceSaturation,
    eddy_current::EddyCurrent,
    transformer_emf::TransformerEmf,
    commutation_demagnetisation::CommutationDemagnetisation,
    magnet_temperature::MagnetTemperature,
    winding_temperature::WindingTemperature,
    skin_effect::SkinEffect,
    commutation_resistance::CommutationResistance,
    voltage_offset::VoltageOffset,
    voltage_gain::VoltageGain,
    supply_dead_zone::SupplyDeadZone,
    supply_impedance::SupplyImpedance,
    converter_dead_time::ConverterDeadTime,
    brush_drop::BrushDrop,
    brush_arcing::BrushArcing,
    coulomb_friction::CoulombFriction,
    asymmetric_friction::AsymmetricFriction,
    stribeck::Stribeck,
    torque_offset::TorqueOffset,
    quadratic_load::QuadraticLoad,
    windage_exponent::WindageExponent,
    fan_dynamics::FanDynamics,
    iron_loss_drag::IronLossDrag,
    stray_load_torque::StrayLoadTorque,
    torque_ripple::TorqueRipple,
    imbalance::Imbalance,
    position_load::PositionLoad,
    bearing_warmup::BearingWarmup,
    parameter_step::ParameterStep,
    two_mass::TwoMass,
    current_compression::CurrentCompression,
    sensor_hysteresis::SensorHysteresis,
    current_gain::CurrentGain,
    current_offset::CurrentOffset,
    channel_delay::ChannelDelay,
    gain_drift::GainDrift,
    adc_clipping::AdcClipping,
    speed_ripple::SpeedRipple,
    speed_lag::SpeedLag,
    speed_sign_lost::SpeedSignLost,
    speed_gain::SpeedGain,
    adc_resolution::AdcResolution,
);

impl<S: Scalar<Base = S>> Effect<S> {
    /// Checks that all values are finite and within their physical ranges.
    ///
    /// # Errors
    /// The first value that is not.
    pub fn validate(&self) -> Result<(), ParameterError> {
        for (value, (name, least, greatest)) in self.values().into_iter().zip(*self.id().limits()) {
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
