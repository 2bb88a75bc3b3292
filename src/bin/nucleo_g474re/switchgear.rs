//! What the station switches: TIM1, whose outputs its break input gates, so that the comparators cut the supply while
//! the program does whatever it does.
//!
//! ```text
//! PA1 ── COMP1 (> DAC3 channel 1) ─┐                      ┌─ CH2, PA9: voltage, PWM of 20 kHz
//! PA7 ── COMP2 (< DAC3 channel 2) ─┴─► break of TIM1 ─────┤
//!  (the same signal: A1 to D11)        MOE, BIF           └─ CH3, PA10: contactor
//! ```
//! Which pins and channels reach the comparators is checked against ST's header (stm32g4xx_hal_comp.h: COMP1 has PA1
//! and DAC3 channel 1, COMP2 PA7 and DAC3 channel 2). The alternate function of the outputs is from memory of the data
//! sheet DS12288, and how the break behaves of RM0440, section 28 (advanced-control timers).
#![allow(unsafe_code)]

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, Input, OutputType, Pull, Speed};
use embassy_stm32::pac;
use embassy_stm32::pac::comp::vals::{Inm, Polarity};
use embassy_stm32::pac::dac::vals::Mode;
use embassy_stm32::pac::timer::regs::SrAdv;
use embassy_stm32::pac::timer::vals::{Bkp, Ocm, Ossi};
use embassy_stm32::peripherals::{PA6, PA7, PA9, PA10, PB0, PC7, TIM1};
use greyrig::app;
use greyrig::sequence::Contacts;

use crate::clocks::CLOCK_HZ;

/// Frequency of the voltage's PWM, Hz: two periods a sample, so that a filter of some 100 Hz behind it leaves little of
/// it.
const PWM_HZ: u32 = 20_000;
/// Its period, cycles of the clock: 13 bits.
const PERIOD: u32 = CLOCK_HZ / PWM_HZ;
/// The timer's outputs on its pins: AF6.
const TIM1_OUTPUT: u8 = 6;
/// Channels 2 and 3, from zero.
const VOLTAGE: usize = 1;
const CONTACTOR: usize = 2;

/// Pins and timer.
pub struct Terminals {
    /// Closed (high): START is pressed (D9).
    pub start: Peri<'static, PC7>,
    /// Closed (high): ABORT is not pressed (D12).
    pub abort: Peri<'static, PA6>,
    /// Closed (high): the emergency stop is not pressed (A3).
    pub emergency: Peri<'static, PB0>,
    /// Voltage (D8).
    pub voltage: Peri<'static, PA9>,
    /// Contactor (D2).
    pub contactor: Peri<'static, PA10>,
    /// The current once more, for the second comparator (D11).
    pub current: Peri<'static, PA7>,
    pub timer: Peri<'static, TIM1>,
}

/// The switches, of the sampling interrupt.
pub struct Switchgear {
    start: Input<'static>,
    abort: Input<'static>,
    emergency: Input<'static>,
    /// Where the timer drives; they are inputs again if they are dropped.
    _outputs: [Flex<'static>; 2],
    _current: Peri<'static, PA7>,
    _timer: Peri<'static, TIM1>,
}

impl Switchgear {
    /// With everything off, and the trip not armed.
    pub fn new(terminals: Terminals) -> Self {
        let Terminals { start, abort, emergency, voltage, contactor, current, timer } = terminals;
        pac::RCC.apb2enr().modify(|enable| enable.set_tim1en(true));
        pac::RCC.ahb2enr().modify(|enable| enable.set_dac3en(true));
        comparators();
        outputs();
        // An open wire is low.
        let input = Pull::Down;
        let driven = |mut pin: Flex<'static>| {
            pin.set_as_af_unchecked(TIM1_OUTPUT, AfType::output(OutputType::PushPull, Speed::Low));
            pin
        };
        Self {
            start: Input::new(start, input),
            abort: Input::new(abort, input),
            emergency: Input::new(emergency, input),
            _outputs: [driven(Flex::new(voltage)), driven(Flex::new(contactor))],
            _current: current,
            _timer: timer,
        }
    }
}

/// High where the current is too high (COMP1) or too low (COMP2, inverted).
fn comparators() {
    pac::DAC3.mcr().write(|mode| {
        mode.set_mode(0, Mode::NORMAL_INT_BUFDIS);
        mode.set_mode(1, Mode::NORMAL_INT_BUFDIS);
        // A clock above 160 MHz.
        mode.set_hfsel(2);
    });
    pac::DAC3.cr().write(|control| {
        control.set_en(0, true);
        control.set_en(1, true);
    });
    pac::COMP1.csr().write(|control| {
        control.set_inmsel(Inm::DACA);
        control.set_en(true);
    });
    pac::COMP2.csr().write(|control| {
        control.set_inmsel(Inm::DACA);
        control.set_polarity(Polarity::INVERTED);
        control.set_en(true);
    });
}

/// Both outputs at zero, low while the break holds them off.
fn outputs() {
    let timer = pac::TIM1;
    timer.arr().write(|period| period.set_arr((PERIOD - 1) as u16));
    for channel in [VOLTAGE, CONTACTOR] {
        // Without preload: what is commanded is there at once.
        timer.ccmr_output(channel / 2).modify(|mode| mode.set_ocm(channel % 2, Ocm::PWM_MODE1));
        timer.ccer().modify(|enable| enable.set_cce(channel, true));
    }
    timer.af1().write(|source| {
        source.set_bkine(false);
        source.set_bkcmpe(0, true);
        source.set_bkcmpe(1, true);
    });
    timer.bdtr().write(|gate| {
        gate.set_ossi(Ossi::IDLE_LEVEL);
        gate.set_bkp(0, Bkp::ACTIVE_HIGH);
        gate.set_bke(0, true);
    });
    timer.cr1().write(|control| control.set_cen(true));
}

/// Cuts the supply, whoever asks; only [`app::Switchgear::arm`] undoes it.
pub fn cut() {
    pac::TIM1.bdtr().modify(|gate| gate.set_moe(false));
}

impl app::Switchgear for Switchgear {
    #[inline(always)]
    fn contacts(&mut self) -> Contacts {
        Contacts {
            start: self.start.is_high(),
            abort_closed: self.abort.is_high(),
            emergency_closed: self.emergency.is_high(),
        }
    }

    #[inline(always)]
    fn has_tripped(&mut self) -> bool {
        pac::TIM1.sr().read().bif(0)
    }

    #[inline(always)]
    fn arm(&mut self) {
        // Flags are cleared by zeros.
        let mut flags = SrAdv(u32::MAX);
        flags.set_bif(0, false);
        pac::TIM1.sr().write_value(flags);
        pac::TIM1.bdtr().modify(|gate| gate.set_moe(true));
    }

    fn trip_outside(&mut self, [low, high]: [u16; 2]) {
        // Both converters have twelve bits and the same reference.
        pac::DAC3.dhr12r(0).write(|data| data.set_dhr(high));
        pac::DAC3.dhr12r(1).write(|data| data.set_dhr(low));
    }

    #[inline(always)]
    fn supply(&mut self, closed: bool, fraction: f32) {
        // A compare value of a whole period is always on.
        let whole = if closed { PERIOD } else { 0 };
        pac::TIM1.ccr(VOLTAGE).write(|compare| compare.set_ccr((fraction * PERIOD as f32) as u16));
        pac::TIM1.ccr(CONTACTOR).write(|compare| compare.set_ccr(whole as u16));
    }
}
