//! Under which conditions the detector judges: direct voltage, 50 and 60 Hz, and what it was not learnt under.

use std::path::Path;

use greyrig_host::context::Context;
use greyrig_host::identify::{Settings, identify};
use greyrig_host::model::{Kind, Model};
use greyrig_host::monitor::calibrate::{self, calibrate};
use greyrig_host::monitor::test::{Outcome, test};
use greyrig_host::recording::{Recording, write};
use greyrig_host::rig::{Motor, Setup};

use crate::bad_input::refused;
use crate::program::greyrig;

/// Begin of a test that is not judged, its length, and when its faults begin, s.
const BLANKING_S: f64 = 3.0;
const TEST_S: f64 = 7.0;
const ONSET_S: f64 = 5.0;

/// A kind of motor on its supply, and the profile that identifies it.
struct Supply {
    kind: Kind,
    mains_hz: f64,
    teaches: &'static str,
}

impl Supply {
    fn nominal(&self) -> Motor {
        match self.kind {
            Kind::Universal => Motor::universal(),
            Kind::PmDc => Motor::pm_dc(),
        }
    }

    fn of_the_lot(&self, seed: u64) -> Motor {
        Motor::sample_from_population(&self.nominal(), 0.03, seed)
    }
}

fn run(supply: &Supply, profile: &str, motor: Motor, seed: u64, fault: Option<String>) -> Recording {
    let setup = Setup::new(supply.kind).profile(profile).unwrap().seconds(TEST_S).seed(seed).motor(motor);
    let setup = fault.iter().fold(setup, |s, f| s.fault(f).unwrap());
    Setup { mains_hz: supply.mains_hz, ..setup }.run().unwrap().recording
}

fn station(supply: &Supply, change: impl Fn(&mut Recording)) -> Model {
    let teach = run(supply, supply.teaches, supply.nominal(), 1, None);
    let model = identify(&[teach], &Settings::new(supply.kind), &Context::quiet()).unwrap().model;
    let mut healthy: Vec<Recording> =
        (1..=10).map(|seed| run(supply, "steady", supply.of_the_lot(seed), seed, None)).collect();
    healthy.iter_mut().for_each(change);
    let detector =
        calibrate(&model, &healthy, calibrate::Settings::blanking(BLANKING_S), &Context::quiet()).unwrap().detector;
    Model { detector: Some(detector), ..model }
}

/// Periods, healthy motors and faults, from the voltage's zero crossings to the verdict.
#[test]
fn the_whole_detector_works_on_direct_voltage_and_on_50_and_60_hz() {
    for (kind, mains_hz, teaches, period_s) in [
        (Kind::Universal, 50.0, "staircase", 1.0 / 50.0),
        (Kind::Universal, 60.0, "staircase", 1.0 / 60.0),
        // A magnet motor's steady profile is direct voltage, which is judged in stretches of 20 ms.
        (Kind::PmDc, 50.0, "dc-steps", 0.02),
    ] {
        let supply = Supply { kind, mains_hz, teaches };
        let model = station(&supply, |_| ());
        let detector = model.detector.as_ref().unwrap();
        let judge = |seed: u64, fault: Option<&str>| {
            let fault = fault.map(|f| format!("{f}@{ONSET_S}"));
            test(&model, detector, &run(&supply, "steady", supply.of_the_lot(seed), seed, fault), &Context::quiet())
                .unwrap()
        };
        for seed in [101, 102, 103] {
            let t = judge(seed, None);
            assert_eq!(t.verdict, Outcome::Pass, "{kind:?} {mains_hz} Hz: {:?} {:?}", t.alarms, t.reasons);
            let late: Vec<f64> = t.replay.rows.iter().map(|r| r.t_s).filter(|t| *t > BLANKING_S).collect();
            let mean = (late[late.len() - 1] - late[0]) / (late.len() - 1) as f64;
            // Crossings lie on the grid of samples, 0.1 ms, at both ends of almost 4 s.
            assert!((mean - period_s).abs() < 1e-4 * period_s, "{kind:?} {mains_hz} Hz: {mean} s");
        }
        for (fault, place) in [
            ("resistance_up=0.4", "electrical"),
            ("bearing_friction=2", "mechanical"),
            ("current_sensor=0.1", "sensor"),
        ] {
            let t = judge(104, Some(fault));
            assert_eq!(t.verdict, Outcome::Fail, "{kind:?} {mains_hz} Hz {fault}");
            let alarm = &t.alarms[0];
            assert_eq!(alarm.kind, place, "{kind:?} {mains_hz} Hz {fault}: {alarm:?} {:?}", t.suspects);
            // Called while an abrupt change stands out, which is a second.
            assert!((ONSET_S..ONSET_S + 1.0).contains(&alarm.t_s), "{kind:?} {mains_hz} Hz {fault}: {} s", alarm.t_s);
        }
    }
}

const MAINS: Supply = Supply { kind: Kind::Universal, mains_hz: 50.0, teaches: "staircase" };

fn at_the_sea(recording: &mut Recording) {
    recording.set_metadata("air_pressure_hpa", "1013");
    recording.add_extra("temp_c", vec![25.0; recording.len()]).unwrap();
}

#[test]
fn conditions_under_which_nothing_was_learnt_give_no_verdict() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let model = Model { motor: Some("VC-7".into()), ..station(&MAINS, at_the_sea) };
    model.save(&here.join("station.toml"), false).unwrap();
    // The profile goes by the nameplate: a motor that gets 80 % of the nominal voltage.
    let mut low = MAINS.of_the_lot(201);
    low.nameplate.voltage_v *= 0.8;
    for (name, motor) in [("good.csv", MAINS.of_the_lot(201)), ("low.csv", low)] {
        let mut recording = run(&MAINS, "steady", motor, 201, None);
        recording.set_metadata("motor", "VC-7");
        write(&recording, &here.join(name), false, &Context::quiet()).unwrap();
    }
    let monitor = |file: &str, more: &[&str]| {
        let output = greyrig(here, &[&["monitor", file, "--model", "station.toml"], more].concat());
        (output.status.code(), String::from_utf8(output.stdout).unwrap())
    };
    assert_eq!(monitor("good.csv", &[]).0, Some(0));
    assert_eq!(monitor("good.csv", &["--air-hpa", "1000", "--temp-c", "20", "--type", "VC-7"]).0, Some(0));
    for (file, more, words) in [
        ("good.csv", &["--temp-c", "60"][..], "at 60 °C"),
        ("good.csv", &["--temp-c", "-5"], "at -5 °C"),
        // 3000 m above the sea: 0.83 kg/m³ in place of 1.20.
        ("good.csv", &["--air-hpa", "700"], "the air weighs 0.83 kg/m³"),
        ("low.csv", &[], "the mains reach 184 V"),
    ] {
        let (code, said) = monitor(file, more);
        assert_eq!(code, Some(4), "{said}");
        assert!(said.contains("cannot judge") && said.contains(words), "{said}");
    }
    let refuse = |more: &[&str], words: &[&str]| {
        refused(&greyrig(here, &[&["monitor", "good.csv", "--model", "station.toml"], more].concat()), words);
    };
    refuse(&["--type", "VC-9"], &["VC-7", "VC-9", "take the model of the type"]);
    refuse(&["--air-hpa", "30"], &["air_pressure_hpa", "550"]);
    wrong_type_in_the_recording(here);
}

/// The recording itself tells another type than the model is of.
fn wrong_type_in_the_recording(here: &Path) {
    let text = std::fs::read_to_string(here.join("good.csv")).unwrap();
    std::fs::write(here.join("other.csv"), text.replace("motor: VC-7", "motor: VC-9")).unwrap();
    refused(&greyrig(here, &["monitor", "other.csv", "--model", "station.toml"]), &["other.csv", "VC-9", "VC-7"]);
}

/// A fan in thin air has less load: told, it is compensated; untold, the motor seems to run too fast.
#[test]
fn thin_air_is_compensated_where_it_is_told() {
    let model = station(&MAINS, at_the_sea);
    let detector = model.detector.as_ref().unwrap();
    let nominal = Motor::universal();
    let thin = Motor { mu2: 0.9 * nominal.mu2, ..nominal };
    let mut recording = run(&MAINS, "steady", thin, 1, None);
    let deviation = |recording: &Recording| {
        let f = test(&model, detector, recording, &Context::quiet()).unwrap().features;
        f64::from(f.speed_deviation)
    };
    let untold = deviation(&recording);
    recording.set_metadata("air_pressure_hpa", (0.9 * 1013.0).to_string());
    let told = deviation(&recording);
    // At given voltage the speed of a series motor goes with a root of the load between the second and the fourth.
    assert!((0.01..0.06).contains(&untold), "{untold}");
    assert!(told.abs() < 0.05 * untold, "told {told}, untold {untold}");
}
