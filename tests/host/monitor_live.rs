//! Tests of motors over the link: the firmware on an emulated Cortex-M4F, a motor that goes wrong, lines that break.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use greyrig::app::bench::{CYCLE, MIDDLE};
use greyrig::link::frame::{MAX_FRAME, Receiver, encode};
use greyrig::link::message::{Asked, Request};
use serde_json::Value;
use tempfile::TempDir;

use crate::bad_input;
use crate::firmware::{Board, folder};
use crate::program::{greyrig, json};

/// The bench's motor is the model but for the counts of its converter, so 1 % is no noise; the limits of errors and
/// deviations are wide, so that what calls is what changes.
const LIMITS: &str = "[detector]\nnominal_voltage = 230.0\nleast_voltage = 0.3\nmost_voltage = 1.1\nleast_speed = 100.0\n\
    blanking_s = 0.5\nfewest_periods = 20\ncurrent = 0.2\nspeed = 0.2\nsparking = 0.1\ncurrent_jump = 0.01\nspeed_jump = 0.01\n\
    current_deviation = [0.0, 0.1]\nspeed_deviation = [0.0, 0.1]\nruns = 10\nholds = [0.999, 0.95]\n";

/// A folder with a station's model: that of the bench, with limits.
pub fn station() -> TempDir {
    let folder = folder(2.2);
    let text = std::fs::read_to_string(folder.path().join("model.toml")).unwrap();
    let (plain, _) = text.split_once("[[effects]]").expect("an effect, which the bench has not");
    std::fs::write(folder.path().join("plain.toml"), plain).unwrap();
    std::fs::write(folder.path().join("station.toml"), format!("{plain}{LIMITS}")).unwrap();
    folder
}

fn flash(folder: &Path, port: &str) {
    assert_eq!(json(folder, &["flash", "--model", "station.toml", "--port", port])["verified"], true);
}

#[test]
fn a_fault_that_begins_during_the_test_raises_the_right_alarm_on_line() {
    let (folder, (board, mut knob)) = (station(), Board::start_with_knob());
    let (here, port) = (folder.path(), board.port.as_str());
    flash(here, port);
    for (letter, kind, suspect) in
        [("r", "electrical", "resistance +"), ("c", "sensor", "gain of the current sensor +5 %")]
    {
        knob.write_all(letter.as_bytes()).unwrap();
        let arguments =
            ["monitor", "--port", port, "--model", "station.toml", "--serial", letter, "--results", "day.csv"];
        let more = ["--out", "run.csv", "--force", "--json"];
        let output = greyrig(here, &[&arguments[..], &more].concat());
        let talk = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{talk}");
        let told: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!((&told["verdict"], &told["lost"], &told["reconnections"]), (&"fail".into(), &0.into(), &0.into()));
        // It was told while the motor still ran.
        assert!(talk.contains("alarm: ") && talk.contains("begins"), "{talk}");
        let (_, place) = talk.split_once("it looks ").unwrap();
        assert!(place.starts_with(kind), "what is told first is right: {talk}");

        let alarm = &told["alarms"][0];
        let sample = told["first_sample"].as_f64().unwrap() + 1e4 * alarm["t_s"].as_f64().unwrap();
        let after = sample as u32 % CYCLE - MIDDLE;
        // Three periods of 200 samples call, one is under way, and the filter settles within one.
        assert!((400..1_100).contains(&after), "{letter}: {after} samples after the fault began");
        assert_eq!(alarm["kind"], kind, "{told}");
        assert!(alarm["suspect"].as_str().unwrap().contains(suspect), "{told}");
        assert_eq!(told["runs"][0]["serial"], letter);

        // The host judges the recording of the test as the microcontroller has judged the motor.
        let again = greyrig(here, &["monitor", "run.csv", "--model", "station.toml", "--json"]);
        assert_eq!(again.status.code(), Some(1));
        let again: Value = serde_json::from_slice(&again.stdout).unwrap();
        for key in ["kind", "cause", "suspect"] {
            assert_eq!(again["alarms"][0][key], alarm[key], "{key}");
        }
        // Both begin with the same sample; the recording's times are printed with ten digits.
        let times = [&again, &told].map(|x| x["alarms"][0]["t_s"].as_f64().unwrap());
        assert!((times[0] - times[1]).abs() < 1e-6, "{times:?}");
    }
    let day = std::fs::read_to_string(here.join("day.csv")).unwrap();
    let lines: Vec<Vec<&str>> = day.lines().skip(1).map(|l| l.split(',').collect()).collect();
    assert_eq!([lines[0][1], lines[0][2], lines[1][1], lines[1][2]], ["r", "fail", "c", "fail"]);
}

/// Between host and board; `disturb` gets each connection's number, the bytes sent to the host so far, and the board.
fn between(board: &Board, disturb: impl Fn(usize, usize, &mut TcpStream) -> bool + Send + 'static) -> String {
    let address = board.port.strip_prefix("tcp:").unwrap().to_owned();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        for (n, host) in listener.incoming().enumerate() {
            let (mut host, mut board) = (host.unwrap(), TcpStream::connect(&address).unwrap());
            let (mut to_board, mut from_host) = (board.try_clone().unwrap(), host.try_clone().unwrap());
            std::thread::spawn(move || std::io::copy(&mut from_host, &mut to_board));
            let (mut sent, mut bytes) = (0, [0; 1024]);
            while let Ok(count @ 1..) = board.read(&mut bytes) {
                sent += count;
                if host.write_all(&bytes[..count]).is_err() || disturb(n, sent, &mut board) {
                    break;
                }
            }
            let _ = host.shutdown(std::net::Shutdown::Both);
            let _ = board.shutdown(std::net::Shutdown::Both);
        }
    });
    port
}

#[test]
fn a_test_survives_a_broken_link() {
    let (folder, board) = (station(), Board::start());
    flash(folder.path(), &board.port);
    // A second's samples and periods are 54 kB: the first connection breaks within the test.
    let port = between(&board, |n, sent, _| {
        let breaks = n == 0 && sent > 60_000;
        if breaks {
            // Longer than the queue of raw samples, 51 ms.
            std::thread::sleep(Duration::from_millis(500));
        }
        breaks
    });
    let arguments = ["monitor", "--port", &port, "--model", "station.toml", "--seconds", "4", "--json"];
    let output = greyrig(folder.path(), &arguments);
    let talk = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{talk}");
    assert!(talk.contains("trying again") && talk.contains("the link is back"), "{talk}");
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&told["verdict"], &told["reconnections"]), (&"pass".into(), &1.into()));
    assert!(told["lost"].as_u64().unwrap() > 0);
}

#[test]
fn a_microcontroller_that_restarts_during_the_test_gives_no_verdict() {
    let (folder, board) = (station(), Board::start());
    flash(folder.path(), &board.port);
    let port = between(&board, |n, sent, board| {
        if n == 0 && sent > 60_000 {
            let mut bytes = [0; MAX_FRAME];
            let length = encode(&Asked { number: 0, request: Request::Restart }, &mut bytes).unwrap();
            board.write_all(&[&[0], &bytes[..length]].concat()).unwrap();
            std::thread::sleep(Duration::from_millis(300));
        }
        n == 0 && sent > 60_000
    });
    let arguments = ["monitor", "--port", &port, "--model", "station.toml", "--seconds", "4", "--results", "day.csv"];
    let output = greyrig(folder.path(), &arguments);
    let talk = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{talk}");
    assert!(talk.lines().last().unwrap().contains("restarted during the test"), "{talk}");
    assert!(!folder.path().join("day.csv").exists());
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_a_test_without_a_verdict_and_the_next_one_begins() {
    let (folder, board) = (station(), Board::start());
    flash(folder.path(), &board.port);
    let arguments = ["monitor", "--port", &board.port, "--model", "station.toml", "--results", "day.csv"];
    let test = Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .env("COLUMNS", crate::program::WIDE)
        .current_dir(folder.path())
        .args(arguments)
        .args(["--out", "run.csv"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    Command::new("kill").args(["-INT", &test.id().to_string()]).status().unwrap();
    let output = test.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(!folder.path().join("day.csv").exists() && !folder.path().join("run.csv").exists());
    let kept = std::fs::read_to_string(folder.path().join("run.incomplete.csv")).expect("what there was of it");
    assert!(kept.contains("# incomplete: the test ended early: ") && kept.lines().count() > 1_000, "{}", &kept[..300]);
    let told = json(folder.path(), &[&arguments[..], &["--seconds", "1.5"]].concat());
    assert_eq!((&told["verdict"], &told["lost"]), (&"pass".into(), &0.into()));
}

#[test]
fn another_model_is_refused_and_so_is_one_without_limits() {
    let (folder, board) = (station(), Board::start());
    let (here, port) = (folder.path(), board.port.as_str());
    let monitor = ["monitor", "--port", port, "--model", "station.toml"];
    bad_input::refused(&greyrig(here, &monitor), &["no parameters", "greyrig flash --model station.toml"]);
    json(here, &["flash", "--model", "plain.toml", "--port", port]);
    bad_input::refused(&greyrig(here, &monitor), &["another model than station.toml", "greyrig flash"]);
    bad_input::refused(&greyrig(here, &["monitor", "--port", port, "--model", "plain.toml"]), &["greyrig calibrate"]);
    let two_ways = ["monitor", "run.csv", "--port", port, "--model", "station.toml"];
    bad_input::refused(&greyrig(here, &two_ways), &["--port"]);
    bad_input::refused(&greyrig(here, &["monitor", "--model", "station.toml"]), &["RUN"]);
}

/// Firmware from before tests could be begun.
#[test]
fn an_older_protocol_is_told_at_once() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let (mut host, _) = listener.accept().unwrap();
        let (mut receiver, mut byte) = (Receiver::new(), [0]);
        while host.read_exact(&mut byte).is_ok() {
            let Some(Ok(body)) = receiver.push(byte[0]) else { continue };
            let Asked { number, .. } = postcard::from_bytes(body).unwrap();
            // As it was then: Message::Reply, Reply::Identity, protocol, fingerprint, firmware, board, chip, rate,
            // skew.
            let identity = (1_u16, 0_u32, "0.0.9", "old", [0_u8; 12], 10_000_u32, [0.0_f32; 2]);
            let mut frame = [0; MAX_FRAME];
            let length = encode(&(0_u8, number, 0_u8, identity), &mut frame).unwrap();
            host.write_all(&frame[..length]).unwrap();
        }
    });
    let folder = station();
    let output = greyrig(folder.path(), &["monitor", "--port", &port, "--model", "station.toml"]);
    let talk = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{talk}");
    assert!(
        talk.contains("0.0.9 speaks version 1 of the link, this greyrig version 3") && talk.contains("cargo fw-run"),
        "{talk}"
    );
}
