//! Independent watchdog (RM0440, section 42): a counter of the 32 kHz oscillator that nothing stops once it runs.

use super::{Answer, NEVER};
use crate::fault::Trouble;

/// LSI, Hz.
const LSI_HZ: u64 = 32_000;

/// The watchdog.
#[derive(Debug, Clone)]
pub struct Iwdg {
    prescaler: u32,
    reload: u32,
    unlocked: bool,
    /// Cycle at which it bites.
    deadline: u64,
}

impl Default for Iwdg {
    fn default() -> Self {
        Self { prescaler: 0, reload: 0xFFF, unlocked: false, deadline: NEVER }
    }
}

impl Iwdg {
    /// When it bites, if nobody pets it.
    pub fn deadline(&self) -> u64 {
        self.deadline
    }

    /// Reads a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&self, offset: u32) -> Answer<u32> {
        match offset {
            0x00 => Ok(0),
            0x04 => Ok(self.prescaler),
            0x08 => Ok(self.reload),
            // SR: new values are taken at once.
            0x0C => Ok(0),
            0x10 => Ok(0xFFF),
            _ => Err(Trouble::Register),
        }
    }

    /// Writes a register, at a time, with the processor's clock.
    ///
    /// # Errors
    /// One that is not modelled; a setting without the key.
    pub fn write(&mut self, offset: u32, value: u32, now: u64, hclk_hz: u32) -> Answer<()> {
        match (offset, value & 0xFFFF) {
            (0x00, 0x5555) => self.unlocked = true,
            (0x00, key @ (0xAAAA | 0xCCCC)) => {
                self.unlocked = false;
                if key == 0xCCCC || self.deadline != NEVER {
                    let ticks = u64::from(self.reload + 1) * (4 << self.prescaler.min(6));
                    self.deadline = now + ticks * u64::from(hclk_hz) / LSI_HZ;
                }
            }
            (0x04 | 0x08, _) if !self.unlocked => return Err(Trouble::used("a setting without the key 0x5555")),
            (0x04, prescaler) => self.prescaler = prescaler & 7,
            (0x08, reload) => self.reload = reload & 0xFFF,
            _ => return Err(Trouble::Register),
        }
        Ok(())
    }
}
