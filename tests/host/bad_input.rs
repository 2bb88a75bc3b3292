//! Bad input ends with exit code 2 and one line that says where, what and what to do.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Runs `greyrig convert` on a file of the given name and content.
fn convert(name: &str, content: &[u8], more: &[&str]) -> Output {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let input = folder.path().join(name);
    std::fs::write(&input, content).expect("a writable file");
    run(&input, &folder.path().join("out.csv"), more)
}

fn run(input: &Path, out: &Path, more: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_greyrig"));
    command.env("COLUMNS", crate::program::WIDE);
    command.arg("convert").arg(input).arg("--out").arg(out).args(more).output().expect("greyrig runs")
}

/// Exit code 2, one line on stderr with all the words, nothing on stdout.
pub fn refused(output: &Output, words: &[&str]) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert_eq!(stderr.trim_end().lines().count(), 1, "{stderr}");
    assert!(stderr.starts_with("greyrig: ") && stderr.contains("; "), "no remedy in: {stderr}");
    for word in words {
        assert!(stderr.contains(word), "'{word}' is not in: {stderr}");
    }
    assert!(output.stdout.is_empty());
}

fn bad_csv(content: &str, words: &[&str]) {
    refused(&convert("run.csv", content.as_bytes(), &[]), words);
}

/// A good table of `rows` rows, to be spoilt.
fn good(rows: usize) -> Vec<String> {
    let mut lines = vec!["t_s,u_v,i_a,omega_rad_s".to_owned()];
    lines.extend((0..rows).map(|k| format!("{},12.5,{},{}", k as f64 * 1e-3, 1.0 + (k % 7) as f64, k)));
    lines
}

#[test]
fn structure_of_the_text() {
    bad_csv("", &["run.csv", "empty"]);
    bad_csv("t_s,u_v,i_a\n", &["run.csv:1", "header but no row"]);
    bad_csv("# rig: 1\n", &["run.csv:1", "comments but no data"]);
    bad_csv("0,1,2\n0.1,1,2\n0.2,1,2\n", &["run.csv:1", "no header", "t_s,u_v,i_a"]);
    bad_csv("this is\nno table\nat all\nreally\n", &["run.csv:1", "no row of numbers"]);
    bad_csv("t_s,u_v\n0,1,2\n0.1,1,2\n0.2,1,2\n", &["run.csv:1", "2 names", "3 fields"]);
    let mut lines = good(20);
    lines[11] = "0.010,12.5".into();
    bad_csv(&lines.join("\n"), &["run.csv:12:2", "2 fields", "header 4"]);
    lines[11] = "0.010,12.5,1,2,3".into();
    bad_csv(&lines.join("\n"), &["run.csv:12:5", "5 fields"]);
}

#[test]
fn cells() {
    let mut lines = good(20);
    lines[6] = "0.005,12.5,abc,5".into();
    bad_csv(&lines.join("\n"), &["run.csv:7:3", "column i_a", "'abc'", "not a number"]);
    lines[6] = "0.005,inf,1,5".into();
    bad_csv(&lines.join("\n"), &["run.csv:7:2", "column u_v", "no finite number"]);
    lines[6] = "0.005,1e999,1,5".into();
    bad_csv(&lines.join("\n"), &["run.csv:7:2", "no finite number"]);
    let mut lines = good(20);
    for line in lines.iter_mut().skip(5) {
        *line = line.replacen(",12.5,", ",,", 1);
    }
    bad_csv(&lines.join("\n"), &["run.csv:6:2", "column u_v", "16 of 20 values are missing"]);
}

#[test]
fn time() {
    let spoil = |row: usize, t: &str| {
        let mut lines = good(50);
        let rest = lines[row].split_once(',').map(|(_, rest)| rest.to_owned()).expect("a row");
        lines[row] = format!("{t},{rest}");
        lines.join("\n")
    };
    bad_csv(&spoil(21, "0.019"), &["run.csv:22:1", "appears twice"]);
    bad_csv(&spoil(21, "0.0153"), &["run.csv:22:1", "jumps back"]);
    bad_csv(&spoil(21, ""), &["run.csv:22:1", "time is missing"]);
    let mut gap = good(50);
    gap.drain(20..45);
    bad_csv(&gap.join("\n"), &["run.csv:21:1", "25 samples are missing"]);
    // A damaged stamp, told in few digits.
    bad_csv(&spoil(50, "7e306"), &["run.csv:51:1", "a gap of 7e306 s", "damaged stamp"]);
    bad_csv(&spoil(49, "7e306"), &["run.csv:51:1", "jumps back from 7e306 s"]);
    let mut reversed = good(50);
    reversed[1..].reverse();
    bad_csv(&reversed.join("\n"), &["run.csv:3:1", "backwards"]);
    let rates: Vec<String> = (0..60).map(|k| format!("{},1,2,3", if k < 30 { k } else { 30 + 3 * (k - 30) })).collect();
    bad_csv(&format!("t_s,u_v,i_a,omega_rad_s\n{}", rates.join("\n")), &["run.csv:33:1", "changes from 1 s to 3 s"]);
    let wild: Vec<String> = (0..60).map(|k| format!("{},1,2,3", k * k)).collect();
    bad_csv(&format!("t_s,u_v,i_a,omega_rad_s\n{}", wild.join("\n")), &["run.csv:", "sampling"]);
    bad_csv("u_v,i_a\n1,2\n3,4\n5,6\n", &["no time column", "sample_time_s"]);
    bad_csv("t_s,u_v\n0,1\n", &["only one sample"]);
    bad_csv("# fs: many Hz\nu_v,i_a\n1,2\n3,4\n5,6\n", &["fs: many Hz", "sample_time_s"]);
}

#[test]
fn names_and_units() {
    let rows = "\n0,1,2,3\n0.1,1,2,4\n0.2,1,2,5\n";
    bad_csv(&format!("t_s,a,b,c{rows}"), &["a, b, c", "--map u_v=COLUMN"]);
    bad_csv(&format!("t_s,voltage,Spannung,i{rows}"), &["'voltage' and 'Spannung'", "--map u_v=voltage"]);
    bad_csv(&format!("t,u [furlong],i,w{rows}"), &["u [furlong]", "furlong", "V, mV, uV, kV"]);
    bad_csv(&format!("t,u [A],i,w{rows}"), &["u [A]", "is in A", "voltage"]);
    bad_csv(&format!("t,u,i,n{rows}"), &["'n' states no unit", "--map 'omega_rad_s=n[rpm]'"]);
    bad_csv(&format!("t,u,v [m/s],angle [rad]{rows}"), &["linear drive", "rotary"]);
    bad_csv(&format!("t,i_a,i_b,i_c{rows}"), &["i_a", "i_b", "three-phase", "--map i_a=i_a"]);
}

#[test]
fn mappings() {
    let table = "t_s,VoltageCh1,CurrentCh2\n0,1,2\n0.1,1,2\n0.2,1,3\n";
    let map = |rules: &[&str], words: &[&str]| {
        let mut more = vec!["--map"];
        more.extend(rules);
        refused(&convert("run.csv", table.as_bytes(), &more), words);
    };
    map(&["u_v=VoltageCh"], &["no column 'VoltageCh'", "the file has VoltageCh1, "]);
    map(&["u_v=CurentCh2*0.1"], &["no column 'CurentCh2'", "the file has CurrentCh2, "]);
    map(&["uv=VoltageCh1"], &["no channel 'uv'", "choose one of u_v"]);
    map(&["u_v=VoltageCh1", "u_v=CurrentCh2"], &["u_v twice"]);
    map(&["u_v"], &["no '='", "TARGET=SOURCE"]);
    map(&["u_v="], &["names no column"]);
    map(&["sample_time_s=-1", "u_v=VoltageCh1"], &["sampling interval"]);
    map(&["u_v=VoltageCh1[rpm]"], &["rpm", "no unit of voltage"]);
    // Several pairs after one --map, and a good result.
    let good = convert("run.csv", table.as_bytes(), &["--map", "u_v=VoltageCh1*0.01", "i_a=CurrentCh2[mA]", "--json"]);
    assert_eq!(good.status.code(), Some(0), "{}", String::from_utf8_lossy(&good.stderr));
    let json: serde_json::Value = serde_json::from_slice(&good.stdout).expect("one JSON object");
    assert_eq!(json["schema"], 1);
    assert_eq!(json["command"], "convert");
    assert_eq!(json["samples"], 3);
    assert_eq!(json["channels"][0]["max"], 0.01);
    assert_eq!(json["channels"][1]["max"], 0.003);
}

#[test]
fn files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out.csv");
    refused(&run(&folder.path().join("none.csv"), &out, &[]), &["none.csv", "check the spelling"]);
    refused(&run(folder.path(), &out, &[]), &["name a file, not a folder"]);
    refused(&convert("run.xyz", b"1", &[]), &["'.xyz'", ".csv", ".parquet", ".mf4", ".tdms"]);
    refused(&convert("run", b"1", &[]), &["no extension", ".csv"]);
    refused(&convert("run.csv", b"PAR1\0\0\0\0", &[]), &["not text", "Parquet"]);
    refused(&convert("run.csv.gz", b"\x1f\x8b\x08\0damaged", &[]), &["damaged"]);
    for name in ["run.mat", "run.h5", "run.mf4", "run.tdms", "run.wav", "run.npz", "run.parquet"] {
        refused(&convert(name, b"t_s,u_v\n0,1\n0.1,2\n", &[]), &[name, "cannot be read", "name it .csv"]);
        refused(&convert(name, b"", &[]), &[name, "empty"]);
    }
    refused(&convert("run.h5", b"TDSm\0\0\0\0\0\0\0\0", &[]), &["it looks like TDMS"]);
    // A result is not overwritten, and has a known format.
    let input = folder.path().join("good.csv");
    std::fs::write(&input, good(20).join("\n") + "\n").expect("a writable file");
    std::fs::write(&out, "keep").expect("a writable file");
    refused(&run(&input, &out, &[]), &["exists already", "--force"]);
    assert_eq!(std::fs::read_to_string(&out).expect("still there"), "keep");
    refused(&run(&input, &folder.path().join("out.xls"), &[]), &["no writer for '.xls'", ".csv"]);
    assert!(run(&input, &out, &["--force"]).status.success());
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(&input, std::fs::Permissions::from_mode(0o000)).expect("mode");
        // The superuser reads everything.
        if std::fs::File::open(&input).is_err() {
            refused(&run(&input, &out, &["--force"]), &["good.csv", "check the permissions"]);
        }
    }
    #[cfg(unix)]
    refused(&run(Path::new("/dev/zero"), &out, &["--force"]), &["no regular file"]);
}

#[test]
fn too_large_files_are_refused_before_reading() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let input = folder.path().join("huge.csv");
    // A sparse file: 3 GB long, hardly any blocks on the disk.
    std::fs::File::create(&input).and_then(|f| f.set_len(3_000_000_000)).expect("a sparse file");
    refused(&run(&input, &folder.path().join("out.csv"), &[]), &["too large: 3.0 GB", "50 million", "cut the run"]);
}

#[cfg(not(feature = "arrow"))]
#[test]
fn a_missing_reader_names_the_build_that_has_it() {
    refused(&convert("run.feather", b"ARROW1\0\0", &[]), &["Arrow", "cargo greyrig-full"]);
}

/// The object on stdout says what the line on stderr does.
fn refused_in_json(output: &Output, command: &str, has_place: bool) -> Value {
    let told: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!((&told["schema"], &told["command"]), (&Value::from(1), &Value::from(command)));
    let text = |name: &str| told["error"][name].as_str();
    let place = text("place").map_or_else(String::new, |place| format!("{place}: "));
    assert_eq!(!place.is_empty(), has_place, "{told}");
    let line = format!("greyrig: {place}{}; {}\n", text("what").unwrap(), text("remedy").unwrap());
    assert_eq!(String::from_utf8_lossy(&output.stderr), line);
    assert_eq!(output.status.code(), Some(2));
    told
}

#[test]
fn with_json_an_error_is_an_object_as_well() {
    let told = refused_in_json(&convert("run.csv", b"", &["--json"]), "convert", true);
    assert!(told["error"]["place"].as_str().unwrap().ends_with("run.csv"), "{told}");
    refused_in_json(&convert("run.csv", b"t_s,u_v\n0,1,2\n0.1,1,2\n0.2,1,2\n", &["--json"]), "convert", true);
    let greyrig = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_greyrig"))
            .env("COLUMNS", crate::program::WIDE)
            .args(arguments)
            .output()
            .expect("greyrig runs")
    };
    // Wrong usage, of the command line and of the command.
    refused_in_json(&greyrig(&["compare", "--json", "--nonsense"]), "compare", false);
    refused_in_json(&greyrig(&["anfis", "fit", "--json"]), "anfis fit", false);
    refused_in_json(&greyrig(&["effects", "magic", "--json"]), "effects", false);
}

#[test]
fn a_recording_at_rest_is_a_verdict_of_a_diagnosis_and_an_error_of_an_identification() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let input = folder.path().join("run.csv");
    let rows = (0..2000).map(|k| format!("{},12.5,1.5,300\n", f64::from(k) * 1e-3)).collect::<String>();
    std::fs::write(&input, format!("t_s,u_v,i_a,omega_rad_s\n{rows}")).expect("a writable file");
    let greyrig = |command: &str| {
        let arguments = [command, input.to_str().unwrap(), "--kind", "pm-dc", "--json"];
        Command::new(env!("CARGO_BIN_EXE_greyrig"))
            .env("COLUMNS", crate::program::WIDE)
            .args(arguments)
            .output()
            .expect("greyrig runs")
    };
    refused_in_json(&greyrig("identify"), "identify", true);
    let diagnosed = greyrig("diagnose");
    let told: Value = serde_json::from_slice(&diagnosed.stdout).expect("one JSON object");
    assert_eq!((&told["verdict"]["kind"], diagnosed.status.code()), (&Value::from("insufficient_data"), Some(0)));
}
