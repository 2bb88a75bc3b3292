//! Messages over a line that loses and invents bytes.

use greyrig::detector::{Alarm, Cause, Features, Kind, Period, Verdict};
use greyrig::hardware::NUCLEO_G474RE;
use greyrig::link::frame::{FrameError, MAX_FRAME, Receiver, encode};
use greyrig::link::load::{self, Load};
use greyrig::link::message::{Asked, CHUNK, Judged, Message, Reply, Report, Request, Samples};
use greyrig::link::packing::{self, pack, packed_length, unpack};
use greyrig::link::{BAUD, MAX_BODY};
use greyrig::units::Counts;
use proptest::prelude::*;

fn frame(message: &impl serde::Serialize) -> Vec<u8> {
    let mut bytes = [0; MAX_FRAME];
    let length = encode(message, &mut bytes).expect("it fits");
    bytes[..length].to_vec()
}

/// Everything that a receiver makes of bytes.
fn received(receiver: &mut Receiver, bytes: &[u8]) -> Vec<Result<Vec<u8>, FrameError>> {
    bytes.iter().filter_map(|&byte| receiver.push(byte).map(|r| r.map(<[u8]>::to_vec))).collect()
}

/// By hand: postcard makes 07 00 of request 7, Hello; its CRC-32 (Python: `zlib.crc32(b"\x07\x00")`) is 0x0E988438;
/// COBS of 07 00 38 84 98 0e is 02 07 05 38 84 98 0e.
#[test]
fn a_frame_byte_by_byte() {
    let bytes = frame(&Asked { number: 7, request: Request::Hello });
    assert_eq!(bytes, [0x02, 0x07, 0x05, 0x38, 0x84, 0x98, 0x0E, 0x00]);
}

#[test]
fn the_longest_messages_fit() {
    let data = [0xAA; CHUNK];
    frame(&Asked { number: 255, request: Request::WriteParameters { offset: u16::MAX, data: &data } });
    frame(&Message::Reply { number: 255, reply: Reply::Parameters(&data) });
    let packed = [0; packing::BYTES];
    let samples = Samples { first: u32::MAX, count: packing::SAMPLES as u8, packed: &packed };
    let capture = frame(&Message::Samples(samples)).len();
    // What the module's documentation promises of a capture's load: bytes of a frame, frames a second, ten bits a byte.
    assert!(capture <= packing::BYTES + 18, "{capture}");
    let load =
        capture as f64 * f64::from(NUCLEO_G474RE.sample_rate_hz) / packing::SAMPLES as f64 * 10.0 / f64::from(BAUD);
    assert!((0.5..0.53).contains(&load), "{load}");
    let mut bytes = [0; MAX_FRAME];
    assert_eq!(encode(&vec![1_u8; MAX_BODY], &mut bytes), Err(FrameError::TooLong));
}

/// Frames as they are made, of the largest numbers: none is longer than the load of the line takes it for.
#[test]
fn the_load_of_the_line_is_that_of_its_longest_frames() {
    let largest = f32::from_bits(0x7F7F_FFFF);
    let report = Report {
        sample: u32::MAX,
        count: u16::MAX,
        voltage_rms: largest,
        current_rms: largest,
        speed: largest,
        residual_current_rms: largest,
        residual_speed_rms: largest,
    };
    let alarm = Alarm { cause: Cause::CurrentDeviation, kind: Kind::Mechanical, ratio: largest };
    // Numbers of four bytes each, whatever they are.
    let features = Features { current: largest, ..Features::default() };
    let period = Period { features, jumps: [largest; 2], judged: true, alarm: Some(alarm) };
    let [test, first, index, sample] = [u32::MAX; 4];
    let judged = Judged { test, first, index, sample, period, verdict: Verdict::Fail };
    let packed = [0xFF; packing::BYTES];
    let samples = Samples { first: u32::MAX, count: packing::SAMPLES as u8, packed: &packed };
    for (message, longest) in [
        (Message::Report(report), load::REPORT),
        (Message::Judged(judged), load::JUDGED),
        (Message::Samples(samples), load::CAPTURED),
    ] {
        let length = frame(&message).len() as u32;
        // Close to it, too: a tenth of the line is not much.
        assert!((longest * 4 / 5..=longest).contains(&length), "{length} of {longest}: {message:?}");
    }
    let load = Load { every: 10, capture: true, follow: false };
    // In ten seconds 10,000 reports and 1,562 frames of 64 samples and half a one.
    let ten_seconds = 20_000 * load::REPORT / 2 + 3_125 * load::CAPTURED / 2;
    assert!((10 * load.bytes_per_second(10_000)).abs_diff(ten_seconds) <= 10);
    assert!(load.fits(10_000) && !Load { every: 9, ..load }.fits(10_000));
    assert!(Load { every: 60, capture: true, follow: true }.fits(10_000));
    assert_eq!(Load::default().bytes_per_second(10_000), 0);
    assert!(!Load { every: 1, ..Load::default() }.fits(u32::MAX));
}

#[test]
fn counts_survive_packing_at_the_ends_of_their_range() {
    let counts = [
        Counts { voltage: 0xFFF, current: 0, speed: 0xFFF },
        Counts { voltage: 0, current: 0xFFF, speed: 0 },
        Counts { voltage: 0x123, current: 0x456, speed: 0x789 },
    ];
    let packed = pack(&counts[2..]);
    assert_eq!(packed.as_slice(), [0x23, 0x61, 0x45, 0x89, 0x07]);
    for n in 0..=counts.len() {
        assert!(unpack(n, &pack(&counts[..n])).expect("as many").eq(counts[..n].iter().copied()));
    }
    assert!(unpack(2, &[0; 8]).is_none() && unpack(65, &[0; packed_length(65)]).is_none());
}

proptest! {
    #[test]
    fn any_counts_survive_packing(counts in prop::collection::vec((0_u16..4096, 0_u16..4096, 0_u16..4096), 0..=64)) {
        let counts: Vec<Counts> =
            counts.into_iter().map(|(voltage, current, speed)| Counts { voltage, current, speed }).collect();
        let packed = pack(&counts);
        prop_assert_eq!(packed.len(), packed_length(counts.len()));
        prop_assert!(unpack(counts.len(), &packed).expect("as many").eq(counts.iter().copied()));
    }

    /// Whatever came before, the frame after a zero is received.
    #[test]
    fn garbage_is_survived(garbage in prop::collection::vec(any::<u8>(), 0..2000)) {
        let mut receiver = Receiver::new();
        received(&mut receiver, &garbage);
        received(&mut receiver, &[0]);
        let asked = Asked { number: 3, request: Request::StartTelemetry { every: 100 } };
        let bodies = received(&mut receiver, &frame(&asked));
        prop_assert_eq!(bodies.len(), 1);
        let body = bodies[0].clone().expect("a whole frame");
        prop_assert_eq!(postcard::from_bytes::<Asked>(&body), Ok(asked));
    }

    /// A CRC of 32 bits finds every burst of up to 32 bits: a wrong byte, and a lost or an invented one within a frame,
    /// too, but for one case in 2^32.
    #[test]
    fn damage_is_noticed(data in prop::collection::vec(any::<u8>(), 0..=CHUNK), at in any::<prop::sample::Index>(),
                         byte in any::<u8>(), kind in 0..3) {
        let good = frame(&Asked { number: 1, request: Request::WriteParameters { offset: 8, data: &data } });
        let mut bad = good.clone();
        let at = at.index(bad.len());
        match kind {
            0 => bad[at] = byte,
            1 => { bad.remove(at); }
            _ => bad.insert(at, byte),
        }
        let mut receiver = Receiver::new();
        let body = received(&mut Receiver::new(), &good)[0].clone().expect("a whole frame");
        for message in received(&mut receiver, &bad).into_iter().flatten() {
            prop_assert_eq!(&message, &body);
        }
    }

    /// Any message that is whole but nonsense is told from a request without a panic.
    #[test]
    fn any_body_is_a_request_or_not(body in prop::collection::vec(any::<u8>(), 0..40)) {
        let _ = postcard::take_from_bytes::<Asked>(&body);
        let _ = postcard::take_from_bytes::<Message>(&body);
    }
}
