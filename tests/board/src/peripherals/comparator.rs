//! The first two comparators (RM0440, section 24) with their thresholds from DAC3 (section 22): COMP1 has PA1 and
//! DAC3's channel 1, COMP2 PA7 and channel 2 (ST's stm32g4xx_hal_comp.h). They look once a sample; their delay of some
//! 20 ns is none here.

use super::{Answer, bit};
use crate::fault::Trouble;

const EN: u32 = 0;
const POLARITY: u32 = 15;
/// INMSEL: a channel of DAC3.
const INVERTING_DAC3: u32 = 0b100 << 4;
/// MCR: both channels to peripherals only, without buffer.
const INTERNAL: u32 = 0b011 | 0b011 << 16;

/// COMP1 and COMP2.
#[derive(Debug, Clone, Default)]
pub struct Comparators {
    csr: [u32; 2],
}

/// DAC3.
#[derive(Debug, Clone, Default)]
pub struct Thresholds {
    cr: u32,
    mcr: u32,
    data: [u32; 2],
}

impl Comparators {
    /// The outputs with these counts at both pins.
    pub fn outputs(&self, counts: u16, thresholds: &Thresholds) -> [bool; 2] {
        std::array::from_fn(|n| {
            let csr = self.csr[n];
            let Some(threshold) = thresholds.level(n).filter(|_| bit(csr, EN)) else { return false };
            (u32::from(counts) > threshold) != bit(csr, POLARITY)
        })
    }

    /// Whether one of them works.
    pub fn any_on(&self) -> bool {
        self.csr.iter().any(|csr| bit(*csr, EN))
    }

    /// Reads a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&self, offset: u32) -> Answer<u32> {
        self.csr.get(offset as usize / 4).copied().ok_or(Trouble::Register)
    }

    /// Writes a register.
    ///
    /// # Errors
    /// One that is not modelled, other inputs than those above, hysteresis, blanking.
    pub fn write(&mut self, offset: u32, value: u32) -> Answer<()> {
        let csr = self.csr.get_mut(offset as usize / 4).ok_or(Trouble::Register)?;
        if value & !(1 << EN | 1 << POLARITY) != INVERTING_DAC3 && value != 0 {
            return Err(Trouble::used("only the first pin against DAC3 is modelled"));
        }
        *csr = value;
        Ok(())
    }
}

impl Thresholds {
    /// What a channel gives to its comparator, counts.
    fn level(&self, channel: usize) -> Option<u32> {
        (bit(self.cr, 16 * channel as u32) && self.mcr & INTERNAL == INTERNAL).then_some(self.data[channel])
    }

    /// Reads a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&self, offset: u32) -> Answer<u32> {
        Ok(match offset {
            0x00 => self.cr,
            0x08 => self.data[0],
            0x14 => self.data[1],
            0x3C => self.mcr,
            _ => return Err(Trouble::Register),
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// One that is not modelled, triggers, waves.
    pub fn write(&mut self, offset: u32, value: u32) -> Answer<()> {
        match offset {
            0x00 if value & !0x1_0001 != 0 => return Err(Trouble::used("triggers and waves of DAC3 are not modelled")),
            0x00 => self.cr = value,
            0x08 => self.data[0] = value & 0xFFF,
            0x14 => self.data[1] = value & 0xFFF,
            // HFSEL is for its speed.
            0x3C if value & !(3 << 14) != INTERNAL => {
                return Err(Trouble::used("of DAC3 only the internal mode is modelled"));
            }
            0x3C => self.mcr = value,
            _ => return Err(Trouble::Register),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_of_two_thresholds() {
        let (mut comparators, mut thresholds) = (Comparators::default(), Thresholds::default());
        for (register, value) in [(0x3C, INTERNAL | 2 << 14), (0x00, 0x1_0001), (0x08, 3000), (0x14, 1000)] {
            thresholds.write(register, value).unwrap();
        }
        assert_eq!(comparators.outputs(4000, &thresholds), [false; 2], "off");
        comparators.write(0, INVERTING_DAC3 | 1).unwrap();
        comparators.write(4, INVERTING_DAC3 | 1 << POLARITY | 1).unwrap();
        for (counts, outputs) in [
            (2000, [false, false]),
            (3000, [false, false]),
            (3001, [true, false]),
            (1001, [false; 2]),
            (1000, [false, true]),
        ] {
            assert_eq!(comparators.outputs(counts, &thresholds), outputs, "{counts}");
        }
        assert!(comparators.write(0, 1).is_err(), "against a part of VREFINT");
    }
}
