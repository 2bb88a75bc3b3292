//! The firmware of the NUCLEO-G474RE, as it is flashed, on the virtual board.

mod bits;
mod boot;
mod ends;
#[path = "../../../image.rs"]
mod image;
mod power_cut;
mod run;
mod sampling;
mod station;
mod terminal;
mod trouble;
mod verdict;

use std::path::{Path, PathBuf};
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
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The image's file: that which GREYRIG_IMAGE names, or the one that `cargo fw` builds.
fn file() -> &'static Path {
    static FILE: OnceLock<PathBuf> = OnceLock::new();
    FILE.get_or_init(|| std::env::var_os("GREYRIG_IMAGE").map_or_else(|| image::build(&["fw"]), PathBuf::from))
}

/// The image.
fn image() -> &'static Image {
    static IMAGE: OnceLock<Image> = OnceLock::new();
    IMAGE.get_or_init(|| Image::parse(&std::fs::read(file()).expect("the image is there")).expect("an image"))
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

/// Numbers by chance, the same ones for a seed.
fn chance(seed: u64) -> impl FnMut() -> u32 {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    move || random.next_u32()
}
