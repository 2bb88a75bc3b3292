//! Pass and fail, on the right pins.

use greyrig::detector::Verdict;
use greyrig::link::message::Mode;
use greyrig_board::Board;
use greyrig_board::host::Host;
use greyrig_board::machine::Pace;
use greyrig_board::peripherals::flash::Contents;

use crate::image;
use crate::station::{rig, station};

/// Length of a test, s; a fault begins within it, after the motor has run up.
const TEST_S: f64 = 7.0;

/// Flashes a board, presses reset, lets the test run; gives the verdict and the pins for pass, alarm, status.
fn verdict(seed: u64, fault: Option<&str>) -> (Verdict, [bool; 3]) {
    let mut host = Host::default();
    let mut board = Board::new(image(), Contents::default(), rig("steady", TEST_S, seed, fault), Pace::ONE).unwrap();
    let status = host.flash(&mut board, &station().payload).unwrap();
    assert_eq!(status.mode, Mode::Running);
    // The motor has started with the processor.
    board.press_reset();
    board.run(TEST_S - 0.1).unwrap();
    let status = host.status(&mut board).unwrap();
    (status.verdict, ["PB10", "PB5", "PA5"].map(|pin| board.is_high(pin)))
}

#[test]
fn a_healthy_motor_passes() {
    assert_eq!(verdict(101, None), (Verdict::Pass, [true, false, false]));
}

#[test]
fn sparking_brushes_fail() {
    assert_eq!(verdict(102, Some("sparking=0.3@5")), (Verdict::Fail, [false, true, false]));
}
