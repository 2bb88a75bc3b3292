//! Impedance between the point where the voltage is measured and the motor: mains, leads, a series choke.
//!
//! `(R + R_s) i` and `(L + L_s) di/dt`, in Ω and H. R and L of a fit contain it exactly.
//!
//! Source: circuit theory.

use super::{
    Acts, Description, EffectId, EffectParameter, Memory, PhysicalEffect, Prior, Relative, Role, Seen, Separation,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Resistance and inductance upstream of the terminals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupplyImpedance<S> {
    /// R_s, Ω.
    pub resistance: S,
    /// L_s, H.
    pub inductance: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for SupplyImpedance<S> {
    const DESCRIPTION: Description = Description {
        name: "impedance of the supply",
        equation: "(R + R_s) i + (L + L_s) di/dt",
        acts: Acts::Electrical,
        seen: Seen::Invisible("the voltage at the motor's terminals, or the impedance of the supply"),
        parameters: &[
            EffectParameter {
                name: "supply_resistance",
                unit: "Ω",
                role: Role::Size,
                range: (0.0, 1e4),
                start: 0.05,
                relative: Relative::Impedance,
                meaning: "resistance between the measuring point and the terminals",
            },
            EffectParameter {
                name: "supply_inductance",
                unit: "H",
                role: Role::SecondSize,
                range: (0.0, 10.0),
                start: 1e-4,
                relative: Relative::Absolute,
                meaning: "inductance between the measuring point and the terminals",
            },
        ],
        size_in_words: "there are {} between the meter and the motor",
        prior: Prior::occasional("the voltage is often taken at the supply instead of at the terminals"),
        why: "Between the voltmeter and the motor are leads, a choke or the source's own resistance. Their drop \
              passes for that of the winding.",
        noticed: "Nothing in the curves. The voltage at the terminals sinks under load while the recorded one stays; \
                  leads get warm.",
        remedy: "Take the voltage at the terminals, with leads of their own. Or measure the leads with an ohmmeter, \
                 and subtract.",
        signature: "none: R and L take its place",
        confused_with: &[EffectId::WindingTemperature, EffectId::InductanceSaturation],
        separated_by: &[Separation::by("an ohmmeter at the terminals, or the voltage measured there")],
        source: "circuit theory",
        ..Description::usual(EffectId::SupplyImpedance)
    };
    fields!(resistance, inductance);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.resistance = balance.resistance.plus(self.resistance);
        balance.inductance = balance.inductance.plus(self.inductance);
    }
}
