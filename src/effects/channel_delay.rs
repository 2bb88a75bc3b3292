//! Delay between the channels: sampling in sequence, a digital filter or unequal anti-alias filters make the current
//! late.
//!
//! `i_shown(t) = i(t − d)`, d in s. A late voltage would be a negative d; it has the sign of eddy currents, and no
//! place here.
//!
//! Two earlier currents are remembered, at the ages a and a + m h, where h is the length of a step, m the least whole
//! number of steps with (m + 1) h ≥ d, and a runs from h to m h; up to d = 2 h these are simply the last two steps.
//! Through them and the present goes a parabola: a chord would show an alternating current smaller, and a direct one
//! not. What is remembered besides is the change `i(t − d) − i(t)` of the true current, which is added to whatever the
//! earlier parts of the chain show: a gain error or compression of the sensor does not act on the change, which would
//! be a product of two small errors.
//!
//! Source: sampling theory; latency in the error model of a current sensor.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Passed, PhysicalEffect, Prior, Relative, Role,
    Separation,
};
use crate::motor::State;
use crate::scalar::Scalar;

/// Current that is shown late.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelDelay<S> {
    /// d, s.
    pub delay: S,
}

/// `round(x − this)` is the least whole number above x − 1, but for a hundredth.
const ALMOST_HALF: f64 = 0.51;

impl<S: Scalar<Base = S>> PhysicalEffect<S> for ChannelDelay<S> {
    const DESCRIPTION: Description = Description {
        name: "late current channel",
        equation: "i_shown(t) = i(t − d)",
        acts: Acts::Measuring,
        parameters: &[EffectParameter {
            name: "channel_delay",
            unit: "s",
            role: Role::Size,
            range: (0.0, 1e-3),
            start: 1e-4,
            relative: Relative::Absolute,
            meaning: "time by which the current is late",
        }],
        size_in_words: "the current channel is {} late",
        excited_by: &[Excitation::Alternating],
        prior: Prior::common("channels are converted one after the other, or filtered by unlike filters"),
        half_an_interval: Some(
            "the delay is half a sampling interval, as of a supply that holds its voltage from one sample to the next (or a simulation \
             that does): then it is no fault of the current channel",
        ),
        why: "Current and voltage are not of the same instant: channels are converted one after the other, or pass \
              unlike filters. The late current looks like an inductance that is not there.",
        noticed: "Nothing at the motor. A resistor in its place shows a current that lags its voltage.",
        remedy: "Put the shift into the set-up of the channels, or give both the same filter. Name it for the \
                 recordings that exist.",
        signature: "fundamental in quadrature with the current, in proportion to amplitude and speed, and a torque in \
                    quadrature to i²; the opposite sign of eddy currents",
        confused_with: &[EffectId::EddyCurrent, EffectId::TransformerEmf, EffectId::Hysteresis],
        separated_by: &[
            Separation::by("a resistor in place of the motor"),
            Separation::by("slow DC ramps against hysteresis"),
            Separation::by("the sign against eddy currents"),
        ],
        source: "sampling theory",
        remembers: true,
        ..Description::usual(EffectId::ChannelDelay)
    };
    fields!(delay);
    fn at_start(&self, state: State<S>, _: S) -> Memory<S> {
        [S::ZERO, state.current, state.current, S::ZERO]
    }
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        let (interval, now) = (passed.interval, passed.after.current);
        let steps = (self.delay / interval - S::constant(ALMOST_HALF)).round();
        let spacing = if steps > S::ONE { steps * interval } else { interval };
        let [_, mut recent, mut old, mut age] = *memory;
        if age + S::constant(0.5) * interval > spacing {
            (recent, old, age) = (passed.before.current, recent, S::ZERO);
        }
        age += interval;
        let rate = (recent - now) / age;
        let bend = ((old - recent) / spacing - rate) / (age + spacing);
        let change = (rate + bend * (self.delay - age)) * self.delay;
        *memory = [change, recent, old, age];
    }
    #[inline(always)]
    fn measure(&self, memory: &Memory<S>, reading: &mut State<S>) {
        reading.current += memory[0];
    }
}
