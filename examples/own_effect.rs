//! An effect that the catalogue does not have, as a term of one's own: `cargo run --example own_effect`.
//!
//! A term runs on the microcontroller as it is. What belongs into the catalogue is a file in `src/effects` and a line
//! in its `catalogue!`.

use greyrig::motor::{Constraints, FluxLaw, Motor, Parameters, Stepper};
use greyrig::term::{Op, Target, Term};

/// Runs the example.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A brake that takes the torque k tanh(ω/ω₀), in reverse Polish order: k and ω₀ are the unknowns 0 and 1.
    let program = [Op::Unknown(0), Op::Speed, Op::Unknown(1), Op::Div, Op::Tanh, Op::Mul];
    let brake = Term::build(Target::Torque, &program, [0.02, 50.0, 0.0, 0.0])?;

    let values = [2.2, 0.02, 0.05, 2e-5, 0.001, 8e-6, 3e-8];
    let motor = Motor::build(Parameters::from_values(FluxLaw::PermanentMagnet, values), &[])?;
    let speed = |terms: &[Term<f64>]| -> Result<f64, Box<dyn std::error::Error>> {
        let mut stepper = Stepper::build(motor.clone().with_terms(terms)?, 1e-4)?;
        (0..20_000).for_each(|_| _ = stepper.step(24.0, 24.0, Constraints::FREE));
        Ok(stepper.reading().speed)
    };
    let (free, braked) = (speed(&[])?, speed(&[brake])?);
    println!("{free:.0} rad/s, braked {braked:.0} rad/s");

    // In the steady state K ω = u − R i, and i carries the torques: by hand 470.0 and 452.9 rad/s.
    assert!((free - 470.0).abs() < 1.0 && (braked - 452.9).abs() < 1.0, "{free} {braked}");
    Ok(())
}
