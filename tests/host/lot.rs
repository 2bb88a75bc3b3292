//! A motor among those of its lot: balances against closed forms, faults against the rig's.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use greyrig::effects::EffectId;
use greyrig_host::context::Context;
use greyrig_host::identify::{Settings, identify};
use greyrig_host::model::lot::{Fault, Onset};
use greyrig_host::model::{Kind, Model};
use greyrig_host::monitor::calibrate::{self, calibrate};
use greyrig_host::monitor::lot::blocks::{Cut, whole};
use greyrig_host::monitor::lot::{Labels, learn};
use greyrig_host::monitor::test::{Outcome, Test, test};
use greyrig_host::recording::{Channel, Recording};
use greyrig_host::rig::{Motor, Setup};

const STEP_S: f64 = 1e-4;

fn recorded(samples: usize, at: impl Fn(f64) -> [f64; 3]) -> Recording {
    let channel = |k: usize| (0..samples).map(|n| at(n as f64 * STEP_S)[k]).collect::<Vec<f64>>();
    Recording::builder(STEP_S)
        .path("closed form")
        .channel(Channel::Voltage, channel(0))
        .channel(Channel::Current, channel(1))
        .channel(Channel::Speed, channel(2))
        .build()
        .unwrap()
}

fn model(kind: &str, [r, l, k, j, mu0]: [f64; 5]) -> Model {
    let value = |name: &str, unit: &str, x: f64| format!("[parameters.{name}]\nvalue = {x:e}\nunit = \"{unit}\"\n");
    let text = format!(
        "schema = 1\nkind = \"{kind}\"\nbase = \"full\"\n{}{}{}{}{}",
        value("R", "ohm", r),
        value("L", "H", l),
        value("K", "V s/rad", k),
        value("J", "kg m2", j),
        value("mu0", "N m", mu0),
    );
    toml::from_str(&text).unwrap()
}

#[test]
fn what_a_resistance_leaves_of_the_power_is_its_losses() {
    // u = R i + L di/dt + K w of a magnet motor at a constant speed on 50 Hz, i = 4 A sin.
    let (r, l, k, w) = (2.0, 0.02, 0.05, 100.0);
    let at = |t: f64| {
        let (i, rate) = (4.0 * (TAU * 50.0 * t).sin(), 4.0 * TAU * 50.0 * (TAU * 50.0 * t).cos());
        [r * i + l * rate + k * w, i, w]
    };
    let recording = recorded(20_000, at);
    let truth = model("pm-dc", [r, l, k, 1e-4, 0.0]);
    let e = whole(&truth, &recording).unwrap();
    let cut = Cut::of(&e);
    assert!((cut.block_s - 0.1).abs() < 1e-4, "{cut:?}");
    let power = |model: &Model| -> Vec<f64> {
        let run = cut.run(model, &e).unwrap();
        assert!(run.blocks.len() >= 18);
        run.blocks.iter().filter(|b| b.counts[0]).map(|b| b.rows[0]).collect()
    };
    // The trapezium rule over a period of a product of sines is exact; borders between samples leave (h w)^2/12 of one
    // interval's power in a thousand of them, 1e-5 of 16 W.
    assert!(power(&truth).iter().all(|p| p.abs() < 1e-3), "{:?}", power(&truth));
    let lower = model("pm-dc", [0.9 * r, l, k, 1e-4, 0.0]);
    // 10 % of R I²/2 = 1.6 W.
    assert!(power(&lower).iter().all(|p| (p - 1.6).abs() < 2e-3), "{:?}", power(&lower));
    // And that is a tenth of what the hypothesis of another resistance says, which is of another motor: 1/0.9.
    let run = cut.run(&lower, &e).unwrap();
    for block in run.blocks.iter().filter(|b| b.counts[0]) {
        let size = block.rows[0] / block.columns[Fault::Resistance as usize][0];
        assert!((size - 0.1 / 0.9).abs() < 2e-3, "{size}");
    }
}

#[test]
fn what_a_friction_leaves_of_the_torque_is_itself() {
    // J dw/dt = K i - mu0 - 0.02 N m of a bearing, on direct current.
    let (k, j, mu0, more, i) = (0.05, 1e-4, 0.03, 0.02, 2.0);
    let rate = (k * i - mu0 - more) / j;
    let at = |t: f64| {
        let w = 50.0 + rate * t;
        [1.0 * i + k * w, i, w]
    };
    let recording = recorded(10_000, at);
    let model = model("pm-dc", [1.0, 1e-3, k, j, mu0]);
    let e = whole(&model, &recording).unwrap();
    let run = Cut::of(&e).run(&model, &e).unwrap();
    for block in run.blocks.iter().filter(|b| b.counts[1]) {
        // A straight line is averaged exactly.
        assert!((block.rows[1] - more).abs() < 1e-9, "{:?}", block.rows);
        assert!((block.columns[Fault::DryFriction as usize][1] - 1.0).abs() < 1e-9);
        // Nothing alternates: the mean of the current is no offset.
        assert!(!block.counts[2]);
    }
    assert!(run.blocks.iter().filter(|b| b.counts[1]).count() >= 7);
}

const PROFILE: &str = "steady";

fn rig(seed: u64) -> Setup {
    let setup = Setup::new(Kind::Universal).profile(PROFILE).unwrap().seconds(7.0).seed(seed);
    ["saturation=0.25", "hysteresis=0.1", "brush_arcing=0.02"].iter().fold(setup, |s, e| s.effect(e).unwrap())
}

fn motor(seed: u64, fault: Option<&str>) -> Recording {
    let setup = rig(seed).motor(Motor::sample_from_population(&Motor::universal(), 0.02, seed));
    fault.into_iter().fold(setup, |s, f| s.fault(f).unwrap()).run().unwrap().recording
}

/// A station that has learnt from ten motors.
fn station() -> &'static Model {
    static STATION: OnceLock<Model> = OnceLock::new();
    STATION.get_or_init(|| {
        let training = [rig(1).profile("staircase").unwrap().seconds(12.0).run().unwrap().recording];
        let effects = vec![EffectId::Saturation, EffectId::Hysteresis];
        let settings = Settings { effects, ..Settings::new(Kind::Universal) };
        let model = identify(&training, &settings, &Context::quiet()).unwrap().model;
        let healthy: Vec<Recording> = (1..=10).map(|seed| motor(seed, None)).collect();
        let calibration = calibrate(&model, &healthy, calibrate::Settings::blanking(3.0), &Context::quiet()).unwrap();
        assert_eq!(calibration.without_lot, None);
        // What is kept in a file is what was learnt.
        let model = Model { detector: Some(calibration.detector), ..model };
        let folder = tempfile::tempdir().unwrap();
        model.save(&folder.path().join("station.toml"), false).unwrap();
        let read = Model::load(&folder.path().join("station.toml")).unwrap();
        assert_eq!(read.detector, model.detector);
        read
    })
}

fn tested(recording: &Recording) -> Test {
    test(station(), station().detector.as_ref().unwrap(), recording, &Context::quiet()).unwrap()
}

#[test]
fn small_faults_are_named_with_instant_and_size() {
    for (fault, expected, size, tolerance) in [
        // A tenth of the size, and what the laws of the plant differ from those of the model by.
        ("resistance_up=0.1@4.6", Fault::Resistance, 0.1, 0.02),
        ("current_sensor=0.03@4.6", Fault::CurrentGain, 0.03, 0.005),
        ("speed_sensor=-0.02@4.6", Fault::SpeedGain, -0.02, 0.004),
        ("fan_load=-0.1@4.6", Fault::Load, f64::NAN, 0.0),
        ("sparking=0.3@4.6", Fault::Sparking, f64::NAN, 0.0),
    ] {
        let found = tested(&motor(77, Some(fault)));
        assert_eq!(found.verdict, Outcome::Fail, "{fault}");
        let first = &found.findings[0];
        let named = found.findings.iter().any(|f| f.as_likely && f.fault == expected);
        assert!(named, "{fault}: {:?}", found.findings.iter().map(|f| &f.text).collect::<Vec<_>>());
        if first.fault == expected && size.is_finite() {
            assert!((first.size - size).abs() < tolerance, "{fault}: {}", first.text);
        }
        // A block of 0.1 s on either side.
        let begin = first.t_s.expect("it begins during the test");
        assert!((4.45..4.8).contains(&begin), "{fault}: {}", first.text);
    }
}

#[test]
fn healthy_motors_of_the_lot_pass() {
    for seed in 201..=212 {
        let found = tested(&motor(seed, None));
        assert_eq!(found.verdict, Outcome::Pass, "motor {seed}: {:?}", found.alarms);
        assert!(found.findings.is_empty());
    }
}

#[test]
fn another_profile_is_not_judged_by_the_lot() {
    let other = rig(301).profile("staircase").unwrap().seconds(7.0).run().unwrap().recording;
    let found = tested(&other);
    assert!(found.reasons.iter().any(|r| r.contains("another profile")), "{:?}", found.reasons);
    assert!(found.findings.is_empty());
}

/// A supply that comes and goes, and a second of it, teach nothing and break nothing.
#[test]
fn what_is_too_short_for_a_lot_says_so() {
    let healthy: Vec<Recording> =
        (1..=4).map(|seed| rig(seed).seconds(0.9).motor(Motor::universal()).run().unwrap().recording).collect();
    let motors: Vec<Vec<usize>> = (0..4).map(|k| vec![k]).collect();
    let learnt = learn(|_| Ok(station().clone()), &healthy, &motors, Labels::Healthy, 1e-3, &Context::quiet()).unwrap();
    assert!(learnt.population.unwrap_err().contains("blocks of 0.10 s"));
}

#[test]
fn a_lot_of_an_older_layout_is_refused_with_the_command_that_renews_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("station.toml");
    station().save(&path, false).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(text.matches("layout = 2").count(), 1);
    for older in ["layout = 1", ""] {
        std::fs::write(&path, text.replace("layout = 2", older)).unwrap();
        let refused = Model::load(&path).unwrap_err().to_string();
        assert!(refused.contains("layout 1 of a lot") && refused.contains("greyrig calibrate"), "{refused}");
    }
}

#[test]
fn a_motor_that_looks_like_none_of_the_others_is_named() {
    let motors: Vec<Vec<usize>> = (0..10).map(|k| vec![k]).collect();
    let learnt = |fault: Option<&str>| {
        let lot: Vec<Recording> = (1..=10).map(|seed| motor(seed, fault.filter(|_| seed == 4))).collect();
        learn(|_| Ok(station().clone()), &lot, &motors, Labels::Healthy, 1e-3, &Context::quiet()).unwrap()
    };
    let clean = learnt(None);
    assert!(clean.outsiders.is_empty(), "{:?}", clean.outsiders);
    // From the start the limits go by Student's t of 9 degrees of freedom: 2.262 for a tenth of false alarms, half of
    // it for this group, on both sides; 3.690 for a hundredth.
    let [tenth, hundredth] = [0, 1].map(|point| &clean.operating_points[point].limits);
    for (a, b) in tenth.iter().zip(hundredth) {
        assert!(b.seen > a.seen, "{a:?} {b:?}");
        let from_the_start = a.onset == Onset::Start;
        assert!(!from_the_start || (b.z / a.z - 3.690 / 2.262).abs() < 1e-3, "{a:?} {b:?}");
    }
    let spoilt = learnt(Some("resistance_up=0.3@4.6"));
    let [outsider] = spoilt.outsiders.as_slice() else { panic!("{:?}", spoilt.outsiders) };
    assert_eq!((outsider.motor, outsider.finding.fault), (3, Fault::Resistance));
}

/// Two of the same fault hide each other where all teach: their like is usual then. Where some may be bad the others
/// are a lot of their own, with the limits that they make by themselves.
#[test]
fn motors_that_may_be_bad_teach_nothing_where_they_are() {
    let bad = [3, 7];
    let is_bad = |seed: u64| bad.contains(&(seed as usize - 1));
    let lot: Vec<Recording> =
        (1..=12).map(|seed| motor(seed, is_bad(seed).then_some("resistance_up=0.3@4.6"))).collect();
    let motors: Vec<Vec<usize>> = (0..lot.len()).map(|k| vec![k]).collect();
    let of = |lot: &[Recording], labels| {
        let motors = &motors[..lot.len()];
        learn(|_| Ok(station().clone()), lot, motors, labels, 1e-3, &Context::quiet()).unwrap()
    };
    let unknown = of(&lot, Labels::Unknown);
    assert_eq!(unknown.outsiders.iter().map(|o| o.motor).collect::<Vec<_>>(), bad, "{:?}", unknown.outsiders);
    let good: Vec<Recording> = (0..lot.len()).filter(|k| !bad.contains(k)).map(|k| lot[k].clone()).collect();
    let by_the_good = of(&good, Labels::Healthy).population.unwrap();
    assert_eq!(unknown.population.unwrap().limits, by_the_good.limits);
    // Of healthy motors nobody is left out.
    assert!(of(&good, Labels::Unknown).outsiders.is_empty());
}

#[test]
fn what_scatters_less_than_a_fault_is_seen_from_smaller_sizes_on() {
    let lot = station().detector.as_ref().unwrap().lot.as_ref().unwrap();
    let seen = |fault: Fault, onset: Onset| {
        lot.limits.iter().find(|l| l.fault == fault && l.onset == onset).map(|l| l.seen).unwrap()
    };
    for fault in [Fault::Resistance, Fault::Turns, Fault::VoltageGain, Fault::SpeedGain, Fault::DryFriction] {
        assert!(seen(fault, Onset::During) < seen(fault, Onset::Start), "{fault:?}");
    }
}
