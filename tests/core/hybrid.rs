//! The correction beside the model: what it may see, and what it may not.

use greyrig::anfis::{Anfis3x3, Firing, Premise, Settings3x3, Shape};
use greyrig::app::bench::MOTOR;
use greyrig::butterworth::Settings;
use greyrig::motor::{Constraints, Motor, Stepper};
use greyrig::tick::Tick;
use greyrig::units::{Amperes, RadiansPerSecond, Sample, Volts};
use proptest::prelude::*;

fn stepper() -> Stepper<f32> {
    Stepper::build(Motor::build(MOTOR, &[]).unwrap(), 1e-4).unwrap()
}

/// A correction of 0.1 A for each ampere that the model has, and of 1 mA for each volt.
fn correction() -> Anfis3x3 {
    let premise = |c: [f64; 3], a: f64| c.map(|c| Premise { a, b: 2.0, c });
    Settings3x3 {
        shape: Shape::Bell,
        firing: Firing::Product,
        premise: [
            premise([-325.0, 0.0, 325.0], 160.0),
            premise([-20.0, 0.0, 20.0], 10.0),
            premise([0.0, 1750.0, 3500.0], 875.0),
        ],
        slopes: [[1e-3, 0.1, 0.0]; 27],
        constants: [0.0; 27],
        inputs: [(-400.0, 400.0), (-40.0, 40.0), (-10.0, 4000.0)],
        output: (-5.0, 5.0),
        margin: 0.1,
    }
    .build()
    .unwrap()
}

fn tick(correction: Option<Anfis3x3>) -> Tick {
    Tick::new(stepper(), Settings::default().build().unwrap()).with_correction(correction)
}

fn voltage(n: u32) -> f32 {
    200.0 * (n as f32 * 0.031_415_93).sin()
}

#[test]
fn the_corrected_current_is_the_model_and_the_correction() {
    let (mut plain, mut hybrid) = (tick(None), tick(Some(correction())));
    for n in 0..10_000 {
        let u = voltage(n);
        let sample = Sample { voltage: Volts(u), ..Sample::default() };
        let (a, b) = (plain.process(sample, Constraints::FREE), hybrid.process(sample, Constraints::FREE));
        assert_eq!(a.modelled.speed, b.modelled.speed, "the speed is physics alone");
        assert_eq!(b.validity, 1.0);
        if n > 500 {
            // Both terms are linear, so they commute with the filter, which delays u by the same as i: 1 mA/V of the
            // filtered voltage is at most 0.2 A.
            let added = b.modelled.current - a.modelled.current - 0.1 * a.modelled.current;
            assert!(added.abs() < 0.2 + 1e-3, "{n}: {added}");
        }
    }
}

proptest! {
    #[test]
    fn no_measurement_reaches_the_correction(
        currents in prop::collection::vec(-1e6f32..1e6, 300),
        speeds in prop::collection::vec(prop_oneof![Just(f32::NAN), -1e5f32..1e5], 300),
    ) {
        let (mut one, mut other) = (tick(Some(correction())), tick(Some(correction())));
        for (n, (i, w)) in currents.iter().zip(&speeds).enumerate() {
            let u = Volts(voltage(n as u32));
            let a = one.process(Sample { voltage: u, ..Sample::default() }, Constraints::FREE);
            let measured = Sample { voltage: u, current: Amperes(*i), speed: RadiansPerSecond(*w) };
            let b = other.process(measured, Constraints::FREE);
            prop_assert_eq!(a.modelled.current.to_bits(), b.modelled.current.to_bits());
            prop_assert_eq!(a.modelled.speed.to_bits(), b.modelled.speed.to_bits());
            prop_assert_eq!(a.validity.to_bits(), b.validity.to_bits());
        }
    }
}

#[test]
fn an_open_supply_needs_no_correction() {
    let mut hybrid = tick(Some(correction()));
    let open = Constraints { current: Some(0.0), speed: None };
    for n in 0..2000 {
        let output = hybrid.process(Sample { voltage: Volts(voltage(n)), ..Sample::default() }, open);
        assert_eq!(output.modelled.current, 0.0);
    }
}
