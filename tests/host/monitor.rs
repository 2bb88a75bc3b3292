//! From a motor type to verdicts on motors: correction, limits, detector, suspects.

use std::sync::OnceLock;

use greyrig::detector::Features;
use greyrig::effects::EffectId;
use greyrig_host::anfis::Method;
use greyrig_host::compare::compare;
use greyrig_host::context::Context;
use greyrig_host::hybrid;
use greyrig_host::identify::{Settings, identify};
use greyrig_host::model::{Kind, Model};
use greyrig_host::monitor::calibrate::{self, calibrate};
use greyrig_host::monitor::test::{Outcome, Test, test};
use greyrig_host::monitor::tolerance::factor;
use greyrig_host::recording::{Recording, write};
use greyrig_host::rig::{Motor, Setup};

const EFFECTS: [&str; 3] = ["saturation=0.25", "hysteresis=0.1", "brush_arcing=0.02"];
const BLANKING_S: f64 = 3.0;

fn rig(profile: &str, seconds: f64, seed: u64) -> Setup {
    let setup = Setup::new(Kind::Universal).profile(profile).unwrap().seconds(seconds).seed(seed);
    EFFECTS.iter().fold(setup, |s, e| s.effect(e).unwrap())
}

/// A motor of the lot on the station's profile.
fn motor(seed: u64, fault: Option<&str>) -> Recording {
    let motor = Motor::sample_from_population(&Motor::universal(), 0.03, seed);
    let setup = rig("steady", 7.0, seed).motor(motor);
    let setup = fault.into_iter().fold(setup, |s, f| s.fault(f).unwrap());
    setup.run().unwrap().recording
}

/// The physical model of the type, the same with a correction, and the station's with limits.
fn station() -> &'static (Model, Model, Model) {
    static STATION: OnceLock<(Model, Model, Model)> = OnceLock::new();
    STATION.get_or_init(|| {
        let training = [rig("staircase", 12.0, 1).run().unwrap().recording];
        let bare = identify(&training, &Settings::new(Kind::Universal), &Context::quiet()).unwrap().model;
        let settings = hybrid::settings(Method::Varpro, 60);
        let corrected = hybrid::train(&bare, &training, 1.0, &settings, &Context::quiet()).unwrap().0;
        let healthy: Vec<Recording> = (1..=10).map(|seed| motor(seed, None)).collect();
        let detector = calibrate(&corrected, &healthy, calibrate::Settings::blanking(BLANKING_S), &Context::quiet())
            .unwrap()
            .detector;
        let station = Model { detector: Some(detector), ..corrected.clone() };
        (bare, corrected, station)
    })
}

fn verdict(fault: &str) -> Test {
    let model = &station().2;
    test(model, model.detector.as_ref().unwrap(), &motor(77, Some(fault)), &Context::quiet()).unwrap()
}

#[test]
fn the_correction_brings_the_error_of_the_current_below_one_percent_on_another_profile() {
    let (bare, corrected, _) = station();
    let mut held_out = rig("ramp", 10.0, 2).run().unwrap().recording;
    // The start is judged by nobody: the detector is blanked there.
    held_out.exclude(0..10_000);
    let error =
        |m: &Model| compare(m, std::slice::from_ref(&held_out), &Context::quiet()).unwrap().esr.current.unwrap();
    assert!(error(bare) > 0.05, "without a correction {}", error(bare));
    assert!(error(corrected) < 0.01, "with it {}", error(corrected));
}

#[test]
fn healthy_motors_that_the_limits_have_not_seen_pass() {
    let model = &station().2;
    for seed in 101..=112 {
        let t = test(model, model.detector.as_ref().unwrap(), &motor(seed, None), &Context::quiet()).unwrap();
        assert_eq!(t.verdict, Outcome::Pass, "motor {seed}: {:?}", t.alarms);
    }
}

#[test]
fn faults_fail_and_are_put_where_they_are() {
    for (fault, kind, suspect) in [
        ("sparking=0.3@5", "electrical", "sparking brushes"),
        ("resistance_up=0.3@5", "electrical", "resistance +"),
        ("bearing_friction=2@5", "mechanical", "friction"),
        ("fan_load=-0.3@5", "mechanical", "-"),
        ("current_sensor=0.15@5", "sensor", "gain of the current sensor +"),
        ("speed_sensor=-0.1@5", "sensor", "gain of the speed sensor -"),
    ] {
        let t = verdict(fault);
        assert_eq!(t.verdict, Outcome::Fail, "{fault}");
        let alarm = &t.alarms[0];
        let told: Vec<_> = t.findings.iter().map(|f| (&f.text, f.z, f.explains, f.as_likely)).collect();
        assert_eq!(alarm.kind, kind, "{fault}: {alarm:?} {told:?}");
        assert!(alarm.suspect.contains(suspect), "{fault}: {alarm:?} {told:?}");
        // Three periods to call, one that is under way, and the filter's delay.
        assert!((5.0..5.2).contains(&alarm.t_s), "{fault}: {} s", alarm.t_s);
    }
}

#[test]
fn parameters_tell_what_was_wrong_from_the_start() {
    let training = [rig("staircase", 12.0, 1).run().unwrap().recording];
    let effects = vec![EffectId::Saturation, EffectId::Hysteresis];
    let model =
        identify(&training, &Settings { effects, ..Settings::new(Kind::Universal) }, &Context::quiet()).unwrap().model;
    let healthy: Vec<Recording> = (1..=10).map(|seed| motor(seed, None)).collect();
    let detector =
        calibrate(&model, &healthy, calibrate::Settings::blanking(BLANKING_S), &Context::quiet()).unwrap().detector;
    let verdict = |fault: &str| test(&model, &detector, &motor(77, Some(fault)), &Context::quiet()).unwrap();
    // Without the effects saturation passes for resistance, so that a run does not determine it.
    assert!(!station().2.detector.as_ref().unwrap().parameters.contains_key("R"));
    // A scatter of 3 % makes limits of some 15 to 20 % from ten motors; a sensor's gain acts on several parameters at
    // once.
    for (fault, kind, suspect, size) in [
        ("resistance_up=0.4@0", "electrical", "resistance", 0.4),
        ("fan_load=-0.5@0", "mechanical", "", -0.5),
        ("speed_sensor=-0.15@0", "sensor", "gain of the speed sensor", -0.15),
    ] {
        let t = verdict(fault);
        assert_eq!(t.verdict, Outcome::Fail, "{fault}");
        let alarm = &t.alarms[0];
        assert_eq!(alarm.kind, kind, "{fault}: {alarm:?} {:?}", t.suspects);
        assert!(alarm.suspect.contains(suspect), "{fault}: {alarm:?} {:?}", t.suspects);
        // The motor's own scatter: two standard deviations of 3 % are two fifths of the smallest fault, less what
        // several parameters average.
        let told = t.suspects[0].change;
        assert!((told / size - 1.0).abs() < 0.35, "{fault}: {told}");
    }
    let t = verdict("resistance_up=0.01@0");
    assert_eq!(t.verdict, Outcome::Pass, "{:?}", t.alarms);
    assert!(t.parameters.contains_key("R") && t.parameters.contains_key("K"), "{:?}", t.parameters);
}

#[test]
fn sparks_are_told_by_themselves_and_multiply_the_arcing() {
    let limit = station().2.detector.as_ref().unwrap().sparking;
    // 5 % of the passages, where healthy motors of this type have arcs at 2 % (shorter ones, of half the voltage).
    let t = verdict("sparking=0.05@5");
    let [alarm] = t.alarms.as_slice() else { panic!("{:?}", t.alarms) };
    let called = t.replay.judged().filter(|r| (alarm.t_s..=alarm.until_s).contains(&r.t_s));
    let most = called.map(|r| f64::from(r.features.sparking)).fold(0.0, f64::max);
    assert!(alarm.ratio > 1.0 && alarm.ratio <= most / limit + 1e-6, "{alarm:?}, but {most} A of {limit} A");
    assert!(t.suspects.iter().all(|s| s.kind != "electrical"), "{:?}", t.suspects);
    let mean = |from: f64, to: f64| {
        Features::mean(t.replay.judged().filter(|r| (from..to).contains(&r.t_s)).map(|r| &r.features)).arcing
    };
    // The paper's factor; the means of a second scatter by a tenth of the healthy value.
    assert!(mean(5.5, 7.0) > 10.0 * mean(3.5, 5.0), "{} {}", mean(3.5, 5.0), mean(5.5, 7.0));
}

#[test]
fn tolerance_factors_are_those_of_the_tables() {
    // NBS Handbook 91, table A-7; the formula is an approximation, good to 2 % there.
    for (n, share, confidence, k) in [(10, 0.99, 0.95, 3.981), (20, 0.95, 0.95, 2.396), (50, 0.999, 0.95, 3.766)] {
        let found = factor(n, share, confidence).unwrap();
        assert!((found / k - 1.0f64).abs() < 0.03, "{n} {share} {confidence}: {found} against {k}");
    }
    assert_eq!(factor(3, 0.99, 0.95), None);
}

use crate::bad_input::refused;
use crate::program::greyrig;

#[test]
fn the_command_tells_by_its_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let model = Model { motor: Some("VC-7".into()), ..station().2.clone() };
    model.save(&folder.path().join("station.toml"), false).unwrap();
    station().0.save(&folder.path().join("bare.toml"), false).unwrap();
    let of_type = |seed, fault| {
        let mut recording = motor(seed, fault);
        recording.set_metadata("motor", "VC-7");
        recording
    };
    let healthy = of_type(201, None);
    write(&healthy, &folder.path().join("good.csv"), false, &Context::quiet()).unwrap();
    write(&of_type(202, Some("sparking=0.5@4")), &folder.path().join("bad.csv"), false, &Context::quiet()).unwrap();
    write(&healthy.part(0..35_000), &folder.path().join("short.csv"), false, &Context::quiet()).unwrap();
    let run =
        |file: &str| greyrig(folder.path(), &["monitor", file, "--model", "station.toml", "--results", "day.csv"]);
    assert_eq!(run("good.csv").status.code(), Some(0));
    let bad = run("bad.csv");
    assert_eq!(bad.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&bad.stdout).contains("sparking brushes"));
    let mut text = std::fs::read_to_string(folder.path().join("bad.csv")).unwrap();
    text.insert_str(0, "# serial: A-17\n");
    std::fs::write(folder.path().join("bad.csv"), text).unwrap();
    let page = ["monitor", "bad.csv", "--model", "station.toml", "--report", "a17.html", "--json"];
    let told: serde_json::Value = serde_json::from_slice(&greyrig(folder.path(), &page).stdout).unwrap();
    assert_eq!(told["runs"][0]["serial"], "A-17");
    let page = std::fs::read_to_string(folder.path().join("a17.html")).unwrap();
    assert!(page.contains("<title>Motor A-17: fail"), "{}", &page[..300]);
    let short = run("short.csv");
    assert_eq!(short.status.code(), Some(4));
    assert!(String::from_utf8_lossy(&short.stdout).contains("could be judged"));
    let day = std::fs::read_to_string(folder.path().join("day.csv")).unwrap();
    let verdicts: Vec<&str> = day.lines().skip(1).map(|l| l.split(',').nth(2).unwrap()).collect();
    assert_eq!(verdicts, ["pass", "fail", "cannot judge"]);
    // Only a file of results is written to: a recording by the same option is refused before the motor is judged, and
    // stays.
    let before = std::fs::read(folder.path().join("bad.csv")).unwrap();
    let wrong = greyrig(folder.path(), &["monitor", "good.csv", "--model", "station.toml", "--results", "bad.csv"]);
    refused(&wrong, &["bad.csv:1:1", "something else", "recording,serial,verdict"]);
    assert_eq!(std::fs::read(folder.path().join("bad.csv")).unwrap(), before);
    // A line that a power cut has left without an end goes aside.
    std::fs::write(folder.path().join("day.csv"), format!("{day}good.csv,B-4,fail,1.2")).unwrap();
    assert_eq!(run("good.csv").status.code(), Some(0));
    let after = std::fs::read_to_string(folder.path().join("day.csv")).unwrap();
    assert_eq!((after.strip_prefix(&day).unwrap().lines().count(), after.contains("B-4")), (1, false));
    let aside = std::fs::read_to_string(folder.path().join("day.csv.cut")).unwrap();
    assert_eq!(aside, "good.csv,B-4,fail,1.2\n");

    let serial = |more: &[&str]| {
        let told = [&["monitor", "good.csv", "--model", "station.toml", "--json", "--serial", "B-3"], more].concat();
        greyrig(folder.path(), &told)
    };
    let told: serde_json::Value = serde_json::from_slice(&serial(&[]).stdout).unwrap();
    assert_eq!(told["runs"][0]["serial"], "B-3");
    for (more, complaint) in [("short.csv", "one motor's"), ("--out=x.csv", "--out is for a test over the link")] {
        let refused = serial(&[more]);
        assert_eq!(refused.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&refused.stderr).contains(complaint), "{refused:?}");
    }
    let another = greyrig(folder.path(), &["monitor", "bad.csv", "--model", "station.toml", "--serial", "B-3"]);
    assert_eq!(another.status.code(), Some(2));

    let without = greyrig(folder.path(), &["monitor", "good.csv", "--model", "bare.toml"]);
    assert_eq!(without.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&without.stderr).contains("greyrig calibrate"));
    let other = greyrig(folder.path(), &["monitor", "good.csv", "--model", "station.toml", "--type", "VC-9"]);
    assert_eq!(other.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&other.stderr).contains("VC-7"));
}

#[test]
fn a_correction_used_where_it_has_not_been_trained_gives_no_verdict() {
    // Trained up to nominal voltage; at a tenth more the current leaves the trained box.
    let mut model = station().2.clone();
    let correction = model.correction.as_mut().unwrap();
    let [low, high] = correction.input[2].range;
    // As if the training had only seen the slower half of the speeds.
    correction.input[2].range = [low, 0.5 * (low + high)];
    let t = test(&model, model.detector.as_ref().unwrap(), &motor(301, None), &Context::quiet()).unwrap();
    assert_eq!(t.verdict, Outcome::CannotJudge);
    assert!(t.reasons[0].contains("not been trained"), "{:?}", t.reasons);
}

#[test]
fn limits_need_several_motors() {
    let folder = tempfile::tempdir().unwrap();
    station().1.save(&folder.path().join("model.toml"), false).unwrap();
    write(&motor(1, None), &folder.path().join("one.csv"), false, &Context::quiet()).unwrap();
    let out = greyrig(folder.path(), &["calibrate", "one.csv", "--model", "model.toml"]);
    assert_eq!(out.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&out.stderr).contains("at least 4 healthy motors"));
    for share in ["0", "0.6", "nan", "-1e-3"] {
        let option = format!("--false-alarms={share}");
        let out = greyrig(folder.path(), &["calibrate", "one.csv", "--model", "model.toml", &option]);
        assert_eq!(out.status.code(), Some(2), "{share}");
        assert!(String::from_utf8_lossy(&out.stderr).contains("share of healthy motors"), "{share}");
    }
}
