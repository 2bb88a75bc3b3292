//! The board behind its pseudo-terminal, and the host's own side of the link: parameters, a recording, its verdict.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use greyrig::link::message::Request;
use greyrig_host::context::Context;
use greyrig_host::device::clock::Clock;
use greyrig_host::device::{Connection, Port, capture, update};

/// The program; it ends with the test.
struct Program {
    child: Child,
    port: Port,
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn start(arguments: &[&str]) -> Program {
    let mut child = Command::new(env!("CARGO_BIN_EXE_greyrig-board"))
        .arg("--image")
        .arg(crate::file())
        .arg("--json")
        .args(arguments)
        .stdout(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut line = String::new();
    BufReader::new(child.stdout.take().expect("a pipe")).read_line(&mut line).expect("it says its port");
    let told: serde_json::Value = serde_json::from_str(&line).expect("JSON");
    let clock = told["clock"].as_str().map(PathBuf::from).into();
    Program { child, port: Port { name: told["port"].as_str().expect("a port").to_owned(), clock } }
}

#[test]
fn the_hosts_commands_work_on_it() {
    let board = start(&["--profile", "steady"]);
    let payload = crate::payload("VC-1400");
    let (device, block) = update::write(&board.port, &payload, &Context::quiet()).unwrap();
    assert_eq!((device.board.as_str(), block.sequence), ("NUCLEO-G474RE", 1));

    let (connection, device) = Connection::open(&board.port, &Context::quiet()).unwrap();
    let capture = capture::record(&board.port, &device, connection, 10_000, &Context::quiet()).unwrap().capture;
    assert_eq!((capture.samples.len(), capture.lost().len(), capture.reconnections), (10_000, 0, 0));
    // The amplitude rises from a tenth of nominal within 15 % of 10 s (rig/profiles.rs): the motor turns.
    let highest = capture.samples.iter().flatten().map(|counts| counts.speed).max();
    assert!(highest > Some(500), "{highest:?}");
}

/// A program that was killed in the middle of a recording leaves samples on the line, and more in the terminal's
/// buffer.
#[test]
fn what_a_killed_program_has_left_is_in_no_recording() {
    let board = start(&["--profile", "steady"]);
    let (mut killed, device) = Connection::open(&board.port, &Context::quiet()).unwrap();
    killed.tell(Request::StartCapture).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    drop(killed);
    std::thread::sleep(Duration::from_millis(700));
    let (connection, _) = Connection::open(&board.port, &Context::quiet()).unwrap();
    let ended = capture::record(&board.port, &device, connection, 5_000, &Context::quiet()).unwrap();
    assert!(ended.early.is_none(), "{:?}", ended.early);
    assert_eq!((ended.capture.samples.len(), ended.capture.missing()), (5_000, 0));
}

/// At a hundredth of real time a write, 24 ms of the board's time, takes longer than all four attempts of half a
/// second.
#[test]
fn time_outs_follow_the_boards_clock() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("clock");
    let board = start(&["--speed", "0.01", "--clock", file.to_str().unwrap()]);
    // The firmware does not listen yet; what it misses is asked again after half a second, which here is a long time.
    board.port.clock.pause(Duration::from_millis(20), &Context::quiet()).unwrap();
    let payload = crate::payload("VC-1400");
    let (_, block) = update::write(&board.port, &payload, &Context::quiet()).unwrap();
    assert_eq!(block.sequence, 1);
    let (connection, device) = Connection::open(&board.port, &Context::quiet()).unwrap();
    let capture = capture::record(&board.port, &device, connection, 100, &Context::quiet()).unwrap().capture;
    assert_eq!((capture.samples.len(), capture.lost().len(), capture.reconnections), (100, 0, 0));

    let impatient = Port { clock: Clock::System, ..board.port.clone() };
    let error = update::write(&impatient, &crate::payload("another"), &Context::quiet()).unwrap_err().to_string();
    assert!(error.starts_with("nobody answers on /dev/"), "{error}");
}

#[test]
fn an_image_that_is_none_is_refused_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.elf");
    std::fs::write(&path, "no ELF file").unwrap();
    for (image, words) in [(path.as_path(), "cannot be loaded"), (&folder.path().join("none"), "cargo fw")] {
        let output =
            Command::new(env!("CARGO_BIN_EXE_greyrig-board")).arg("--image").arg(image).output().expect("it runs");
        let talk = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), talk.lines().count()), (Some(2), 1), "{talk}");
        assert!(talk.contains(words), "{talk}");
    }
}
