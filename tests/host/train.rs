//! `greyrig train`: what it tells and shows beside the model.

use greyrig_host::anfis::Method;
use greyrig_host::compare::compare;
use greyrig_host::context::Context;
use greyrig_host::hybrid;
use greyrig_host::identify::{Settings, identify};
use greyrig_host::model::Kind;
use greyrig_host::recording::{Recording, write};
use greyrig_host::rig::Setup;

use crate::bad_input::refused;
use crate::program::greyrig;

fn run(profile: &str, seconds: f64, seed: u64) -> Recording {
    let setup = Setup::new(Kind::Universal).profile(profile).unwrap().seconds(seconds).seed(seed);
    setup.effect("saturation=0.25").unwrap().run().unwrap().recording
}

#[test]
fn the_report_shows_what_was_learnt_and_a_delay_is_only_compared() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let (staircase, ramp) = (run("staircase", 6.0, 1), run("ramp", 4.0, 2));
    write(&staircase, &here.join("a.csv"), false, &Context::quiet()).unwrap();
    write(&ramp, &here.join("b.csv"), false, &Context::quiet()).unwrap();
    identify(&[staircase], &Settings::new(Kind::Universal), &Context::quiet())
        .unwrap()
        .model
        .save(&here.join("m.toml"), false)
        .unwrap();
    let train = ["train", "a.csv", "b.csv", "--model", "m.toml", "--epochs", "4"];
    let with = |more: &[&str]| greyrig(here, &[&train[..], more].concat());

    let plain = with(&["--out", "plain.toml"]);
    assert_eq!(plain.status.code(), Some(0), "{}", String::from_utf8_lossy(&plain.stderr));
    let output = with(&["--out", "compared.toml", "--delay", "0.005", "--report", "t.html", "--json"]);
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["delayed"]["delay_s"], 0.005);
    let (delayed, without) = (told["delayed"]["rmse_chk"].as_f64().unwrap(), told["rmse_chk"].as_f64().unwrap());
    assert!(delayed > 0.0 && delayed != without, "{delayed} {without}");
    let [a, b] = ["plain.toml", "compared.toml"].map(|name| std::fs::read_to_string(here.join(name)).unwrap());
    assert_eq!(a, b, "the model has no delayed input");

    let page = std::fs::read_to_string(here.join("t.html")).unwrap();
    for heading in [
        "Learning curve",
        "Membership functions of u_v, before training",
        "Membership functions of modelled i_a, after training",
        "Response over u_v and modelled omega_rad_s",
    ] {
        assert!(page.contains(heading), "{heading}");
    }
    refused(&with(&["--delay", "7"]), &["--delay from 0.0001 to 1"]);
}

/// Saturation that takes 35 % of the flux, learnt from three staircases whose steps lie between each other's.
#[test]
fn three_staircases_bring_a_profile_held_out_below_one_percent() {
    let run = |profile: &str, seconds: f64, seed: u64, peak: Option<f64>| {
        let mut setup = Setup::new(Kind::Universal).profile(profile).unwrap().seconds(seconds).seed(seed);
        for effect in ["saturation=0.35", "hysteresis=0.1", "brush_arcing=0.02"] {
            setup = setup.effect(effect).unwrap();
        }
        setup.peak_voltage_v = peak;
        setup.run().unwrap().recording
    };
    let staircases =
        [run("staircase", 12.0, 1, None), run("staircase", 12.0, 11, Some(300.0)), run("staircase", 7.0, 12, None)];
    let mut ramp = run("ramp", 10.0, 2, None);
    ramp.exclude(0..10_000);
    let ramp = [ramp];
    let physics = identify(&staircases, &Settings::new(Kind::Universal), &Context::quiet()).unwrap().model;
    let settings = hybrid::settings(Method::Varpro, 30);
    let (corrected, _) = hybrid::train(&physics, &staircases, 1.0, &settings, &Context::quiet()).unwrap();
    let error = |model| compare(model, &ramp, &Context::quiet()).unwrap().esr.current.unwrap();
    let (before, after) = (error(&physics), error(&corrected));
    assert!(before > 0.12 && after < 0.01, "{before} {after}");
}
