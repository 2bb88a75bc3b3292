//! Three 12-bit counts in 4.5 bytes.
//!
//! The counts of voltage, current and speed of one sample after another are a stream of 12-bit numbers; two of them, a
//! and b, take three bytes: the low eight bits of a; the high four of a below the low four of b; the high eight of b.
//! An odd number of samples ends with half a byte of zeros.

use crate::units::Counts;

/// Bits of a count.
pub const BITS: u32 = 12;
/// Samples in a frame of a raw capture: 288 bytes every 6.4 ms.
pub const SAMPLES: usize = 64;
/// Bytes that so many samples take.
pub const BYTES: usize = packed_length(SAMPLES);

/// Bytes that a number of samples takes.
pub const fn packed_length(samples: usize) -> usize {
    (samples * 9).div_ceil(2)
}

/// Packs at most [`SAMPLES`] samples, of whose counts the lowest 12 bits matter.
pub fn pack(samples: &[Counts]) -> heapless::Vec<u8, BYTES> {
    let mut packed = heapless::Vec::new();
    let mut numbers = samples.iter().take(SAMPLES).flat_map(|c| [c.voltage, c.current, c.speed].map(|n| n & 0xFFF));
    while let Some(a) = numbers.next() {
        let [low, high] = a.to_le_bytes();
        // There is room for all of SAMPLES.
        let _ = packed.push(low);
        match numbers.next() {
            Some(b) => {
                let _ = packed.push(high | (b << 4) as u8);
                let _ = packed.push((b >> 4) as u8);
            }
            None => {
                let _ = packed.push(high);
            }
        }
    }
    packed
}

/// The samples of [`pack`]; nothing if the length is not that of so many samples.
pub fn unpack(count: usize, packed: &[u8]) -> Option<impl Iterator<Item = Counts> + '_> {
    if count > SAMPLES || packed.len() != packed_length(count) {
        return None;
    }
    let number = move |n: usize| {
        let at = n / 2 * 3;
        let byte = |k: usize| u16::from(packed.get(at + k).copied().unwrap_or(0));
        if n.is_multiple_of(2) { byte(0) | (byte(1) & 0xF) << 8 } else { byte(1) >> 4 | byte(2) << 4 }
    };
    Some((0..count).map(move |n| Counts {
        voltage: number(3 * n),
        current: number(3 * n + 1),
        speed: number(3 * n + 2),
    }))
}
