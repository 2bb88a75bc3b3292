//! What is kept over a reset.

use greyrig::incident::{Cause, IN_A_ROW, Incident, Kept, MAX_PLACE, Phase, Reset, WORDS};
use proptest::prelude::*;

const CAUSES: [Cause; 6] =
    [Cause::Panic, Cause::HardFault, Cause::Watchdog, Cause::SupplyDip, Cause::Program, Cause::Hardware];
const WATCHDOG: Reset = Reset { watchdog: true, brown_out: false };
const BROWN_OUT: Reset = Reset { watchdog: false, brown_out: true };

fn panicked() -> Incident {
    Incident::new(Cause::Panic, 4_711).at_line("src/motor/stepper.rs", 128)
}

#[test]
fn every_record_survives_its_words_and_no_bit_can_change() {
    for cause in CAUSES {
        let incident = Incident { cause, from: u32::MAX, status: [1, 2], ..panicked() };
        for phase in [Phase::Running, Phase::Ended] {
            for incident in [None, Some(incident.clone())] {
                let kept = Kept { phase, in_a_row: 255, incident };
                let words = kept.to_words();
                assert_eq!(Kept::from_words(words), Some(kept));
                for bit in 0..32 * WORDS {
                    let mut wrong = words;
                    wrong[bit / 32] ^= 1 << (bit % 32);
                    assert_eq!(Kept::from_words(wrong), None, "bit {bit}");
                }
            }
        }
    }
    // What memory holds when power comes.
    for word in [0, u32::MAX, 0xC3C3_C3C3] {
        assert_eq!(Kept::from_words([word; WORDS]), None);
    }
}

#[test]
fn of_a_long_name_the_end_is_kept() {
    let incident = Incident::new(Cause::Panic, 0).at_line("/home/somebody/registry/embassy-stm32/src/usart/ring.rs", 1);
    assert_eq!((incident.place.as_str(), incident.place.len()), ("-stm32/src/usart/ring.rs", MAX_PLACE));
    assert_eq!(panicked().place, "src/motor/stepper.rs");
    let beyond = Incident::new(Cause::Panic, 0).at_line("ω.rs", 1);
    assert_eq!(beyond.place, ".rs");
}

#[test]
fn a_start_knows_what_went_before() {
    let running = Kept::default();
    // Power came: nothing is known, whatever the flags.
    for reset in [Reset::default(), WATCHDOG, BROWN_OUT] {
        assert_eq!(Kept::next(None, reset, 7), running);
    }
    // The button, a request, a debugger.
    assert_eq!(Kept::next(Some(running.clone()), Reset::default(), 7), running);
    for (reset, cause) in [(WATCHDOG, Cause::Watchdog), (BROWN_OUT, Cause::SupplyDip)] {
        let next = Kept::next(Some(running.clone()), reset, 7);
        assert_eq!(next, Kept { in_a_row: 1, incident: Some(Incident::new(cause, 7)), ..running.clone() });
    }
    // The program's own record says more than a flag.
    let next = Kept::next(Some(running.clone().ended(panicked())), WATCHDOG, 7);
    assert_eq!(next, Kept { in_a_row: 1, incident: Some(panicked()), ..running.clone() });
    // The next good start still tells it.
    let later = Kept::next(Some(next), Reset::default(), 9);
    assert_eq!((later.in_a_row, later.incident, later.phase), (0, Some(panicked()), Phase::Running));
    // Again and again.
    let mut kept = running;
    for n in 0..300_u32 {
        assert_eq!(kept.holds_back(), n >= IN_A_ROW.into(), "after {n}");
        kept = Kept::next(Some(kept.ended(panicked())), Reset::default(), 0);
    }
}

proptest! {
    #[test]
    fn arbitrary_words_are_no_record(words in any::<[u32; WORDS]>()) {
        prop_assert_eq!(Kept::from_words(words), None);
    }
}
