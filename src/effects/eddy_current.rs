//! Eddy currents in laminations and poles: the flux lags in time.
//!
//! `T dφ/dt = F(i) − φ`, here to first order in T, which at mains frequency is exact to (2π f T)², 0.1 % of the effect for
//! 100 µs: `K T ω di/dt` less back-EMF, `K T i di/dt` less torque, and `χ T L d²i/dt²` less inductive voltage. How the last one
//! stays algebraic is told at [`crate::motor::Motor::slopes`].
//!
//! Source: classical eddy-current loss as a resistance parallel to the magnetising inductance; field form
//! σ d²/12 dB/dt in the Modelica Standard Library, Magnetic.FluxTubes.

use super::{Acts, Description, EffectParameter, Memory, Motors, PhysicalEffect, Relative};
use crate::motor::{Balance, OperatingPoint};
use crate::scalar::Scalar;

/// Flux that lags the current in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EddyCurrent<S> {
    /// T, s.
    pub lag: S,
    /// χ.
    pub linked: S,
}

impl<S: Scalar<Base = S>> PhysicalEffect<S> for EddyCurrent<S> {
    const DESCRIPTION: Description = Description {
        id: "eddy_current",
        name: "eddy currents in the iron (flux lag)",
        equation: "φ = F(i) − T dF/dt in K φ ω and K φ i; λ lags likewise with its share χ",
        acts: Acts::Both,
        motors: Motors::Series,
        lags_flux: true,
        parameters: &[
            EffectParameter {
                name: "eddy_lag",
                unit: "s",
                range: (0.0, 2e-3),
                start: 8e-5,
                relative: Relative::Absolute,
                meaning: "time constant of the flux",
            },
            EffectParameter {
                name: "eddy_linked",
                unit: "1",
                range: (0.0, 1.0),
                start: 0.6,
                relative: Relative::Absolute,
                meaning: "share of the inductance that lags",
            },
        ],
        signature: "fundamental in quadrature with the current, in proportion to amplitude and speed, without a third \
                    harmonic; the opposite sign of a late current channel",
        confused_with: &["channel_delay", "transformer_emf", "hysteresis"],
        separated_by: "a resistor in place of the motor, which shows the delay of the channels alone; slow DC ramps against \
                       hysteresis; a locked rotor against the transformer EMF",
        source: "Modelica Standard Library, Magnetic.FluxTubes (dynamic hysteresis)",
        ..Description::USUAL
    };
    fields!(lag, linked);
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(&self, _: &OperatingPoint<N>, _: &Memory<S>, balance: &mut Balance<N>) {
        balance.flux_lag = balance.flux_lag.plus(self.lag);
        balance.inductance_lag = balance.inductance_lag.plus(self.lag * self.linked);
    }
}
