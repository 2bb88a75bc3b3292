//! The variables by which a simulator speaks of a model: what it sets, what it reads, and the numbers that it knows
//! them by.
//!
//! A simulator that imports a model (by the Functional Mock-up Interface, say) reads from a description which variables
//! there are, and asks for them by numbers. The host writes the description, and what runs in the simulator answers;
//! both take the numbers from here.
//!
//! | number | variable |
//! | --- | --- |
//! | 0 … 5 | time; voltage and load; current, speed and torque |
//! | 8, 9 | current and speed at the begin |
//! | 16 + k | base parameter k, in the order of [`BaseParameter::ALL`] |
//! | 64 + 8 n + k | parameter k of effect n, in the order of [`Settings::effects`] |
//! | 256 + 8 n + k | unknown k of term n, in the order of [`Settings::terms`] |

use crate::effects::{Effect, MAX_EFFECT_PARAMETERS, MAX_EFFECTS};
use crate::motor::{BaseParameter, MAX_TERMS, Parameters};
use crate::parameters::Settings;
use crate::term::MAX_UNKNOWNS;

/// Numbers from one effect, or one term, to the next.
const STRIDE: u32 = 8;
const BASE: u32 = 16;
const EFFECTS: u32 = 64;
const TERMS: u32 = 256;

const _: () = {
    assert!(MAX_EFFECT_PARAMETERS <= STRIDE as usize && MAX_UNKNOWNS <= STRIDE as usize);
    assert!(BASE as usize + BaseParameter::ALL.len() <= EFFECTS as usize);
    assert!(EFFECTS as usize + MAX_EFFECTS * STRIDE as usize <= TERMS as usize);
};

/// A variable of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variable {
    /// The independent variable, s.
    Time,
    /// Input: the supply voltage, V.
    Voltage,
    /// Input: a torque (N m) or force (N) that brakes a motion in the positive direction.
    Load,
    /// Output: the current as the measuring chain shows it, A.
    Current,
    /// Output: the speed as the measuring chain shows it, rad/s or m/s.
    Speed,
    /// Output: K φ i, the torque (N m) or force (N) that current and flux make.
    Torque,
    /// The current at the begin, A.
    StartCurrent,
    /// The speed at the begin, rad/s or m/s.
    StartSpeed,
    /// A parameter of the base model.
    Base(BaseParameter),
    /// A parameter of an effect.
    Effect {
        /// The effect's place in [`Settings::effects`].
        place: usize,
        /// The parameter's place in the effect's description.
        parameter: usize,
    },
    /// An unknown of a term of the user's own.
    Term {
        /// The term's place in [`Settings::terms`].
        place: usize,
        /// The unknown's place in the term.
        unknown: usize,
    },
}

impl Variable {
    /// The number by which a simulator knows it.
    pub fn number(self) -> u32 {
        match self {
            Self::Time => 0,
            Self::Voltage => 1,
            Self::Load => 2,
            Self::Current => 3,
            Self::Speed => 4,
            Self::Torque => 5,
            Self::StartCurrent => 8,
            Self::StartSpeed => 9,
            Self::Base(parameter) => BASE + parameter as u32,
            Self::Effect { place, parameter } => EFFECTS + STRIDE * place as u32 + parameter as u32,
            Self::Term { place, unknown } => TERMS + STRIDE * place as u32 + unknown as u32,
        }
    }

    /// The variable with a number; a model need not have it.
    pub fn with_number(number: u32) -> Option<Self> {
        let within = |first: u32| (((number - first) / STRIDE) as usize, ((number - first) % STRIDE) as usize);
        Some(match number {
            0 => Self::Time,
            1 => Self::Voltage,
            2 => Self::Load,
            3 => Self::Current,
            4 => Self::Speed,
            5 => Self::Torque,
            8 => Self::StartCurrent,
            9 => Self::StartSpeed,
            TERMS.. => {
                let (place, unknown) = within(TERMS);
                (place < MAX_TERMS && unknown < MAX_UNKNOWNS).then_some(Self::Term { place, unknown })?
            }
            EFFECTS.. => {
                let (place, parameter) = within(EFFECTS);
                (place < MAX_EFFECTS && parameter < MAX_EFFECT_PARAMETERS)
                    .then_some(Self::Effect { place, parameter })?
            }
            BASE.. => Self::Base(*BaseParameter::ALL.get((number - BASE) as usize)?),
            _ => return None,
        })
    }

    /// The value of a parameter; `None` for what is no parameter of these settings.
    pub fn value(self, settings: &Settings) -> Option<f32> {
        match self {
            Self::Base(parameter) => settings.motor.values().get(parameter as usize).copied(),
            Self::Effect { place, parameter } => {
                let effect = settings.effects.get(place)?;
                effect.description().parameters.get(parameter)?;
                effect.values().get(parameter).copied()
            }
            Self::Term { place, unknown } => settings.terms.get(place)?.unknowns().get(unknown).copied(),
            _ => None,
        }
    }

    /// Gives a parameter a value, which is not checked; `None` for what is no parameter of these settings.
    pub fn set(self, settings: &mut Settings, value: f32) -> Option<()> {
        self.value(settings)?;
        match self {
            Self::Base(parameter) => {
                let mut values = settings.motor.values();
                *values.get_mut(parameter as usize)? = value;
                settings.motor = Parameters::from_values(settings.motor.flux_law, values);
            }
            Self::Effect { place, parameter } => {
                let effect = settings.effects.get_mut(place)?;
                let mut values = effect.values();
                *values.get_mut(parameter)? = value;
                *effect = Effect::new(effect.id(), &values);
            }
            Self::Term { place, unknown } => {
                let term = settings.terms.get_mut(place)?;
                let mut unknowns = term.unknowns();
                *unknowns.get_mut(unknown)? = value;
                *term = term.with_unknowns(unknowns);
            }
            _ => return None,
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_variable_has_a_number_of_its_own() {
        let known = (0..1000).filter_map(|n| Some((n, Variable::with_number(n)?)));
        let mut count = 0;
        for (number, variable) in known {
            assert_eq!(variable.number(), number, "{variable:?}");
            count += 1;
        }
        assert_eq!(count, 8 + 7 + MAX_EFFECTS * MAX_EFFECT_PARAMETERS + MAX_TERMS * MAX_UNKNOWNS);
    }
}
