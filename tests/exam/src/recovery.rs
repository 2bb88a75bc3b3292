//! What adding the named effects recovers: the held-out error on a ramp before and after, and whether R, J
//! and the flux are true again.

use greyrig_host::addition::identify_with;
use greyrig_host::compare::compare;
use greyrig_host::context::Context;
use greyrig_host::error::Result;
use greyrig_host::identify::flux::swings;
use greyrig_host::identify::{Settings, identify};

use crate::cases::Case;
use crate::score::Outcome;

/// The outcome of adding.
#[derive(Debug, Clone, Copy)]
pub struct Recovery {
    /// Number of the case.
    pub seed: u64,
    /// Free-run error-to-signal ratio of the current, held out: before, after, and that of noise alone.
    pub esr: [f64; 3],
    /// How far R, J and the linkage at the largest current are off, in half widths of their 95 % intervals; NaN without
    /// one.
    pub off: [f64; 3],
}

impl Recovery {
    /// (E_before − E_after)/(E_before − floor).
    pub fn share(&self) -> f64 {
        let [before, after, floor] = self.esr;
        (before - after) / (before - floor)
    }
}

/// Adds the effects that a diagnosis has named.
///
/// # Errors
/// Recordings that cannot be used, an interrupt.
pub fn add(case: &Case, outcome: &Outcome) -> Result<Recovery> {
    let training = case.recordings()?;
    let held_out = [case.held_out()?];
    let before = identify(&training, &Settings::new(case.excitation.kind()), &Context::quiet())?;
    let after = identify_with(&training, &Settings::new(case.excitation.kind()), &outcome.named, &Context::quiet())?
        .identification;
    let (worse, better) =
        (compare(&before.model, &held_out, &Context::quiet())?, compare(&after.model, &held_out, &Context::quiet())?);
    let current = |c: &greyrig_host::compare::Comparison| c.esr.current.unwrap_or(0.0);
    let floor = better.noise_floor.current.unwrap_or(0.0);
    let motor = case.motor();
    let off = |truth: f64, value: f64, [low, high]: [f64; 2]| 2.0 * (value - truth).abs() / (high - low);
    let parameter = |name: &str, truth: f64| {
        let found = after.parameters.iter().find(|p| p.name == name);
        found.and_then(|p| Some(off(truth, p.value?, p.ci95?))).unwrap_or(f64::NAN)
    };
    let plant = case.plant()?;
    let flux = after.flux.map_or(f64::NAN, |f| off(plant.linkage(swings(f.current), f.speed), f.value, f.ci95));
    Ok(Recovery {
        seed: case.seed,
        esr: [current(&worse), current(&better), floor],
        off: [parameter("R", motor.r), parameter("J", motor.j), flux],
    })
}
