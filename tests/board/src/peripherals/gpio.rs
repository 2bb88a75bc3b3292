//! General-purpose pins (RM0440, section 11.4). Inputs read what is connected to them, outputs what
//! they drive.

use super::Answer;
use crate::fault::Trouble;

/// A port of sixteen pins.
#[derive(Debug, Clone)]
pub struct Port {
    /// MODER, OTYPER, OSPEEDR, PUPDR.
    settings: [u32; 4],
    odr: u32,
    afr: [u32; 2],
    /// What is connected to the pins.
    pub levels: u32,
}

/// What a pin is (MODER).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Input.
    Input,
    /// Output of the program.
    Output,
    /// Of a peripheral, with the number of the alternate function.
    Alternate(u32),
    /// Analog.
    Analog,
}

impl Port {
    /// After a reset: analog, but for the pins of the debugger on ports A and B.
    pub fn new(n: usize) -> Self {
        let (moder, speed, pull) = match n {
            0 => (0xABFF_FFFF, 0x0C00_0000, 0x6400_0000),
            1 => (0xFFFF_FEBF, 0x0000_00C0, 0x0000_0100),
            _ => (0xFFFF_FFFF, 0, 0),
        };
        Self { settings: [moder, 0, speed, pull], odr: 0, afr: [0; 2], levels: 0 }
    }

    /// What a pin is.
    pub fn mode(&self, pin: u32) -> Mode {
        match self.settings[0] >> (2 * pin) & 3 {
            0 => Mode::Input,
            1 => Mode::Output,
            2 => Mode::Alternate(self.afr[pin as usize / 8] >> (4 * (pin % 8)) & 0xF),
            _ => Mode::Analog,
        }
    }

    /// Whether the program drives a pin high.
    pub fn is_high(&self, pin: u32) -> bool {
        self.mode(pin) == Mode::Output && self.odr >> pin & 1 == 1
    }

    /// Reads a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&self, offset: u32) -> Answer<u32> {
        match offset {
            0x00..=0x0C => Ok(self.settings[offset as usize / 4]),
            0x10 => Ok((0..16)
                .filter(|&pin| self.is_high(pin) || (self.mode(pin) == Mode::Input && self.levels >> pin & 1 == 1))
                .fold(0, |all, pin| all | 1 << pin)),
            0x14 => Ok(self.odr),
            0x20 | 0x24 => Ok(self.afr[(offset as usize - 0x20) / 4]),
            _ => Err(Trouble::Register),
        }
    }

    /// Writes a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn write(&mut self, offset: u32, value: u32) -> Answer<()> {
        match offset {
            0x00..=0x0C => self.settings[offset as usize / 4] = value,
            0x14 => self.odr = value & 0xFFFF,
            // BSRR: a pin that is set and reset at once is set.
            0x18 => self.odr = self.odr & !(value >> 16) | value & 0xFFFF,
            0x20 | 0x24 => self.afr[(offset as usize - 0x20) / 4] = value,
            0x28 => self.odr &= !value,
            _ => return Err(Trouble::Register),
        }
        Ok(())
    }
}
