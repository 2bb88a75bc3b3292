//! The board behind its pseudo-terminal, and the host's own side of the link: parameters, a recording, its verdict.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

use greyrig::app::bench::MOTOR;
use greyrig::parameters::block::MAX_PAYLOAD;
use greyrig::parameters::{Settings, section};
use greyrig_host::device::{Connection, capture, update};

/// The program; it ends with the test.
struct Program {
    child: Child,
    port: String,
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
    Program { child, port: told["port"].as_str().expect("a port").to_owned() }
}

#[test]
fn the_hosts_commands_work_on_it() {
    let board = start(&["--profile", "steady"]);
    let settings = Settings { motor_type: "VC-1400".try_into().unwrap(), motor: MOTOR, ..Settings::default() };
    let payload = section::encode(&settings, &mut [0; MAX_PAYLOAD]).unwrap().to_vec();
    let (device, block) = update::write(&board.port, &payload).unwrap();
    assert_eq!((device.board.as_str(), block.sequence), ("NUCLEO-G474RE", 1));

    let (connection, device) = Connection::open(&board.port).unwrap();
    let capture = capture::record(&board.port, &device, connection, 10_000).unwrap();
    assert_eq!((capture.samples.len(), capture.lost().len(), capture.reconnections), (10_000, 0, 0));
    // The amplitude rises from a tenth of nominal within 15 % of 10 s (rig/profiles.rs): the motor turns.
    let highest = capture.samples.iter().flatten().map(|counts| counts.speed).max();
    assert!(highest > Some(500), "{highest:?}");
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
