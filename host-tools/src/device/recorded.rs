//! From a capture to a recording.

use std::collections::BTreeMap;

use greyrig::units::CalibrationSettings;

use super::capture::Capture;
use super::error::Result;
use super::{Device, RIG};
use crate::recording::{Channel, Recording};

/// Adds who has recorded.
pub fn describe(metadata: &mut BTreeMap<String, String>, device: &Device) {
    let mut add = |key: &str, value: String| metadata.insert(key.to_owned(), value);
    add("board", device.board.clone());
    add("chip", device.chip.clone());
    add("firmware", device.firmware.clone());
    add("firmware build", device.build.clone());
    for (key, skew) in ["skew_i_a_s", "skew_omega_rad_s_s"].into_iter().zip(device.skew_s) {
        if skew != 0.0 {
            add(key, format!("{skew:e}"));
        }
    }
}

/// A capture in SI units; samples that were lost are masked.
///
/// # Errors
/// A calibration that cannot be, or no sample at all.
pub fn recording(
    capture: &Capture,
    calibration: &CalibrationSettings,
    metadata: BTreeMap<String, String>,
) -> Result<Recording> {
    let calibration = calibration.build()?;
    let valid = capture.samples.iter().map(Option::is_some).collect();
    let mut columns = [const { Vec::new() }; 3];
    for sample in &capture.samples {
        let si = sample.map(|counts| calibration.sample(counts));
        let values = si.map(|s| [s.voltage.0, s.current.0, s.speed.0]);
        for (n, column) in columns.iter_mut().enumerate() {
            column.push(values.map_or(f64::NAN, |v| f64::from(v[n])));
        }
    }
    let [u, i, omega] = columns;
    Ok(Recording::builder(1.0 / f64::from(RIG.sample_rate_hz))
        .channel(Channel::Voltage, u)
        .channel(Channel::Current, i)
        .channel(Channel::Speed, omega)
        .valid(valid)
        .metadata(metadata)
        .build()?)
}
