//! `greyrig predict`, and the series of `greyrig compare`: sample by sample what the model makes of a voltage.

use std::path::Path;

use greyrig::butterworth::Cascade;
use greyrig::motor::{Constraints, State, Stepper};
use greyrig_host::compare::compare;
use greyrig_host::context::Context;
use greyrig_host::forecast::{self, Prediction, Settings, Source, Supply, predict};
use greyrig_host::hybrid;
use greyrig_host::identify::{self, identify};
use greyrig_host::model::{Kind, Model};
use greyrig_host::recording::{Channel, Mapping, Recording, load, write};
use greyrig_host::rig::Setup;

use crate::bad_input::refused;
use crate::program::{greyrig, json};

fn recorded(kind: Kind, profile: &str, seconds: f64, seed: u64) -> Recording {
    Setup::new(kind).profile(profile).unwrap().seconds(seconds).seed(seed).run().unwrap().recording
}

fn fitted(recordings: &[Recording], kind: Kind) -> Model {
    identify(recordings, &identify::Settings::new(kind), &Context::quiet()).unwrap().model
}

fn made(model: &Model, recording: &Recording, settings: Settings) -> Prediction {
    predict(model, recording, &settings, &Context::quiet()).unwrap()
}

fn voltage_alone(recording: &Recording) -> Recording {
    let mut alone = recording.clone();
    [Channel::Current, Channel::Speed].iter().for_each(|channel| alone.remove_channel(*channel));
    alone
}

/// A model file for a motor of 2 Ω, 10 mH and 0.05 V s, as written by hand: it remembers no fit.
const BY_HAND: &str = r#"schema = 1
kind = "pm-dc"
base = "viscous"
parameters.R = { value = 2.0, unit = "ohm" }
parameters.L = { value = 0.01, unit = "H" }
parameters.K = { value = 0.05, unit = "V s/rad" }
parameters.J = { value = 2e-5, unit = "kg m2" }
parameters.mu1 = { value = 1e-5, unit = "N m s/rad" }
"#;

fn by_hand(folder: &Path) -> Model {
    let path = folder.join("by_hand.toml");
    std::fs::write(&path, BY_HAND).unwrap();
    Model::load(&path).unwrap()
}

/// Through the filter of the comparison the prediction has the bits of the comparison's model, with a learned
/// correction as without.
#[test]
fn a_prediction_is_the_free_run_of_compare() {
    let recording = recorded(Kind::Universal, "staircase", 4.0, 1);
    let model = fitted(std::slice::from_ref(&recording), Kind::Universal);
    let settings = hybrid::settings(greyrig_host::anfis::Method::Hybrid, 2);
    let (corrected, _) =
        hybrid::train(&model, std::slice::from_ref(&recording), 1.0, &settings, &Context::quiet()).unwrap();
    let other = recorded(Kind::Universal, "ramp", 4.0, 2);
    let mut runs = Vec::new();
    for model in [&model, &corrected] {
        let compared = compare(model, std::slice::from_ref(&other), &Context::quiet()).unwrap();
        let traces = &compared.per_recording[0].traces;
        let run = made(model, &other, Settings::default());
        let coefficients = model.filter.at(other.sample_time_s()).build::<f32>().unwrap();
        for (predicted, modelled) in [(&run.current, &traces.modelled_current), (&run.speed, &traces.modelled_speed)] {
            let mut filter = Cascade::<f32>::default();
            filter.reset_to(predicted[0] as f32);
            let filtered: Vec<f64> =
                predicted.iter().map(|x| f64::from(filter.process(&coefficients, *x as f32))).collect();
            assert_eq!(&filtered, modelled);
        }
        runs.push(run.current);
    }
    assert_ne!(runs[0], runs[1], "the correction does something");
    let [before, after] = [&model, &corrected].map(|model| model.fitted.clone().unwrap());
    assert_eq!(before.uncertainty, after.uncertainty);
    assert_ne!(before.current, after.current, "what is left with the correction is another rest");
}

/// The core's stepper by itself, along a straight line from sample to sample.
#[test]
fn a_prediction_is_what_the_core_steps() {
    let folder = tempfile::tempdir().unwrap();
    let model = by_hand(folder.path());
    let voltage: Vec<f64> = (0..3000).map(|n| 12.0 * (f64::from(n) * 0.01).sin()).collect();
    let input = Recording::builder(1e-4).channel(Channel::Voltage, voltage.clone()).build().unwrap();
    let settings = Settings { input: Supply::Linear, current: Some(0.5), speed: Some(30.0), ..Settings::default() };
    let run = made(&model, &input, settings);
    let mut stepper = Stepper::<f32>::build(model.motor().unwrap(), 1e-4).unwrap();
    stepper.go_on_in(State { current: 0.5, speed: 30.0 }, 0.0);
    for n in 0..voltage.len() {
        if n > 0 {
            let free = Constraints { current: None, speed: None };
            stepper.step(voltage[n - 1] as f32, voltage[n] as f32, free);
        }
        let State { current, speed } = stepper.reading();
        assert_eq!((run.current[n], run.speed[n]), (f64::from(current), f64::from(speed)), "sample {n}");
    }
    assert_eq!((run.begin.i_a_from, run.begin.omega_rad_s_from), (Source::Given, Source::Given));
    assert!(run.band.is_none() && run.extrapolation.is_none());
}

/// A held rotor is a coil: i = U/R (1 − e^(−R t/L)) after a step; along a line over the first interval h it is later by
/// the mean of that over the interval. The stepper is off by less than a thousandth (its own tests).
#[test]
fn the_voltage_between_its_samples_is_as_asked() {
    let folder = tempfile::tempdir().unwrap();
    let model = by_hand(folder.path());
    // As long as L/R: what the voltage does in between is most of the current.
    let h = 5e-3;
    let voltage = vec![0.0, 12.0, 12.0, 12.0, 12.0];
    let build = |voltage: Vec<f64>| Recording::builder(h).channel(Channel::Voltage, voltage);
    let input = build(voltage).rotor_locked(vec![true; 5]).build().unwrap();
    let settled = |t: f64| 6.0 * (1.0 - (-t / 5e-3).exp());
    let held = made(&model, &input, Settings { input: Supply::Held, ..Settings::default() });
    let linear = made(&model, &input, Settings { input: Supply::Linear, ..Settings::default() });
    for n in 1..5 {
        let since = f64::from(n as u32 - 1) * h;
        assert!((held.current[n] - settled(since)).abs() < 6e-3, "held, {n}: {}", held.current[n]);
        // ∫₀ʰ settled(since + s) ds/h
        let mean = 6.0 * (1.0 - (-since / 5e-3).exp() * (1.0 - (-h / 5e-3).exp()) * 5e-3 / h);
        assert!((linear.current[n] - mean).abs() < 6e-3, "linear, {n}: {} {mean}", linear.current[n]);
    }
    assert!(held.speed.iter().chain(&linear.speed).all(|w| *w == 0.0));
    // An open supply breaks the current off.
    let open: Vec<bool> = (0..5).map(|n| n >= 3).collect();
    let input = build(vec![12.0; 5]).supply_open(open).build().unwrap();
    let run = made(&model, &input, Settings::default());
    assert!(run.current[2] > 1.0 && run.current[3..] == [0.0, 0.0], "{:?}", run.current);
}

/// Two motors, current and speed, two profiles each: means of 94.6 and 94.2 % with a range from 92.0 to 95.1 % over 4
/// motors and 11 sets of effects (docs/predict.md).
#[test]
fn the_band_holds_its_share_of_runs_that_no_fit_has_seen() {
    let within = |measured: &[f64], [low, high]: &[Vec<f64>; 2]| {
        let inside = measured.iter().zip(low.iter().zip(high)).filter(|(x, (low, high))| *low <= *x && *x <= *high);
        inside.count() as f64 / measured.len() as f64
    };
    for (kind, profiles) in [(Kind::Universal, ["staircase", "ramp"]), (Kind::PmDc, ["dc-steps", "dc-ramp"])] {
        let model = fitted(&profiles.map(|profile| recorded(kind, profile, 6.0, 1)), kind);
        for profile in profiles {
            let other = recorded(kind, profile, 6.0, 2);
            let held = |share: f64| {
                let settings = Settings { band: Some(share), ..Settings::default() };
                let band = made(&model, &voltage_alone(&other), settings).band.unwrap();
                [(Channel::Current, band.current), (Channel::Speed, band.speed)]
                    .map(|(channel, band)| within(other.channel(channel).unwrap(), &band.unwrap()))
            };
            for (share, least, most) in [(0.95, 0.91, 0.98), (0.5, 0.43, 0.57)] {
                let held = held(share);
                assert!(held.iter().all(|held| (least..most).contains(held)), "{kind:?} {profile} {share}: {held:?}");
            }
        }
    }
}

#[test]
fn what_lies_beyond_the_fit_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let model = fitted(&[recorded(Kind::PmDc, "dc-steps", 4.0, 1)], Kind::PmDc);
    model.save(&here.join("m.toml"), false).unwrap();
    let range = model.fitted.as_ref().unwrap().range;
    // Half of what was seen, and half a second of twice as much.
    let far = |n: u32| (10_000..15_000).contains(&n);
    let voltage = (0..30_000).map(|n| range.u_v[1] * if far(n) { 2.0 } else { 0.5 }).collect();
    let input = Recording::builder(1e-4).channel(Channel::Voltage, voltage).build().unwrap();
    write(&input, &here.join("u.csv"), false, &Context::quiet()).unwrap();
    let told = json(here, &["predict", "u.csv", "--model", "m.toml", "--out", "s.csv", "--band", "90"]);
    assert_eq!((&told["command"], &told["recordings"][0]), (&"predict".into(), &"u.csv".into()));
    assert_eq!((&told["samples"], &told["band"], &told["out"]), (&30_000.into(), &0.9.into(), &"s.csv".into()));
    assert!(told["data_findings"].is_array());
    let stretches = told["extrapolated"].as_array().unwrap();
    let of = |name: &str| stretches.iter().filter(|s| s["quantity"] == name).collect::<Vec<_>>();
    let [voltage] = of("u_v")[..] else { panic!("{stretches:?}") };
    let number = |key: &str| voltage[key].as_f64().unwrap();
    assert!((number("from_s") - 1.0).abs() < 1e-9 && (number("to_s") - 1.4999).abs() < 1e-9, "{voltage}");
    assert!((number("beyond") - range.u_v[1]).abs() < 1e-9, "{voltage}");
    let speed = of("omega_rad_s");
    assert!(speed[0]["from_s"].as_f64().unwrap() > 1.0, "it takes a while to get there: {speed:?}");
    // The file says the same, and more.
    let series = load(&here.join("s.csv"), &Mapping::default(), &Context::quiet()).unwrap();
    let column = |name: &str| &series.extras().iter().find(|extra| extra.name == name).unwrap().values;
    let flags = column("extrapolated");
    assert!(flags[9_999] == 0.0 && flags[10_000..15_000].iter().all(|flag| *flag == 1.0));
    let current = series.channel(Channel::Current).unwrap();
    let last = told["final"]["i_a"]["value"].as_f64().unwrap();
    assert_eq!(current.last(), Some(&last));
    let [low, high] = ["i_a_lo", "i_a_hi"].map(column);
    assert!((0..current.len()).all(|n| low[n] < current[n] && current[n] < high[n]));
    // Where the motor is driven harder than ever, the band is wider.
    let width = |n: usize| high[n] - low[n];
    assert!(width(10_050) > width(9_000), "{} {}", width(10_050), width(9_000));
    let said = greyrig(here, &["predict", "u.csv", "--model", "m.toml", "--out", "t.csv"]);
    let said = String::from_utf8(said.stdout).unwrap();
    assert!(said.contains("extrapolated: u_v from 1.0000 s to 1.4999 s"), "{said}");
}

#[test]
fn what_was_measured_is_carried_along_in_either_format() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let mut recording = recorded(Kind::PmDc, "dc-steps", 2.0, 1);
    let warm: Vec<f64> = (0..recording.len()).map(|n| 20.0 + n as f64 * 1e-3).collect();
    recording.add_extra("temp_c", warm.clone()).unwrap();
    write(&recording, &here.join("run.csv"), false, &Context::quiet()).unwrap();
    fitted(&[recording.clone()], Kind::PmDc).save(&here.join("m.toml"), false).unwrap();
    for out in ["s.csv", "s.parquet"] {
        let output = greyrig(here, &["predict", "run.csv", "--model", "m.toml", "--out", out]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let series = load(&here.join(out), &Mapping::default(), &Context::quiet()).unwrap();
        assert_eq!(series.channel(Channel::Voltage), recording.channel(Channel::Voltage));
        assert_ne!(series.channel(Channel::Current), recording.channel(Channel::Current));
        let column = |name: &str| series.extras().iter().find(|extra| extra.name == name).map(|e| e.values.as_slice());
        for (name, channel) in [("measured_i_a", Channel::Current), ("measured_omega_rad_s", Channel::Speed)] {
            assert_eq!(column(name), recording.channel(channel), "{name} in {out}");
        }
        assert_eq!(column("temp_c"), Some(warm.as_slice()));
    }
    let [csv, parquet] =
        ["s.csv", "s.parquet"].map(|out| load(&here.join(out), &Mapping::default(), &Context::quiet()));
    assert_eq!(csv.unwrap().channels(), parquet.unwrap().channels());
}

#[test]
fn what_cannot_be_predicted_is_one_clear_line() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    by_hand(here);
    let rows = |missing: std::ops::Range<u32>| -> String {
        let row = |n: u32| format!("{},{}\n", f64::from(n) * 1e-3, if n < 50 { 0 } else { 12 });
        std::iter::once("t_s,u_v\n".to_owned()).chain((0..400).filter(|n| !missing.contains(n)).map(row)).collect()
    };
    std::fs::write(here.join("u.csv"), rows(0..0)).unwrap();
    std::fs::write(here.join("gap.csv"), rows(100..150)).unwrap();
    std::fs::write(here.join("i.csv"), rows(0..0).replace("u_v", "i_a")).unwrap();
    let ask = |file: &str, more: &[&str]| {
        let asked = ["predict", file, "--model", "by_hand.toml", "--out", "s.csv"];
        greyrig(here, &[&asked[..], more].concat())
    };
    refused(&ask("i.csv", &[]), &["i.csv", "no voltage", "--map u_v=COLUMN"]);
    refused(&ask("gap.csv", &[]), &["gap.csv", "0.1000 s to 0.1500 s", "--initial"]);
    refused(&ask("u.csv", &["--band", "95"]), &["what its fit has left over", "identify it again"]);
    refused(&ask("u.csv", &["--band", "100"]), &["100 %", "--band 95"]);
    refused(&ask("u.csv", &["--initial", "i_a=1,theta=3"]), &["theta", "omega_rad_s"]);
    refused(&ask("u.csv", &["--initial", "i_a=1,i_a=3"]), &["i_a twice"]);
    refused(&ask("u.csv", &["--initial", "omega_rad_s=1e30"]), &["diverges", "unit"]);
    assert!(!here.join("s.csv").exists(), "nothing half written");
    let asked = ["predict", "u.csv", "--model", "by_hand.toml", "--out", "s.xyz"];
    refused(&greyrig(here, &asked), &["s.xyz", ".parquet"]);
    let told = ask("u.csv", &["--initial", "omega_rad_s=100"]);
    assert_eq!(told.status.code(), Some(0), "{}", String::from_utf8_lossy(&told.stderr));
    let told = String::from_utf8(told.stdout).unwrap();
    assert!(told.contains("100 rad/s, as given") && told.contains("extrapolated: not known"), "{told}");
    refused(&ask("u.csv", &[]), &["s.csv exists already", "--force"]);
    // A model file whose memory has been spoilt.
    let model = fitted(&[recorded(Kind::PmDc, "dc-steps", 2.0, 1)], Kind::PmDc);
    let text = model.text().unwrap();
    assert_eq!(toml::from_str::<Model>(&text).unwrap(), model);
    for (from, to, words) in [
        ("    \"R\",", "    \"Rx\",", ["no parameter Rx", "[fitted]"]),
        ("floor = ", "floor = -", ["[fitted]", "not negative"]),
        ("freedom = ", "freedom = 0.0 #", ["[fitted]", "each name"]),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(here.join("by_hand.toml"), text.replacen(from, to, 1)).unwrap();
        refused(&ask("u.csv", &["--force"]), &words);
    }
}

#[test]
fn behind_a_gap_the_run_begins_anew_from_what_was_measured() {
    let recording = recorded(Kind::PmDc, "dc-steps", 4.0, 3);
    let model = fitted(std::slice::from_ref(&recording), Kind::PmDc);
    let channel = |channel: Channel| recording.channel(channel).unwrap().to_vec();
    let parted = Recording::builder(recording.sample_time_s())
        .channel(Channel::Voltage, channel(Channel::Voltage))
        .channel(Channel::Current, channel(Channel::Current))
        .channel(Channel::Speed, channel(Channel::Speed))
        .gaps(std::iter::once(15_000..18_000).collect())
        .build()
        .unwrap();
    let run = made(&model, &parted, Settings { band: Some(0.95), ..Settings::default() });
    let whole = made(&model, &recording, Settings::default());
    assert_eq!(run.current[..15_000], whole.current[..15_000]);
    assert!(run.current[15_000..18_000].iter().all(|i| i.is_nan()));
    let compared = compare(&model, std::slice::from_ref(&parted), &Context::quiet()).unwrap();
    assert_eq!(compared.per_recording.len(), 2);
    let speed = &channel(Channel::Speed);
    assert!((run.speed[18_000] - speed[18_000]).abs() < 0.05 * speed[18_000].abs().max(10.0));
    assert_eq!(run.recorded(), 37_000);
    assert_eq!(run.series(&model, &parted).rows(), 37_000, "rows of a gap are not there");
    assert_eq!(run.last(), Some(39_999));
    assert!(forecast::MEASURED.starts_with("measured"));
}

/// The figures of a comparison, made anew from its series.
#[test]
fn the_series_of_a_comparison_are_what_its_figures_are_made_of() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let simulate = |name: &str, more: &[&str]| {
        let output = greyrig(here, &[&["simulate", "--seconds", "5", "--out", name], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    };
    simulate("run.csv", &["--profile", "staircase", "--seed", "1"]);
    simulate("other.csv", &["--profile", "ramp", "--seed", "2", "--effect", "saturation=0.4"]);
    json(here, &["identify", "run.csv", "--out", "m.toml"]);
    let ask = ["compare", "other.csv", "run.csv", "--model", "m.toml"];
    let told = json(here, &[&ask[..], &["--out", "c.csv"]].concat());
    assert_eq!(told["out"], "c.csv");
    let text = std::fs::read_to_string(here.join("c.csv")).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 100_000);
    let place = |name: &str| header.iter().position(|h| *h == name).unwrap_or_else(|| panic!("{name} in {header:?}"));
    let number = |row: &[&str], name: &str| -> f64 { row[place(name)].parse().unwrap() };
    for (k, recording) in ["other.csv", "run.csv"].into_iter().enumerate() {
        let counted: Vec<&Vec<&str>> =
            rows.iter().filter(|row| row[place("recording")] == recording && row[place("counted")] == "1").collect();
        for (signal, column) in [("current", "i_a"), ("speed", "omega_rad_s")] {
            let [residual, measured, modelled] = ["residual_", "measured_", "modelled_"]
                .map(|side| counted.iter().map(|row| number(row, &format!("{side}{column}"))).collect::<Vec<f64>>());
            assert!((0..residual.len()).all(|n| residual[n] == modelled[n] - measured[n]));
            let squares = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>();
            let esr = (squares(&residual) / squares(&measured)).sqrt();
            let expected = told["per_recording"][k]["esr"][signal].as_f64().unwrap();
            // Sums of 50,000 values in another order.
            assert!((esr / expected - 1.0).abs() < 1e-9, "{recording} {signal}: {esr} {expected}");
        }
    }
    let regions = told["where"].as_array().unwrap();
    assert!(!regions.is_empty());
    for (k, region) in regions.iter().enumerate() {
        let residual = if region["quantity"] == "current" { "residual_i_a" } else { "residual_omega_rad_s" };
        let squares = |inside: bool| -> f64 {
            let rows = rows.iter().filter(|row| row[place("counted")] == "1");
            let rows = rows.filter(|row| !inside || row[place(&format!("where_{}", k + 1))] == "1");
            rows.map(|row| number(row, residual).powi(2)).sum()
        };
        let share = region["share"].as_f64().unwrap();
        assert!((squares(true) / squares(false) - share).abs() < 1e-9, "{region}");
        assert!(text.contains(&format!("# where_{}: {}\n", k + 1, region["text"].as_str().unwrap())));
    }
    refused(&greyrig(here, &[&ask[..], &["--out", "c.csv"]].concat()), &["c.csv exists already"]);
    refused(&greyrig(here, &[&ask[..], &["--out", "c.txt"]].concat()), &["c.txt", ".parquet"]);
    json(here, &[&ask[..], &["--out", "c.parquet"]].concat());
    let columns = load(&here.join("c.parquet"), &Mapping::default(), &Context::quiet());
    assert!(columns.is_err(), "two recordings one below the other are none");
    let one = json(here, &["compare", "run.csv", "--model", "m.toml", "--out", "one.parquet"]);
    assert_eq!(one["out"], "one.parquet");
    let series = load(&here.join("one.parquet"), &Mapping::default(), &Context::quiet()).unwrap();
    assert!(series.extras().iter().all(|extra| extra.name != "recording"));
}
