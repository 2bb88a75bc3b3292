//! One tick of the rig, as the sampling interrupt runs it: counts in, residual out. `cargo run --example tick`.

use greyrig::butterworth;
use greyrig::motor::{Constraints, FluxLaw, Motor, Parameters, Stepper};
use greyrig::tick::Tick;
use greyrig::units::{CalibrationSettings, Counts};

/// Runs the example.
pub fn main() {
    let motor = |resistance: f32| {
        let values = [resistance, 0.02, 9.45e-3, 1.8e-4, 0.015, 8e-6, 2.98e-8];
        Motor::build(Parameters::from_values(FluxLaw::Series, values), &[]).expect("a motor that there can be")
    };
    let stepper = |resistance| Stepper::build(motor(resistance), 1e-4).expect("slower than the sampling");
    let filter = butterworth::Settings::default().build().expect("the usual filter");
    let calibration = CalibrationSettings::default().build().expect("the usual calibration");

    // The model, and in place of the converter a motor whose resistance is a tenth higher.
    let mut tick = Tick::new(stepper(2.2), filter);
    let mut rig = stepper(2.42);
    let [voltage_scale, current_scale, speed_scale] = calibration.scales();
    let counts = |value: f32, scale: greyrig::units::Scale| (value / scale.per_count + scale.zero).round() as u16;

    let (mut error, mut signal) = (0.0, 0.0);
    let mut before = 0.0;
    for n in 0..20_000u16 {
        let voltage = 325.0 * (std::f32::consts::TAU * f32::from(n % 200) / 200.0).sin();
        let state = rig.step(before, voltage, Constraints::FREE);
        before = voltage;
        let sample = calibration.sample(Counts {
            voltage: counts(voltage, voltage_scale),
            current: counts(state.current, current_scale),
            speed: counts(state.speed, speed_scale),
        });
        let output = tick.process(sample, Constraints::FREE);
        error += output.residual().current.powi(2);
        signal += output.measured.current.powi(2);
    }
    let ratio = (error / signal).sqrt();
    println!("error-to-signal ratio of the current: {:.1} %", 100.0 * ratio);
    assert!(ratio > 0.004, "the model shows that the motor is another one");
}
