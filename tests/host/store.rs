//! The store of recordings as a user meets it: what goes in comes out, nothing is there twice, nothing is lost.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use greyrig_host::context::Context;
use greyrig_host::recording::{self, Channel, Mapping, Recording};
use serde_json::Value;
use tempfile::TempDir;

use crate::bad_input::refused;
use crate::program::greyrig;

fn json(output: &Output) -> Value {
    let text = String::from_utf8(output.stdout.clone()).expect("UTF-8");
    assert_eq!(text.trim_end().lines().count(), 1, "one object: {text} {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_str(&text).expect("JSON")
}

/// A run of a motor whose current is its own: numbers as a rig prints them.
fn write_run(path: &Path, motor: u32, rows: u32, metadata: &str) {
    let mut text = format!("# serial: S{motor:04}\n{metadata}t_s,u_v,i_a,omega_rad_s\n");
    for k in 0..rows {
        let t = f64::from(k) * 1e-3;
        let u = 12.0 + 8.0 * (0.7 * f64::from(k % 97)).sin();
        let i = 1.0 + f64::from((k * 31 + motor * 17) % 101) / 50.0;
        text += &format!("{t},{u:.4},{i:.3},{}\n", f64::from(k) / 7.0 + f64::from(motor));
    }
    std::fs::write(path, text).unwrap();
}

const TOLD: &str = "# motor: universal\n# line: A 3\n# date: 2026-11-30T06:15:00\n";

/// A folder with runs `r0.csv`, `r1.csv` … of as many motors.
fn with_runs(motors: u32, rows: u32) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("runs")).unwrap();
    for motor in 0..motors {
        write_run(&folder.path().join(format!("runs/r{motor}.csv")), motor, rows, TOLD);
    }
    folder
}

fn load(path: &Path) -> Recording {
    recording::load(path, &Mapping::default(), &Context::quiet()).unwrap()
}

/// Files of a folder and those below, links not followed.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.is_symlink() { all.extend(files(&path)) } else { all.push(path) }
    }
    all.sort();
    all
}

fn data_files(store: &Path) -> Vec<PathBuf> {
    files(store).into_iter().filter(|path| path.extension().is_some_and(|e| e == "parquet")).collect()
}

#[test]
fn what_goes_in_comes_out_and_is_there_once() {
    let folder = with_runs(3, 200);
    let here = |name: &str| folder.path().join(name);
    // The same samples in another file of another kind are the same recording.
    let converted = greyrig(folder.path(), &["convert", "runs/r0.csv", "--out", "again.parquet"]);
    assert!(converted.status.success());
    std::fs::write(here("runs/broken.csv"), "t_s,u_v,i_a\n0,1,x\n").unwrap();

    let output = greyrig(folder.path(), &["store", "add", "motors", "runs", "again.parquet", "--json"]);
    let added = json(&output);
    assert_eq!(output.status.code(), Some(2), "a file was refused");
    let counts = ["given", "added", "already_there", "refused", "left"].map(|key| added[key].as_u64().unwrap());
    assert_eq!(counts, [5, 3, 1, 1, 0]);
    assert_eq!(added["refusals"][0]["file"], "runs/broken.csv");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.lines().any(|line| line.starts_with("greyrig: runs/broken.csv:2:")), "{stderr}");
    // The current, printed with few decimals, is counts; the voltage takes more than 65,536 of them, and sevenths are
    // on no grid.
    assert_eq!((&added["kept_as"]["int16"], &added["kept_as"]["float64"]), (&3.into(), &6.into()));
    std::fs::remove_file(here("runs/broken.csv")).unwrap();

    let again = json(&greyrig(folder.path(), &["store", "add", "motors", "runs", "--json"]));
    assert_eq!((&again["added"], &again["already_there"]), (&0.into(), &3.into()));
    let listed = json(&greyrig(folder.path(), &["store", "ls", "motors", "--each", "--json"]));
    assert_eq!(listed["count"], 3);
    let place = &listed["folders"][0];
    assert_eq!([&place["line"], &place["type"], &place["day"]], ["A 3", "universal", "2026-11-30"]);
    assert!(here("motors/recordings/line=A%203/type=universal/day=2026-11-30").is_dir());
    let digest =
        listed["entries"].as_array().unwrap().iter().find(|e| e["serial"] == "S0001").unwrap()["sha256"].clone();
    for key in ["S0001", &digest.as_str().unwrap()[..10]] {
        let got = greyrig(folder.path(), &["store", "get", "motors", key, "--out", "out.csv", "--force"]);
        assert!(got.status.success(), "{}", String::from_utf8_lossy(&got.stderr));
        let (put_in, out) = (load(&here("runs/r1.csv")), load(&here("out.csv")));
        for channel in Channel::ALL {
            let bits = |r: &Recording| r.channel(channel).map(|x| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>());
            assert_eq!(bits(&out), bits(&put_in), "{}", channel.column());
        }
        assert_eq!((out.metadata(), out.sample_time_s()), (put_in.metadata(), put_in.sample_time_s()));
    }
    refused(
        &greyrig(folder.path(), &["store", "get", "motors", "S9", "--out", "none.csv"]),
        &["motors", "S9", "--each"],
    );
    assert!(!here("none.csv").exists());
    assert!(json(&greyrig(folder.path(), &["store", "check", "motors", "--json"]))["whole"].as_bool().unwrap());
}

#[test]
fn what_the_files_do_not_tell_the_user_can() {
    let folder = tempfile::tempdir().unwrap();
    write_run(&folder.path().join("a.csv"), 1, 50, "");
    write_run(&folder.path().join("b.csv"), 2, 50, "# line: B\n");
    let told = ["--line", "A", "--type", "M42", "--date", "2026-01-31"];
    let output = greyrig(folder.path(), &[&["store", "add", "motors", "a.csv", "b.csv", "--json"], &told[..]].concat());
    assert_eq!((json(&output)["added"].clone(), json(&output)["refused"].clone()), (1.into(), 1.into()));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(stderr.contains("b.csv") && stderr.contains("\"B\"") && stderr.contains("\"A\""), "{stderr}");
    for (filter, count) in
        [("line=A,type=M42,from=2026-01-31,to=2026-01-31", 1), ("from=2026-02-01", 0), ("serial=S0001", 1)]
    {
        let listed = json(&greyrig(folder.path(), &["store", "ls", "motors", "--where", filter, "--json"]));
        assert_eq!(listed["count"], count, "{filter}");
    }
    refused(&greyrig(folder.path(), &["store", "ls", "motors", "--where", "colour=red"]), &["colour", "line, type"]);
    refused(&greyrig(folder.path(), &["store", "add", "motors", "a.csv", "--date", "soon"]), &["soon", "2026-01-31"]);
}

#[test]
fn a_question_is_asked_once_of_each_recording() {
    let folder = with_runs(70, 60);
    let ask =
        |more: &[&str]| json(&greyrig(folder.path(), &[&["store", "run", "motors", "check", "--json"], more].concat()));
    json(&greyrig(folder.path(), &["store", "add", "motors", "runs", "--json"]));
    let some = ask(&["--where", "serial=S0003"]);
    assert_eq!((&some["asked"], &some["done_before"]), (&1.into(), &0.into()));
    let all = ask(&[]);
    assert_eq!((&all["asked"], &all["done_before"], &all["damaged"]), (&69.into(), &1.into(), &0.into()));
    let again = ask(&[]);
    assert_eq!((&again["asked"], &again["done_before"]), (&0.into(), &70.into()));
    // Another kind of motor is another question.
    assert_eq!(ask(&["--kind", "pm-dc"])["asked"], 70);
    write_run(&folder.path().join("runs/r70.csv"), 70, 60, TOLD);
    json(&greyrig(folder.path(), &["store", "add", "motors", "runs", "--json"]));
    assert_eq!((&ask(&[])["asked"], &ask(&[])["done_before"]), (&1.into(), &71.into()));
    let whole = json(&greyrig(folder.path(), &["store", "check", "motors", "--json"]));
    assert_eq!((&whole["recordings"], &whole["results"], &whole["twice"]), (&71.into(), &141.into(), &0.into()));
    let listed = json(&greyrig(folder.path(), &["store", "ls", "motors", "--json"]));
    let counted: u64 = listed["results"].as_array().unwrap().iter().map(|share| share["count"].as_u64().unwrap()).sum();
    assert_eq!(counted, 141);
}

/// A parameter in the store is what `identify` says of the file.
#[test]
fn a_result_is_that_of_the_command() {
    let folder = tempfile::tempdir().unwrap();
    for seed in ["1", "2"] {
        let out = format!("r{seed}.csv");
        greyrig(folder.path(), &["simulate", "--seconds", "2", "--seed", seed, "--spread", "0.03", "--out", &out]);
    }
    let add = greyrig(folder.path(), &["store", "add", "motors", "r1.csv", "r2.csv"]);
    assert!(add.status.success(), "{}", String::from_utf8_lossy(&add.stderr));
    let ran = json(&greyrig(folder.path(), &["store", "run", "motors", "identify", "--json"]));
    assert_eq!(ran["outcomes"]["identified"], 2, "{ran}");
    let told = json(&greyrig(folder.path(), &["identify", "r2.csv", "--json"]));
    use greyrig_host::store::{Store, files, results::Results};
    let store = Store::open(&folder.path().join("motors")).unwrap();
    let mut rows = Vec::new();
    for file in files::find::<Results>(store.root()).unwrap().files {
        rows.extend(files::rows::<Results>(&file.path).unwrap().into_iter().map(Result::unwrap));
    }
    let same = |row: &&greyrig_host::store::results::Outcome| {
        row.parameters.iter().zip(told["parameters"].as_array().unwrap()).all(|(own, told)| {
            own.name == told["name"] && own.value == told["value"].as_f64() && own.unit == told["unit"]
        })
    };
    assert_eq!(rows.iter().filter(same).count(), 1, "the other is of another motor");
    // A model of another type of motor is asked of none.
    greyrig(folder.path(), &["identify", "r1.csv", "--out", "m.toml"]);
    let text = std::fs::read_to_string(folder.path().join("m.toml")).unwrap();
    let other = text.replace("motor = \"universal\"", "motor = \"M42\"");
    assert_ne!(other, text);
    std::fs::write(folder.path().join("other.toml"), other).unwrap();
    let ran = json(&greyrig(folder.path(), &["store", "run", "motors", "identify", "--model", "other.toml", "--json"]));
    assert_eq!((&ran["asked"], &ran["other_type"]), (&0.into(), &2.into()));
    refused(&greyrig(folder.path(), &["store", "run", "motors", "monitor"]), &["--model", "calibrate"]);
    refused(
        &greyrig(folder.path(), &["store", "run", "motors", "monitor", "--model", "m.toml"]),
        &["m.toml", "calibrate"],
    );
}

/// Additions and runs that are killed at any moment, and given again, end as if nobody had disturbed them.
#[test]
#[cfg(unix)]
fn what_was_killed_goes_on_and_ends_the_same() {
    let folder = with_runs(150, 400);
    let repeat = |arguments: &[&str]| {
        // Each time it may work longer, so that it comes to its end whatever the machine.
        for round in 1_u32.. {
            let mut child = Command::new(env!("CARGO_BIN_EXE_greyrig"))
                .env("COLUMNS", crate::program::WIDE)
                .current_dir(folder.path())
                .args(arguments)
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .unwrap();
            std::thread::sleep(Duration::from_millis(15 * u64::from(round)));
            match child.try_wait().unwrap() {
                Some(status) => return assert!(status.success(), "{arguments:?}: {status}"),
                None => {
                    child.kill().unwrap();
                    child.wait().unwrap();
                }
            }
        }
    };
    repeat(&["store", "add", "motors", "runs"]);
    repeat(&["store", "run", "motors", "check"]);
    repeat(&["store", "add", "motors", "runs"]);
    let whole = json(&greyrig(folder.path(), &["store", "check", "motors", "--json"]));
    for (key, expected) in
        [("recordings", 150), ("results", 150), ("twice", 0), ("without_recording", 0), ("damaged_rows", 0)]
    {
        assert_eq!(whole[key], expected, "{key}");
    }
    let hidden = files(&folder.path().join("motors"));
    let hidden = hidden.iter().filter(|path| path.file_name().unwrap().to_string_lossy().starts_with(".greyrig-"));
    assert_eq!(
        hidden.filter(|path| path.to_string_lossy().contains("recordings")).count(),
        0,
        "the next writer tidies up"
    );
}

#[test]
#[cfg(unix)]
fn an_interrupt_keeps_what_is_done() {
    let folder = with_runs(400, 2000);
    let child = Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .env("COLUMNS", crate::program::WIDE)
        .current_dir(folder.path())
        .args(["store", "add", "motors", "runs", "--json"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    while !folder.path().join("motors/recordings.lock").exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
    std::thread::sleep(Duration::from_millis(60));
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let output = child.wait_with_output().unwrap();
    let told = json(&output);
    let count = |key: &str| told[key].as_u64().unwrap();
    assert_eq!(count("added") + count("left"), 400, "{told}");
    // A machine that had it all done meanwhile was not interrupted.
    assert_eq!(output.status.code(), Some(if told["interrupted"] == true { 130 } else { 0 }));
    let listed = json(&greyrig(folder.path(), &["store", "ls", "motors", "--json"]));
    assert_eq!(listed["count"], told["added"]);
}

/// Two that add at once wait for each other; each recording is there once.
#[test]
fn two_writers_lose_nothing() {
    let folder = with_runs(60, 200);
    let start = || {
        Command::new(env!("CARGO_BIN_EXE_greyrig"))
            .env("COLUMNS", crate::program::WIDE)
            .current_dir(folder.path())
            .args(["store", "add", "motors", "runs", "--json"])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let both = [start(), start()].map(|child| json(&child.wait_with_output().unwrap()));
    let sum = |key: &str| both.iter().map(|told| told[key].as_u64().unwrap()).sum::<u64>();
    assert_eq!((sum("added"), sum("already_there")), (60, 60));
    let whole = json(&greyrig(folder.path(), &["store", "check", "motors", "--json"]));
    assert_eq!((&whole["recordings"], &whole["twice"]), (&60.into(), &0.into()));
}

#[test]
fn damage_is_told_and_left_out() {
    let folder = with_runs(130, 60);
    json(&greyrig(folder.path(), &["store", "add", "motors", "runs", "--json"]));
    let store = folder.path().join("motors");
    let data = data_files(&store);
    assert_eq!(data.len(), 3, "64 rows a group");
    // Half a file, as of a copy that was cut off.
    let half = std::fs::read(&data[1]).unwrap();
    std::fs::write(&data[1], &half[..half.len() / 2]).unwrap();
    let whole = data_files(&store).len();
    let output = greyrig(folder.path(), &["store", "ls", "motors", "--json"]);
    assert_eq!((output.status.code(), whole), (Some(0), 3));
    let left = json(&output)["count"].as_u64().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert!(stderr.contains("damaged") && stderr.contains("left out"), "{stderr}");
    assert!(left == 130 - 64 || left == 130 - 2, "{left}");
    let ran = greyrig(folder.path(), &["store", "run", "motors", "check", "--json"]);
    assert_eq!((json(&ran)["asked"].as_u64(), ran.status.code()), (Some(left), Some(2)));
    let checked = greyrig(folder.path(), &["store", "check", "motors", "--json"]);
    assert_eq!((json(&checked)["damaged_files"].clone(), checked.status.code()), (1.into(), Some(2)));
    // Taken away, its recordings can be added again.
    std::fs::remove_file(&data[1]).unwrap();
    let added = json(&greyrig(folder.path(), &["store", "add", "motors", "runs", "--json"]));
    assert_eq!((added["added"].as_u64(), added["already_there"].as_u64()), (Some(130 - left), Some(left)));
}

#[test]
fn a_store_of_a_newer_greyrig_is_left_alone() {
    let folder = with_runs(1, 60);
    json(&greyrig(folder.path(), &["store", "add", "motors", "runs", "--json"]));
    std::fs::write(folder.path().join("motors/greyrig-store.json"), "{\"schema\": 7}").unwrap();
    let before: Vec<_> = files(&folder.path().join("motors")).iter().map(|path| std::fs::read(path).unwrap()).collect();
    for arguments in [
        &["store", "add", "motors", "runs"][..],
        &["store", "ls", "motors"],
        &["store", "check", "motors"],
        &["store", "run", "motors", "check"],
        &["store", "get", "motors", "S0000", "--out", "x.csv"],
    ] {
        refused(&greyrig(folder.path(), arguments), &["layout 7", "layout 1"]);
    }
    let after: Vec<_> = files(&folder.path().join("motors")).iter().map(|path| std::fs::read(path).unwrap()).collect();
    assert_eq!(after, before);
    refused(&greyrig(folder.path(), &["store", "ls", "runs"]), &["runs", "no store", "store add"]);
    refused(&greyrig(folder.path(), &["store", "add", "runs", "runs"]), &["runs", "no store"]);
    refused(&greyrig(folder.path(), &["store", "ls", "nothing"]), &["nothing"]);
    let told = json(&greyrig(folder.path(), &["store", "ls", "nothing", "--json"]));
    assert_eq!(told["command"], "store ls");
    assert!(told["error"]["remedy"].is_string());
}

/// A name with slashes and dots makes a folder of the store, and none outside of it.
#[test]
fn no_name_leads_out_of_the_store() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("a/b");
    std::fs::create_dir_all(&inner).unwrap();
    write_run(&inner.join("r.csv"), 1, 60, "# line: ../../../x\n# motor: /etc/passwd\n# date: 2026-01-01\n");
    let added = json(&greyrig(&inner, &["store", "add", "motors", "r.csv", "--json"]));
    assert_eq!(added["added"], 1);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    let listed = json(&greyrig(&inner, &["store", "ls", "motors", "--json"]));
    assert_eq!(
        (&listed["folders"][0]["line"], &listed["folders"][0]["type"]),
        (&"../../../x".into(), &"/etc/passwd".into())
    );
}

/// A file may not grow beyond some kilobytes, as on a full disk: what was in the store still is, and what is given
/// again goes in once there is room.
#[test]
#[cfg(unix)]
fn a_full_disk_leaves_what_was_there() {
    let folder = with_runs(40, 3000);
    json(&greyrig(folder.path(), &["store", "add", "motors", "runs/r0.csv", "--json"]));
    let before = data_files(&folder.path().join("motors"));
    let program = env!("CARGO_BIN_EXE_greyrig");
    let limited = format!("trap '' XFSZ; ulimit -f 64; exec '{program}' store add motors runs");
    let output = Command::new("sh").current_dir(folder.path()).args(["-c", &limited]).output().unwrap();
    refused(&output, &["arge", "free some space", "nothing is added twice"]);
    assert_eq!(data_files(&folder.path().join("motors")), before);
    let added = json(&greyrig(folder.path(), &["store", "add", "motors", "runs", "--json"]));
    assert_eq!((&added["added"], &added["already_there"]), (&39.into(), &1.into()));
    let whole = json(&greyrig(folder.path(), &["store", "check", "motors", "--json"]));
    assert_eq!((&whole["recordings"], &whole["whole"], &whole["unfinished"]), (&40.into(), &true.into(), &0.into()));
}
