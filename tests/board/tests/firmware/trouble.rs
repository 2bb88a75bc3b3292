//! What may go wrong around the board.

use greyrig::app::bench::Bench;
use greyrig::faults::Fault;
use greyrig::link::message::{Mode, Request};
use greyrig_board::analog::Counts;
use greyrig_board::host::Host;

use crate::{board, chance, count, payload};

#[test]
fn garbage_on_the_line_does_no_harm() {
    let (mut board, mut host) = (board(), Host::default());
    let mut chance = chance(1);
    let garbage: Vec<u8> = std::iter::repeat_with(|| chance() as u8).take(20_000).collect();
    board.run(0.01).unwrap();
    board.send(&garbage);
    // 20 kB take 0.22 s at 92,160 bytes a second.
    board.run(0.3).unwrap();
    board.send(&[0]);
    let status = host.flash(&mut board, &payload("after garbage")).unwrap();
    assert_eq!(status.mode, Mode::Running);
    board.send(&garbage);
    board.run(0.3).unwrap();
    board.send(&[0]);
    let status = host.status(&mut board).unwrap();
    assert!(count(&status, Fault::BadFrame) > 0);
    assert_eq!((status.mode, count(&status, Fault::TickOverrun)), (Mode::Running, 0));
    assert_eq!(board.machine().usart2.lost(), 0, "bytes that the receiver did not take");
}

#[test]
fn a_converter_at_its_end_is_told() {
    let (mut board, mut host) = (board(), Host::default());
    let mut motor = Bench::new().unwrap();
    let clipped = std::iter::repeat_with(move || {
        let counts = motor.counts();
        [counts.voltage, counts.current.saturating_mul(2).min(4095), counts.speed]
    });
    board.run(0.01).unwrap();
    host.tell(&mut board, Request::ClearFaults).unwrap();
    let status = host.status(&mut board).unwrap();
    assert_eq!([Fault::VoltageClipped, Fault::CurrentClipped].map(|fault| count(&status, fault)), [0, 0]);
    board.connect(Box::new(Counts::new(clipped)));
    board.run(0.2).unwrap();
    let status = host.status(&mut board).unwrap();
    assert_eq!(count(&status, Fault::VoltageClipped), 0);
    assert!(count(&status, Fault::CurrentClipped) > 100, "{status:?}");
}

/// The trigger comes off: no tick, no petting, a bite half a second later (docs/firmware.md), and it is told.
#[test]
fn the_watchdog_bites_when_the_tick_is_stalled() {
    let (mut board, mut host) = (board(), Host::default());
    let status = host.flash(&mut board, &payload("watched")).unwrap();
    assert_eq!(count(&status, Fault::WatchdogReset), 0);
    board.machine_mut().trigger_cut = true;
    board.run(0.45).unwrap();
    let stalled = host.status(&mut board).unwrap();
    assert_eq!(count(&stalled, Fault::WatchdogReset), 0);
    board.machine_mut().trigger_cut = false;
    // 0.5 s after the last tick it would have bitten; the ticks are back before.
    board.run(0.5).unwrap();
    let samples = host.status(&mut board).unwrap().samples;
    assert!(samples > stalled.samples);
    board.machine_mut().trigger_cut = true;
    board.run(0.55).unwrap();
    board.machine_mut().trigger_cut = false;
    board.run(0.05).unwrap();
    let status = host.status(&mut board).unwrap();
    assert_eq!((count(&status, Fault::WatchdogReset), status.mode), (1, Mode::Running));
    assert!(status.samples < samples);
}
