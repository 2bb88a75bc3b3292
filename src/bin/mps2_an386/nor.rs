//! RAM in place of flash, with the flash's manners: words of 64 bits that are written once, pages that are erased.
//!
//! It is the machine's 16 MiB of external RAM (Arm DAI 0386), outside what the linker uses, so that neither the
//! start-up code nor the emulator's reset touches it: what was written survives a restart, but not the end of the
//! emulator.
#![allow(unsafe_code)]

use core::ptr;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use greyrig::parameters::block::{SLOTS, WRITE_SIZE};

use crate::figures::HARDWARE;

const BASE: usize = 0x2100_0000;
/// The rig's slots and, behind them, those of the parameters.
const SIZE: usize = SLOTS * (HARDWARE.rig.size + HARDWARE.slots.size);
const ERASED: u8 = 0xFF;

/// The memory. There is one.
pub struct Nor(());

impl Nor {
    pub const fn new() -> Self {
        Self(())
    }

    fn byte(offset: usize) -> *mut u8 {
        (BASE + offset) as *mut u8
    }
}

impl ErrorType for Nor {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Nor {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        check_read(self, offset, bytes.len())?;
        for (n, byte) in bytes.iter_mut().enumerate() {
            // SAFETY: RAM that nothing else uses; the range was checked.
            *byte = unsafe { ptr::read_volatile(Self::byte(offset as usize + n)) };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl NorFlash for Nor {
    const WRITE_SIZE: usize = WRITE_SIZE;
    const ERASE_SIZE: usize = HARDWARE.slots.size;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        check_erase(self, from, to)?;
        for offset in from..to {
            // SAFETY: as in `read`.
            unsafe { ptr::write_volatile(Self::byte(offset as usize), ERASED) };
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        check_write(self, offset, bytes.len())?;
        for (n, &byte) in bytes.iter().enumerate() {
            let place = Self::byte(offset as usize + n);
            // SAFETY: as in `read`.
            unsafe {
                if ptr::read_volatile(place) != ERASED {
                    return Err(NorFlashErrorKind::Other);
                }
                ptr::write_volatile(place, byte);
            }
        }
        Ok(())
    }
}
