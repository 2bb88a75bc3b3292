//! The type's model on other motors of the type: how far the correction brings it to what the scatter of the motors
//! leaves.

use greyrig_host::compare::compare;
use greyrig_host::context::Context;
use greyrig_host::error::Result;
use greyrig_host::recording::{Channel, Recording};
use greyrig_host::rig::Motor;

use crate::lot::{MotorType, SPREAD, Station};

/// Begin of a recording that does not count, s.
const BLANKING_S: f64 = 1.0;
/// Length of a recording, s.
const RAMP_S: f64 = 10.0;

/// A motor of the lot on a ramp, which no training has seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// Error of the current that the type's own motor shows against this one, both without noise: the spread floor. No
    /// model of the type can do better.
    pub floor: f64,
    /// Errors of the current of the stations' models.
    pub errors: Vec<f64>,
}

/// Runs a motor of the lot; number 0 is the motor of the type itself.
///
/// # Errors
/// An interrupt.
pub fn held(of: &MotorType, seed: u64, stations: &[Station]) -> Result<Held> {
    let nominal = Motor::universal();
    let motor = if seed == 0 { nominal } else { Motor::sample_from_population(&nominal, SPREAD, seed) };
    let run = |motor: Motor, noise: f64| -> Result<Recording> {
        Ok(of.rig("ramp", RAMP_S, 7_000 + seed)?.motor(motor).noise(noise).run()?.recording)
    };
    let (ideal, here) = (run(nominal, 0.0)?, run(motor, 0.0)?);
    let mut recording = run(motor, 1.0)?;
    let blank = (BLANKING_S / recording.sample_time_s()) as usize;
    recording.exclude(0..blank);
    let current = |r: &Recording| r.channel(Channel::Current).unwrap_or_default().to_vec();
    let (a, b) = (current(&ideal), current(&here));
    let square = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>();
    let off = square(&mut a.iter().zip(&b).skip(blank).map(|(a, b)| a - b));
    let all = square(&mut b.iter().skip(blank).copied());
    let recordings = [recording];
    let errors = stations
        .iter()
        .map(|s| Ok(compare(&s.model, &recordings, &Context::quiet())?.esr.current.unwrap_or(f64::NAN)))
        .collect::<Result<_>>()?;
    Ok(Held { floor: (off / all).sqrt(), errors })
}
