//! The microcontroller's side of the link, on a flash in memory, with its sampling beside it and restarts in between.

use greyrig::app::{self, Lamps, Outgoing, Sampler, Server, Shared};
use greyrig::hardware::{Hardware, NUCLEO_G474RE};
use greyrig::link::frame::{MAX_FRAME, Receiver, encode};
use greyrig::link::message::{Asked, CHUNK, Message, Reply, Request};
use greyrig::parameters::FINGERPRINT;
use greyrig::parameters::block::{MAX_PAYLOAD, SLOTS, payload_crc};
use greyrig::units::Counts;

use crate::Seen;
use crate::link::Raw;
use crate::nor::{Cut, Nor};

struct Board {
    flash: Nor,
}

impl app::Board for Board {
    type Flash = Nor;
    const HARDWARE: Hardware = Hardware { board: "fuzz", skew_s: [0.0; 2], ..NUCLEO_G474RE };
    const FLASH: u32 = NUCLEO_G474RE.rig.address;

    fn flash(&mut self) -> &mut Nor {
        &mut self.flash
    }
    fn chip(&self) -> [u8; 12] {
        [0; 12]
    }
    fn deepest_stack(&self) -> u32 {
        0
    }
    async fn receive(&mut self, _: &mut [u8]) -> usize {
        0
    }
    async fn send(&mut self, _: &[u8]) {}
    fn show(&mut self, _: Lamps) {}

    fn micros(&self) -> Option<u64> {
        None
    }
    fn alive(&mut self) {}
    fn restart(&mut self) -> ! {
        unreachable!("restarts are made by the loop below")
    }
}

/// Steps are a letter and what it takes:
///
/// | letter | what follows | what happens |
/// | --- | --- | --- |
/// | `b` | length, bytes | the bytes come over the line as they are |
/// | `f` | length, bytes | they come as the body of a frame |
/// | `p` | length (2), bytes | they are written as parameters and committed |
/// | `s` | count, 6 bytes | so many samples, which begin at these counts and move on |
/// | `c` | number, kind | the power is cut at a write or an erasure of this number, and comes back |
/// | `r` | | restart |
///
/// Every answer has to be a frame that the host can read, and what was committed is there after the restart.
pub fn receive(data: &[u8]) -> Seen {
    let mut flash = Nor::erased(2 * SLOTS);
    let (mut rest, mut seen) = (data, Vec::new());
    // As many starts as a fuzzer needs to see two blocks and two cuts.
    for _ in 0..8 {
        let (after, next) = run(flash, rest, &mut seen);
        flash = after.powered();
        match next {
            Some(next) => rest = next,
            None => break,
        }
    }
    seen.dedup();
    Seen::of(seen)
}

fn take<'d>(rest: &mut &'d [u8], count: usize) -> Option<&'d [u8]> {
    let (taken, after) = rest.split_at_checked(count)?;
    *rest = after;
    Some(taken)
}

/// Runs until a restart; gives the flash, and what is left of the input. `seen` takes the kinds of answers.
fn run<'d>(flash: Nor, mut rest: &'d [u8], seen: &mut Vec<u8>) -> (Nor, Option<&'d [u8]>) {
    let shared = Shared::new();
    let mut board = Board { flash };
    let (mut server, active) = Server::start(&mut board, &shared);
    let mut sampler = Sampler::new(active, &shared, &NUCLEO_G474RE);
    let mut restart = false;
    let mut step = |rest: &mut &'d [u8]| -> Option<bool> {
        match take(rest, 1)?[0] {
            b'b' => {
                let length = take(rest, 1)?[0].into();
                feed(&mut server, &mut board, take(rest, length)?, &mut restart, seen);
            }
            b'f' => {
                let length = take(rest, 1)?[0].into();
                body(&mut server, &mut board, take(rest, length)?, &mut restart, seen);
            }
            b'p' => {
                let length = take(rest, 2)?;
                let length = usize::from(u16::from_le_bytes([length[0], length[1]])).min(MAX_PAYLOAD);
                let payload = take(rest, length)?;
                for (n, data) in payload.chunks(CHUNK).enumerate() {
                    ask(&mut server, &mut board, Request::WriteParameters { offset: (n * CHUNK) as u16, data }, seen);
                }
                let (length, crc) = (payload.len() as u16, payload_crc(payload));
                ask(&mut server, &mut board, Request::CommitParameters { fingerprint: FINGERPRINT, length, crc }, seen);
            }
            b's' => {
                let count = take(rest, 1)?[0];
                let words = take(rest, 6)?;
                let word = |n: usize| u16::from_le_bytes([words[n], words[n + 1]]);
                for n in 0..u16::from(count) {
                    let move_on = |start: u16, step: u16| start.wrapping_add(n.wrapping_mul(step)) & 0xFFF;
                    let counts = Counts { voltage: move_on(word(0), 7), current: move_on(word(2), 3), speed: word(4) };
                    sampler.sample(counts, u32::from(n == 100));
                    while let Some(outgoing) = server.unasked() {
                        seen.push(heard(&outgoing));
                    }
                }
            }
            b'c' => {
                let cut = take(rest, 2)?;
                let kind = [Cut::Before, Cut::Within, Cut::After][usize::from(cut[1] % 3)];
                board.flash = board.flash.clone().cut_at(cut[0].into(), kind);
            }
            _ => restart = true,
        }
        Some(restart)
    };
    loop {
        match step(&mut rest) {
            Some(false) => {}
            Some(true) => break,
            None => return (board.flash, None),
        }
    }
    (board.flash, Some(rest))
}

fn feed(server: &mut Server, board: &mut Board, bytes: &[u8], restart: &mut bool, seen: &mut Vec<u8>) {
    for &byte in bytes {
        if let Some(outgoing) = server.receive(byte, board) {
            *restart |= outgoing.restart;
            seen.push(heard(&outgoing));
        }
    }
}

fn body(server: &mut Server, board: &mut Board, body: &[u8], restart: &mut bool, seen: &mut Vec<u8>) {
    let mut frame = [0; MAX_FRAME];
    if let Ok(length) = encode(&Raw(body), &mut frame) {
        feed(server, board, &[&[0], &frame[..length]].concat(), restart, seen);
    }
}

fn ask(server: &mut Server, board: &mut Board, request: Request, seen: &mut Vec<u8>) {
    let mut frame = [0; MAX_FRAME];
    let length = encode(&Asked { number: 7, request }, &mut frame).expect("a request fits");
    feed(server, board, &[&[0], &frame[..length]].concat(), &mut false, seen);
}

/// What goes to the host is a frame with a message in it; gives what kind of message.
fn heard(outgoing: &Outgoing) -> u8 {
    let mut receiver = Receiver::new();
    let (last, head) = outgoing.bytes().split_last().expect("a frame is not empty");
    head.iter().for_each(|&byte| assert!(receiver.push(byte).is_none()));
    let body = receiver.push(*last).expect("the frame ends").expect("it is whole");
    match postcard::from_bytes::<Message>(body).expect("a message") {
        Message::Reply { reply, .. } => {
            if let Reply::Parameters(data) = reply {
                assert!(data.len() <= CHUNK);
            }
            // The reply's own number, and of a refusal the reason.
            let mut bytes = [0; MAX_FRAME];
            let bytes = postcard::to_slice(&reply, &mut bytes).expect("it was in a frame");
            let reason = if matches!(reply, Reply::Refused(_)) { bytes[1] } else { 0 };
            16 * bytes[0] + reason
        }
        Message::Samples(_) => 253,
        Message::Report(_) => 254,
        Message::Judged(_) => 255,
    }
}
