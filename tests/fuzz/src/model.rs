//! Model and station files: an error of one line, or a model that can be written, read again, and flashed or refused in
//! a line.

use std::path::Path;

use greyrig::parameters::block::MAX_PAYLOAD;
use greyrig::parameters::section;
use greyrig_host::device::parameters;
use greyrig_host::model::Model;

use crate::recordings::one_line;
use crate::{Seen, with_file};

/// A model file.
pub fn load(data: &[u8]) -> Seen {
    let model = match with_file("model.toml", data, Model::load) {
        Err(error) => return one_line(&error),
        Ok(model) => model,
    };
    let path = Path::new("model.toml");
    if let Err(error) = model.limits(path) {
        one_line(&error);
    }
    match model.text() {
        Err(error) => {
            one_line(&error);
        }
        Ok(text) => {
            let again = with_file("again.toml", text.as_bytes(), Model::load);
            assert_eq!(again.map_err(|e| e.to_string()).as_ref(), Ok(&model), "{text}");
        }
    }
    match parameters::settings(&model, path) {
        Err(error) => one_line(&error),
        Ok(settings) => {
            let mut buffer = [0; MAX_PAYLOAD];
            // Longer than a slot is the only reason left.
            if let Ok(payload) = section::encode(&settings, &mut buffer) {
                assert_eq!(section::decode(payload), Ok(settings));
            }
            Seen::of((model.effects.len(), model.terms.len(), model.detector.is_some(), model.correction.is_some()))
        }
    }
}

/// A rig's calibration.
pub fn calibration(data: &[u8]) -> Seen {
    match with_file("rig.toml", data, parameters::calibration) {
        Err(error) => one_line(&error),
        Ok(settings) => {
            assert!(settings.build().is_ok());
            Seen::of("calibration")
        }
    }
}
