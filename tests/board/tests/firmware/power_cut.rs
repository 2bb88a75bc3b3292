//! Power cuts while parameters are written: the old block or the new one, whenever.

use greyrig::faults::Fault;
use greyrig::link::message::Mode;
use greyrig::parameters::block::payload_crc;
use greyrig_board::board::CLOCK_HZ;
use greyrig_board::host::{Host, commit};

use crate::{board, chance, count, payload};

/// Cuts.
const CUTS: usize = 200;

#[test]
fn every_cut_leaves_the_old_or_the_new_block() {
    let (mut board, mut host) = (board(), Host::default());
    // Both slots are used: the one that is written anew holds a block.
    let old = payload("old");
    let new = payload("a new one, with a longer name");
    host.flash(&mut board, &payload("older")).unwrap();
    host.flash(&mut board, &old).unwrap();
    host.bring(&mut board, &new).unwrap();

    // How long it takes, undisturbed.
    let begin = board.moment().unwrap();
    let from = board.machine().now;
    host.commit(&mut board, &new).unwrap();
    let length = board.machine().now - from;
    // A page's erasure alone takes 22 ms.
    assert!(length > CLOCK_HZ * 22 / 1000, "{length} cycles");

    let mut chance = chance(7);
    let (mut olds, mut news, mut unreadable, mut told) = (0, 0, 0, 0);
    for n in 0..CUTS {
        board.go_back(&begin).unwrap();
        let mut host = host.clone();
        host.send(&mut board, commit(&new));
        // The erasure takes nearly all of the time: half of the cuts come in the last eighth, in which words are
        // programmed.
        let share = if n % 2 == 0 { length } else { length / 8 };
        let at = from + length - share + u64::from(chance()) * share / (1 << 32);
        board.run_until(at).unwrap();
        board.cut_power(&mut chance).unwrap();
        unreadable += usize::from(!board.machine().flash.contents.unreadable.is_empty());
        board.run(0.05).unwrap();
        let status = host.status(&mut board).unwrap_or_else(|e| panic!("{e} after cut {n} at cycle {at}"));
        let block = status.in_force.unwrap_or_else(|| panic!("no block after a cut at {at}"));
        assert_eq!(status.mode, Mode::Running);
        told += usize::from(count(&status, Fault::FlashUnreadable) > 0);
        match block.crc {
            crc if crc == payload_crc(&old) => olds += 1,
            crc if crc == payload_crc(&new) => news += 1,
            _ => panic!("another block after a cut at {at}: {block:?}"),
        }
        // What the cut has left can be written over; every tenth time is enough.
        if n % 10 == 0 {
            let block = host.bring(&mut board, &new).and_then(|()| host.commit(&mut board, &new)).unwrap();
            assert_eq!(block.crc, payload_crc(&new));
        }
    }
    println!(
        "{CUTS} cuts in {:.1} ms: {olds} old, {news} new, {unreadable} left unreadable words, {told} met one",
        1e3 * length as f64 / CLOCK_HZ as f64
    );
    // The handler of the non-maskable interrupt has been at work, too.
    assert!(olds > 0 && news > 0 && unreadable > 0 && told > 0, "{olds} {news} {unreadable} {told}");
}
