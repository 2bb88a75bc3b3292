//! From a model file to the parameters of the microcontroller.

use std::path::Path;

use greyrig::butterworth;
use greyrig::parameters::block::MAX_PAYLOAD;
use greyrig::parameters::rig::{MAX_RIG, Rig};
use greyrig::parameters::{MAX_TEXT, Origin, Settings, Text, section};
use greyrig::units::{CalibrationSettings, Scale};
use serde::Deserialize;

use super::RIG;
use crate::error::{Error, Place, Result};
use crate::model::Model;

/// A rig's calibration as a file: `[voltage]`, `[current]`, `[speed]`, each with `zero` (counts) and `per_count` (SI
/// units).
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CalibrationFile {
    voltage: Channel,
    current: Channel,
    speed: Channel,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Channel {
    zero: f32,
    per_count: f32,
}

impl From<Channel> for Scale {
    fn from(Channel { zero, per_count }: Channel) -> Self {
        Self { zero, per_count }
    }
}

/// Reads a rig's calibration.
///
/// # Errors
/// A file that cannot be read or holds no calibration that could be.
pub fn calibration(path: &Path) -> Result<CalibrationSettings> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
    let wrong = |line, what: String| {
        let remedy = "give [voltage], [current] and [speed], each with zero (counts) and per_count (V, A, rad/s)";
        Error::input(Place::at(path, line, 0), what, remedy)
    };
    let file: CalibrationFile = toml::from_str(&text).map_err(|e| {
        let line = e.span().map_or(0, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        wrong(line, e.message().lines().next().unwrap_or("no calibration").to_owned())
    })?;
    let settings =
        CalibrationSettings { voltage: file.voltage.into(), current: file.current.into(), speed: file.speed.into() };
    settings.build().map_err(|e| wrong(0, e.to_string()))?;
    Ok(settings)
}

/// The parameters of a model, checked as the microcontroller checks them.
///
/// # Errors
/// A name that is too long, a value that the microcontroller would refuse.
pub fn settings(model: &Model, path: &Path) -> Result<Settings> {
    let filter = butterworth::Settings {
        order: model.filter.order,
        cutoff_hz: model.filter.cutoff_hz,
        sample_rate_hz: RIG.sample_rate_hz.into(),
    };
    settings_at(model, path, filter)
}

/// The same at the sampling rate of another filter than the rig's.
///
/// # Errors
/// As there.
pub fn settings_at(model: &Model, path: &Path, filter: butterworth::Settings) -> Result<Settings> {
    let refuse = |what: String| Error::input(Place::file(path), what, "correct the model, or identify it again");
    let motor = model.motor::<f32>().map_err(|e| refuse(e.to_string()))?;
    let motor_type = model.motor.as_deref().unwrap_or_default();
    let settings = Settings {
        motor_type: Text::try_from(motor_type)
            .map_err(|_| refuse(format!("the motor's name is longer than {MAX_TEXT} bytes")))?,
        rig: None,
        filter,
        motor: *motor.parameters(),
        effects: motor.effects().iter().copied().collect(),
        terms: motor.terms().iter().copied().collect(),
        correction: model.correction_settings()?,
        detector: model.detector.as_ref().map(|d| d.settings(1.0 / filter.sample_rate_hz)),
        sequence: None,
        origin: None,
    };
    settings.build().map_err(|e| refuse(e.to_string()))?;
    Ok(settings)
}

/// The payload of a block.
///
/// # Errors
/// More than fits.
pub fn payload(settings: &Settings, path: &Path) -> Result<Vec<u8>> {
    section::encode(settings, &mut [0; MAX_PAYLOAD])
        .map(<[u8]>::to_vec)
        .map_err(|e| Error::input(Place::file(path), e.to_string(), "use fewer effects or shorter terms"))
}

/// Who writes a block, for an image of the firmware.
pub fn origin(build: [u8; 8]) -> Origin {
    // A version is short.
    Origin { greyrig: Text::try_from(env!("CARGO_PKG_VERSION")).unwrap_or_default(), build }
}

/// A rig's name.
///
/// # Errors
/// One that is too long.
pub fn rig_name(name: &str) -> Result<Text> {
    Text::try_from(name)
        .map_err(|_| Error::usage(format!("the rig's name is longer than {MAX_TEXT} bytes"), "choose a shorter one"))
}

/// The payload of a rig's block.
///
/// # Errors
/// A name with control characters, a calibration that no rig has.
pub fn rig_payload(rig: &Rig) -> Result<Vec<u8>> {
    rig.validate()
        .and_then(|()| rig.encode(&mut [0; MAX_RIG]).map(<[u8]>::to_vec))
        .map_err(|e| Error::usage(format!("the rig: {e}"), "give another name or calibration"))
}
