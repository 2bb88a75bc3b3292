//! The firmware of the NUCLEO-G474RE, as it is flashed, on the virtual board.

mod bits;
mod boot;
mod power_cut;
mod sampling;
mod station;
mod trouble;
mod verdict;

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::OnceLock;

use greyrig::app::bench::{Bench, MOTOR};
use greyrig::faults::{Fault, TABLE};
use greyrig::link::message::Status;
use greyrig::parameters::block::MAX_PAYLOAD;
use greyrig::parameters::{Settings, section};
use greyrig_board::analog::{Analog, Counts};
use greyrig_board::machine::Pace;
use greyrig_board::peripherals::flash::Contents;
use greyrig_board::{Board, Image};

/// The image: that which GREYRIG_IMAGE names, or the one that `cargo fw` builds.
fn image() -> &'static Image {
    static IMAGE: OnceLock<Image> = OnceLock::new();
    IMAGE.get_or_init(|| {
        let path = std::env::var_os("GREYRIG_IMAGE").map_or_else(build, PathBuf::from);
        Image::parse(&std::fs::read(path).expect("the image is there")).expect("an image")
    })
}

fn build() -> PathBuf {
    let output = Command::new(env!("CARGO"))
        .args(["fw", "--message-format", "json-render-diagnostics"])
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .stderr(Stdio::inherit())
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "needs the target: rustup target add thumbv7em-none-eabihf");
    let messages = String::from_utf8(output.stdout).expect("cargo writes UTF-8");
    let (_, rest) = messages.split_once("\"executable\":\"").expect("cargo names the executable");
    rest.split('"').next().expect("a string ends").into()
}

/// The core's own motor at the pins.
fn bench() -> Box<dyn Analog> {
    let mut bench = Bench::new().expect("a motor");
    Box::new(Counts::new(std::iter::repeat_with(move || {
        let counts = bench.counts();
        [counts.voltage, counts.current, counts.speed]
    })))
}

/// A board with erased parameters, a cycle per instruction, and a motor at its pins.
fn board() -> Board {
    Board::new(image(), Contents::default(), bench(), Pace::ONE).expect("the image fits")
}

/// Parameters of the core's own motor; the name tells them apart.
fn payload(motor_type: &str) -> Vec<u8> {
    let settings =
        Settings { motor_type: motor_type.try_into().expect("a short name"), motor: MOTOR, ..Settings::default() };
    section::encode(&settings, &mut [0; MAX_PAYLOAD]).expect("it fits").to_vec()
}

/// How often a fault was counted.
fn count(status: &Status, fault: Fault) -> u32 {
    TABLE.iter().zip(status.faults).find(|(described, _)| described.fault == fault).map_or(0, |(_, count)| count)
}

/// Numbers by Marsaglia's xorshift, from a seed that is not zero.
fn chance(mut state: u64) -> impl FnMut() -> u32 {
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 32) as u32
    }
}
