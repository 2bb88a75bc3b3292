//! The processor's own registers beside the interrupt controller's (ARMv7-M ARM, chapters B3 and C1): system control
//! block, SysTick, cycle counter, floating-point context control.

use super::{Answer, NEVER, bit};
use crate::exceptions::Exceptions;
use crate::fault::Trouble;

/// What a write asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wish {
    /// Nothing more.
    Nothing,
    /// AIRCR.SYSRESETREQ.
    Reset,
}

/// The registers.
#[derive(Debug, Clone)]
pub struct System {
    /// Where the vectors are.
    pub vtor: u32,
    /// SCR.SEVONPEND.
    pub event_on_pending: bool,
    scr: u32,
    ccr: u32,
    shcsr: u32,
    /// CFSR, HFSR, MMFAR, BFAR.
    pub cfsr: u32,
    /// HardFault status.
    pub hfsr: u32,
    cpacr: u32,
    demcr: u32,
    /// FPCCR without LSPACT.
    fpccr: u32,
    /// FPCAR.
    fpcar: u32,
    /// FPCCR.LSPACT: the floating-point registers of an interrupted program still have to be written to FPCAR.
    lazy: bool,
    fpdscr: u32,
    dwt: u32,
    /// CYCCNT is the cycle less this.
    counted_from: u64,
    systick: SysTick,
}

#[derive(Debug, Clone, Default)]
struct SysTick {
    csr: u32,
    reload: u32,
    /// Cycle of the next time that it reaches zero.
    zero: u64,
}

impl Default for System {
    fn default() -> Self {
        Self {
            vtor: 0,
            event_on_pending: false,
            scr: 0,
            ccr: 0x200,
            shcsr: 0,
            cfsr: 0,
            hfsr: 0,
            cpacr: 0,
            demcr: 0,
            fpccr: 0xC000_0000,
            fpcar: 0,
            lazy: false,
            fpdscr: 0,
            dwt: 0x4000_0000,
            counted_from: 0,
            systick: SysTick { zero: NEVER, ..SysTick::default() },
        }
    }
}

const AIRCR_KEY: u32 = 0x05FA;
/// Cortex-M4 r0p1.
const CPUID: u32 = 0x410F_C241;

impl System {
    /// When SysTick reaches zero.
    pub fn next(&self) -> u64 {
        self.systick.zero
    }

    /// Whether CPACR lets privileged programs use the FPU (ARMv7-M ARM, section B3.2.20).
    #[inline]
    pub fn fpu_is_on(&self) -> bool {
        self.cpacr >> 20 & 0b0101 == 0b0101
    }

    /// An exception's frame has room for floating-point registers here. Says whether they have to be written there at
    /// once.
    pub fn reserve(&mut self, address: u32) -> bool {
        self.lazy = bit(self.fpccr, 30);
        self.fpcar = address;
        !self.lazy
    }

    /// Where floating-point registers still have to be written, if they have; from now on they have not.
    #[inline]
    pub fn take_reserved(&mut self) -> Option<u32> {
        std::mem::take(&mut self.lazy).then_some(self.fpcar)
    }

    /// Time has passed; says whether SysTick's exception becomes pending.
    pub fn advance(&mut self, now: u64) -> bool {
        let timer = &mut self.systick;
        if now < timer.zero {
            return false;
        }
        let period = u64::from(timer.reload) + 1;
        timer.zero += ((now - timer.zero) / period + 1) * period;
        timer.csr |= 1 << 16;
        bit(timer.csr, 1)
    }

    /// Reads a register, by its address within 0xE000_0000 …
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&mut self, offset: u32, now: u64, exceptions: &Exceptions, active: u32) -> Answer<u32> {
        Ok(match offset {
            0x1000 => self.dwt,
            0x1004 => {
                if self.counts() {
                    (now - self.counted_from) as u32
                } else {
                    self.counted_from as u32
                }
            }
            0xE010 => {
                let value = self.systick.csr;
                self.systick.csr &= !(1 << 16);
                value
            }
            0xE014 => self.systick.reload,
            0xE018 => {
                if self.systick.zero == NEVER {
                    0
                } else {
                    (self.systick.zero - now) as u32
                }
            }
            0xE100..0xE500 => exceptions.read(offset - 0xE100).ok_or(Trouble::Register)?,
            0xED00 => CPUID,
            0xED04 => exceptions.icsr() | active,
            0xED08 => self.vtor,
            0xED0C => 0xFA05_0000,
            0xED10 => self.scr,
            0xED14 => self.ccr,
            0xED18..=0xED20 => exceptions.priorities((offset - 0xED18) as usize + 4),
            0xED24 => self.shcsr,
            0xED28 => self.cfsr,
            0xED2C => self.hfsr,
            // DFSR, MMFAR, BFAR.
            0xED30..=0xED38 => 0,
            0xED88 => self.cpacr,
            0xEDF0 => 0,
            0xEDFC => self.demcr,
            0xEF34 => self.fpccr | u32::from(self.lazy),
            0xEF38 => self.fpcar,
            0xEF3C => self.fpdscr,
            _ => return Err(Trouble::Register),
        })
    }

    /// The processor's clock has stood for so many cycles, and with it the cycle counter. No manual says so; users of
    /// such chips report it.
    pub fn stand_still(&mut self, cycles: u64) {
        if self.counts() {
            self.counted_from += cycles;
        }
    }

    fn counts(&self) -> bool {
        bit(self.dwt, 0) && bit(self.demcr, 24)
    }

    fn keep_count(&mut self, now: u64, change: impl FnOnce(&mut Self)) {
        let count = if self.counts() { now - self.counted_from } else { self.counted_from };
        change(self);
        self.counted_from = if self.counts() { now - count } else { count };
    }

    /// Writes a register.
    ///
    /// # Errors
    /// One that is not modelled, what is forbidden.
    pub fn write(
        &mut self,
        offset: u32,
        bytes: usize,
        value: u32,
        now: u64,
        exceptions: &mut Exceptions,
    ) -> Answer<Wish> {
        match offset {
            0xE100..0xE500 => exceptions.write(offset - 0xE100, bytes, value).ok_or(Trouble::Register)?,
            0xED18..0xED24 => exceptions.set_priorities((offset - 0xED18) as usize + 4, bytes, value),
            _ if bytes != 4 => return Err(Trouble::used(format!("{bytes} bytes are written to a word"))),
            0x1000 if value & !1 & !0x4000_0000 == 0 => self.keep_count(now, |s| s.dwt = 0x4000_0000 | value & 1),
            0x1004 => {
                self.counted_from = if self.counts() { now.wrapping_sub(value.into()) } else { value.into() };
            }
            // LAR of the DWT.
            0x1FB0 => {}
            0xE010 => {
                if value & 1 == 0 {
                    self.systick.zero = NEVER;
                } else {
                    if !bit(value, 2) {
                        return Err(Trouble::used("SysTick's external clock is not modelled"));
                    }
                    if self.systick.zero == NEVER {
                        self.systick.zero = now + u64::from(self.systick.reload) + 1;
                    }
                }
                self.systick.csr = value & 7;
            }
            0xE014 => self.systick.reload = value & 0xFF_FFFF,
            0xE018 => {
                if self.systick.zero != NEVER {
                    self.systick.zero = now + u64::from(self.systick.reload) + 1;
                }
            }
            0xED04 => exceptions.write_icsr(value),
            0xED08 => self.vtor = value & !0x7F,
            0xED0C => {
                if value >> 16 != AIRCR_KEY {
                    return Ok(Wish::Nothing);
                }
                if value >> 8 & 7 > 3 {
                    return Err(Trouble::used("groups of priorities are not modelled"));
                }
                if bit(value, 2) {
                    return Ok(Wish::Reset);
                }
            }
            0xED10 => {
                if bit(value, 1) {
                    return Err(Trouble::used("SLEEPONEXIT is not modelled"));
                }
                self.scr = value;
                self.event_on_pending = bit(value, 4);
            }
            0xED14 if bit(value, 9) => self.ccr = value,
            0xED14 => return Err(Trouble::used("a stack aligned to four bytes is not modelled")),
            0xED24 => self.shcsr = value,
            0xED28 => self.cfsr &= !value,
            0xED2C => self.hfsr &= !value,
            0xED30 => {}
            0xED88 => self.cpacr = value,
            0xEDFC => self.keep_count(now, |s| s.demcr = value),
            // ASPEN has to stay: the emulator keeps track of floating-point contexts by it.
            0xEF34 if bit(value, 31) && bit(value, 0) == self.lazy => self.fpccr = value & 0xC000_0000,
            0xEF34 => return Err(Trouble::used("FPCCR: only LSPEN can be changed")),
            0xEF3C if value == 0 => self.fpdscr = value,
            _ => return Err(Trouble::Register),
        }
        Ok(Wish::Nothing)
    }
}
