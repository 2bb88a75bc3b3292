//! What people see: answers that fit 80 columns, the command that goes on, colour only where it is wanted, names that
//! were meant, a greeting.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

/// Columns of an old terminal, a page and a mail.
const COLUMNS: usize = 80;

fn greyrig_in(folder: &Path, arguments: &[&str], set: &[(&str, &str)]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_greyrig"));
    for name in ["NO_COLOR", "CLICOLOR_FORCE", "CLICOLOR"] {
        command.env_remove(name);
    }
    command.current_dir(folder).args(arguments).env("COLUMNS", COLUMNS.to_string());
    command.envs(set.iter().copied()).output().expect("greyrig runs")
}

fn greyrig(folder: &Path, arguments: &[&str]) -> Output {
    greyrig_in(folder, arguments, &[])
}

fn said(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

/// Lines that are wider than the terminal; a command that is there to be copied stands in one line.
fn too_wide(text: &str, columns: usize) -> Vec<&str> {
    text.lines().filter(|line| line.chars().count() > columns && !line.starts_with("next: ")).collect()
}

fn make(folder: &Path, arguments: &[&str]) {
    let output = greyrig(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// A folder with two short recordings of a motor that hides saturation, and a model of it without.
fn prepared() -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (file, profile, seed) in [("run.csv", "staircase", "1"), ("ramp.csv", "ramp", "2")] {
        let hidden = ["--seconds", "8", "--seed", seed, "--effect", "saturation=0.4", "--out", file];
        make(folder.path(), &[&["simulate", "--profile", profile][..], &hidden].concat());
    }
    make(folder.path(), &["identify", "run.csv", "--out", "model.toml"]);
    folder
}

#[test]
fn answers_fit_eighty_columns_and_end_with_the_command_that_goes_on() {
    let folder = prepared();
    let here = folder.path();
    // Each with the begin of the command that goes on.
    let asked: [(&str, Option<&str>); 17] = [
        ("check run.csv", Some("identify run.csv")),
        ("identify run.csv ramp.csv --out both.toml", Some("diagnose run.csv ramp.csv --model both.toml")),
        ("compare run.csv ramp.csv --model model.toml", Some("diagnose run.csv ramp.csv --model model.toml")),
        ("diagnose run.csv ramp.csv --model model.toml", Some("add saturation")),
        ("add saturation --model model.toml run.csv ramp.csv --out with.toml", Some("diagnose run.csv ramp.csv")),
        ("challenge run.csv --model with.toml --effect brush_drop", None),
        ("plan --model with.toml --rivals saturation,current_compression --seconds 4", Some("simulate --kind")),
        ("predict run.csv --model with.toml --out series.csv", Some("compare run.csv --model with.toml")),
        ("convert run.csv --out again.csv", Some("check again.csv")),
        ("effects", Some("effects saturation")),
        ("effects saturation", Some("simulate --effect saturation")),
        ("simulate --list", Some("simulate --kind universal")),
        ("simulate --list --kind pm-dc", Some("simulate --kind pm-dc")),
        ("simulate --seconds 2 --out short.csv", Some("identify short.csv")),
        ("board --help", None),
        ("--help", None),
        ("diagnose --help", None),
    ];
    for (line, next) in asked {
        let output = greyrig(here, &line.split(' ').collect::<Vec<_>>());
        let text = said(&output);
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(too_wide(&text, COLUMNS), [""; 0], "{line}");
        if let Some(next) = next {
            let last = text.lines().last().unwrap_or_default();
            assert!(last.starts_with(&format!("next: greyrig {next}")), "{line}: {last}");
        }
        assert!(!text.contains('\u{1b}'), "{line}: no colour on a pipe");
    }
}

#[test]
fn the_station_fits_eighty_columns() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let here = folder.path();
    let files: Vec<String> = (1..=6).map(|n| format!("healthy-{n}.csv")).collect();
    for (n, file) in files.iter().enumerate() {
        let seed = (n + 1).to_string();
        let lot = ["--spread", "0.03", "--seed", &seed, "--seconds", "6", "--profile", "ramp", "--out", file];
        make(here, &[&["simulate"][..], &lot].concat());
    }
    let faulty = ["--seconds", "6", "--profile", "ramp", "--fault", "sparking=0.5@3", "--out", "faulty.csv"];
    make(here, &[&["simulate", "--seed", "11"][..], &faulty].concat());
    make(here, &["identify", &files[0], &files[1], "--out", "model.toml"]);
    let healthy: Vec<&str> = files.iter().map(String::as_str).collect();
    let calibrate = ["--model", "model.toml", "--out", "station.toml", "--what-would-be-seen"];
    let calibrated = greyrig(here, &[&["calibrate"][..], &healthy, &calibrate].concat());
    let judged = greyrig(here, &["monitor", "faulty.csv", &files[0], "--model", "station.toml"]);
    let golden = greyrig(here, &["master", &files[0], "--model", "station.toml"]);
    let mut answers = vec![("calibrate", calibrated, 0), ("monitor", judged, 1), ("master", golden, 0)];
    if cfg!(feature = "parquet") {
        let store = |arguments: &[&str]| greyrig(here, &[&["store"][..], arguments].concat());
        answers.push(("store add", store(&[&["add", "motors"][..], &healthy].concat()), 0));
        answers.push(("store run", store(&["run", "motors", "check"]), 0));
        answers.push(("store ls", store(&["ls", "motors"]), 0));
        answers.push(("store ls --each", store(&["ls", "motors", "--each"]), 0));
        answers.push(("store check", store(&["check", "motors"]), 0));
    }
    for (command, output, code) in answers {
        let text = said(&output);
        assert_eq!(output.status.code(), Some(code), "{command}: {text}{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(too_wide(&text, COLUMNS), [""; 0], "{command}");
    }
}

#[test]
fn narrow_and_wide_terminals_are_kept_to_as_well() {
    let folder = prepared();
    let ask = ["diagnose", "run.csv", "ramp.csv", "--model", "model.toml"];
    let mut lines = Vec::new();
    for columns in [50, 140] {
        let text = said(&greyrig_in(folder.path(), &ask, &[("COLUMNS", &columns.to_string())]));
        assert_eq!(too_wide(&text, columns), [""; 0], "{columns} columns");
        lines.push(text.lines().count());
    }
    assert!(lines[0] > lines[1], "a narrow terminal takes more lines: {lines:?}");
}

#[test]
fn colour_is_shown_where_it_is_asked_for_and_never_in_json() {
    let folder = prepared();
    let here = folder.path();
    let ask = ["compare", "run.csv", "--model", "model.toml"];
    let plain = said(&greyrig(here, &ask));
    let forced = said(&greyrig_in(here, &ask, &[("CLICOLOR_FORCE", "1")]));
    assert!(forced.contains('\u{1b}'), "{forced}");
    // Without it the text is the same to the letter.
    let mut stripped = forced.clone();
    while let Some(begin) = stripped.find('\u{1b}') {
        let end = begin + stripped[begin..].find('m').expect("a sequence ends");
        stripped.replace_range(begin..=end, "");
    }
    assert_eq!(stripped, plain);
    assert!(!said(&greyrig_in(here, &ask, &[("NO_COLOR", "1")])).contains('\u{1b}'));
    let json = said(&greyrig_in(here, &[&ask[..], &["--json"]].concat(), &[("CLICOLOR_FORCE", "1")]));
    assert!(serde_json::from_str::<Value>(&json).is_ok() && json.lines().count() == 1, "{json}");
}

#[test]
fn an_error_is_one_json_object_however_narrow_the_terminal() {
    let folder = prepared();
    // Usage, a file that is not there, a name that is not known, a file that cannot be read, one that exists, a link.
    std::fs::write(folder.path().join("broken.csv"), "t_s,u_v\n0,what\n1,2\n").expect("a file");
    let failures: [(&str, i32); 7] = [
        ("compare run.csv --model model.toml --nonsense", 2),
        ("compare missing-in-a-folder-with-a-long-name.csv --model model.toml", 2),
        ("diagnose run.csv --exclude satration", 2),
        ("identify broken.csv", 2),
        ("identify run.csv --out model.toml", 2),
        ("identify", 2),
        ("record --port /dev/no-such-port --seconds 1 --out new.csv", 3),
    ];
    for (line, code) in failures {
        let words: Vec<&str> = line.split(' ').chain(["--json"]).collect();
        let output = greyrig_in(folder.path(), &words, &[("COLUMNS", "40")]);
        let text = said(&output);
        let told: Value = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{line}: {e}: {text}"));
        assert_eq!((output.status.code(), text.lines().count()), (Some(code), 1), "{line}: {text}");
        assert_eq!((&told["schema"], &told["command"]), (&Value::from(1), &Value::from(words[0])), "{line}");
        assert!(told["error"]["what"].is_string() && told["error"]["remedy"].is_string(), "{line}: {told}");
        assert_eq!(String::from_utf8_lossy(&output.stderr).lines().count(), 1, "{line}: one line for people");
    }
}

#[test]
fn a_name_that_is_nearly_right_is_asked_back() {
    let folder = prepared();
    for (line, meant) in [
        ("effects satration", "did you mean saturation?"),
        ("diagnose run.csv --exclude hysteresys", "did you mean hysteresis?"),
        ("add satration --model model.toml run.csv", "did you mean saturation?"),
        ("simulate --effect brushdrop --out x.csv", "did you mean brush_drop?"),
        ("simulate --fault sparkling --out x.csv", "did you mean sparking?"),
        ("simulate --profile starcase --out x.csv", "did you mean staircase?"),
        ("identify run.csv --fix KK=1", "did you mean K?"),
        ("identify run.csv --map i_b=i_a", "did you mean i_a?"),
        ("identify run.csv --map u_v=u_w", "did you mean u_v?"),
        ("compare runn.csv --model model.toml", "did you mean run.csv?"),
        ("compare run.csv --model modl.toml", "did you mean model.toml?"),
        ("identify run.csv --fx R=1", "did you mean --fix?"),
        ("identify run.csv --kind pmdc", "did you mean pm-dc?"),
        ("idetify run.csv", "did you mean identify?"),
    ] {
        let output = greyrig(folder.path(), &line.split(' ').collect::<Vec<_>>());
        let talk = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), talk.lines().count()), (Some(2), 1), "{line}: {talk}");
        assert!(talk.contains(meant), "{line}: {talk}");
    }
    // What is like nothing is answered by what there is.
    let talk = String::from_utf8(greyrig(folder.path(), &["effects", "gremlins"]).stderr).expect("UTF-8");
    assert!(!talk.contains("did you mean") && talk.contains("brush_drop"), "{talk}");
}

#[test]
fn the_name_alone_is_greeted_in_three_lines() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = greyrig(folder.path(), &[]);
    let text = said(&output);
    assert_eq!((output.status.code(), text.lines().count()), (Some(0), 3), "{text}");
    assert!(text.contains("greyrig demo") && text.contains("--help") && output.stderr.is_empty(), "{text}");
    assert_eq!(too_wide(&text, COLUMNS), [""; 0]);
}

/// A motor that saturates: a back-EMF that grows less and less with the current. One term makes up for it as far as a
/// drop can, the other one has its form; the fit of neither may end worse than without.
#[test]
fn a_term_of_ones_own_lowers_the_error_and_has_a_unit() {
    let folder = prepared();
    for (term, unit, least) in [("k*i*abs(i)", "V/A2", 0.9), ("k*w*tanh(i/4)", "V s/rad", 0.6)] {
        let ask = ["add", "--term", term, "--model", "model.toml", "run.csv", "ramp.csv", "--json"];
        let output = greyrig(folder.path(), &ask);
        let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(told["accepted"], true, "{term}: {told}");
        let of = |key: &str, signal: &str| told[key][signal].as_f64().expect("a number");
        for signal in ["current", "speed"] {
            let [before, after] = ["held_out_before", "held_out_after"].map(|key| of(key, signal));
            assert!(after < least * before, "{term}, {signal}: {after} after {before}");
        }
        let k = told["parameters"].as_array().and_then(|all| all.iter().find(|p| p["name"] == "k")).expect("k");
        assert_eq!(k["unit"], unit, "{term}");
    }
}
