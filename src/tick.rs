//! One tick: everything that happens to a sample, every 100 µs.
//!
//! ```text
//! counts ─ calibration ─┬─ u ──► model, correction ─ i, ω ─► Butterworth ─┐
//!                       └─ i, ω ───────────────────────────► Butterworth ─┴─► residual = modelled − measured
//! ```
//! The raw voltage drives the model; one and the same filter then runs over the measured and the modelled signals.
//! (Filtering u instead would not do: the products K i ω and K i² of filtered signals are not the filtered products.)
//!
//! The model, corrected or not, never sees the measured current or speed after its start: it runs freely, and what it
//! departs from the motor is what the residual shows.
//! # Example
//! ```
//! use greyrig::butterworth;
//! use greyrig::motor::{Constraints, FluxLaw, Motor, Parameters, Stepper};
//! use greyrig::tick::Tick;
//! use greyrig::units::{Amperes, RadiansPerSecond, Sample, Volts};
//!
//! let values = [2.2, 0.02, 9.45e-3, 1.8e-4, 0.015, 8e-6, 2.98e-8];
//! let motor = Motor::build(Parameters::from_values(FluxLaw::Series, values), &[]).expect("a motor that there can be");
//! let stepper = Stepper::build(motor, 1e-4).expect("slower than the sampling");
//! let filter = butterworth::Settings::default().build().expect("the usual filter");
//! let mut tick = Tick::new(stepper, filter);
//!
//! // On 100 V the model draws a current; the motor, whose circuit is open, draws none.
//! let sample = Sample { voltage: Volts(100.0), current: Amperes(0.0), speed: RadiansPerSecond(0.0) };
//! let output = (0..500).map(|_| tick.process(sample, Constraints::FREE)).last().expect("500 ticks");
//! assert!(output.residual().current.abs() > 10.0);
//! ```

use crate::anfis::Anfis3x3;
use crate::butterworth::{Bank, Coefficients};
use crate::hybrid::corrected;
use crate::motor::{Constraints, State, Stepper};
use crate::units::Sample;

/// What one tick gives.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Output {
    /// Raw voltage, V, and raw current, A; where they were unusable, the last usable ones.
    pub raw: [f32; 2],
    /// Measured and filtered current (A) and speed (rad/s).
    pub measured: State<f32>,
    /// Modelled and filtered current (A) and speed (rad/s).
    pub modelled: State<f32>,
    /// How far the correction is within what it has been trained on: 1 inside, 0 far outside; 1 without a correction.
    pub validity: f32,
    /// Whether the modelled rotor was stopped or turned round with this sample, which then took longer.
    pub crossed_zero: bool,
}

impl Output {
    /// Modelled minus measured: A, rad/s.
    pub fn residual(&self) -> State<f32> {
        State {
            current: self.modelled.current - self.measured.current,
            speed: self.modelled.speed - self.measured.speed,
        }
    }
}

/// The state of the rig's computation between two samples. In this order, because an instruction of the processor
/// reaches a kilobyte beyond the address that it has.
#[derive(Debug, Clone)]
#[repr(C)]
pub struct Tick {
    filter: Coefficients<f32>,
    /// Of the measured and the modelled current and speed.
    channels: Bank<f32, 4>,
    last_voltage: Option<f32>,
    stepper: Stepper<f32>,
    correction: Option<Anfis3x3>,
}

impl Tick {
    /// From a model and a filter.
    pub fn new(stepper: Stepper<f32>, filter: Coefficients<f32>) -> Self {
        Self { stepper, filter, channels: Bank::default(), last_voltage: None, correction: None }
    }

    /// With a learned correction of the modelled current.
    #[must_use]
    pub fn with_correction(mut self, correction: Option<Anfis3x3>) -> Self {
        self.correction = correction;
        self
    }

    /// Starts the model from a state instead of from standstill.
    pub fn start_from(&mut self, state: State<f32>) {
        self.stepper.set_state(state);
    }

    /// Processes one sample. The first one only starts the filters in their steady state.
    ///
    /// A sample that is not a finite number is replaced: the voltage by the last one, current and speed within the
    /// filter, so that one bad sample does not silence the model for ever.
    #[inline(always)]
    pub fn process(&mut self, sample: Sample, constraints: Constraints<f32>) -> Output {
        let voltage = match &mut self.last_voltage {
            Some(last) => {
                let voltage = if sample.voltage.0.is_finite() { sample.voltage.0 } else { *last };
                self.stepper.step(*last, voltage, constraints);
                *last = voltage;
                voltage
            }
            None => self.begin(sample.voltage.0, sample.current.0, sample.speed.0, constraints),
        };
        let (modelled, validity) = self.model(voltage, constraints);
        let signals = [sample.current.0, sample.speed.0, modelled.current, modelled.speed];
        let ([raw_current, ..], [current, speed, modelled_current, modelled_speed]) =
            self.channels.process(&self.filter, signals);
        Output {
            raw: [voltage, raw_current],
            measured: State { current, speed },
            modelled: State { current: modelled_current, speed: modelled_speed },
            validity,
            crossed_zero: self.stepper.crossed_zero(),
        }
    }

    /// What the model shows at a voltage, and how far its correction can be relied on.
    #[inline(always)]
    fn model(&self, voltage: f32, constraints: Constraints<f32>) -> (State<f32>, f32) {
        let reading = self.stepper.reading();
        match &self.correction {
            Some(correction) => corrected(correction, voltage, reading, constraints),
            None => (reading, 1.0),
        }
    }

    /// Starts the filters in the steady state of the first sample; gives its voltage.
    #[cold]
    #[inline(never)]
    fn begin(&mut self, voltage: f32, current: f32, speed: f32, constraints: Constraints<f32>) -> f32 {
        let voltage = if voltage.is_finite() { voltage } else { 0.0 };
        self.last_voltage = Some(voltage);
        let (modelled, _) = self.model(voltage, constraints);
        self.channels.reset_to([current, speed, modelled.current, modelled.speed]);
        voltage
    }
}
