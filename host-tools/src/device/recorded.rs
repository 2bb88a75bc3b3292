//! From a capture to a recording.

use std::collections::BTreeMap;

use greyrig::parameters::SAMPLE_RATE_HZ;
use greyrig::units::CalibrationSettings;

use super::Device;
use super::capture::Capture;
use crate::error::{Error, Result};
use crate::recording::{Channel, Recording};

/// Adds who has recorded.
pub fn describe(metadata: &mut BTreeMap<String, String>, device: &Device) {
    let mut add = |key: &str, value: String| metadata.insert(key.to_owned(), value);
    add("board", device.board.clone());
    add("chip", device.chip.clone());
    add("firmware", device.firmware.clone());
    for (key, skew) in ["skew_i_a_s", "skew_omega_rad_s_s"].into_iter().zip(device.skew_s) {
        if skew != 0.0 {
            add(key, format!("{skew:e}"));
        }
    }
}

/// A capture in SI units; samples that were lost lie on the straight line between their neighbours and are marked invalid.
///
/// # Errors
/// A calibration that cannot be.
pub fn recording(
    capture: &Capture,
    calibration: &CalibrationSettings,
    metadata: BTreeMap<String, String>,
) -> Result<Recording> {
    let wrong = |e: greyrig::units::CalibrationError| Error::link(e.to_string(), "write the parameters again");
    let calibration = calibration.build().map_err(wrong)?;
    let valid: Vec<bool> = capture.samples.iter().map(Option::is_some).collect();
    let mut columns = [const { Vec::new() }; 3];
    for sample in &capture.samples {
        let si = sample.map(|counts| calibration.sample(counts));
        let values = si.map(|s| [s.voltage.0, s.current.0, s.speed.0]);
        for (n, column) in columns.iter_mut().enumerate() {
            column.push(values.map_or(f64::NAN, |v| f64::from(v[n])));
        }
    }
    for column in &mut columns {
        bridge(column, &capture.lost());
    }
    let channels = [Channel::Voltage, Channel::Current, Channel::Speed].into_iter().zip(columns).collect();
    Ok(Recording { sample_time_s: 1.0 / f64::from(SAMPLE_RATE_HZ), channels, valid, metadata, ..Recording::default() })
}

/// Straight lines across gaps. A capture begins with a sample; one that ends in a gap keeps its last value.
fn bridge(column: &mut [f64], gaps: &[std::ops::Range<usize>]) {
    for gap in gaps {
        let before = gap.start.checked_sub(1).map_or(0.0, |n| column[n]);
        let after = column.get(gap.end).copied().unwrap_or(before);
        let steps = (gap.len() + 1) as f64;
        for n in gap.clone() {
            column[n] = before + (after - before) * (n - gap.start + 1) as f64 / steps;
        }
    }
}
