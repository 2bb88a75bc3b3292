//! Magnetic hysteresis of the iron: the flux follows the current late by a fixed amount, whatever the frequency.
//!
//! A play lets small reversals of the current pass: x stays where it is while `|i − x| < p`, with p = i_c/2, and else
//! follows at that distance. The magnetising current is `i − r (i − x) − (1 − r/2) i_c z`, where z runs from −1 to 1
//! with the history of x alone (rate-independent):
//! ```text
//! dz/dx = r (1 + e − z s)/((2 + e) (1 − r/2) i_c)  up to z = s,  s = sign(dx/dt)
//! ```
//! which over a stretch of monotonic x is `z = s (1 + e) − (s (1 + e) − z₀) exp(−r |x − x₀|/((2 + e) (1 − r/2) i_c))`,
//! ended at z = s: exact for a step of any size, so that no time step limits it. At a reversal from saturation the
//! share r of the flux rests; after half of the loop's width it follows the slower the nearer saturation is, with e = 0
//! for ever, else until a current at which the branch closes. This is what plays (Prandtl–Ishlinskii) do whose widths
//! are p and more, distributed exponentially, with e up to a largest one; a large e is one play. Loops inside a loop,
//! which close in iron, close here as long as they are narrower than 2 p; z alone would be worn down by them, and so by
//! the noise of a DC voltage. The inductive voltage of the share c of the inductance follows: `dλ/di = L (1 − c
//! d(lag)/di)`, of which a twentieth is left at least: leakage through air, without which no current could be computed
//! after a reversal with c = r = 1. Where the iron saturates as well, the part that lags is smaller by dφ/di.
//!
//! Source: the Duhem model (P. Duhem 1897), of which e = 0 is the form of Bouc and Wen with exponent 1 and β = γ; plays
//! as in M. A. Krasnosel'skii and A. V. Pokrovskii, Systems with Hysteresis, 1989.

use super::{
    Acts, Description, EffectId, EffectParameter, Excitation, Memory, Motors, Passed, PhysicalEffect, Prior, Relative,
    Role, Separation,
};
use crate::motor::{Balance, OperatingPoint, State};
use crate::scalar::Scalar;

/// Flux with a memory of the current's turning points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hysteresis<S> {
    /// i_c, A.
    pub coercive: S,
    /// r.
    pub resting: S,
    /// e.
    pub closing: S,
    /// c.
    pub linked: S,
}

/// Below this coercive current, A, the loop counts as closed; it keeps the way of a reversal from zero.
const CLOSED: f64 = 1e-6;
/// Share of the coercive current by which the play lags.
const PLAY: f64 = 0.5;

/// Share of the inductance that is leakage through air at least.
const LEAKAGE: f64 = 0.05;

/// How far the magnetising current is behind, A, and how that changes with the current; where in the play it is, (i −
/// x)/p from −1 to 1; and z.
struct Lag<N> {
    current: N,
    slope: N,
    place: N,
    z: N,
}

impl<S: Scalar<Base = S>> Hysteresis<S> {
    /// The lag at a current, from z, the current and the place in the play that the memory holds.
    #[inline(always)]
    fn lag<N: Scalar<Base = S>>(&self, current: N, memory: &Memory<S>) -> Lag<N> {
        let [begun, last, place, _] = *memory;
        let play = self.coercive * S::constant(PLAY);
        let edge = play * self.resting;
        let rest = self.coercive - edge;
        // In this order nothing is rounded while the play is at its end, and it is known to be there.
        let from_centre = current.plus(-last).plus(place * play);
        if from_centre.abs().value() < play {
            let lag = from_centre.times(self.resting).plus(rest * begun);
            return Lag {
                current: lag,
                slope: N::lift(self.resting),
                place: from_centre.times(S::ONE / play),
                z: N::lift(begun),
            };
        }
        let side = if from_centre.value() + place * S::constant(CLOSED) < S::ZERO { -S::ONE } else { S::ONE };
        let (z, rise) = self.branch(from_centre.plus(-(side * play)), side, rest, begun);
        // Within a step that leaves the play the inductance stays what it was: where it doubled between the stages of a
        // step, their weights would make the current stand still.
        let slope = if place.abs() < S::ONE && play > S::ZERO { N::lift(self.resting) } else { rise.times(rest) };
        Lag { current: z.times(rest).plus(side * edge), slope, place: N::lift(side), z }
    }

    /// z and dz/dx after a stretch of x to a side, from z₀.
    #[inline(always)]
    fn branch<N: Scalar<Base = S>>(&self, gone: N, side: S, rest: S, begun: S) -> (N, N) {
        let aim = self.closing + S::ONE;
        let steepness = self.resting / ((aim + S::ONE) * (rest + S::constant(CLOSED)));
        let z = gone.times(-(side * steepness)).exp().times(begun - side * aim).plus(side * aim);
        // What is closed stays so; rounding must not open it.
        if z.value() * side > S::ONE || begun * side >= S::ONE {
            return (N::lift(side), N::ZERO);
        }
        (z, z.times(-(side * steepness)).plus(steepness * aim))
    }
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for Hysteresis<S> {
    const DESCRIPTION: Description = Description {
        name: "magnetic hysteresis",
        equation: "φ(i − r (i − x) − i_k z), x = i but for a play of i_c/2, dz/dx = r (1 + e − z s)/((2 + e) i_k) up to z = s, \
                   s = sign(dx/dt), i_k = (1 − r/2) i_c; dλ/di = L (1 − c d(r (i − x) + i_k z)/di)",
        acts: Acts::Both,
        motors: Motors::Series,
        parameters: &[
            EffectParameter {
                name: "hysteresis_coercive",
                unit: "A",
                role: Role::Size,
                range: (0.0, 100.0),
                start: 0.015,
                relative: Relative::Current,
                meaning: "coercive current: half the width of the loop",
            },
            EffectParameter {
                name: "hysteresis_resting",
                unit: "1",
                role: Role::Shape,
                range: (0.2, 1.0),
                start: 0.9,
                relative: Relative::Absolute,
                meaning: "share of the flux that rests at first when the current turns round",
            },
            EffectParameter {
                name: "hysteresis_closing",
                unit: "1",
                role: Role::Shape,
                range: (0.0, 4.0),
                start: 0.5,
                relative: Relative::Absolute,
                meaning: "how straight a branch comes to its end: 0 never quite, 1 after 2.6 coercive currents, 4 after 2.2 (r = 1)",
            },
            EffectParameter {
                name: "hysteresis_linked",
                unit: "1",
                role: Role::Linked,
                range: (0.0, 1.0),
                start: 0.6,
                relative: Relative::Absolute,
                meaning: "share of the inductance that has the loop",
            },
        ],
        size_in_words: "the flux is {} behind the current, whichever way that goes",
        excited_by: &[Excitation::Alternating, Excitation::Current],
        prior: Prior::common("every iron has it, solid or soft steel poles most"),
        why: "The flux of the iron depends on where the current comes from. On the way up it is smaller than on the \
              way down, so that flux over current is a loop and no line, and the current of a period leans to one \
              side.",
        noticed: "The current's wave is skew, most at small amplitudes; iron that is magnetised to and fro hums at \
                  twice the mains frequency, and gets warm at no load.",
        remedy: "Name it. If it is larger than in motors of the same type, ask for the sheets: another steel, sheets \
                 that were not annealed after stamping, or solid parts in the path of the flux.",
        signature: "fundamental in quadrature with the current, nearly independent of the amplitude; a torque in quadrature to \
                    i²",
        confused_with: &[
            EffectId::EddyCurrent,
            EffectId::ChannelDelay,
            EffectId::TransformerEmf,
            EffectId::InductanceSaturation,
        ],
        separated_by: &[
            Separation::by("slow DC ramps, where the loop stays and every lag in time vanishes"),
            Separation::by("different amplitudes"),
        ],
        source: "Duhem model; Bouc and Wen with exponent 1; plays of Prandtl and Ishlinskii",
        remembers: true,
        ..Description::usual(EffectId::Hysteresis)
    };
    fields!(coercive, resting, closing, linked);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, memory: &Memory<S>, balance: &mut Balance<N>) {
        let lag = self.lag(at.current, memory);
        balance.magnetising -= lag.current;
        balance.flux_slope = balance.flux_slope * lag.slope.times(-S::ONE).plus(S::ONE);
        let left = lag.slope.times(-self.linked).plus(S::ONE);
        let leakage = S::constant(LEAKAGE);
        balance.inductance =
            if left.value() < leakage { balance.inductance.times(leakage) } else { balance.inductance * left };
    }
    fn at_start(&self, state: State<S>, _: S) -> Memory<S> {
        [S::ZERO, state.current, S::ZERO, S::ZERO]
    }
    #[inline(always)]
    fn advance(&self, passed: &Passed<S>, memory: &mut Memory<S>) {
        let current = passed.after.current;
        if current != memory[1] {
            let lag = self.lag(current, memory);
            *memory = [lag.z, current, lag.place, S::ZERO];
        }
    }
}
