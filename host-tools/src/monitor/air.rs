//! The air: a fan's load is proportional to its density.
//!
//! A recording tells the air by `# air_pressure_hpa: 1003` and, if it is not 20 °C, `# air_temp_c: 24`:
//!
//! ```text
//! ρ = p/(R_s T),  R_s = 287.05 J/(kg K)          M_fan = μ2 ω² ρ/ρ₀
//! ```
//!
//! with ρ₀ the mean over the healthy motors that have taught the limits. Humid air of 25 °C is up to 1 % lighter than
//! dry air, which is neglected.
//!
//! Source: ISO 2533:1975, Standard Atmosphere (R_s of dry air).

use std::borrow::Cow;

use greyrig::motor::BaseParameter;

use crate::error::{Error, Place, Result};
use crate::model::{DetectorEntry, Model};
use crate::recording::Recording;

/// Gas constant of dry air, J/(kg K).
const GAS: f64 = 287.05;
/// Temperature of the air where none is told, °C.
const USUAL_C: f64 = 20.0;
/// Pressures that there are at a test rig, hPa: 4000 m above the sea, and a high at the sea.
const PRESSURES: std::ops::RangeInclusive<f64> = 550.0..=1100.0;
/// Temperatures that there are at a test rig, °C.
const TEMPERATURES: std::ops::RangeInclusive<f64> = -30.0..=60.0;

/// Density of the air, kg/m³, if the recording tells the pressure.
///
/// # Errors
/// A pressure or temperature that is no number or not of this world.
pub fn density(recording: &Recording) -> Result<Option<f64>> {
    let number = |key: &str, range: std::ops::RangeInclusive<f64>| -> Result<Option<f64>> {
        let Some(text) = recording.metadata().get(key) else { return Ok(None) };
        text.trim().parse().ok().filter(|x| range.contains(x)).map(Some).ok_or_else(|| {
            Error::input(
                Place::file(recording.path()),
                format!("{key} is {text:?}"),
                format!("give a number from {} to {}", range.start(), range.end()),
            )
        })
    };
    let temperature = number("air_temp_c", TEMPERATURES)?.unwrap_or(USUAL_C);
    Ok(number("air_pressure_hpa", PRESSURES)?.map(|hpa| 100.0 * hpa / (GAS * (temperature + 273.15))))
}

/// The model in the air of a recording, where that and the air of the limits are known.
///
/// # Errors
/// As [`density`].
pub fn compensated<'a>(model: &'a Model, detector: &DetectorEntry, recording: &Recording) -> Result<Cow<'a, Model>> {
    let (Some([low, high]), Some(density)) = (detector.air_kg_m3, density(recording)?) else {
        return Ok(Cow::Borrowed(model));
    };
    let mut changed = model.clone();
    if let Some(load) = changed.base_parameter_mut(BaseParameter::Mu2) {
        load.value *= density / (0.5 * (low + high));
    }
    Ok(Cow::Owned(changed))
}
