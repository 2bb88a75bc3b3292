//! Transformer EMF in the coils that the brushes short-circuit: a damper winding on the main flux.
//!
//! As for eddy currents the flux lags, but most at standstill: `T = T₀/(1 + |ω|/ω_t)`. A lag that has not halved at the
//! largest speed of the recordings is not told from that of eddy currents, which does not fade.
//!
//! Source: general machine theory (AC commutator machines).

use super::memory::{around_point, follow_rate, lag_flux};
use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Motors, Passed, PhysicalEffect, Prior, Relative,
    Role, Separation, Turn,
};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Flux lag by the commutating coils.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransformerEmf<S> {
    /// T₀, s.
    pub lag: S,
    /// ω_t, rad/s.
    pub fading: S,
    /// χ.
    pub linked: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for TransformerEmf<S> {
    const DESCRIPTION: Description = Description {
        name: "transformer EMF of the short-circuited coils (damper effect)",
        equation: "as eddy currents, with T = T₀/(1 + |ω|/ω_t)",
        acts: Acts::Both,
        motors: Motors::Series,
        lags_flux: true,
        parameters: &[
            EffectParameter {
                name: "transformer_lag",
                unit: "s",
                role: Role::Size,
                range: (0.0, 3e-3),
                start: 1.5e-4,
                relative: Relative::Absolute,
                meaning: "time constant of the flux at standstill",
            },
            EffectParameter {
                name: "transformer_fading",
                unit: "rad/s",
                role: Role::Shape,
                range: (1e-4, 1e5),
                start: 0.3,
                relative: Relative::Speed,
                meaning: "speed at which it has halved",
            },
            EffectParameter {
                name: "transformer_linked",
                unit: "1",
                role: Role::Linked,
                range: (0.0, 1.0),
                start: 0.6,
                relative: Relative::Absolute,
                meaning: "share of the inductance that lags",
            },
        ],
        size_in_words: "the flux follows {} after the current at standstill",
        excited_by: &[Excitation::Alternating, Excitation::LowSpeed],
        prior: Prior::occasional("brushes short coils in every commutator motor; on direct current it is nothing"),
        at_standstill: Some(EffectId::EddyCurrent),
        why: "The coil under a brush is short-circuited by it. On AC the main field induces a current in that ring, \
              as in a transformer's winding, and that damps the flux. The faster the commutator, the shorter each \
              ring lasts.",
        noticed: "Sparks at the brushes while the motor starts on AC and has hardly begun to turn, and none at the \
                  same current on DC; marks on the bars.",
        remedy: "It is in every commutator motor on AC. Brushes of higher resistance, narrower ones, or fewer turns \
                 to a coil make it less. A long stall on AC burns the bars: avoid it.",
        signature: "that of eddy currents, stronger at standstill; none on DC",
        turns_into: Some(Turn { parameter: 1, beyond: 1.0, into: EffectId::EddyCurrent }),
        confused_with: &[EffectId::EddyCurrent, EffectId::ChannelDelay, EffectId::Hysteresis],
        separated_by: &[Separation::locked_rotor("a locked rotor against the running motor at the same current")],
        source: "general machine theory",
        remembers: true,
        ..Description::usual(EffectId::TransformerEmf)
    };
    fields!(lag, fading, linked);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, memory: &Memory<S>, balance: &mut Balance<N>) {
        lag_flux(self.lag_at(at.speed), self.linked, memory, balance);
    }
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        follow_rate(self.lag_at(passed.after.speed), passed, memory);
    }
    #[inline(always)]
    fn around_point(&self, memory: &Memory<S>) -> Memory<S> {
        around_point(memory)
    }
}

impl<S: Scalar<Base = S>> TransformerEmf<S> {
    /// T at a speed, s.
    #[inline(always)]
    fn lag_at<N: Scalar<Base = S>>(&self, speed: N) -> N {
        speed.abs().times(S::ONE / self.fading).plus(S::ONE).inverse().times(self.lag)
    }
}
