//! The peripherals that the firmware uses, a file each. Registers are named in the terms of RM0440.
//!
//! A peripheral answers reads and writes at an offset within its registers, can be told that time has passed, and says
//! when it wants to be told again.

pub mod adc;
pub mod advanced;
pub mod comparator;
pub mod dbgmcu;
pub mod dma;
pub mod flash;
pub mod gpio;
pub mod iwdg;
pub mod pwr;
pub mod rcc;
pub mod syscfg;
pub mod system;
pub mod timer;
pub mod usart;

use crate::fault::Trouble;

/// No time.
pub const NEVER: u64 = u64::MAX;

/// What an access gives.
pub type Answer<T> = Result<T, Trouble>;

/// Whether a bit is set.
pub fn bit(value: u32, place: u32) -> bool {
    value >> place & 1 == 1
}
