//! A universal motor with saturated iron on the mains: `cargo run --example simulate`.

use std::f64::consts::TAU;

use greyrig::effects::{Effect, EffectId};
use greyrig::motor::{Constraints, FluxLaw, Motor, ParameterError, Parameters, Stepper};

const INTERVAL_S: f64 = 1e-4;

/// Runs the example.
pub fn main() -> Result<(), ParameterError> {
    let base = Parameters {
        flux_law: FluxLaw::Series,
        resistance: 2.2,
        inductance: 20e-3,
        flux_coefficient: 9.45e-3,
        inertia: 1.8e-4,
        dry_friction: 0.015,
        viscous_friction: 8e-6,
        turbulent_friction: 2.98e-8,
    };
    // An effect of the catalogue, at its usual size.
    let parameters = EffectId::Saturation.description().parameters;
    let usual: Vec<f64> = parameters.iter().map(|parameter| parameter.start).collect();
    let effect = Effect::new(EffectId::Saturation, &usual);

    for (name, effects) in [("linear iron", &[][..]), ("saturated iron", &[effect])] {
        let mut stepper = Stepper::build(Motor::build(base, effects)?, INTERVAL_S)?;
        let voltage = |n: u32| 325.0 * (TAU * 50.0 * INTERVAL_S * f64::from(n)).sin();
        let mut largest = 0.0f64;
        for n in 1..=20_000 {
            let state = stepper.step(voltage(n - 1), voltage(n), Constraints::FREE);
            largest = largest.max(state.current.abs());
        }
        let speed = stepper.reading().speed;
        println!("{name}: {speed:.0} rad/s after 2 s, at most {largest:.1} A");
        assert!(speed > 1_000.0 && largest > 10.0);
    }
    Ok(())
}
