//! Measured and modelled signals of one recording, filtered alike.

use greyrig::anfis::Anfis3x3;
use greyrig::butterworth::Cascade;
use greyrig::motor::Motor;

use super::result::Traces;
use crate::error::Result;
use crate::experiment::{Drive, Experiment, Imposed, derivative};
use crate::filtering::{directions_by_quantum, zero_phase};
use crate::free_run::{DIVERGED, free_run};

/// A filtered simulation: current and speed, sample by sample.
pub struct Simulated {
    /// A.
    pub current: Vec<f64>,
    /// rad/s.
    pub speed: Vec<f64>,
    /// Whether one of them leaves all bounds.
    pub diverges: bool,
}

/// Simulates the model over an experiment in `f32`, as the microcontroller does, with its learned correction if it has
/// one, and filters the result.
///
/// # Errors
/// Parameters that the stepper refuses at this sampling rate.
pub fn simulate(
    motor: &Motor<f32>,
    correction: Option<&Anfis3x3>,
    e: &Experiment,
    imposed: Imposed<'_>,
) -> Result<Simulated> {
    let coefficients = e.coefficients::<f32>();
    let (mut current, mut speed) = (Cascade::<f32>::default(), Cascade::<f32>::default());
    let mut simulated =
        Simulated { current: Vec::with_capacity(e.len()), speed: Vec::with_capacity(e.len()), diverges: false };
    let within = [&e.current, &e.speed].map(|signal| largest(signal.as_deref()));
    free_run(motor, correction, e, imposed, |n, state| {
        let values = [state.current, state.speed].map(f64::from);
        simulated.diverges |= values.iter().zip(within).any(|(x, most)| !x.is_finite() || x.abs() > most);
        if n == 0 {
            current.reset_to(state.current);
            speed.reset_to(state.speed);
        }
        simulated.current.push(f64::from(current.process(&coefficients, state.current)));
        simulated.speed.push(f64::from(speed.process(&coefficients, state.speed)));
    })?;
    Ok(simulated)
}

/// What a modelled signal has to exceed to diverge; without a measured one only what no number holds.
fn largest(measured: Option<&[f64]>) -> f64 {
    let largest = measured.unwrap_or_default().iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if largest > 0.0 { DIVERGED * largest } else { f64::INFINITY }
}

/// A measured signal through the microcontroller's filter.
pub fn filtered(e: &Experiment, signal: &[f64]) -> Vec<f64> {
    let coefficients = e.coefficients::<f32>();
    let mut cascade = Cascade::<f32>::default();
    cascade.reset_to(signal.first().copied().unwrap_or(0.0) as f32);
    signal.iter().map(|x| f64::from(cascade.process(&coefficients, *x as f32))).collect()
}

/// All signals of an experiment in free run.
///
/// # Errors
/// Parameters that the stepper refuses.
pub fn traces(
    motor: &Motor<f32>,
    correction: Option<&Anfis3x3>,
    precise: &Motor<f64>,
    e: &Experiment,
    start_s: f64,
) -> Result<Traces> {
    let simulated = simulate(motor, correction, e, Imposed::Nothing)?;
    let mut traces = Traces {
        start_s,
        sample_time_s: e.interval_s,
        mains_period_s: e.mains_period_s,
        counted: e.counted.clone(),
        diverges: simulated.diverges,
        ..Traces::default()
    };
    if let Some(current) = &e.current {
        traces.measured_current = filtered(e, current);
        traces.modelled_current = simulated.current;
    }
    if let Some(speed) = &e.speed {
        traces.measured_speed = filtered(e, speed);
        traces.modelled_speed = simulated.speed;
    }
    match (e.drive, &e.speed) {
        (Drive::Voltage, _) => traces.voltage = e.input.clone(),
        (Drive::Torque, Some(speed)) => {
            let acceleration = derivative(speed, e.interval_s);
            let direction = directions_by_quantum(speed);
            let needed: Vec<f64> = (0..speed.len())
                .map(|n| precise.parameters().inertia * acceleration[n] + precise.load_torque(speed[n], direction[n]))
                .collect();
            if let (Some(measured), Some(modelled)) = (zero_phase(&e.input, e.filter), zero_phase(&needed, e.filter)) {
                traces.measured_torque = measured;
                traces.modelled_torque = modelled;
                // The ends of a zero-phase filter know too little of what lies beyond them.
                let trim = ((2.0 / e.filter.cutoff_hz) / e.interval_s) as usize;
                let n = traces.counted.len();
                for k in (0..trim.min(n)).chain(n.saturating_sub(trim)..n) {
                    traces.counted[k] = false;
                }
            }
        }
        (Drive::Torque, None) => {}
    }
    Ok(traces)
}
