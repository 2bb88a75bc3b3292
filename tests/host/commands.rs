//! The commands as a user meets them: JSON, model files, files that cannot be written, interrupts.

use std::path::PathBuf;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

use crate::bad_input::refused;
use crate::program::greyrig;

fn json(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout.clone()).expect("UTF-8");
    assert!(["NaN", ":inf", ":-inf"].iter().all(|no_number| !text.contains(no_number)), "{text}");
    assert_eq!(text.trim_end().lines().count(), 1, "one object on one line");
    serde_json::from_str(&text).expect("JSON")
}

/// A folder with a short recording and a model of it.
fn prepared() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let make = |arguments: &[&str]| {
        let output = greyrig(folder.path(), arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    make(&["simulate", "--profile", "staircase", "--seconds", "4", "--seed", "1", "--out", "run.csv"]);
    make(&["identify", "run.csv", "--out", "model.toml"]);
    folder
}

#[test]
fn json_follows_the_interface() {
    let folder = prepared();
    let identified = json(&greyrig(folder.path(), &["identify", "run.csv", "--json"]));
    assert_eq!((&identified["schema"], &identified["command"]), (&1.into(), &"identify".into()));
    assert_eq!(identified["recordings"][0], "run.csv");
    let names: Vec<&str> =
        identified["parameters"].as_array().unwrap().iter().map(|p| p["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["R", "L", "K", "J", "mu0", "mu1", "mu2"]);
    for parameter in identified["parameters"].as_array().unwrap() {
        assert!(
            parameter["value"].is_number() && parameter["unit"].is_string() && parameter["identifiable"].is_boolean()
        );
        let interval = parameter["ci95"].as_array().unwrap();
        assert!(
            interval[0].as_f64() < parameter["value"].as_f64() && parameter["value"].as_f64() < interval[1].as_f64()
        );
    }
    for key in ["current", "speed"] {
        assert!(identified["esr"][key].is_number() && identified["noise_floor"][key].is_number());
    }
    assert!(identified["noise_floor_source"].is_string());

    greyrig(
        folder.path(),
        &["simulate", "--profile", "ramp", "--seconds", "6", "--effect", "saturation=0.4", "--out", "s.csv"],
    );
    let compared = json(&greyrig(folder.path(), &["compare", "s.csv", "--model", "model.toml", "--json"]));
    let regions = compared["where"].as_array().expect("a list");
    assert!(!regions.is_empty());
    for region in regions {
        for key in ["from", "to", "error_rms", "times_average"] {
            assert!(region[key].is_number(), "{key}");
        }
        assert!(region["axis"].is_string() && region["quantity"].is_string() && region["text"].is_string());
    }
    assert!(compared["per_recording"][0]["esr"]["current"].is_number());

    let added =
        json(&greyrig(folder.path(), &["add", "torque_offset", "--model", "model.toml", "run.csv", "s.csv", "--json"]));
    assert_eq!(added["accepted"], false, "a constant torque is not what saturation lacks");
    for key in ["esr_before", "esr_after", "held_out_before", "held_out_after"] {
        assert!(added[key]["current"].is_number(), "{key}");
    }
}

#[test]
fn adding_takes_the_member_of_the_class_that_has_the_right_sign() {
    let folder = tempfile::tempdir().unwrap();
    for (file, profile, seed) in [("run.csv", "staircase", "1"), ("ramp.csv", "ramp", "2")] {
        let seconds = ["--seconds", "12", "--seed", seed, "--effect", "skin_effect=0.25", "--out", file];
        greyrig(folder.path(), &[&["simulate", "--profile", profile], &seconds[..]].concat());
    }
    greyrig(folder.path(), &["identify", "run.csv", "--out", "model.toml"]);
    let ask = ["add", "commutation_demagnetisation", "--model", "model.toml", "run.csv", "ramp.csv", "--json"];
    let added = json(&greyrig(folder.path(), &ask));
    // Late commutation lowers the resistance that seems to be there, skin effect raises it.
    assert_eq!(added["effects"], serde_json::json!(["skin_effect"]));
    assert_eq!(added["accepted"], true);
    assert!(added["notes"].as_array().unwrap().iter().any(|n| n.as_str().unwrap().contains("instead")), "{added}");
    let [before, after] = ["held_out_before", "held_out_after"].map(|key| added[key]["current"].as_f64().unwrap());
    assert!(after < 0.5 * before, "{after} after {before}");
}

#[test]
fn adding_holds_what_a_part_of_a_recording_does_not_tell() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| greyrig(folder.path(), arguments);
    // Two thirds of a slow ramp hold one acceleration, which is no other torque than a constant one: the inertia stays
    // as the model has it.
    let magnets = ["--kind", "pm-dc"];
    let made = ["simulate", "--profile", "dc-ramp", "--seed", "1", "--effect", "current_offset", "--out", "ramp.csv"];
    run(&[&made[..], &magnets].concat());
    run(&[&["identify", "ramp.csv", "--out", "model.toml"][..], &magnets].concat());
    let added = json(&run(&["add", "current_offset", "--model", "model.toml", "ramp.csv", "--json"]));
    assert_eq!(added["accepted"], true, "{added}");
    // A motor that coasts has no current on which a brush drop could be judged.
    run(&["simulate", "--profile", "coast-down", "--seconds", "8", "--effect", "brush_drop", "--out", "coast.csv"]);
    run(&["identify", "coast.csv", "--out", "coast.toml"]);
    let said = run(&["add", "brush_drop", "--model", "coast.toml", "coast.csv"]);
    let said = String::from_utf8_lossy(&said.stdout).into_owned();
    assert!(said.contains("shows nothing of what was added") && said.contains("cannot judge"), "{said}");
}

#[test]
fn friction_is_judged_on_the_end_of_a_coast_down() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| greyrig(folder.path(), arguments);
    let coast_down = ["simulate", "--profile", "coast-down", "--seconds", "10", "--effect", "stribeck", "--seed", "1"];
    run(&[&coast_down[..], &["--out", "coast.csv"]].concat());
    run(&["identify", "coast.csv", "--out", "coast.toml"]);
    let added = |effect: &str| json(&run(&["add", effect, "--model", "coast.toml", "coast.csv", "--json"]));
    let right = added("stribeck");
    assert_eq!(right["accepted"], true, "{right}");
    // With the supply open there is no current, so no error of it either; the speed alone judges.
    assert!(right["held_out_before"]["current"].is_null(), "{right}");
    let speed = |key: &str| right[key]["speed"].as_f64().unwrap();
    assert!(speed("held_out_after") < 0.5 * speed("held_out_before"), "{right}");
    // Warming bearings change the coast-down, too, but are not what is missing here.
    let wrong = added("bearing_warmup");
    assert_eq!(wrong["accepted"], false, "{wrong}");
}

#[test]
fn a_model_file_is_read_with_care() {
    let folder = prepared();
    let model = std::fs::read_to_string(folder.path().join("model.toml")).unwrap();
    let with = |from: &str, to: &str, words: &[&str]| {
        assert!(model.contains(from), "{from} is not in the model file:\n{model}");
        std::fs::write(folder.path().join("bad.toml"), model.replacen(from, to, 1)).unwrap();
        refused(&greyrig(folder.path(), &["compare", "run.csv", "--model", "bad.toml"]), words);
    };
    with("[parameters.R]", "[parameters.R]\nbogus = 1", &["bad.toml:", "bogus"]);
    with("unit = \"ohm\"", "unit = \"mohm\"", &["bad.toml:", "R is in \"mohm\"", "ohm"]);
    with("schema = 1", "schema = 99", &["bad.toml:1:", "layout 99"]);
    with("kind = \"universal\"", "kind = \"turbine\"", &["bad.toml:", "turbine"]);
    with("kind = \"universal\"", "kind = \"pm-dc\"", &["bad.toml:", "K is in"]);
    with("schema = 1", "schema = = 1", &["bad.toml:1:"]);
    with("[parameters.J]", "[parameters.Q]", &["bad.toml:", "no parameter Q"]);
    with("motor = \"universal\"", "motor = \"another\"", &["run.csv", "motor type", "another"]);
    let broken = |line: &str| line.starts_with("value = ");
    let zeroed: String =
        model.lines().map(|l| if broken(l) { "value = -1.0\n".into() } else { format!("{l}\n") }).collect();
    std::fs::write(folder.path().join("bad.toml"), zeroed).unwrap();
    refused(
        &greyrig(folder.path(), &["compare", "run.csv", "--model", "bad.toml"]),
        &["bad.toml:", "must lie between"],
    );
    refused(
        &greyrig(folder.path(), &["compare", "run.csv", "--model", "none.toml"]),
        &["none.toml", "check the spelling"],
    );
}

#[test]
fn nothing_is_overwritten_or_half_written() {
    let folder = prepared();
    let path = folder.path().join("model.toml");
    let before = std::fs::read(&path).unwrap();
    refused(&greyrig(folder.path(), &["identify", "run.csv", "--out", "model.toml"]), &["exists already", "--force"]);
    assert_eq!(std::fs::read(&path).unwrap(), before);
    refused(&greyrig(folder.path(), &["identify", "run.csv", "--out", "/dev/full"]), &["/dev/full", "free some space"]);
    refused(&greyrig(folder.path(), &["identify", "run.csv", "--out", "no/such/model.toml"]), &["no/such/model.toml"]);
    refused(&greyrig(folder.path(), &["identify", "run.csv", "--fix", "Q=1"]), &["no parameter 'Q'", "mu2"]);
    refused(&greyrig(folder.path(), &["identify", "run.csv", "--fix", "J"]), &["NAME=VALUE"]);
    refused(
        &greyrig(folder.path(), &["identify", "run.csv", "--effect", "magic"]),
        &["no effect 'magic'", "saturation"],
    );
    refused(&greyrig(folder.path(), &["identify"]), &["RUN"]);
}

/// A file may not grow beyond a kilobyte, as on a full disk: nothing of it is left, and what was there still is.
#[test]
#[cfg(unix)]
fn a_full_disk_leaves_what_was_there() {
    let folder = prepared();
    let count = || std::fs::read_dir(folder.path()).unwrap().count();
    let (before, files) = (std::fs::read(folder.path().join("run.csv")).unwrap(), count());
    for out in ["new.csv", "run.csv --force"] {
        let program = env!("CARGO_BIN_EXE_greyrig");
        let limited = format!("trap '' XFSZ; ulimit -f 2; exec '{program}' convert run.csv --out {out}");
        let output = Command::new("sh").current_dir(folder.path()).args(["-c", &limited]).output().unwrap();
        refused(&output, &[out.split(' ').next().unwrap(), "arge"]);
        assert_eq!((std::fs::read(folder.path().join("run.csv")).unwrap() == before, count()), (true, files), "{out}");
    }
}

#[test]
#[cfg(unix)]
fn an_interrupt_leaves_nothing_behind() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out: PathBuf = folder.path().join("long.csv");
    let mut child = Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .env("COLUMNS", crate::program::WIDE)
        .args(["simulate", "--profile", "staircase", "--seconds", "3000", "--out"])
        .arg(&out)
        .spawn()
        .expect("greyrig runs");
    std::thread::sleep(Duration::from_millis(400));
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    let start = Instant::now();
    let status = loop {
        match child.try_wait().expect("the child is there") {
            Some(status) => break status,
            None if start.elapsed() > Duration::from_secs(20) => {
                child.kill().ok();
                panic!("greyrig goes on after an interrupt");
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    assert_eq!(status.code(), Some(130));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "no file, not even a temporary one");
}
