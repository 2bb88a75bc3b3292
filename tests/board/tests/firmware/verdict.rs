//! Pass and fail, on the right pins.

use greyrig::detector::Verdict;
use greyrig::link::message::Mode;
use greyrig_board::Board;
use greyrig_board::analog::Counts;
use greyrig_board::host::Host;
use greyrig_board::machine::Pace;
use greyrig_board::peripherals::flash::Contents;

use crate::image;
use crate::station::{rig, station};

/// Length of a test, s; a fault begins within it, after the motor has run up.
const TEST_S: f64 = 7.0;

/// What a pin does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Pin {
    Low,
    High,
    Pulses,
}

/// Watches the pins for pass, alarm, status, for a fifth of a second: two pulses.
fn pins(board: &mut Board) -> [Pin; 3] {
    let seen: Vec<[bool; 3]> = (0..200)
        .map(|_| {
            board.run(1e-3).unwrap();
            ["PB10", "PB5", "PA5"].map(|pin| board.is_high(pin))
        })
        .collect();
    std::array::from_fn(|n| {
        let edges = seen.windows(2).filter(|pair| pair[0][n] != pair[1][n]).count();
        match edges {
            0 if seen[0][n] => Pin::High,
            0 => Pin::Low,
            // Ten a second (docs/wiring.md).
            3..=5 => Pin::Pulses,
            _ => panic!("pin {n}: {edges} edges"),
        }
    })
}

/// Flashes a board, presses reset, lets the test run.
fn tested(seed: u64, fault: Option<&str>) -> (Board, Host) {
    let mut host = Host::default();
    let mut board = Board::new(image(), Contents::default(), rig("steady", TEST_S, seed, fault), Pace::ONE).unwrap();
    let status = host.flash(&mut board, &station().payload).unwrap();
    assert_eq!(status.mode, Mode::Running);
    // The motor has started with the processor.
    board.press_reset();
    board.run(TEST_S - 0.5).unwrap();
    (board, host)
}

fn verdict(seed: u64, fault: Option<&str>) -> (Verdict, [Pin; 3]) {
    let (mut board, mut host) = tested(seed, fault);
    let pins = pins(&mut board);
    (host.status(&mut board).unwrap().verdict, pins)
}

#[test]
fn a_healthy_motor_passes() {
    assert_eq!(verdict(101, None), (Verdict::Pass, [Pin::Pulses, Pin::Low, Pin::Low]));
}

#[test]
fn sparking_brushes_fail() {
    assert_eq!(verdict(102, Some("sparking=0.3@5")), (Verdict::Fail, [Pin::Low, Pin::High, Pin::Low]));
}

/// A pass does not stand on a chain that cannot be right, nor on a program that hangs.
#[test]
fn a_pass_ends_with_the_chain_and_with_the_program() {
    let (mut board, mut host) = tested(101, None);
    let passed = board.moment().unwrap();
    assert_eq!(pins(&mut board)[0], Pin::Pulses);
    // The wire of the current comes off: its amplifier goes to its end.
    board.connect(Box::new(Counts::new(std::iter::repeat([2048, 4095, 1000]))));
    board.run(0.01).unwrap();
    assert_eq!(pins(&mut board), [Pin::Low, Pin::Low, Pin::High]);
    let status = host.status(&mut board).unwrap();
    assert_eq!((status.verdict, status.plausible), (Verdict::CannotJudge, false));
    // Without a sample the thread runs on, and the pass stands still: within the half second until the watchdog bites.
    board.go_back(&passed).unwrap();
    board.machine_mut().trigger_cut = true;
    board.run(0.01).unwrap();
    assert!(matches!(pins(&mut board)[0], Pin::Low | Pin::High));
    // After its bite nothing is left of the pass.
    board.run(0.4).unwrap();
    board.machine_mut().trigger_cut = false;
    board.run(0.05).unwrap();
    assert_eq!(pins(&mut board), [Pin::Low, Pin::Low, Pin::High]);
}
