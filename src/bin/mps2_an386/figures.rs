//! The figures of the machine.

use greyrig::hardware::{Hardware, NUCLEO_G474RE};

/// Those of the board that it stands for, but that nothing is sampled late.
pub const HARDWARE: Hardware = Hardware { board: "mps2-an386 (QEMU)", skew_s: [0.0; 2], ..NUCLEO_G474RE };
