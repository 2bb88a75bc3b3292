//! A motor type with its model, correction and limits, as a test station has them.

use std::sync::OnceLock;

use greyrig::parameters::Settings;
use greyrig::units::CalibrationSettings;
use greyrig_board::analog::Analog;
use greyrig_board::rig::{Commanded, Rig};
use greyrig_host::anfis::Method;
use greyrig_host::context::Context;
use greyrig_host::device::parameters;
use greyrig_host::hybrid;
use greyrig_host::identify::{self, identify};
use greyrig_host::model::{Kind, Model};
use greyrig_host::monitor::calibrate::{self, calibrate};
use greyrig_host::recording::Recording;
use greyrig_host::rig::{Motor, Setup};

/// What all motors of the type have.
const EFFECTS: [&str; 3] = ["saturation=0.25", "hysteresis=0.1", "brush_arcing=0.02"];
/// Begin of a test that is not judged, s.
const BLANKING_S: f64 = 3.0;

/// A type of motor at its station.
pub struct Station {
    /// Its parameters, as they go to the flash.
    pub payload: Vec<u8>,
}

fn setup(profile: &str, seconds: f64, seed: u64) -> Setup {
    let setup = Setup::new(Kind::Universal).profile(profile).unwrap().seconds(seconds).seed(seed);
    EFFECTS.iter().fold(setup, |setup, effect| setup.effect(effect).unwrap())
}

fn motor(profile: &str, seconds: f64, seed: u64, fault: Option<&str>) -> Setup {
    let setup = setup(profile, seconds, seed).motor(Motor::sample_from_population(&Motor::universal(), 0.03, seed));
    fault.into_iter().fold(setup, |setup, fault| setup.fault(fault).unwrap())
}

/// A motor of the type at the pins.
pub fn rig(profile: &str, seconds: f64, seed: u64, fault: Option<&str>) -> Box<dyn Analog> {
    Box::new(Rig::new(motor(profile, seconds, seed, fault)).unwrap())
}

/// A motor of the type whose supply the board commands, and the calibration of its rig.
pub fn commanded(seed: u64, fault: Option<&str>, full_scale_v: f64) -> (Box<dyn Analog>, CalibrationSettings) {
    let rig = Commanded::new(&motor("steady", 7.0, seed, fault), full_scale_v).unwrap();
    let calibration = rig.calibration();
    (Box::new(rig), calibration)
}

/// The type with its model, trained on one motor, and limits from ten.
pub fn station() -> &'static Station {
    static STATION: OnceLock<Station> = OnceLock::new();
    STATION.get_or_init(|| {
        let training = [setup("staircase", 12.0, 1).run().unwrap().recording];
        let bare = identify(&training, &identify::Settings::new(Kind::Universal), &Context::quiet()).unwrap().model;
        let settings = hybrid::settings(Method::Varpro, 60);
        let model = hybrid::train(&bare, &training, 1.0, &settings, &Context::quiet()).unwrap().0;
        let healthy: Vec<Recording> =
            (1..=10).map(|seed| motor("steady", 7.0, seed, None).run().unwrap().recording).collect();
        let detector =
            calibrate(&model, &healthy, calibrate::Settings::blanking(BLANKING_S), &Context::quiet()).unwrap().detector;
        let model = Model { detector: Some(detector), ..model };
        let calibration = Rig::new(setup("steady", 7.0, 1)).unwrap().calibration();
        let path = std::path::Path::new("station.toml");
        // As a block of before, with the rig in it.
        let rig = greyrig::parameters::Rig { name: "virtual".try_into().unwrap(), calibration, supply: None };
        let settings = Settings { rig: Some(rig), ..parameters::settings(&model, path).unwrap() };
        Station { payload: parameters::payload(&settings, path).unwrap() }
    })
}
