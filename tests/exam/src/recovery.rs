//! What adding the named effects recovers: the held-out error on a ramp before and after, and whether R and J are true again.

use greyrig_host::compare::compare;
use greyrig_host::error::Result;
use greyrig_host::identify::{Settings, identify};
use greyrig_host::model::Kind;
use greyrig_host::rig::Motor;

use crate::cases::{Case, SPREAD};
use crate::score::Outcome;

/// The outcome of adding.
#[derive(Debug, Clone, Copy)]
pub struct Recovery {
    /// (E_before − E_after)/(E_before − floor) of the current, held out.
    pub share: f64,
    /// Whether R and J lie in their 95 % intervals.
    pub covered: [bool; 2],
}

/// Adds the effects that a diagnosis has named.
///
/// # Errors
/// Recordings that cannot be used, an interrupt.
pub fn add(case: &Case, outcome: &Outcome) -> Result<Recovery> {
    let training = case.recordings()?;
    let held_out = [case.held_out()?];
    let before = identify(&training, &Settings::new(Kind::Universal))?;
    let effects = outcome.named.iter().map(|id| (*id).to_owned()).collect();
    let after = identify(&training, &Settings { effects, ..Settings::new(Kind::Universal) })?;
    let (worse, better) = (compare(&before.model, &held_out)?, compare(&after.model, &held_out)?);
    let current = |c: &greyrig_host::compare::Comparison| c.esr.current.unwrap_or(0.0);
    let floor = better.noise_floor.current.unwrap_or(0.0);
    let motor = Motor::sample_from_population(&Motor::universal(), SPREAD, case.seed);
    let covers = |name: &str, truth: f64| {
        let interval = after.parameters.iter().find(|p| p.name == name).and_then(|p| p.ci95);
        interval.is_some_and(|[low, high]| (low..=high).contains(&truth))
    };
    Ok(Recovery {
        share: (current(&worse) - current(&better)) / (current(&worse) - floor),
        covered: [covers("R", motor.r), covers("J", motor.j)],
    })
}
