//! General-purpose timers (RM0440, sections 29 and 30: TIM2, TIM5; 31: TIM15), counting up, with update and compare events.
//! TIM5 can be clocked by the trigger of TIM2 (external clock mode 1).
//!
//! Prescaler and period take effect at the next update event, or at once if they are written while the counter stands
//! still (ARR without ARPE always at once). Inputs, outputs, other slave modes and one-pulse mode are errors.

use super::{Answer, NEVER, bit};
use crate::fault::Trouble;

const CEN: u32 = 0;
const UDIS: u32 = 1;
const URS: u32 = 2;
const UIF: u32 = 1;
/// MMS: the update event is the trigger output.
const MMS_UPDATE: u32 = 0b010;
/// SMS: each rising edge of the trigger input is a clock; TS: that is ITR1.
const COUNTS_ITR1: u32 = 0b111 | 1 << 4;

/// A timer.
#[derive(Debug, Clone)]
pub struct Timer {
    /// Highest count: 16 or 32 bits.
    widest: u32,
    /// Compare channels.
    channels: usize,
    cr1: u32,
    cr2: u32,
    smcr: u32,
    dier: u32,
    sr: u32,
    ccmr: [u32; 2],
    ccer: u32,
    bdtr: u32,
    /// PSC as written, and as it counts.
    prescaler: [u32; 2],
    /// ARR as written, and as it counts.
    period: [u32; 2],
    ccr: [u32; 4],
    /// The count at cycle `since`, from which the prescaler counts.
    count: u32,
    since: u64,
    /// Cycle of the last update event that nobody has asked for yet.
    trigger: Option<u64>,
}

impl Timer {
    /// TIM2: 32 bits, four channels.
    pub fn tim2() -> Self {
        Self::new(u32::MAX, 4)
    }

    /// TIM5: as TIM2.
    pub fn tim5() -> Self {
        Self::tim2()
    }

    /// TIM15: 16 bits, two channels.
    pub fn tim15() -> Self {
        Self::new(0xFFFF, 2)
    }

    fn new(widest: u32, channels: usize) -> Self {
        Self {
            widest,
            channels,
            cr1: 0,
            cr2: 0,
            smcr: 0,
            dier: 0,
            sr: 0,
            ccmr: [0; 2],
            ccer: 0,
            bdtr: 0,
            prescaler: [0; 2],
            period: [widest; 2],
            ccr: [0; 4],
            count: 0,
            since: 0,
            trigger: None,
        }
    }

    /// BDTR: TIM15 has it, TIM2 has not.
    fn has_break(&self) -> bool {
        self.channels == 2
    }

    /// Whether its own clock makes it count.
    fn runs(&self) -> bool {
        bit(self.cr1, CEN) && self.smcr == 0
    }

    /// An edge of ITR1 comes.
    pub fn clock(&mut self, now: u64) {
        if !bit(self.cr1, CEN) || self.smcr != COUNTS_ITR1 {
            return;
        }
        self.since = now;
        if self.count >= self.period[1] {
            self.count = 0;
            self.update(true);
        } else {
            self.count += 1;
        }
    }

    /// Cycles of a count.
    fn step(&self) -> u64 {
        u64::from(self.prescaler[1]) + 1
    }

    /// Cycles until the count is `count` next, from `since` on; it takes a whole period to come back to where it is.
    fn until(&self, count: u32) -> u64 {
        // A count beyond a period that was shortened runs to the widest first.
        let last = if self.count > self.period[1] { self.widest } else { self.period[1] };
        let period = u64::from(last) + 1;
        let ahead = if count > self.count {
            u64::from(count - self.count)
        } else {
            period + u64::from(count) - u64::from(self.count)
        };
        ahead * self.step()
    }

    /// When something happens that an interrupt or another peripheral waits for.
    pub fn next(&self) -> u64 {
        if let Some(at) = self.trigger {
            return at;
        }
        if !self.runs() {
            return NEVER;
        }
        let wanted = self.sr & 0x1F ^ 0x1F;
        let mut cycles = NEVER;
        if self.dier & wanted & UIF != 0 || self.is_master() {
            cycles = self.until(0);
        }
        for n in 0..self.channels {
            if self.dier & wanted & 2 << n != 0 && self.ccr[n] <= self.period[1] {
                cycles = cycles.min(self.until(self.ccr[n]));
            }
        }
        self.since.saturating_add(cycles)
    }

    fn is_master(&self) -> bool {
        self.cr2 >> 4 & 7 == MMS_UPDATE && !bit(self.cr1, UDIS)
    }

    /// Time has passed.
    pub fn advance(&mut self, now: u64) {
        while self.runs() {
            let wrap = self.until(0);
            let passed = (now - self.since).min(wrap) / self.step();
            if passed == 0 {
                return;
            }
            let before = self.count;
            let wraps = passed * self.step() == wrap;
            // Reached in this stretch: counts above the one it began with, or zero at its end.
            let last = if wraps { self.period[1].max(before) } else { before + passed as u32 };
            for n in 0..self.channels {
                let at = self.ccr[n];
                if (at > before && at <= last) || (wraps && at == 0) {
                    self.sr |= 2 << n;
                }
            }
            self.since += passed * self.step();
            self.count = if wraps { 0 } else { last };
            if wraps {
                self.update(true);
            }
        }
        if !self.runs() {
            self.since = now;
        }
    }

    /// An update event (section 29.4.3): shadow registers are loaded.
    fn update(&mut self, flag: bool) {
        if bit(self.cr1, UDIS) {
            return;
        }
        self.prescaler[1] = self.prescaler[0];
        self.period[1] = self.period[0];
        if flag {
            self.sr |= UIF;
        }
        if self.is_master() {
            self.trigger = Some(self.since);
        }
    }

    /// The cycle of the trigger output, once.
    pub fn take_trigger(&mut self) -> Option<u64> {
        self.trigger.take()
    }

    /// Whether its interrupt's line is high.
    pub fn interrupts(&self) -> bool {
        self.sr & self.dier & 0x1F != 0
    }

    /// Reads a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&self, offset: u32) -> Answer<u32> {
        Ok(match offset {
            0x00 => self.cr1,
            0x04 => self.cr2,
            0x08 => self.smcr,
            0x0C => self.dier,
            0x10 => self.sr,
            0x14 => 0,
            0x18 | 0x1C => self.ccmr[(offset as usize - 0x18) / 4],
            0x20 => self.ccer,
            0x24 => self.count,
            0x28 => self.prescaler[0],
            0x2C => self.period[0],
            0x34..=0x40 if (offset as usize - 0x34) / 4 < self.channels => self.ccr[(offset as usize - 0x34) / 4],
            0x44 if self.has_break() => self.bdtr,
            _ => return Err(Trouble::Register),
        })
    }

    /// Writes a register; time has been passed on before.
    ///
    /// # Errors
    /// One that is not modelled, a mode that is not.
    pub fn write(&mut self, offset: u32, value: u32, now: u64) -> Answer<()> {
        match offset {
            0x00 => {
                if value & 0b111_1000 != 0 {
                    return Err(Trouble::used("counting down, centred or once is not modelled"));
                }
                if !self.runs() {
                    self.since = now;
                }
                self.cr1 = value;
            }
            0x04 => {
                if value & !0x70 != 0 || !matches!(value >> 4 & 7, 0 | MMS_UPDATE) {
                    return Err(Trouble::used("only RESET and UPDATE are modelled as master modes"));
                }
                self.cr2 = value;
            }
            // Field by field: the source alone does nothing yet.
            0x08 if value & !COUNTS_ITR1 == 0 && matches!(value & 7, 0 | 7) => {
                self.smcr = if value & 7 == 0 && value >> 4 == 0 { 0 } else { value };
                self.since = now;
            }
            0x08 => return Err(Trouble::used("of the slave modes only a clock by ITR1 is modelled")),
            0x0C => {
                if value & !0x1F != 0 {
                    return Err(Trouble::used("requests to the DMA are not modelled"));
                }
                self.dier = value;
            }
            // Flags are cleared by zeros.
            0x10 => self.sr &= value,
            0x14 => {
                if value & !1 != 0 {
                    return Err(Trouble::used("only UG is modelled in EGR"));
                }
                self.count = 0;
                self.since = now;
                self.update(!bit(self.cr1, URS));
            }
            0x18 | 0x1C => {
                if value & 0x0303 != 0 {
                    return Err(Trouble::used("captures are not modelled"));
                }
                self.ccmr[(offset as usize - 0x18) / 4] = value;
            }
            0x20 if value != 0 => return Err(Trouble::used("outputs are not modelled")),
            0x20 => self.ccer = value,
            0x24 => {
                self.count = value & self.widest;
                self.since = now;
            }
            0x28 => self.prescaler[0] = value & 0xFFFF,
            0x2C => {
                self.period[0] = value & self.widest;
                if !bit(self.cr1, 7) {
                    self.period[1] = self.period[0];
                }
            }
            0x34..=0x40 if (offset as usize - 0x34) / 4 < self.channels => {
                self.ccr[(offset as usize - 0x34) / 4] = value & self.widest;
            }
            0x44 if self.has_break() => self.bdtr = value,
            _ => return Err(Trouble::Register),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RM0440, section 29.4.1: an update every (PSC + 1)(ARR + 1) cycles.
    #[test]
    fn updates_come_every_period() {
        let mut timer = Timer::tim2();
        for (register, value) in [(0x28, 3), (0x2C, 9), (0x04, MMS_UPDATE << 4), (0x14, 1), (0x00, 1)] {
            timer.write(register, value, 1000).unwrap();
        }
        assert_eq!(timer.take_trigger(), Some(1000), "UG is an update event, too");
        assert_eq!(timer.next(), 1040);
        timer.advance(1039);
        assert_eq!((timer.read(0x24), timer.take_trigger()), (Ok(9), None));
        timer.advance(1041);
        assert_eq!((timer.read(0x24), timer.take_trigger(), timer.next()), (Ok(0), Some(1040), 1080));
    }

    /// RM0440, section 29.4.23: in external clock mode 1 the counter counts edges of the trigger, and nothing else.
    #[test]
    fn a_slave_counts_triggers() {
        let mut timer = Timer::tim5();
        for (register, value) in [(0x08, 1 << 4), (0x08, 1 << 4 | 7), (0x00, 1)] {
            timer.write(register, value, 0).unwrap();
        }
        timer.advance(1_000_000);
        assert_eq!((timer.read(0x24), timer.next()), (Ok(0), NEVER));
        for n in 1..=3 {
            timer.clock(1_000_000 + n);
        }
        assert_eq!(timer.read(0x24), Ok(3));
        assert!(timer.write(0x08, 7, 0).is_ok_and(|()| {
            timer.clock(0);
            timer.read(0x24) == Ok(3)
        }));
        assert!(timer.write(0x08, 0b110, 0).is_err(), "trigger mode");
    }

    #[test]
    fn compare_sets_its_flag_when_the_count_gets_there() {
        let mut timer = Timer::tim15();
        for (register, value) in [(0x34, 5), (0x0C, 2), (0x00, 1)] {
            timer.write(register, value, 0).unwrap();
        }
        assert_eq!(timer.next(), 5);
        timer.advance(4);
        assert!(!timer.interrupts());
        timer.advance(5);
        assert!(timer.interrupts());
        timer.write(0x10, !2, 6).unwrap();
        assert!(!timer.interrupts());
    }
}
