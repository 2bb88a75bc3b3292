//! ADC1 with its injected sequence (RM0440, section 21), and the settings common to ADC1 and ADC2.
//!
//! Regular conversions, watchdogs, oversampling and other resolutions than 12 bits are errors. Calibration and the
//! start take the time that the manual states; a conversion takes its sampling time and 12.5 cycles of the converter's
//! clock.

use super::{Answer, NEVER, bit};
use crate::analog::Analog;
use crate::fault::Trouble;

const ADEN: u32 = 0;
const ADDIS: u32 = 1;
const JADSTART: u32 = 3;
const JADSTP: u32 = 5;
const ADVREGEN: u32 = 28;
const DEEPPWD: u32 = 29;
const ADCAL: u32 = 31;

const ADRDY: u32 = 1;
const JEOC: u32 = 1 << 5;
const JEOS: u32 = 1 << 6;

/// External trigger 2 of the injected sequence of ADC1: TIM2_TRGO (table of injected triggers of ADC1 and ADC2).
const TIM2_TRGO: u32 = 2;
/// Cycles of the converter that a calibration takes (data sheet DS12288, ADC characteristics).
const CALIBRATION: u64 = 116;
/// Time that the voltage regulator needs (DS12288), µs.
const REGULATOR_US: u64 = 20;
/// Half cycles of the sampling times (SMPR1).
const SAMPLING: [u64; 8] = [5, 13, 25, 49, 95, 185, 495, 1281];
/// Half cycles of a conversion of 12 bits.
const CONVERSION: u64 = 25;

/// The converter.
#[derive(Debug, Clone)]
pub struct Adc {
    isr: u32,
    ier: u32,
    cr: u32,
    cfgr: u32,
    smpr: [u32; 2],
    jsqr: u32,
    jdr: [u16; 4],
    /// What a running sequence will give.
    coming: [u16; 4],
    difsel: u32,
    /// CCR of the common registers.
    ccr: u32,
    /// When the regulator is ready, the calibration over, the converter on, the sequence converted.
    regulated: u64,
    calibrated: u64,
    on: u64,
    converted: u64,
    /// When the last sequence ended.
    ended: u64,
    /// Sequences since the reset.
    sequences: u64,
    /// Triggers that came while a sequence was running, and were ignored.
    ignored: u64,
}

impl Default for Adc {
    fn default() -> Self {
        Self {
            isr: 0,
            ier: 0,
            cr: 1 << DEEPPWD,
            cfgr: 1 << 31,
            smpr: [0; 2],
            jsqr: 0,
            jdr: [0; 4],
            coming: [0; 4],
            difsel: 0,
            ccr: 0,
            regulated: NEVER,
            calibrated: NEVER,
            on: NEVER,
            converted: NEVER,
            ended: 0,
            sequences: 0,
            ignored: 0,
        }
    }
}

/// Clocks of the processor and of the converter before its prescaler, Hz.
#[derive(Debug, Clone, Copy)]
pub struct Clocks {
    /// Of the processor.
    pub hclk_hz: u32,
    /// Of the converter.
    pub adc_hz: u32,
}

impl Adc {
    /// When something is done.
    pub fn next(&self) -> u64 {
        self.calibrated.min(self.on).min(self.converted)
    }

    /// Time has passed.
    pub fn advance(&mut self, now: u64) {
        if now >= self.calibrated {
            self.calibrated = NEVER;
            self.cr &= !(1 << ADCAL);
        }
        if now >= self.on {
            self.on = NEVER;
            self.isr |= ADRDY;
        }
        if now >= self.converted {
            self.ended = self.converted;
            self.converted = NEVER;
            self.jdr = self.coming;
            self.isr |= JEOC | JEOS;
            self.sequences += 1;
        }
    }

    /// Whether its interrupt's line is high.
    pub fn interrupts(&self) -> bool {
        self.isr & self.ier != 0
    }

    /// When the last sequence ended.
    pub fn ended(&self) -> u64 {
        self.ended
    }

    /// Triggers that came during a sequence and were ignored.
    pub fn ignored(&self) -> u64 {
        self.ignored
    }

    /// Sequences converted since the reset.
    pub fn sequences(&self) -> u64 {
        self.sequences
    }

    /// Cycles of the converter's clock, in halves, as cycles of the processor.
    fn cycles(&self, halves: u64, clocks: Clocks) -> Answer<u64> {
        if self.ccr >> 16 & 3 != 0 {
            return Err(Trouble::used("CKMODE: only the asynchronous clock is modelled"));
        }
        let divisor = [1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256].get(self.ccr as usize >> 18 & 0xF).copied();
        let divisor = divisor.ok_or_else(|| Trouble::used("PRESC has a reserved value"))?;
        let hz = u64::from(clocks.adc_hz) / divisor;
        if hz > 60_000_000 {
            return Err(Trouble::used(format!("a clock of {hz} Hz; 60 MHz are allowed (DS12288)")));
        }
        Ok((halves * u64::from(clocks.hclk_hz)).div_ceil(2 * hz))
    }

    /// The timer's trigger output has risen: starts the injected sequence, if it waits for this trigger (section
    /// 21.4.18).
    ///
    /// # Errors
    /// A setting that is not modelled, an input that is not connected.
    pub fn trigger(&mut self, at: u64, clocks: Clocks, analog: &mut dyn Analog) -> Answer<()> {
        let (source, edge) = (self.jsqr >> 2 & 0x1F, self.jsqr >> 7 & 3);
        if !bit(self.cr, JADSTART) || source != TIM2_TRGO || edge != 1 {
            return Ok(());
        }
        if self.converted != NEVER {
            self.ignored += 1;
            return Ok(());
        }
        analog.begin(at as f64 / f64::from(clocks.hclk_hz));
        let mut halves = 0;
        for n in 0..=(self.jsqr as usize & 3) {
            let input = (self.jsqr >> (9 + 6 * n) & 0x1F) as u8;
            let time = self.smpr[usize::from(input) / 10] >> (3 * (input % 10)) & 7;
            halves += SAMPLING[time as usize] + CONVERSION;
            self.coming[n] = analog
                .convert(input)
                .ok_or_else(|| Trouble::used(format!("input {input} is converted, to which nothing is connected")))?;
        }
        self.converted = at + self.cycles(halves, clocks)?;
        Ok(())
    }

    /// Inputs of the injected sequence.
    pub fn inputs(&self) -> impl Iterator<Item = u8> {
        let jsqr = self.jsqr;
        (0..=(jsqr & 3)).map(move |n| (jsqr >> (9 + 6 * n) & 0x1F) as u8)
    }

    /// Reads a register of ADC1 (below 0x100) or of those common to both (from 0x300 on).
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&self, offset: u32) -> Answer<u32> {
        Ok(match offset {
            0x00 => self.isr,
            0x04 => self.ier,
            0x08 => self.cr,
            0x0C => self.cfgr,
            // CFGR2: no oversampling.
            0x10 => 0,
            0x14 | 0x18 => self.smpr[(offset as usize - 0x14) / 4],
            0x4C => self.jsqr,
            0x80..=0x8C => self.jdr[(offset as usize - 0x80) / 4].into(),
            0xB0 => self.difsel,
            0x308 => self.ccr,
            _ => return Err(Trouble::Register),
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// One that is not modelled, what the manual forbids.
    pub fn write(&mut self, offset: u32, value: u32, now: u64, clocks: Clocks) -> Answer<()> {
        let stopped = !bit(self.cr, JADSTART);
        match offset {
            0x00 => self.isr &= !value,
            0x04 => self.ier = value,
            0x08 => self.control(value, now, clocks)?,
            0x0C => {
                // JQDIS and what belongs to regular conversions may stand as they like.
                if value & (3 << 3) != 0 || bit(value, 20) || bit(value, 21) || bit(value, 25) {
                    return Err(Trouble::used("CFGR: only 12 bits without JDISCEN, JQM and JAUTO are modelled"));
                }
                self.cfgr = value;
            }
            0x10 if value != 0 => return Err(Trouble::used("oversampling is not modelled")),
            0x10 => {}
            0x14 | 0x18 if stopped => self.smpr[(offset as usize - 0x14) / 4] = value,
            0x4C => self.jsqr = value,
            0xB0 if value != 0 => return Err(Trouble::used("differential inputs are not modelled")),
            0xB0 => self.difsel = value,
            0x308 if value & !(3 << 16 | 0xF << 18) == 0 => self.ccr = value,
            0x14 | 0x18 | 0x308 => return Err(Trouble::used(format!("{value:#x} is written to {offset:#x}"))),
            _ => return Err(Trouble::Register),
        }
        Ok(())
    }

    /// CR, whose bits are set by the program and cleared by the converter (section 21.7.3).
    fn control(&mut self, value: u32, now: u64, clocks: Clocks) -> Answer<()> {
        let rises = |place| bit(value, place) && !bit(self.cr, place);
        if rises(ADVREGEN) {
            self.regulated = now + REGULATOR_US * u64::from(clocks.hclk_hz) / 1_000_000;
        }
        let regulated = now >= self.regulated;
        if rises(ADCAL) {
            if !regulated || bit(self.cr, ADEN) {
                return Err(Trouble::used("a calibration before the regulator is ready, or with the converter on"));
            }
            self.calibrated = now + self.cycles(2 * CALIBRATION, clocks)?;
        }
        if rises(ADEN) {
            if !regulated || bit(self.cr, ADCAL) || bit(value, ADCAL) {
                return Err(Trouble::used("ADEN before the regulator is ready, or during a calibration"));
            }
            // One conversion (DS12288, t_STAB).
            self.on = now + self.cycles(2 * CONVERSION, clocks)?;
        }
        if rises(JADSTART) {
            if !bit(self.cr, ADEN) || self.on != NEVER {
                return Err(Trouble::used("JADSTART before the converter is on"));
            }
            if self.jsqr >> 7 & 3 == 0 {
                return Err(Trouble::used("an injected sequence that the program starts is not modelled"));
            }
        }
        if bit(value, 2) {
            return Err(Trouble::used("regular conversions are not modelled"));
        }
        // DEEPPWD and ADVREGEN can be cleared by the program; the others only set.
        let free = 1 << DEEPPWD | 1 << ADVREGEN | 1 << 30;
        self.cr = self.cr & !free | value & (free | 1 << ADCAL | 1 << ADEN | 1 << JADSTART);
        if bit(value, ADDIS) {
            self.cr &= !(1 << ADEN);
        }
        if bit(value, JADSTP) {
            self.cr &= !(1 << JADSTART);
            self.converted = NEVER;
        }
        Ok(())
    }
}
