//! The link: frames of any bytes, and messages as the host takes them.

use greyrig::link::frame::{MAX_FRAME, Receiver, encode};
use greyrig::link::message::{Asked, Message, Request};
use greyrig_host::device::capture::Capture;
use serde::Serialize;
use serde::ser::SerializeTuple;

use crate::Seen;

/// Bytes as they are, without a length.
pub struct Raw<'a>(pub &'a [u8]);

impl Serialize for Raw<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

/// Any bytes on the line, then a whole frame of them behind a zero: that one arrives.
pub fn frames(data: &[u8]) -> Seen {
    let (mut receiver, mut seen) = (Receiver::new(), Vec::new());
    for &byte in data {
        match receiver.push(byte) {
            Some(Ok(body)) => {
                seen.push(postcard::from_bytes::<Asked>(body).map_or(1, |asked| 10 + kind(&asked.request)))
            }
            Some(Err(error)) => seen.push(2 + error as usize),
            None => {}
        }
    }
    seen.dedup();
    let mut frame = [0; MAX_FRAME];
    let Ok(length) = encode(&Raw(data), &mut frame) else { return Seen::of(seen) };
    assert!(frame[..length - 1].iter().all(|&byte| byte != 0));
    receiver.push(0);
    let (last, head) = frame[..length].split_last().expect("a frame is not empty");
    head.iter().for_each(|&byte| assert!(receiver.push(byte).is_none()));
    match receiver.push(*last) {
        Some(Ok(body)) => assert_eq!(body, data),
        // An empty frame counts as nothing; that of an empty message has its check sum.
        other => panic!("{other:?}"),
    }
    Seen::of(seen)
}

/// The number of a request's variant: the first byte of its encoding.
pub fn kind(request: &Request) -> usize {
    postcard::to_slice(request, &mut [0; MAX_FRAME]).map_or(0, |bytes| bytes[0].into())
}

/// Messages one behind the other, as the host takes them: samples into a capture of a thousand.
pub fn messages(data: &[u8]) -> Seen {
    const MOST: usize = 1000;
    let mut capture = Capture::with_room(0);
    let (mut rest, mut seen) = (data, Vec::new());
    while let Ok((message, next)) = postcard::take_from_bytes::<Message>(rest) {
        if next.len() == rest.len() {
            break;
        }
        seen.push(rest[0]);
        rest = next;
        let mut frame = [0; MAX_FRAME];
        // What was received could have been sent, unless it is longer than a frame.
        let _ = encode(&message, &mut frame);
        if let Message::Samples(samples) = &message {
            let before = capture.samples.clone();
            capture.take(samples, MOST);
            assert!(capture.samples.len() <= MOST && capture.samples.starts_with(&before));
        }
    }
    let missing: usize = capture.lost().iter().map(std::ops::Range::len).sum();
    assert_eq!(missing, capture.missing());
    assert_eq!(capture.window(capture.first, capture.samples.len()).samples, capture.samples);
    seen.dedup();
    Seen::of((seen, (1 + capture.samples.len()).ilog2(), capture.lost().len()))
}
