//! Parameters: what is accepted can be encoded again, and the sampler runs with it on any samples.

use greyrig::app::{Sampler, Shared};
use greyrig::hardware::NUCLEO_G474RE;
use greyrig::link::message::Message;
use greyrig::parameters::block::MAX_PAYLOAD;
use greyrig::parameters::{Settings, section};
use greyrig::units::Counts;

use crate::Seen;

/// Samples that an accepted set runs on: three periods of 50 Hz, enough for a judged one.
const SAMPLES: u16 = 600;

/// A payload.
pub fn section(data: &[u8]) -> Seen {
    let settings = match section::decode(data) {
        Err(error) => return Seen::error(&format!("{error:?}")),
        Ok(settings) => settings,
    };
    let mut buffer = [0; MAX_PAYLOAD];
    let again = section::encode(&settings, &mut buffer).expect("what was accepted fits");
    assert_eq!(section::decode(again).as_ref(), Ok(&settings));
    run(&settings, data);
    let effects: Vec<_> = settings.effects.iter().map(|effect| effect.description().id).collect();
    Seen::of((effects, settings.terms.len(), settings.correction.is_some(), settings.detector.is_some()))
}

/// Runs the sampler with what was accepted.
fn run(settings: &Settings, data: &[u8]) {
    let active = settings.build().expect("what was accepted can be built");
    let shared = Shared::new();
    shared.begin_test(1);
    shared.follow(true);
    shared.report(10);
    let mut sampler = Sampler::new(Some(active), &shared, &NUCLEO_G474RE);
    // Samples from the payload's own last bytes, so that the fuzzer can choose them: ramps, and jumps to the rails.
    let tail = |n: usize| u16::from(data.get(data.len().wrapping_sub(1 + n)).copied().unwrap_or_default());
    for n in 0..SAMPLES {
        let jump = if n.is_multiple_of(97) { 0xFFF } else { 0 };
        let ramp = |k: usize| (n.wrapping_mul(1 + tail(k)) ^ jump) & 0xFFF;
        sampler.sample(Counts { voltage: ramp(0), current: ramp(1), speed: ramp(2) }, 0);
    }
    while let Some(window) = shared.reports.pop() {
        let message = Message::Report(window.report());
        assert!(postcard::to_slice(&message, &mut [0; 512]).is_ok());
    }
}
