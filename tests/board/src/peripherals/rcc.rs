//! Reset and clock control (RM0440, section 7).
//!
//! Oscillators and PLL are ready as soon as they are on. Clocks of peripherals have to be enabled before their
//! registers are used; the machine asks [`Rcc::enabled`].

use super::{Answer, bit};
use crate::fault::Trouble;

/// Why the processor has started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reset {
    /// Power came (section 7.1.1).
    Power,
    /// The program asked for it.
    Software,
    /// The independent watchdog bit.
    Watchdog,
    /// Somebody pressed the button.
    Pin,
}

/// HSI16, Hz.
const HSI_HZ: u64 = 16_000_000;
/// The crystal X3 of the board (UM2505), Hz.
const HSE_HZ: u64 = 24_000_000;
/// The most that the processor may have in range 1 boost mode (section 6.1.5), Hz.
const MOST_HZ: u64 = 170_000_000;

const CR: u32 = 0x00;
const CFGR: u32 = 0x08;
const PLLCFGR: u32 = 0x0C;
const AHB1ENR: u32 = 0x48;
const AHB2ENR: u32 = 0x4C;
const APB1ENR1: u32 = 0x58;
const APB2ENR: u32 = 0x60;
const CCIPR: u32 = 0x88;
const BDCR: u32 = 0x90;
const CSR: u32 = 0x94;
const CRRCR: u32 = 0x98;
const CCIPR2: u32 = 0x9C;

/// Registers that only keep what is written: enable bits, resets, clocks in sleep, choices of clocks.
const PLAIN: [u32; 27] = [
    0x04, 0x18, 0x28, 0x2C, 0x30, 0x38, 0x3C, 0x40, 0x48, 0x4C, 0x50, 0x58, 0x5C, 0x60, 0x68, 0x6C, 0x70, 0x78, 0x7C,
    0x80, CFGR, PLLCFGR, CCIPR, CCIPR2, BDCR, CRRCR, CR,
];

/// What is not zero after a reset; the last six are clocks in sleep.
const RESETS: [(u32, u32); 12] = [
    (CR, 1 << 8),
    (0x04, 0x4000_0000),
    (CFGR, 1),
    (PLLCFGR, 0x1000),
    (AHB1ENR, 1 << 8),
    (APB1ENR1, 1 << 10),
    (0x68, 0x130F),
    (0x6C, 0x050F_667F),
    (0x70, 0x101),
    (0x78, 0xD2FE_CD3F),
    (0x7C, 0x103),
    (0x80, 0x0437_F801),
];

/// The registers.
#[derive(Debug, Clone)]
pub struct Rcc {
    registers: [u32; 0x28],
    /// RMVF clears these (section 7.4.29).
    flags: u32,
    hclk_hz: u32,
}

impl Rcc {
    /// After a reset.
    pub fn new(reset: Reset) -> Self {
        let mut rcc = Self { registers: [0; 0x28], flags: 0, hclk_hz: HSI_HZ as u32 };
        for (offset, value) in RESETS {
            rcc.set(offset, value);
        }
        rcc.flags = match reset {
            Reset::Power => 1 << 27 | 1 << 26,
            Reset::Software => 1 << 28 | 1 << 26,
            Reset::Watchdog => 1 << 29 | 1 << 26,
            Reset::Pin => 1 << 26,
        };
        rcc
    }

    fn get(&self, offset: u32) -> u32 {
        self.registers[offset as usize / 4]
    }

    fn set(&mut self, offset: u32, value: u32) {
        self.registers[offset as usize / 4] = value;
    }

    /// Reads a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&self, offset: u32) -> Answer<u32> {
        let value =
            if PLAIN.contains(&offset) || offset == CSR { self.get(offset) } else { return Err(Trouble::Register) };
        Ok(match offset {
            CR => value | ready(value),
            // SWS follows SW.
            CFGR => value & !(3 << 2) | (value & 3) << 2,
            BDCR | CRRCR => value & !2 | (value & 1) << 1,
            CSR => value & 1 | (value & 1) << 1 | self.flags,
            _ => value,
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// One that is not modelled, a clock that cannot be.
    pub fn write(&mut self, offset: u32, value: u32) -> Answer<()> {
        if offset == CSR {
            if bit(value, 23) {
                self.flags = 0;
            }
            self.set(CSR, value & 1);
            return Ok(());
        }
        if !PLAIN.contains(&offset) {
            return Err(Trouble::Register);
        }
        if offset == PLLCFGR && bit(self.get(CR), 24) {
            return Err(Trouble::used("PLLCFGR is written while the PLL is on"));
        }
        self.set(offset, value);
        if matches!(offset, CR | CFGR | PLLCFGR) {
            self.choose_clock()?;
        }
        Ok(())
    }

    fn choose_clock(&mut self) -> Answer<()> {
        let (cr, cfgr) = (self.get(CR), self.get(CFGR));
        let off = |name: &str| Err(Trouble::used(format!("the processor is to run from {name}, which is off")));
        let hz = match cfgr & 3 {
            1 if bit(cr, 8) => HSI_HZ,
            2 if bit(cr, 16) => HSE_HZ,
            3 if bit(cr, 24) => self.pll_r_hz()?,
            1 => return off("HSI16"),
            2 => return off("HSE"),
            3 => return off("the PLL"),
            _ => return Err(Trouble::used("SW has a reserved value")),
        };
        let hpre = cfgr >> 4 & 0xF;
        // 0b0xxx: not divided; 0b1000 … 0b1111: by 2, 4, 8, 16, 64, 128, 256, 512.
        let shift = if hpre < 8 { 0 } else { [1, 2, 3, 4, 6, 7, 8, 9][hpre as usize - 8] };
        if cfgr >> 8 & 0x3F & 0b10_0100 != 0 {
            return Err(Trouble::used("clocks of APB1 and APB2 that are divided are not modelled"));
        }
        let hz = hz >> shift;
        if hz > MOST_HZ {
            return Err(Trouble::used(format!("{hz} Hz are more than the {MOST_HZ} Hz that the processor may have")));
        }
        self.hclk_hz = hz as u32;
        Ok(())
    }

    fn pll_r_hz(&self) -> Answer<u64> {
        let (cr, pll) = (self.get(CR), self.get(PLLCFGR));
        let source = match pll & 3 {
            2 if bit(cr, 8) => HSI_HZ,
            3 if bit(cr, 16) => HSE_HZ,
            _ => return Err(Trouble::used("the PLL has no source that is on")),
        };
        if !bit(pll, 24) {
            return Err(Trouble::used("the PLL's output R is off"));
        }
        let (m, n, r) = (u64::from(pll >> 4 & 0xF) + 1, u64::from(pll >> 8 & 0x7F), 2 * (u64::from(pll >> 25 & 3) + 1));
        Ok(source * n / m / r)
    }

    /// Clock of processor, buses and timers, Hz.
    pub fn hclk_hz(&self) -> u32 {
        self.hclk_hz
    }

    /// Clock of ADC1 and ADC2 before their own prescaler, Hz (section 7.4.27, ADC12SEL).
    pub fn adc12_hz(&self) -> Answer<u32> {
        match self.get(CCIPR) >> 28 & 3 {
            2 => Ok(self.hclk_hz),
            _ => Err(Trouble::used("only the system clock is modelled as that of ADC1 and ADC2")),
        }
    }

    /// Whether the clock of the peripheral at an address is on.
    pub fn enabled(&self, base: u32) -> bool {
        let (register, place) = match base {
            0x4000_0000 => (APB1ENR1, 0),
            0x4000_0C00 => (APB1ENR1, 3),
            0x4000_4400 => (APB1ENR1, 17),
            0x4000_7000 => (APB1ENR1, 28),
            // The comparators have the clock of SYSCFG.
            0x4001_0000 | 0x4001_0200 => (APB2ENR, 0),
            0x4001_2C00 => (APB2ENR, 11),
            0x4001_4000 => (APB2ENR, 16),
            0x4002_0000 => (AHB1ENR, 0),
            0x4002_0800 => (AHB1ENR, 2),
            0x4800_0000..0x4800_1C00 => (AHB2ENR, (base - 0x4800_0000) / 0x400),
            0x5000_0000 => (AHB2ENR, 13),
            0x5000_1000 => (AHB2ENR, 18),
            _ => return true,
        };
        bit(self.get(register), place)
    }
}

/// HSIRDY (10), HSERDY (17) and PLLRDY (25) follow HSION, HSEON and PLLON.
fn ready(cr: u32) -> u32 {
    (cr >> 8 & 1) << 10 | (cr >> 16 & 1) << 17 | (cr >> 24 & 1) << 25
}
