//! The firmware on an emulated Cortex-M4F, and the commands that talk to it as a user gives them.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use greyrig::app::bench::{Bench, MOTOR};
use greyrig::parameters::block::{HEADER, Header};
use greyrig::parameters::section;
use greyrig::units::CalibrationSettings;
use serde_json::Value;
use tempfile::TempDir;

use crate::{bad_input, image};

use crate::program::{greyrig, json};

/// What xtask/src/size.rs allows, bytes.
const MOST_STACK: u64 = 47_000;

/// Builds the firmware once and gives the path to it.
fn image() -> &'static Path {
    static IMAGE: OnceLock<PathBuf> = OnceLock::new();
    IMAGE.get_or_init(|| image::build(&["fw-qemu"]))
}

/// An emulated board; it ends with the test.
pub struct Board {
    emulator: Child,
    pub port: String,
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}

impl Board {
    fn emulator(serial: &str) -> Command {
        let mut command = Command::new("qemu-system-arm");
        command.args(["-M", "mps2-an386", "-nographic", "-monitor", "none", "-serial", serial]);
        // An instruction takes 8 ns of the board's time: as many a second as on a board at 125 MHz, if each took a
        // cycle.
        command.args(["-icount", "shift=3", "-kernel"]).arg(image());
        command.stdin(Stdio::null()).stdout(Stdio::null());
        command
    }

    /// Behind a TCP port.
    pub fn start() -> Self {
        let free = free_port();
        let emulator = Self::emulator(&format!("tcp:127.0.0.1:{free},server=on,wait=off"));
        let board = Self { emulator: spawn(emulator), port: format!("tcp:127.0.0.1:{free}") };
        connect(free);
        board
    }

    /// Behind a TCP port, with a line to what makes its motor go wrong.
    pub fn start_with_knob() -> (Self, TcpStream) {
        let (link, knob) = (free_port(), free_port());
        let mut emulator = Self::emulator(&format!("tcp:127.0.0.1:{link},server=on,wait=off"));
        emulator.args(["-serial", &format!("tcp:127.0.0.1:{knob},server=on,wait=off")]);
        let board = Self { emulator: spawn(emulator), port: format!("tcp:127.0.0.1:{link}") };
        connect(link);
        (board, connect(knob))
    }

    /// Behind a pseudo-terminal, as a serial port.
    #[cfg(unix)]
    fn start_on_terminal() -> Self {
        let mut command = Self::emulator("pty");
        let mut emulator = spawn_from(command.stdout(Stdio::piped()));
        let mut lines = BufReader::new(emulator.stdout.take().expect("a pipe")).lines();
        let port = lines.find_map(|line| {
            let line = line.expect("UTF-8");
            Some(line.split_once("redirected to ")?.1.split(' ').next()?.to_owned())
        });
        Self { emulator, port: port.expect("the emulator says which terminal") }
    }
}

fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a free port").port()
}

fn connect(port: u16) -> TcpStream {
    let deadline = Instant::now() + Duration::from_secs(20);
    loop {
        if let Ok(stream) = TcpStream::connect(("127.0.0.1", port)) {
            return stream;
        }
        assert!(Instant::now() < deadline, "the emulator does not listen");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn spawn(mut command: Command) -> Child {
    spawn_from(&mut command)
}

fn spawn_from(command: &mut Command) -> Child {
    command.spawn().expect("needs qemu-system-arm (on Debian: apt-get install qemu-system-arm)")
}

fn refused(folder: &Path, arguments: &[&str], words: &[&str]) {
    bad_input::refused(&greyrig(folder, arguments), words);
}

/// A folder with a model in it.
pub fn folder(resistance: f64) -> TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let values = [
        ("R", resistance, "ohm"),
        ("L", 0.02, "H"),
        ("K", 9.45e-3, "V s/(rad A)"),
        ("J", 1.8e-4, "kg m2"),
        ("mu0", 0.015, "N m"),
        ("mu1", 8e-6, "N m s/rad"),
        ("mu2", 2.98e-8, "N m s2/rad2"),
    ];
    let mut text = "schema = 1\nkind = \"universal\"\nbase = \"full\"\nmotor = \"VC-1400\"\n".to_owned();
    for (name, value, unit) in values {
        text += &format!("[parameters.{name}]\nvalue = {value:?}\nunit = {unit:?}\n");
    }
    text += "[[effects]]\nid = \"brush_drop\"\n[effects.parameters.brush_drop]\nvalue = 2.5\nunit = \"V\"\n\
             [effects.parameters.brush_transition]\nvalue = 0.3\nunit = \"A\"\n";
    std::fs::write(folder.path().join("model.toml"), text).expect("it is written");
    folder
}

/// A recording's columns by name.
fn columns(path: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = std::fs::read_to_string(path).expect("the recording is there");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names: Vec<String> = lines.next().expect("a header").split(',').map(str::to_owned).collect();
    let mut columns = vec![Vec::new(); names.len()];
    for line in lines {
        line.split(',').zip(&mut columns).for_each(|(cell, column)| column.push(cell.parse().expect("a number")));
    }
    (names, columns)
}

/// What the board samples from its start on, in SI units.
fn truth(count: usize) -> Vec<[f64; 3]> {
    let calibration = CalibrationSettings::default().build().unwrap();
    let mut bench = Bench::new().unwrap();
    (0..count)
        .map(|_| {
            let sample = calibration.sample(bench.counts());
            [sample.voltage.0, sample.current.0, sample.speed.0].map(f64::from)
        })
        .collect()
}

/// Every sample that is marked valid is the one that the board has sampled.
fn assert_recorded(path: &Path, first: usize) -> usize {
    let (names, columns) = columns(path);
    assert_eq!(names[..4], ["t_s", "u_v", "i_a", "omega_rad_s"]);
    let truth = truth(first + columns[0].len());
    let mut wrong = 0;
    for (n, truth) in truth[first..].iter().enumerate() {
        if names.get(4).is_none_or(|name| name != "valid" || columns[4][n] == 1.0) {
            assert_eq!([columns[1][n], columns[2][n], columns[3][n]], *truth, "sample {n}");
        } else {
            wrong += 1;
        }
    }
    wrong
}

#[test]
fn parameters_are_flashed_and_survive_and_a_recording_is_complete() {
    let (folder, board) = (folder(2.2), Board::start());
    let here = folder.path();
    let port = board.port.as_str();

    let planned = json(here, &["flash", "--model", "model.toml", "--port", port, "--dry-run"]);
    assert_eq!((&planned["already_there"], &planned["verified"]), (&false.into(), &false.into()));
    assert_eq!(planned["device"]["board"], "mps2-an386 (QEMU)");
    let first = json(here, &["flash", "--model", "model.toml", "--port", port, "--rig", "rig 1"]);
    assert_eq!((&first["slot"], &first["sequence"], &first["verified"]), (&0.into(), &1.into(), &true.into()));
    let planned = json(here, &["flash", "--model", "model.toml", "--port", port, "--dry-run", "--rig", "rig 1"]);
    assert_eq!(planned["already_there"], true, "it has survived the restart");

    let text = std::fs::read_to_string(here.join("model.toml")).unwrap();
    std::fs::write(here.join("model.toml"), text.replace("value = 2.2", "value = 2.3")).unwrap();
    let second = json(here, &["flash", "--model", "model.toml", "--port", port, "--rig", "rig 1"]);
    assert_eq!((&second["slot"], &second["sequence"]), (&1.into(), &2.into()));
    assert_ne!(first["crc32"], second["crc32"]);

    let told = json(here, &["record", "--port", port, "--seconds", "1.5", "--out", "run.csv"]);
    assert_eq!((&told["samples"], &told["lost"]), (&15_000.into(), &0.into()));
    // What the stack really took is less than the bound that `cargo xtask size` finds, and than what it allows.
    let deepest = told["status"]["deepest_stack"].as_u64().unwrap();
    assert!((4_000..MOST_STACK).contains(&deepest), "{deepest}");
    let first_sample = told["first_sample"].as_u64().unwrap() as usize;
    assert_eq!(assert_recorded(&here.join("run.csv"), first_sample), 0);
    let text = std::fs::read_to_string(here.join("run.csv")).unwrap();
    assert!(text.contains("# motor: VC-1400") && text.contains("# rig: rig 1"), "{}", &text[..300]);
    // What was recorded is a recording like any other.
    let compared = json(here, &["compare", "run.csv", "--model", "model.toml"]);
    assert!(compared["esr"]["current"].as_f64().unwrap() < 0.2);
}

#[test]
fn garbage_on_the_link_does_no_harm() {
    let (folder, board) = (folder(2.2), Board::start());
    let address = board.port.strip_prefix("tcp:").unwrap();
    let mut noise = 1_u32;
    // The emulated port takes about a byte per sample, so these last half a second.
    let garbage: Vec<u8> = (0..5_000)
        .map(|_| {
            noise ^= noise << 13;
            noise ^= noise >> 17;
            noise ^= noise << 5;
            (noise >> 8) as u8
        })
        .collect();
    {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(&garbage).unwrap();
        stream.flush().unwrap();
        std::thread::sleep(Duration::from_millis(200));
    }
    let told = json(folder.path(), &["flash", "--model", "model.toml", "--port", &board.port]);
    assert_eq!(told["verified"], true);
    {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(&garbage).unwrap();
        std::thread::sleep(Duration::from_millis(200));
    }
    let output = greyrig(folder.path(), &["record", "--port", &board.port, "--seconds", "0.1", "--out", "run.csv"]);
    assert!(output.status.success());
    let talk = String::from_utf8(output.stderr).unwrap();
    assert!(talk.contains("fault 30") && talk.contains("were no frame"), "{talk}");
}

/// A line that breaks: the recording goes on, and what went by is marked.
#[test]
fn a_recording_survives_a_broken_link() {
    let (folder, board) = (folder(2.2), Board::start());
    let port = breaking(&board, 20_000, || true);
    let told = json(folder.path(), &["record", "--port", &port, "--seconds", "3", "--out", "run.csv"]);
    assert_eq!((&told["samples"], &told["reconnections"]), (&30_000.into(), &1.into()));
    let lost = told["lost"].as_u64().unwrap() as usize;
    let places = told["lost_places"].as_array().unwrap();
    assert!(lost > 0 && places.len() == 1, "{told}");
    let first_sample = told["first_sample"].as_u64().unwrap() as usize;
    assert_eq!(assert_recorded(&folder.path().join("run.csv"), first_sample), lost);
}

#[cfg(unix)]
#[test]
fn a_serial_port_will_do() {
    let (folder, board) = (folder(2.2), Board::start_on_terminal());
    let told = json(folder.path(), &["flash", "--model", "model.toml", "--port", &board.port]);
    assert_eq!(told["verified"], true);
    let told = json(folder.path(), &["record", "--port", &board.port, "--seconds", "0.5", "--out", "run.csv"]);
    assert_eq!(told["samples"], 5_000);
    let (first, lost) = (told["first_sample"].as_u64().unwrap() as usize, told["lost"].as_u64().unwrap() as usize);
    assert_eq!(assert_recorded(&folder.path().join("run.csv"), first), lost);
}

/// A recording under way, of 500 s.
#[cfg(unix)]
fn begin_recording(folder: &Path, port: &str) -> Child {
    let recording = Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .env("COLUMNS", crate::program::WIDE)
        .current_dir(folder)
        .args(["record", "--port", port, "--seconds", "500", "--out", "run.csv"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    recording
}

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_what_was_recorded() {
    let (folder, board) = (folder(2.2), Board::start());
    let here = folder.path();
    for name in ["run.incomplete.csv", "run.incomplete-2.csv"] {
        let recording = begin_recording(here, &board.port);
        Command::new("kill").args(["-INT", &recording.id().to_string()]).status().unwrap();
        let output = recording.wait_with_output().unwrap();
        let talk = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(130), "{talk}");
        let last = talk.lines().last().unwrap();
        assert!(last.contains("s of 500 s were recorded, then interrupted") && last.contains(name), "{talk}");
        let text = std::fs::read_to_string(here.join(name)).unwrap();
        assert!(text.contains("# incomplete: ") && text.contains("then interrupted"), "{}", &text[..300]);
        let first = text.lines().find_map(|line| line.strip_prefix("# first sample: ")).unwrap().parse().unwrap();
        assert_eq!(assert_recorded(&here.join(name), first), 0);
        assert!(!here.join("run.csv").exists(), "what is incomplete has not the name of what was asked for");
    }
    let told = json(here, &["flash", "--model", "model.toml", "--port", &board.port]);
    assert_eq!(told["verified"], true);
}

/// What a killed program has left running, and what of it is still on the line, is not in the next recording.
#[cfg(unix)]
#[test]
fn a_recording_after_one_that_was_killed_is_whole() {
    for board in [Board::start(), Board::start_on_terminal()] {
        let folder = folder(2.2);
        let here = folder.path();
        let mut killed = begin_recording(here, &board.port);
        killed.kill().unwrap();
        killed.wait().unwrap();
        assert_eq!(std::fs::read_dir(here).unwrap().count(), 1, "only the model is there");
        std::thread::sleep(Duration::from_millis(500));
        let told = json(here, &["record", "--port", &board.port, "--seconds", "0.5", "--out", "run.csv"]);
        assert_eq!((&told["samples"], &told["lost"], &told["complete"]), (&5_000.into(), &0.into(), &true.into()));
        assert_eq!(assert_recorded(&here.join("run.csv"), told["first_sample"].as_u64().unwrap() as usize), 0);
    }
}

/// Between host and board; the first connection ends after so many bytes, and then `then` is done before the next.
fn breaking(board: &Board, after: usize, then: impl Fn() -> bool + Send + 'static) -> String {
    let address = board.port.strip_prefix("tcp:").unwrap().to_owned();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let mut first = true;
        while let Ok((mut host, _)) = listener.accept() {
            let mut board = TcpStream::connect(&address).unwrap();
            let (mut to_board, mut from_host) = (board.try_clone().unwrap(), host.try_clone().unwrap());
            std::thread::spawn(move || std::io::copy(&mut from_host, &mut to_board));
            let mut left = if first { after } else { usize::MAX };
            let mut bytes = [0; 1024];
            while left > 0 {
                let count = board.read(&mut bytes).unwrap_or(0).min(left);
                if count == 0 || host.write_all(&bytes[..count]).is_err() {
                    break;
                }
                left -= count;
            }
            let _ = host.shutdown(std::net::Shutdown::Both);
            let _ = board.shutdown(std::net::Shutdown::Both);
            if first && !then() {
                return;
            }
            first = false;
        }
    });
    port
}

#[test]
fn a_link_that_is_lost_leaves_what_was_recorded() {
    let (folder, board) = (folder(2.2), Board::start());
    let port = breaking(&board, 20_000, || false);
    let output = greyrig(folder.path(), &["record", "--port", &port, "--seconds", "60", "--out", "run.csv", "--json"]);
    let talk = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{talk}");
    let last = talk.lines().last().unwrap();
    assert!(last.contains("then the link was lost") && last.contains("run.incomplete.csv"), "{talk}");
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&told["complete"], &told["out"]), (&false.into(), &"run.incomplete.csv".into()));
    // 4.5 bytes a sample, and some for the frame: 20 kB are some four thousand.
    assert!((3_000..4_500).contains(&told["samples"].as_u64().unwrap()), "{told}");
    let first = told["first_sample"].as_u64().unwrap() as usize;
    assert_eq!(assert_recorded(&folder.path().join("run.incomplete.csv"), first), 0);
}

#[test]
fn a_recording_with_much_lost_is_no_success() {
    let (folder, board) = (folder(2.2), Board::start());
    let port = breaking(&board, 20_000, || {
        // Longer than the rest of the recording, however slow the emulator is.
        std::thread::sleep(Duration::from_secs(5));
        true
    });
    let output = greyrig(folder.path(), &["record", "--port", &port, "--seconds", "1", "--out", "run.csv", "--json"]);
    let talk = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{talk}");
    assert!(talk.lines().last().unwrap().contains("% of the samples were lost on the way"), "{talk}");
    let told: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&told["samples"], &told["out"]), (&10_000.into(), &"run.incomplete.csv".into()));
    assert!(told["lost"].as_u64().unwrap() > 2_000, "{told}");
    assert!(!folder.path().join("run.csv").exists());
}

/// Calibration and name are the rig's: another model leaves them as they are.
#[test]
fn a_rig_keeps_its_calibration() {
    let (folder, board) = (folder(2.2), Board::start());
    let (here, port) = (folder.path(), board.port.as_str());
    let rig = "[voltage]\nzero = 2000.0\nper_count = 0.25\n[current]\nzero = 2100.0\nper_count = 0.03\n\
               [speed]\nzero = 10.0\nper_count = 1.5\n";
    std::fs::write(here.join("rig.toml"), rig).unwrap();
    let flash = ["flash", "--model", "model.toml", "--port", port];
    let told = json(here, &flash);
    assert_eq!((&told["calibration"], &told["rig"]), (&"usual".into(), &"".into()));
    let told = json(here, &[&flash[..], &["--calibration", "rig.toml", "--rig", "rig 3"]].concat());
    assert_eq!(told["calibration"], "given");
    let given = told["crc32"].clone();
    for more in [&[][..], &["--dry-run"], &["--rig", "rig 3"]] {
        let told = json(here, &[&flash[..], more].concat());
        assert_eq!((&told["calibration"], &told["rig"], &told["crc32"]), (&"kept".into(), &"rig 3".into(), &given));
    }
    let told = json(here, &["rig", "--port", port]);
    assert_eq!(told["calibration"][0]["per_count"], 0.25);
    // The motor's block tells who has written it, and to which image; so does a recording.
    let build = told["device"]["build"].as_str().unwrap().to_owned();
    assert_eq!(told["origin"]["build"], build.as_str(), "{told}");
    assert!(build.len() == 16 && build != "0000000000000000", "{build}");
    // A recording is in its units.
    json(here, &["record", "--port", port, "--seconds", "0.01", "--out", "run.csv"]);
    let text = std::fs::read_to_string(here.join("run.csv")).unwrap();
    assert!(text.contains(&format!("# firmware build: {build}")), "{}", &text[..400]);
    let (_, columns) = columns(&here.join("run.csv"));
    let counts = |value: f64| value / 0.25 + 2000.0;
    assert!(columns[1].iter().all(|&u| (counts(u) - counts(u).round()).abs() < 1e-3 && u.abs() < 0.25 * 4096.0));
    // An image without a calibration leaves the rig's slots alone; one with it has them before the motor's.
    let image = ["flash", "--model", "model.toml", "--image"];
    let told = json(here, &[&image[..], &["p.bin"]].concat());
    assert_eq!((&told["calibration"], &told["address"]), (&"untouched".into(), &0x0807_F000_u32.into()));
    assert_eq!(std::fs::read(here.join("p.bin")).unwrap().len(), 4096);
    let told = json(here, &[&image[..], &["r.bin", "--calibration", "rig.toml", "--rig", "rig 9"]].concat());
    assert_eq!((&told["calibration"], &told["address"]), (&"given".into(), &0x0807_E000_u32.into()));
    let bytes = std::fs::read(here.join("r.bin")).unwrap();
    let header = Header::from_bytes(bytes[..HEADER].try_into().unwrap()).unwrap();
    let payload = &bytes[HEADER..HEADER + usize::from(header.length)];
    assert_eq!(header.check(payload), Ok(()));
    let rig = greyrig::parameters::Rig::decode(payload).unwrap();
    assert_eq!((rig.name.as_str(), rig.calibration.speed.per_count), ("rig 9", 1.5));
    assert_eq!(bytes[4096..], std::fs::read(here.join("p.bin")).unwrap());
    refused(here, &[&image[..], &["q.bin", "--rig", "rig 9"]].concat(), &["--calibration"]);
}

#[test]
fn nobody_there_is_trouble_with_the_link() {
    let folder = folder(2.2);
    let nobody = TcpListener::bind("127.0.0.1:0").unwrap();
    let silent = format!("tcp:{}", nobody.local_addr().unwrap());
    let flash = ["flash", "--model", "model.toml", "--port"];
    let record = ["record", "--seconds", "1", "--out", "run.csv", "--port"];
    for (port, says) in [
        (silent.as_str(), "nobody answers"),
        ("/dev/no-such-port", "cannot be opened"),
        ("tcp:127.0.0.1:1", "cannot be opened"),
    ] {
        for command in [&flash[..], &record[..]] {
            let output = greyrig(folder.path(), &[command, &[port]].concat());
            let talk = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(3), "{talk}");
            let line = talk.lines().last().unwrap();
            assert!(line.contains(says) && line.contains("; check"), "{line}");
        }
    }
}

/// A board that is named is asked, and tells whose it is; one that is not there is told beside it.
#[test]
fn ports_are_listed_with_the_boards_that_answer() {
    let (folder, board) = (folder(2.2), Board::start());
    let here = folder.path();
    let port = board.port.as_str();
    let listed = |more: &[&str]| {
        let output = greyrig(here, &[&["ports", "--json", "--port", port], more].concat());
        let told: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let of = |name: &str| told["ports"].as_array().unwrap().iter().find(|p| p["port"] == name).unwrap().clone();
        (output.status.code(), of(port), more.last().map(|name| of(name)))
    };
    let (code, found, _) = listed(&[]);
    assert_eq!((code, &found["asked"], &found["rig"]), (Some(0), &true.into(), &Value::Null));
    assert_eq!((&found["device"]["board"], &found["error"]), (&"mps2-an386 (QEMU)".into(), &Value::Null));

    json(here, &["flash", "--model", "model.toml", "--port", port, "--rig", "rig 1"]);
    let (code, found, other) = listed(&["--port", "/dev/no-such-port"]);
    assert_eq!((code, &found["rig"], &found["motor"]), (Some(3), &"rig 1".into(), &"VC-1400".into()));
    let error = &other.unwrap()["error"];
    assert!(error["what"].as_str().unwrap().contains("cannot be opened") && error["remedy"] != "", "{error}");

    let output = greyrig(here, &["ports", "--port", port]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success() && text.contains("rig 1") && text.contains("VC-1400"), "{text}");
}

#[test]
fn what_belongs_to_a_rig_is_shown_and_written_beside_the_motor() {
    let (folder, board) = (folder(2.2), Board::start());
    let here = folder.path();
    fn rig<'a>(board: &'a Board, more: &[&'a str]) -> Vec<&'a str> {
        [&["rig", "--port", board.port.as_str()], more].concat()
    }
    std::fs::write(
        here.join("rig.toml"),
        "[voltage]\nzero = 2000\nper_count = 0.25\n[current]\nzero = 2048\nper_count = 0.0125\n[speed]\nzero = 0\nper_count = 1.5\n",
    )
    .unwrap();
    // A rig has a name before it has a motor.
    let told = json(here, &rig(&board, &["--name", "rig 0"]));
    assert_eq!((&told["rig"], &told["motor"], &told["mode"]), (&"rig 0".into(), &Value::Null, &"safe mode".into()));
    refused(here, &rig(&board, &["--name", &"r".repeat(33)]), &["longer than 32 bytes"]);

    json(here, &["flash", "--model", "model.toml", "--port", &board.port, "--rig", "rig 1"]);
    let told = json(here, &rig(&board, &[]));
    assert_eq!((&told["rig"], &told["motor"], &told["written"]), (&"rig 1".into(), &"VC-1400".into(), &false.into()));
    let told = json(here, &rig(&board, &["--name", "rig 7", "--calibration", "rig.toml"]));
    assert_eq!((&told["rig"], &told["motor"], &told["mode"]), (&"rig 7".into(), &"VC-1400".into(), &"running".into()));
    let voltage = &told["calibration"][0];
    assert_eq!((&voltage["zero"], &voltage["per_count"]), (&2000.0.into(), &0.25.into()), "{told}");
    // The motor's parameters are as they were: those of the model.
    let same = ["flash", "--model", "model.toml", "--port", &board.port, "--dry-run"];
    assert_eq!(json(here, &same)["already_there"], true);
    let text = String::from_utf8(greyrig(here, &rig(&board, &["--clear-faults"])).stdout).unwrap();
    assert!(text.contains("rig 7") && text.contains("(counts − 2000) · 0.25 V"), "{text}");
}

/// Without a named port nothing but a probe is asked, and that there is none is no trouble.
#[test]
fn a_machine_without_boards_is_no_trouble() {
    let output = greyrig(Path::new("."), &["ports"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(!output.stdout.is_empty());
}

/// A virtual board that has stopped: nobody waits for ever.
#[test]
fn a_clock_that_stands_still_is_told() {
    let folder = folder(2.2);
    let nobody = TcpListener::bind("127.0.0.1:0").unwrap();
    let silent = format!("tcp:{}", nobody.local_addr().unwrap());
    let record = ["record", "--seconds", "1", "--out", "run.csv", "--port", &silent, "--clock", "clock"];
    for (content, says) in [
        (None, "clock: No such file"),
        (Some("noon"), "no number of microseconds"),
        (Some("5\n"), "stood still for 10 s"),
    ] {
        if let Some(content) = content {
            std::fs::write(folder.path().join("clock"), content).unwrap();
        }
        let output = greyrig(folder.path(), &record);
        let talk = String::from_utf8(output.stderr).unwrap();
        assert_eq!((output.status.code(), talk.lines().count()), (Some(3), 1), "{talk}");
        assert!(talk.contains(says) && talk.contains("; check"), "{talk}");
    }
}

#[test]
fn images_hold_the_block() {
    let folder = folder(2.2);
    let here = folder.path();
    let flash = |image: &'static str| ["flash", "--model", "model.toml", "--image", image];
    let told = json(here, &[&flash("p.bin")[..], &["--dry-run"]].concat());
    assert!(told["dry_run"] == true && !here.join("p.bin").exists());
    json(here, &flash("p.bin"));
    let bytes = std::fs::read(here.join("p.bin")).unwrap();
    assert_eq!(bytes.len(), 2 * 2048, "the last two pages of bank 2");
    let header = Header::from_bytes(bytes[..HEADER].try_into().unwrap()).expect("a header");
    let payload = &bytes[HEADER..HEADER + usize::from(header.length)];
    assert_eq!(header.check(payload), Ok(()));
    let settings = section::decode(payload).expect("parameters");
    assert_eq!((settings.motor, settings.motor_type.as_str()), (MOTOR, "VC-1400"));
    assert!(bytes[HEADER + payload.len()..].iter().all(|&byte| byte == 0xFF));

    json(here, &flash("p.hex"));
    let text = std::fs::read_to_string(here.join("p.hex")).unwrap();
    let mut from_hex: Vec<u8> = Vec::new();
    let mut base = 0;
    // Intel HEX by hand: `:` length address type data checksum.
    for line in text.lines() {
        let record: Vec<u8> =
            (1..line.len()).step_by(2).map(|n| u8::from_str_radix(&line[n..n + 2], 16).unwrap()).collect();
        assert_eq!(record.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte)), 0, "checksum of {line}");
        let offset = u32::from(u16::from_be_bytes([record[1], record[2]]));
        let data = &record[4..record.len() - 1];
        match record[3] {
            4 => base = u32::from(u16::from_be_bytes([data[0], data[1]])) << 16,
            0 => {
                assert_eq!(base + offset, 0x0807_F000 + from_hex.len() as u32);
                from_hex.extend(data);
            }
            1 => {}
            other => panic!("record type {other}"),
        }
    }
    assert_eq!(from_hex, bytes);

    refused(here, &flash("p.bin"), &["p.bin exists already", "--force"]);
    refused(here, &flash("p.elf"), &["p.elf: images are .bin or .hex"]);
}

#[test]
fn what_the_microcontroller_would_refuse_is_refused_before() {
    let folder = folder(2.2);
    let here = folder.path();
    let model = std::fs::read_to_string(here.join("model.toml")).unwrap();
    let image = ["flash", "--model", "bad.toml", "--image", "p.bin"];
    let bad = |text: String| std::fs::write(here.join("bad.toml"), text).unwrap();
    bad(model.replace("VC-1400", &"m".repeat(33)));
    refused(here, &image, &["bad.toml", "longer than 32 bytes"]);
    bad(format!("{model}\n[filter]\norder = 4\ncutoff_hz = 6000.0\n"));
    refused(here, &image, &["bad.toml", "cutoff_hz"]);
    bad(model.replace("value = 0.00018", "value = 1e-9"));
    refused(here, &image, &["bad.toml", "J is too small"]);
    bad(model);
    let rig = |text: &str| std::fs::write(here.join("rig.toml"), text).unwrap();
    let with_rig = [&image[..], &["--calibration", "rig.toml"]].concat();
    rig("[voltage]\nzero = 2047.5\n");
    refused(here, &with_rig, &["rig.toml:1", "per_count"]);
    rig("[voltage]\nzero = 1\nper_count = 0\n[current]\nzero = 1\nper_count = 1\n[speed]\nzero = 1\nper_count = 1\n");
    refused(here, &with_rig, &["rig.toml", "voltage"]);
    refused(here, &["flash", "--model", "bad.toml"], &["--port"]);
    refused(here, &[&image[..], &["--clock", "clock"]].concat(), &["--image", "--clock"]);
    refused(here, &["record", "--port", "x", "--seconds", "0", "--out", "r.csv"], &["--seconds"]);
}

/// The place in the flash is in the chip's memory map, as the probe's own tables have it.
#[cfg(feature = "probe")]
#[test]
fn a_probe_would_write_to_the_right_place() {
    let folder = folder(2.2);
    let told = json(folder.path(), &["flash", "--model", "model.toml", "--probe", "--dry-run"]);
    assert_eq!(told["chip"], "STM32G474RETx");
    let unknown = ["flash", "--model", "model.toml", "--dry-run", "--probe", "no-such-chip"];
    let output = greyrig(folder.path(), &unknown);
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stderr));
}
