//! System configuration (RM0440, section 9): registers that keep what is written. The firmware uses no external
//! interrupts (EXTI), so their lines lead nowhere, and EXTI itself is not modelled.

use super::Answer;
use crate::fault::Trouble;

/// MEMRMP, CFGR1, EXTICR1 … EXTICR4, SCSR, CFGR2, SWPR, SKR.
#[derive(Debug, Clone)]
pub struct Syscfg {
    registers: [u32; 10],
}

impl Default for Syscfg {
    fn default() -> Self {
        // CFGR1: interrupts of the FPU are allowed, all but that of an inexact result.
        Self { registers: [0, 0x7C00_0001, 0, 0, 0, 0, 0, 0, 0, 0] }
    }
}

impl Syscfg {
    /// Reads a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&self, offset: u32) -> Answer<u32> {
        self.registers.get(offset as usize / 4).copied().ok_or(Trouble::Register)
    }

    /// Writes a register.
    ///
    /// # Errors
    /// One that is not modelled; a write protection of the CCM-SRAM.
    pub fn write(&mut self, offset: u32, value: u32) -> Answer<()> {
        if offset == 0x20 && value != 0 {
            return Err(Trouble::used("write protection of the CCM-SRAM is not modelled"));
        }
        *self.registers.get_mut(offset as usize / 4).ok_or(Trouble::Register)? = value;
        Ok(())
    }
}
