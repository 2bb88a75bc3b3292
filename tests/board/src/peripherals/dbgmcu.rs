//! Debug support (RM0440, section 47.6): identity, and what stops under a debugger; there is none.

use super::{Answer, bit};
use crate::fault::Trouble;

/// Device 0x469 (category 3), revision Z.
const IDCODE: u32 = 0x2003_6469;

/// CR and the freeze registers.
#[derive(Debug, Clone, Default)]
pub struct Dbgmcu {
    registers: [u32; 5],
}

impl Dbgmcu {
    /// DBG_SLEEP: the processor's clock runs on while it sleeps.
    pub fn keeps_clocks_in_sleep(&self) -> bool {
        bit(self.registers[1], 0)
    }

    /// A debugger goes and leaves CR as it was before it came, or as a reset by power leaves it.
    pub fn detach(&mut self) {
        self.registers[1] = 0;
    }

    /// Reads a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&self, offset: u32) -> Answer<u32> {
        match offset {
            0x00 => Ok(IDCODE),
            0x04..=0x10 => Ok(self.registers[offset as usize / 4]),
            _ => Err(Trouble::Register),
        }
    }

    /// Writes a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn write(&mut self, offset: u32, value: u32) -> Answer<()> {
        match offset {
            0x04..=0x10 => self.registers[offset as usize / 4] = value,
            _ => return Err(Trouble::Register),
        }
        Ok(())
    }
}
