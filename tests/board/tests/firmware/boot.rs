//! The start, and what is told over the line.

use greyrig::faults::Fault;
use greyrig::link::BAUD;
use greyrig::link::message::{Mode, Reply, Request};
use greyrig_board::host::Host;

use crate::{board, count, payload};

#[test]
fn without_parameters_it_starts_into_safe_mode() {
    let (mut board, mut host) = (board(), Host::default());
    let status = host.status(&mut board).unwrap();
    assert_eq!((status.mode, status.in_force), (Mode::Safe, None));
    assert_eq!(count(&status, Fault::NotConfigured), 1);
    // Neither pass nor alarm; the light is on (docs/firmware.md).
    assert_eq!(["PB10", "PB5", "PA5"].map(|pin| board.is_high(pin)), [false, false, true]);
    let name = host.ask(&mut board, Request::Hello, |reply| match reply {
        Reply::Identity(identity) => Some((identity.board.to_owned(), identity.sample_rate_hz)),
        _ => None,
    });
    assert_eq!(name.unwrap(), ("NUCLEO-G474RE".to_owned(), 10_000));
}

/// A receiver samples in the middle of each bit: half a bit in ten is 5 %, of which a partner may take half.
#[test]
fn the_line_has_its_rate() {
    let mut board = board();
    board.run(0.01).unwrap();
    let machine = board.machine();
    let rate = machine.usart2.baud(machine.rcc.hclk_hz()).unwrap();
    assert!((f64::from(rate) / f64::from(BAUD) - 1.0).abs() < 0.025, "{rate}");
}

#[test]
fn it_runs_with_the_parameters_that_were_flashed() {
    let (mut board, mut host) = (board(), Host::default());
    let status = host.flash(&mut board, &payload("one")).unwrap();
    let block = status.in_force.unwrap();
    assert_eq!((status.mode, block.slot, block.sequence), (Mode::Running, 0, 1));
    let status = host.flash(&mut board, &payload("two")).unwrap();
    let block = status.in_force.unwrap();
    assert_eq!((status.mode, block.slot, block.sequence), (Mode::Running, 1, 2));
    let read = host.ask(&mut board, Request::ReadParameters { offset: 0 }, |reply| match reply {
        Reply::Parameters(bytes) => Some(bytes.to_vec()),
        _ => None,
    });
    assert!(payload("two").starts_with(&read.unwrap()));
    // The button changes nothing about it.
    board.press_reset();
    board.run(0.05).unwrap();
    assert_eq!(host.status(&mut board).unwrap().in_force, Some(block));
}
