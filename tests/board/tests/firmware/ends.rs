//! How the program can come to an end, and what the next start tells of it.

use greyrig::faults::Fault;
use greyrig::incident::{Cause, IN_A_ROW, Incident};
use greyrig::link::message::{Mode, Reply, Request, Status};
use greyrig_board::Board;
use greyrig_board::host::Host;

use crate::{board, chance, count, payload};

fn running() -> (Board, Host) {
    let (mut board, mut host) = (board(), Host::default());
    let status = host.flash(&mut board, &payload("mortal")).unwrap();
    assert_eq!((status.mode, status.incident), (Mode::Running, None));
    board.run(0.1).unwrap();
    (board, host)
}

fn after(board: &mut Board, host: &mut Host) -> Status {
    board.run(0.05).unwrap();
    host.status(board).unwrap()
}

fn incident(status: &Status) -> &Incident {
    status.incident.as_ref().unwrap_or_else(|| panic!("{status:?}"))
}

#[test]
fn a_hard_fault_is_told_with_its_place() {
    let (mut board, mut host) = running();
    let place = board.jump_astray();
    let status = after(&mut board, &mut host);
    let told = incident(&status).clone();
    // FORCED, by an undefined instruction (ARMv7-M ARM, sections B3.2.15 and B3.2.16).
    assert_eq!((told.cause, told.at, told.status), (Cause::HardFault, place, [1 << 16, 1 << 30]));
    assert!(told.samples > 1_000 && status.samples < 1_000, "{status:?}");
    assert_eq!((status.mode, count(&status, Fault::Incident)), (Mode::Running, 1));
    // It is told until somebody has seen it, over resets, too.
    board.press_reset();
    let status = after(&mut board, &mut host);
    assert_eq!((incident(&status), count(&status, Fault::Incident)), (&told, 0));
    host.tell(&mut board, Request::ClearFaults).unwrap();
    assert_eq!(host.status(&mut board).unwrap().incident, None);
    // Nor is it known when power has been off.
    board.jump_astray();
    board.cut_power(chance(3)).unwrap();
    assert_eq!(after(&mut board, &mut host).incident, None);
}

/// A stack that is too deep changes no variable: below it there is no memory.
#[test]
fn the_end_of_the_stack_is_a_hard_fault() {
    let (mut board, mut host) = running();
    board.exhaust_stack();
    let status = after(&mut board, &mut host);
    let told = incident(&status);
    // STKERR, the stacking of an interrupt, or PRECISERR, the program's own; the frame with the place is lost.
    assert_eq!(told.cause, Cause::HardFault);
    assert!(told.status[0] & (1 << 12 | 1 << 9) != 0 && told.status[1] == 1 << 30, "{told:?}");
    assert_eq!(status.mode, Mode::Running);
}

/// The parameters may be the cause: after three ends in a row they are left alone, and the host is heard.
#[test]
fn a_program_that_ends_again_and_again_starts_into_safe_mode() {
    let (mut board, mut host) = running();
    for n in 1..=IN_A_ROW {
        board.jump_astray();
        let status = after(&mut board, &mut host);
        let mode = if n < IN_A_ROW { Mode::Running } else { Mode::Safe };
        assert_eq!((status.mode, count(&status, Fault::HeldBack)), (mode, u32::from(n == IN_A_ROW)), "end {n}");
    }
    // Whoever presses the button wants to know.
    board.press_reset();
    assert_eq!(after(&mut board, &mut host).mode, Mode::Running);
    // Ten seconds of running between two ends are a good start.
    board.jump_astray();
    assert_eq!(after(&mut board, &mut host).mode, Mode::Running);
    board.run(10.1).unwrap();
    for _ in 1..IN_A_ROW {
        board.jump_astray();
        assert_eq!(after(&mut board, &mut host).mode, Mode::Running);
    }
}

/// An unreadable word of the program itself: told once, and no loop of resets.
#[test]
fn an_unreadable_program_stands_in_the_end() {
    let (mut board, mut host) = running();
    for n in 1..=IN_A_ROW {
        board.machine_mut().spoil_program(0x1238);
        let status = after(&mut board, &mut host);
        let told = incident(&status);
        assert_eq!((told.cause, told.at, told.status[0]), (Cause::Program, 0x1238, 1 << 31 | 0x1238), "{n}");
        assert_eq!(count(&status, Fault::FlashUnreadable), 0, "it is not the parameters'");
    }
    let resets = board.machine().resets;
    board.machine_mut().spoil_program(0x1238);
    // Longer than the watchdog would wait.
    board.run(2.0).unwrap();
    assert_eq!(board.machine().resets, resets);
    assert_eq!(["PB10", "PB5"].map(|pin| board.is_high(pin)), [false, true]);
    let sequences = host.status(&mut board);
    assert!(sequences.is_err(), "{sequences:?}");
    // The button, or power, is a way out.
    board.press_reset();
    assert_eq!(after(&mut board, &mut host).mode, Mode::Running);
}

#[test]
fn a_dip_of_the_supply_and_the_watchdog_are_told() {
    let (mut board, mut host) = running();
    board.dip_supply(chance(4)).unwrap();
    let status = after(&mut board, &mut host);
    assert_eq!((incident(&status).cause, count(&status, Fault::Incident)), (Cause::SupplyDip, 1));
    assert!(incident(&status).samples > 1_000, "{status:?}");
    board.machine_mut().trigger_cut = true;
    board.run(0.55).unwrap();
    board.machine_mut().trigger_cut = false;
    let status = after(&mut board, &mut host);
    assert_eq!((incident(&status).cause, count(&status, Fault::WatchdogReset)), (Cause::Watchdog, 1));
    assert_eq!(count(&status, Fault::Incident), 0, "it has a fault of its own");
}

/// Which image runs is told, and is the linker's digest of it.
#[test]
fn the_image_tells_which_it_is() {
    use object::Object;
    let bytes = std::fs::read(crate::file()).unwrap();
    let digest = object::File::parse(&*bytes).unwrap().build_id().unwrap().expect("a digest").to_vec();
    let (mut board, mut host) = (board(), Host::default());
    let build = host.ask(&mut board, Request::Hello, |reply| match reply {
        Reply::Identity(identity) => Some(identity.build),
        _ => None,
    });
    let build = build.unwrap();
    assert_eq!(build, digest[..8]);
    assert_ne!(build, [0; 8]);
}
