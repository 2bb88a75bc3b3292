//! The link between host and microcontroller: requests and replies, telemetry, raw samples.
//!
//! ```text
//! message ─ postcard ─┬─► CRC-32 (ISO-HDLC, little-endian) ─► COBS ─► 0x00
//!                     └──── MAX_BODY bytes at most
//! ```
//! [`message`] says what is said, [`frame`] how it gets over a line that may lose and invent bytes, [`packing`] how
//! three 12-bit samples become 4.5 bytes.
//!
//! # Conversation
//! The host asks, the microcontroller answers each request once, with the request's number. Before anything else the
//! host says [`message::Request::Hello`]; it goes on only if [`message::PROTOCOL`] is its own, and writes parameters
//! only if the fingerprint of the layout is, too. An answer that does not come is asked for again: every request may be
//! repeated. Samples and telemetry come unasked between answers, once started.
//!
//! # Baud rate
//! A raw capture takes 10,000 samples/s × 4.5 bytes = 45 kB/s. Frames of 64 samples add at most 18 bytes each, 2.9
//! kB/s; at ten bits a byte on the line that is 479 kbit/s. [`BAUD`] carries 92.2 kB/s: 52 % of it is used, and a frame
//! waits for no more than its predecessor. What is more than the line carries is refused ([`load`]).

pub mod frame;
pub mod load;
pub mod message;
pub mod packing;

/// Symbols per second, with 8 data bits, no parity, 1 stop bit. At a 170 MHz clock the divider 184 gives 923,913, 0.25
/// % off.
pub const BAUD: u32 = 921_600;

/// Longest message, bytes.
pub const MAX_BODY: usize = 320;
