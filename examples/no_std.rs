//! A motor that limits its own current, for a program without the standard library: `cargo build --example no_std`, and
//! `--target thumbv7em-none-eabihf` for a microcontroller.
#![no_std]

use greyrig::motor::{Constraints, FluxLaw, Motor, ParameterError, Parameters, Stepper};

/// A model beside the motor, from which a controller takes the current that no sensor measures.
pub struct Observer {
    stepper: Stepper<f32>,
    last_voltage: f32,
}

impl Observer {
    /// Of a permanent-magnet motor, sampled every 100 µs. No allocation: its size is known when it is compiled.
    ///
    /// # Errors
    /// A parameter that no motor can have.
    pub fn new(values: [f32; 7]) -> Result<Self, ParameterError> {
        let motor = Motor::build(Parameters::from_values(FluxLaw::PermanentMagnet, values), &[])?;
        Ok(Self { stepper: Stepper::build(motor, 1e-4)?, last_voltage: 0.0 })
    }

    /// The current, A, with a voltage (V) and a measured speed (rad/s).
    pub fn current(&mut self, voltage: f32, speed: f32) -> f32 {
        let measured = Constraints { speed: Some(speed), current: None };
        let state = self.stepper.step(self.last_voltage, voltage, measured);
        self.last_voltage = voltage;
        state.current
    }
}
