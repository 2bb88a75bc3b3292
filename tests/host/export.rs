//! Units for other simulators: what is in them, and that they do what the model does.

use std::collections::BTreeMap;
use std::io::{Cursor, Read};
use std::path::{Path, PathBuf};

use greyrig::exchange::Variable;
use greyrig::motor::BaseParameter;
use greyrig::parameters::FINGERPRINT;
use greyrig_fmi::instance::Instance;
use greyrig_fmi::resources;
use greyrig_host::between::Between;
use greyrig_host::experiment::{Experiment, Imposed};
use greyrig_host::export::library::Library;
use greyrig_host::export::{Version, unit};
use greyrig_host::model::Model;
use greyrig_host::recording::{Channel, Recording};
use quick_xml::Reader;
use quick_xml::events::Event;
use tempfile::TempDir;
use zip::ZipArchive;

use crate::bad_input;
use crate::firmware::folder;
use crate::program::{greyrig, json};

/// What the exporter knows a library by, in the head of a library: it loads none.
fn library(folder: &Path) -> PathBuf {
    let mut bytes = vec![0; 64];
    bytes[..4].copy_from_slice(b"\x7fELF");
    bytes[18] = 62;
    bytes.extend(format!("greyrig-fmi {};", env!("CARGO_PKG_VERSION")).bytes());
    bytes.extend(FINGERPRINT.to_le_bytes());
    bytes.extend(b"p rest");
    let path = folder.join("library.so");
    std::fs::write(&path, bytes).expect("it is written");
    path
}

fn model(folder: &TempDir) -> Model {
    Model::load(&folder.path().join("model.toml")).expect("a model")
}

fn made(model: &Model, folder: &TempDir, version: Version, interval_s: f64) -> Vec<u8> {
    let library = Library::read(&library(folder.path())).expect("a library");
    unit(model, Path::new("model.toml"), version, interval_s, &[library]).expect("a unit").bytes
}

fn files(unit: Vec<u8>) -> BTreeMap<String, Vec<u8>> {
    let mut zip = ZipArchive::new(Cursor::new(unit)).expect("a zip file");
    (0..zip.len())
        .map(|n| {
            let mut file = zip.by_index(n).expect("a file");
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes).expect("its bytes");
            (file.name().expect("UTF-8").into_owned(), bytes)
        })
        .collect()
}

/// The elements of a description in their order, each with its attributes.
fn elements(xml: &[u8]) -> Vec<(String, BTreeMap<String, String>)> {
    let mut reader = Reader::from_reader(xml);
    let mut all = Vec::new();
    loop {
        match reader.read_event().expect("XML") {
            Event::Start(e) | Event::Empty(e) => {
                let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("UTF-8");
                let attributes = e.attributes().map(|a| {
                    let a = a.expect("an attribute");
                    (text(a.key.as_ref()), a.unescape_value().expect("a value").into_owned())
                });
                all.push((text(e.name().as_ref()), attributes.collect()));
            }
            Event::Eof => return all,
            _ => {}
        }
    }
}

/// The resources of a unit in a folder, as a simulator unpacks them, and an instance by them.
fn instance(files: &BTreeMap<String, Vec<u8>>, token: &str) -> Instance {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, bytes) in files {
        if let Some(name) = name.strip_prefix("resources/") {
            std::fs::write(folder.path().join(name), bytes).expect("it is written");
        }
    }
    Instance::new(resources::read(folder.path(), token).expect("a unit's resources"))
}

/// A voltage that jumps, rises and turns its sign.
fn voltage(count: usize) -> Vec<f64> {
    (0..count).map(|n| 150.0 * (0.03 * n as f64).sin() + if n % 700 > 350 { 60.0 } else { 0.0 }).collect()
}

/// From the model file to the numbers that a simulator reads: those of the library's free run along a held voltage, bit
/// by bit.
#[test]
fn a_unit_runs_as_the_model_does_along_a_held_voltage() {
    for interval_s in [1e-4, 2e-4, 5e-5] {
        let folder = folder(2.2);
        let model = model(&folder);
        let files = files(made(&model, &folder, Version::Three, interval_s));
        let token = String::from_utf8(files["resources/token.txt"].clone()).expect("UTF-8");
        let mut instance = instance(&files, &token);
        instance.enter_initialization(0.0).unwrap();
        instance.exit_initialization().unwrap();

        let input = voltage(4_000);
        let recording = Recording::builder(interval_s)
            .channel(Channel::Voltage, input.clone())
            .channel(Channel::Current, vec![0.0; input.len()])
            .channel(Channel::Speed, vec![0.0; input.len()])
            .build()
            .expect("a recording");
        let precise = model.motor::<f64>().unwrap();
        let e = Experiment::new(&recording, &model.filter).unwrap().with_course(Between::Switched(0.0), &precise);
        let motor = model.motor::<f32>().unwrap();
        let mut largest = 0.0f64;
        e.run(&motor, e.substeps(&motor).unwrap(), Imposed::Nothing, |n, state| {
            if n > 0 {
                instance.set(Variable::Voltage.number(), input[n - 1]).unwrap();
                instance.step((n - 1) as f64 * interval_s, interval_s).unwrap();
            }
            let shown = [Variable::Current, Variable::Speed].map(|v| instance.get(v.number()).unwrap());
            assert_eq!(shown, [state.current, state.speed].map(f64::from), "sample {n} at {interval_s} s");
            largest = largest.max(shown[1]);
        })
        .unwrap();
        assert!(largest > 10.0, "the motor turns: {largest} rad/s");
    }
}

#[test]
fn a_description_and_the_library_speak_of_the_same_variables() {
    let folder = folder(2.2);
    let model = model(&folder);
    for (version, element, token_key) in
        [(Version::Three, "Float64", "instantiationToken"), (Version::Two, "ScalarVariable", "guid")]
    {
        let files = files(made(&model, &folder, version, 1e-4));
        let all = elements(&files["modelDescription.xml"]);
        let (root, head) = &all[0];
        assert_eq!((root.as_str(), head["fmiVersion"].as_str()), ("fmiModelDescription", version.name()));
        assert_eq!(head["modelName"], "VC-1400");
        let mut instance = instance(&files, &head[token_key]);
        let mut names = Vec::new();
        for (n, (name, attributes)) in all.iter().enumerate().filter(|(_, (name, _))| name == element) {
            let number: u32 = attributes["valueReference"].parse().unwrap();
            // In the older version start value and unit stand in the element within.
            let real = if version == Version::Two { &all[n + 1].1 } else { attributes };
            let value = instance.get(number).unwrap_or_else(|e| panic!("{name} {number}: {e}"));
            if let Some(start) = real.get("start") {
                assert_eq!(value, start.parse::<f64>().unwrap(), "{attributes:?}");
                instance.set(number, value).unwrap();
            }
            assert_eq!(attributes["causality"] == "parameter", attributes["variability"] == "fixed");
            assert!(real.contains_key("unit"), "{attributes:?}");
            names.push(attributes["name"].clone());
        }
        for name in ["u_v", "load_n_m", "i_a", "omega_rad_s", "R", "mu2", "brush_drop.brush_transition"] {
            assert!(names.iter().any(|known| known == name), "{name}");
        }
        let value = |name: &str| {
            let (_, attributes) = all.iter().find(|(_, a)| a.get("name").is_some_and(|n| n == name)).unwrap();
            instance.get(attributes["valueReference"].parse().unwrap()).unwrap()
        };
        assert_eq!([value("R"), value("J"), value("brush_drop.brush_drop")], [2.2, 1.8e-4, 2.5]);
        let units = all.iter().filter(|(name, _)| name == "Unit").count();
        assert_eq!(units, all.iter().filter(|(name, _)| name == "BaseUnit").count());
    }
}

#[test]
fn the_same_model_makes_the_same_unit_and_another_one_another_token() {
    let (one, other) = (folder(2.2), folder(2.3));
    let token = |unit: &[u8]| files(unit.to_vec())["resources/token.txt"].clone();
    let [first, again] = [(); 2].map(|()| made(&model(&one), &one, Version::Three, 1e-4));
    assert_eq!(first, again);
    for unit in [
        made(&model(&other), &other, Version::Three, 1e-4),
        made(&model(&one), &one, Version::Three, 5e-5),
        made(&model(&one), &one, Version::Two, 1e-4),
    ] {
        assert_ne!(token(&first), token(&unit));
    }
}

/// Names that XML and a zip file have to stand.
#[test]
fn a_motor_may_be_called_anything() {
    let folder = folder(2.2);
    let name = "<\"Größe\" & 'Co', a name of more than thirty-two bytes>";
    let model = Model { motor: Some(name.to_owned()), ..model(&folder) };
    let files = files(made(&model, &folder, Version::Three, 1e-4));
    assert_eq!(elements(&files["modelDescription.xml"])[0].1["modelName"], name);
}

#[test]
fn a_linear_drive_has_its_units() {
    let folder = folder(2.2);
    let path = folder.path().join("model.toml");
    let mut text = std::fs::read_to_string(&path).unwrap();
    for (rotary, linear) in [
        ("N m s2/rad2", "N s2/m2"),
        ("N m s/rad", "N s/m"),
        ("\"N m\"", "\"N\""),
        ("kg m2", "kg"),
        ("V s/(rad A)", "V s/(m A)"),
        ("kind =", "motion = \"linear\"\nkind ="),
    ] {
        text = text.replace(rotary, linear);
    }
    std::fs::write(&path, text).unwrap();
    let files = files(made(&model(&folder), &folder, Version::Three, 1e-4));
    let all = elements(&files["modelDescription.xml"]);
    let unit = |name: &str| {
        let (_, attributes) = all.iter().find(|(_, a)| a.get("name").is_some_and(|n| n == name)).unwrap();
        attributes["unit"].clone()
    };
    assert_eq!(["omega_rad_s", "load_n_m", "J"].map(unit), ["m/s", "N", "kg"]);
}

#[test]
fn the_command_writes_a_unit() {
    let folder = folder(2.2);
    let here = folder.path();
    let library = library(here);
    let library = library.to_str().unwrap();
    let told = json(here, &["export", "--model", "model.toml", "--fmu", "motor.fmu", "--library", library]);
    assert_eq!((&told["fmi"], &told["platforms"][0]), (&"3.0".into(), &"x86_64-linux".into()));
    assert_eq!((&told["interval_s"], &told["portable"]), (&1e-4.into(), &true.into()));
    let three = files(std::fs::read(here.join("motor.fmu")).unwrap());
    assert_eq!(three["binaries/x86_64-linux/greyrig_fmi.so"], std::fs::read(library).unwrap());
    assert!(Model::load(&here.join("model.toml")).unwrap().text().unwrap().as_bytes() == three["resources/model.toml"]);

    let again = ["export", "--model", "model.toml", "--fmu", "motor.fmu", "--library", library, "--fmi", "2"];
    bad_input::refused(&greyrig(here, &again), &["motor.fmu exists already", "--force"]);
    let told = json(here, &[&again[..], &["--force"]].concat());
    assert_eq!(told["fmi"], "2.0");
    let two = files(std::fs::read(here.join("motor.fmu")).unwrap());
    assert!(two.contains_key("binaries/linux64/greyrig_fmi.so"));
}

#[test]
fn what_cannot_be_exported_is_told() {
    let folder = folder(2.2);
    let here = folder.path();
    let good = library(here);
    let good = good.to_str().unwrap();
    let refused = |more: &[&str], words: &[&str]| {
        let arguments = [&["export", "--fmu", "motor.fmu"], more].concat();
        bad_input::refused(&greyrig(here, &arguments), words);
        assert!(!here.join("motor.fmu").exists());
    };
    let with_model = ["--model", "model.toml", "--library", good];
    refused(&["--model", "none.toml"], &["none.toml"]);
    refused(
        &["--model", "model.toml", "--library", "model.toml"],
        &["no library", "cargo build --release -p greyrig-fmi"],
    );
    refused(&[&with_model[..], &["--library", good]].concat(), &["second library for x86_64-linux"]);
    refused(&[&with_model[..], &["--interval", "0"]].concat(), &["an interval of 0 s cannot be"]);
    refused(&[&with_model[..], &["--interval", "1e9"]].concat(), &["model.toml"]);

    let bytes = std::fs::read(good).unwrap();
    let at = bytes.windows(4).position(|at| at == FINGERPRINT.to_le_bytes()).unwrap();
    let mut other = bytes.clone();
    other[at] ^= 1;
    std::fs::write(here.join("other.so"), other).unwrap();
    refused(&["--model", "model.toml", "--library", "other.so"], &["lays parameters out differently"]);
    std::fs::write(here.join("other.so"), &bytes[..64]).unwrap();
    refused(&["--model", "model.toml", "--library", "other.so"], &["not the library of greyrig's units"]);

    let text = std::fs::read_to_string(here.join("model.toml")).unwrap();
    std::fs::write(here.join("model.toml"), format!("accepted = false\n{text}")).unwrap();
    refused(&with_model, &["not accepted", "--unaccepted"]);
    let mut lacking = model(&folder);
    lacking.accepted = None;
    lacking.parameters.remove(BaseParameter::L.name());
    lacking.save(&here.join("model.toml"), true).unwrap();
    refused(&with_model, &["the model has no L", "--fix"]);
}

/// All that the equations name is declared, once, and the model's values stand there.
#[test]
fn the_command_writes_equations() {
    let folder = folder(2.2);
    let here = folder.path();
    let told = json(here, &["export", "--model", "model.toml", "--modelica", "motor.mo"]);
    assert_eq!(told["modelica"], "motor.mo");
    let text = std::fs::read_to_string(here.join("motor.mo")).unwrap();
    assert!(text.starts_with("model VC_1400 ") && text.trim_end().ends_with("end VC_1400;"), "{text}");
    for line in ["R(unit = \"Ohm\") = 2.2e0 ", "J(unit = \"kg.m2\") = 1.8e-4 ", "brush_drop(unit = \"V\") = 2.5e0 "] {
        assert!(text.contains(line), "{line} is not in: {text}");
    }
    let (head, body) = text.split_once("equation\n").unwrap();
    let words = |text: &str| -> Vec<String> {
        let word = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
        let words = text.split(|c| !word(c)).filter(|word| word.starts_with(|c: char| c.is_ascii_alphabetic()));
        words.map(str::to_owned).collect()
    };
    let lines = head.lines().filter(|line| !line.trim_start().starts_with("//"));
    let code: String = lines.flat_map(|line| line.split('"').step_by(2).chain(["\n"])).collect();
    let declared = words(&code);
    let language = ["abs", "sign", "exp", "der", "noEvent", "if", "then", "else", "end", "VC_1400"];
    for word in words(body) {
        let times = declared.iter().filter(|name| **name == word).count();
        assert!(times == 1 || language.contains(&word.as_str()), "{word}: declared {times} times in {text}");
    }
}

#[test]
fn what_is_no_equation_is_told() {
    let folder = folder(2.2);
    let here = folder.path();
    let path = here.join("model.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let lag = "[[effects]]\nid = \"speed_lag\"\n[effects.parameters.speed_lag]\nvalue = 0.01\nunit = \"s\"\n";
    std::fs::write(&path, format!("{text}{lag}")).unwrap();
    let export = |more: &[&str]| greyrig(here, &[&["export", "--model", "model.toml"], more].concat());
    bad_input::refused(&export(&["--modelica", "motor.mo"]), &["model.toml", "speed_lag", "--fmu"]);
    assert!(!here.join("motor.mo").exists());
    for nothing in [&[][..], &["--fmu", "a", "--modelica", "b"], &["--modelica", "b", "--fmi", "2"]] {
        assert_eq!(export(nothing).status.code(), Some(2), "{nothing:?}");
    }
}
