//! A fuzzy network that has been trained elsewhere, evaluated as on the microcontroller: `cargo run --example anfis`.

use greyrig::anfis::{Firing, Premise, Settings, SettingsError, Shape};

/// Runs the example.
pub fn main() -> Result<(), SettingsError> {
    // Two inputs with two membership functions each make four rules: z = ±x y by corner, trained on the square ±1.
    let bells = [Premise { a: 1.0, b: 2.0, c: -1.0 }, Premise { a: 1.0, b: 2.0, c: 1.0 }];
    let network = Settings::<2, 2, 4> {
        shape: Shape::Bell,
        firing: Firing::Product,
        premise: [bells; 2],
        slopes: [[0.5, 0.5], [0.5, -0.5], [-0.5, 0.5], [-0.5, -0.5]].map(|[p, q]| [-p, -q]),
        constants: [0.0; 4],
        inputs: [(-1.0, 1.0); 2],
        output: (-1.0, 1.0),
        margin: 0.1,
    }
    .build::<f32>()?;

    for inputs in [[0.0, 0.0], [0.5, 0.5], [-0.9, 0.2], [1.05, 0.0], [2.0, 0.0]] {
        let correction = network.correct(inputs);
        println!("{inputs:?}: {:.3}, validity {:.2}", correction.value, correction.validity);
    }
    assert_eq!(network.correct([0.5, 0.5]).validity, 1.0);
    assert_eq!(network.correct([2.0, 0.0]).validity, 0.0, "far from where it has been trained");
    Ok(())
}
