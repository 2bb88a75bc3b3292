//! The station's sequence on the emulated board, as a user sets it up and runs it.

use std::io::Write;
use std::time::Duration;

use serde_json::Value;

use crate::bad_input;
use crate::firmware::Board;
use crate::monitor_live::station;
use crate::program::{greyrig, json};

/// The bench runs down slowly; the test waits for the begin of that.
const SEQUENCE: &str = "profile = \"steady\"\nseconds = 3.0\npeak_voltage_v = 325.0\ntrip_a = 30.0\noverspeed_rad_s = 4500.0\n\
    rest_rad_s = 2900.0\ntime_out_s = 10.0\n[stuck]\nfrom_v = 200.0\nbelow_rad_s = 20.0\nwithin_s = 0.5\n";

#[test]
fn the_board_runs_its_sequence() {
    let (folder, (board, mut knob)) = (station(), Board::start_with_knob());
    let (here, port) = (folder.path(), board.port.as_str());
    std::fs::write(here.join("sequence.toml"), SEQUENCE).unwrap();
    let run = |more: &[&str]| greyrig(here, &[&["run", "--port", port], more].concat());
    let state = |more: &[&str]| json(here, &[&["run", "--port", port], more].concat())["run"].clone();
    let refused = |output: &std::process::Output, code: i32, words: &str| {
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "{told}");
        assert!(told.contains(words), "{told}");
    };
    refused(&run(&[]), 3, "no sequence");
    let flash = ["flash", "--model", "station.toml", "--sequence", "sequence.toml", "--port", port];
    bad_input::refused(&greyrig(here, &flash), &["no supply"]);
    assert_eq!(json(here, &["rig", "--port", port, "--supply", "ac:325:50"])["supply"], "50 Hz, 0 to 325 V peak");
    let told = json(here, &flash);
    assert!((told["sequence_s"].as_f64().unwrap() - 3.0).abs() < 1e-6, "{told}");
    assert_eq!(
        json(here, &["rig", "--port", port, "--name", "rig 3"])["supply"],
        "50 Hz, 0 to 325 V peak",
        "it is kept"
    );

    // After a start nothing moves.
    let first = state(&["--state"]);
    assert_eq!((&first["state"], &first["runs"]), (&"stopped".into(), &0.into()), "{first}");
    refused(&run(&[]), 3, "the processor has started");
    assert_eq!(state(&["--acknowledge"])["emergency_closed"], true);
    assert_eq!(state(&["--state"])["state"], "idle");
    let told = state(&[]);
    assert_eq!(
        (&told["state"], &told["verdict"], &told["runs"]),
        (&"passed".into(), &"pass".into(), &1.into()),
        "{told}"
    );
    assert_eq!(told["command"], 0.0);

    // An emergency stop within a run, and a station that stays stopped while it is open.
    let stopped = std::thread::scope(|scope| {
        let running = scope.spawn(|| run(&[]));
        std::thread::sleep(Duration::from_millis(1500));
        knob.write_all(b"e").unwrap();
        running.join().unwrap()
    });
    assert_eq!(stopped.status.code(), Some(4));
    let told = String::from_utf8(stopped.stdout).unwrap();
    assert!(told.contains("run 2: stopped") && told.contains("the emergency stop is open"), "{told}");
    state(&["--acknowledge"]);
    assert_eq!(state(&["--state"])["state"], "stopped");
    knob.write_all(b"E").unwrap();
    std::thread::sleep(Duration::from_millis(200));
    state(&["--acknowledge"]);
    assert_eq!(state(&["--state"])["state"], "idle");

    // The button, without a host; and the host stops it.
    knob.write_all(b"s").unwrap();
    let begun = (0..50).map(|_| state(&["--state"])).find(|now: &Value| now["runs"] == 3).expect("it begins");
    assert_eq!(begun["state"], "running", "{begun}");
    knob.write_all(b"S").unwrap();
    state(&["--abort"]);
    let aborted = state(&["--state"]);
    assert_eq!((&aborted["state"], &aborted["stop"]), (&"stopped".into(), &"aborted".into()), "{aborted}");
}
