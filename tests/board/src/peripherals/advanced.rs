//! TIM1 as an output stage (RM0440, section 28): two PWM outputs that the break input gates. It does not count for the
//! program: what is modelled is the share of the period for which an output is high.

use super::{Answer, bit};
use crate::fault::Trouble;

/// BDTR.
const BKE: u32 = 12;
const BKP: u32 = 13;
const AOE: u32 = 14;
const MOE: u32 = 15;
const OSSI: u32 = 10;
/// SR: the break has come.
const BIF: u32 = 1 << 7;
/// AF1: the break's sources, BKIN and the first two comparators, and their polarities.
const BKINE: u32 = 0;
const BKCMP1E: u32 = 1;
const BKCMP2E: u32 = 2;
const POLARITIES: u32 = 0xF << 9;
/// OCxM: PWM mode 1.
const PWM_1: u32 = 0b110;

/// The timer.
#[derive(Debug, Clone)]
pub struct Advanced {
    cr1: u32,
    sr: u32,
    ccmr: [u32; 2],
    ccer: u32,
    arr: u32,
    ccr: [u32; 4],
    bdtr: u32,
    af1: u32,
    /// Levels of the comparators' outputs.
    comparators: [bool; 2],
}

impl Default for Advanced {
    fn default() -> Self {
        Self {
            cr1: 0,
            sr: 0,
            ccmr: [0; 2],
            ccer: 0,
            arr: 0xFFFF,
            ccr: [0; 4],
            bdtr: 0,
            af1: 1,
            comparators: [false; 2],
        }
    }
}

impl Advanced {
    /// The share of the period for which an output is high; channels from 1.
    pub fn duty(&self, channel: usize) -> f64 {
        let n = channel - 1;
        let mode = self.ccmr[n / 2] >> (8 * (n % 2) + 4) & 7;
        let driven = bit(self.cr1, 0) && bit(self.bdtr, MOE) && bit(self.ccer, 4 * n as u32) && mode == PWM_1;
        if driven { (f64::from(self.ccr[n]) / f64::from(self.arr + 1)).min(1.0) } else { 0.0 }
    }

    /// The comparators' outputs have these levels.
    pub fn compare(&mut self, outputs: [bool; 2]) {
        self.comparators = outputs;
        self.watch();
    }

    /// The break acts at once, and is noted.
    fn watch(&mut self) {
        let enabled = [BKCMP1E, BKCMP2E].map(|place| bit(self.af1, place));
        let active = self.comparators.iter().zip(enabled).any(|(output, enabled)| *output && enabled);
        if active && bit(self.bdtr, BKE) {
            self.bdtr &= !(1 << MOE);
            self.sr |= BIF;
        }
    }

    /// Reads a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&self, offset: u32) -> Answer<u32> {
        Ok(match offset {
            0x00 => self.cr1,
            0x04 | 0x08 | 0x0C | 0x28 | 0x30 => 0,
            0x10 => self.sr,
            0x18 | 0x1C => self.ccmr[(offset as usize - 0x18) / 4],
            0x20 => self.ccer,
            0x2C => self.arr,
            0x34..=0x40 => self.ccr[(offset as usize - 0x34) / 4],
            0x44 => self.bdtr,
            0x60 => self.af1,
            _ => return Err(Trouble::Register),
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// One that is not modelled, a mode that is not.
    pub fn write(&mut self, offset: u32, value: u32) -> Answer<()> {
        match offset {
            0x00 if value & !1 == 0 => self.cr1 = value,
            0x00 => return Err(Trouble::used("only counting up without preload is modelled")),
            0x10 => self.sr &= value,
            // Preloads and captures.
            0x18 | 0x1C if value & !0x7070 != 0 => {
                return Err(Trouble::used("only outputs without preload are modelled"));
            }
            0x18 | 0x1C => self.ccmr[(offset as usize - 0x18) / 4] = value,
            0x20 if value & !0x1111 != 0 => return Err(Trouble::used("only plain outputs are modelled")),
            0x20 => self.ccer = value,
            0x2C => self.arr = value & 0xFFFF,
            0x34..=0x40 => self.ccr[(offset as usize - 0x34) / 4] = value & 0xFFFF,
            0x44 => {
                if bit(value, AOE) {
                    return Err(Trouble::used("outputs that come back by themselves are not modelled"));
                }
                if bit(value, MOE) && !(bit(value, BKE) && bit(value, BKP) && bit(value, OSSI)) {
                    return Err(Trouble::used("outputs without a break that is active high are not modelled"));
                }
                self.bdtr = value;
                self.watch();
            }
            0x60 => {
                if bit(value, BKINE) || value & POLARITIES != 0 {
                    return Err(Trouble::used("a break by a pin, or by a low comparator, is not modelled"));
                }
                self.af1 = value;
                self.watch();
            }
            0x04 | 0x08 | 0x0C | 0x28 | 0x30 if value == 0 => {}
            _ => return Err(Trouble::Register),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn armed() -> Advanced {
        let mut timer = Advanced::default();
        for (register, value) in [
            (0x2C, 999),
            (0x18, 0x6000),
            (0x1C, 0x0060),
            (0x20, 0x0110),
            (0x60, 0b110),
            (0x44, 1 << BKE | 1 << BKP | 1 << OSSI),
            (0x00, 1),
            (0x38, 250),
            (0x3C, 1000),
        ] {
            timer.write(register, value).unwrap();
        }
        assert_eq!([2, 3].map(|channel| timer.duty(channel)), [0.0, 0.0], "not before MOE");
        timer.write(0x44, timer.bdtr | 1 << MOE).unwrap();
        timer
    }

    #[test]
    fn outputs_are_gated_by_the_break() {
        let mut timer = armed();
        assert_eq!([1, 2, 3].map(|channel| timer.duty(channel)), [0.0, 0.25, 1.0]);
        for outputs in [[true, false], [false, true]] {
            let mut timer = armed();
            timer.compare(outputs);
            assert_eq!((timer.duty(2), timer.duty(3), timer.read(0x10)), (0.0, 0.0, Ok(BIF)));
            // It is latched, and cannot be undone while the level is there.
            timer.write(0x10, !BIF).unwrap();
            timer.write(0x44, timer.bdtr | 1 << MOE).unwrap();
            assert_eq!((timer.duty(3), timer.read(0x10)), (0.0, Ok(BIF)));
            timer.compare([false; 2]);
            assert_eq!((timer.duty(3), timer.read(0x10)), (0.0, Ok(BIF)), "not by itself");
            timer.write(0x10, !BIF).unwrap();
            timer.write(0x44, timer.bdtr | 1 << MOE).unwrap();
            assert_eq!((timer.duty(3), timer.read(0x10)), (1.0, Ok(0)));
        }
        // A comparator that is not among its sources.
        timer.write(0x60, 0b010).unwrap();
        timer.compare([false, true]);
        assert_eq!(timer.duty(3), 1.0);
        assert!(timer.write(0x44, 1 << MOE).is_err(), "outputs that no break gates");
    }
}
