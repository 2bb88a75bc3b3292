//! Power control (RM0440, section 6): the core's voltage range. Changes take effect at once.

use super::Answer;
use crate::fault::Trouble;

/// CR1 … CR4, and CR5 at 0x80; SR1, SR2, SCR; PUCRx and PDCRx.
#[derive(Debug, Clone)]
pub struct Pwr {
    registers: [u32; 0x21],
}

impl Default for Pwr {
    fn default() -> Self {
        let mut registers = [0; 0x21];
        // CR1: range 1; CR3: EIWUL; CR5: R1MODE, no boost.
        (registers[0], registers[2], registers[0x20]) = (0x200, 0x8000, 0x100);
        Self { registers }
    }
}

impl Pwr {
    /// Reads a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&self, offset: u32) -> Answer<u32> {
        match offset {
            0x00..=0x0C | 0x20..=0x54 | 0x80 => Ok(self.registers[offset as usize / 4]),
            // SR1: nothing has woken; SR2: VOSF is clear, REGLPF is clear.
            0x10 | 0x14 => Ok(0),
            _ => Err(Trouble::Register),
        }
    }

    /// Writes a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn write(&mut self, offset: u32, value: u32) -> Answer<()> {
        match offset {
            0x00..=0x0C | 0x20..=0x54 | 0x80 => self.registers[offset as usize / 4] = value,
            // SCR clears flags that are never set.
            0x18 => {}
            _ => return Err(Trouble::Register),
        }
        Ok(())
    }
}
