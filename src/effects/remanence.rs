//! Remanent flux: what is left in the iron when the current is switched off.
//!
//! `K (i + i_r) ω` and `K (i + i_r) i`, with the remanence as an equivalent magnetising current i_r.
//!
//! Source: general machine theory.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Motors, PhysicalEffect, Prior, Relative, Role,
    Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Flux without current.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Remanence<S> {
    /// i_r, A.
    pub current: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for Remanence<S> {
    const DESCRIPTION: Description = Description {
        name: "remanent flux",
        equation: "K (i + i_r) ω and K (i + i_r) i",
        acts: Acts::Both,
        motors: Motors::Series,
        parameters: &[EffectParameter {
            name: "remanence_current",
            unit: "A",
            role: Role::Size,
            range: (-100.0, 100.0),
            start: 0.015,
            relative: Relative::Current,
            meaning: "equivalent magnetising current",
        }],
        size_in_words: "the iron keeps the flux of {} when the current is switched off",
        excited_by: &[Excitation::Direct, Excitation::Current],
        prior: Prior::occasional("every iron keeps some flux; it shows where the current passes zero"),
        two_make_it: Some([EffectId::CurrentOffset, EffectId::VoltageOffset]),
        why: "The iron keeps a little flux when no current flows. A rotor that turns in it makes a voltage without a \
              current, and a current that passes zero still makes a torque.",
        noticed: "A motor that is spun by hand, or coasts with the supply open, shows a small direct voltage at its \
                  terminals that goes with the speed. Nothing is heard.",
        remedy: "It is harmless, and often wanted: a series generator starts by it. Name it in the model. If it \
                 changes from run to run, demagnetise before each: a falling alternating current with the rotor \
                 held.",
        signature: "a direct voltage in proportion to the speed; a torque at mains frequency",
        confused_with: &[EffectId::CurrentOffset, EffectId::VoltageOffset],
        separated_by: &[
            Separation::open_supply(
                "the coasting motor with an open supply, which shows the voltage without a current",
            ),
            Separation::locked_rotor("a locked rotor"),
        ],
        source: "general machine theory",
        ..Description::usual(EffectId::Remanence)
    };
    fields!(current);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.magnetising = balance.magnetising.plus(self.current);
    }
}
