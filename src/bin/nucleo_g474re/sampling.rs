//! The sampling interrupt: TIM2 starts the injected sequence of ADC1 10,000 times a second, and its end interrupts.
//! TIM5 counts the same trigger (RM0440, internal triggers of the timers: TIM2_TRGO is ITR1), so that samples are
//! numbered by hardware that counts whether the processor sleeps or not.
//!
//! The three channels follow one another by (24.5 + 12.5) cycles of 42.5 MHz, 0.87 µs each (RM0440, timing of the
//! converter); recordings say so, and the fit corrects it.
#![allow(unsafe_code)]

use core::ptr;
use core::sync::atomic::{AtomicPtr, Ordering};

use cortex_m::peripheral::DWT;
use embassy_stm32::adc::{Adc, AdcChannel, AdcConfig, Exten, InjectedAdc, SampleTime};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac;
use embassy_stm32::pac::timer::vals::{Mms, Sms, Ts};
use embassy_stm32::peripherals::{ADC1, PA0, PA1, PA8, PC0, TIM2, TIM5};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::{RoundTo, Timer};
use embassy_stm32::{Peri, interrupt, triggers};
use greyrig::app::grid::Grid;
use greyrig::app::{Sampler, Station};
use greyrig::hardware::NUCLEO_G474RE;
use greyrig::parameters::Active;
use greyrig::sequence::Sequence;
use greyrig::units::Counts;
use static_cell::StaticCell;

use crate::clocks::CLOCK_HZ;
use crate::firmware::SHARED;
use crate::switchgear::Switchgear;

/// What the board gives to sampling.
pub struct Converter {
    pub adc: Peri<'static, ADC1>,
    pub voltage: Peri<'static, PA0>,
    pub current: Peri<'static, PA1>,
    pub speed: Peri<'static, PC0>,
    pub timer: Peri<'static, TIM2>,
    /// Counts what the other one triggers.
    pub counter: Peri<'static, TIM5>,
    /// High while a tick is computed, for an oscilloscope.
    pub busy: Peri<'static, PA8>,
}

/// What the interrupt works with.
struct Sampling {
    adc: InjectedAdc<'static, ADC1, 3>,
    sampler: Sampler<'static>,
    station: Station<'static, Switchgear>,
    busy: Output<'static>,
    grid: Grid<CYCLES_PER_SAMPLE>,
    /// They stop if they are dropped.
    _timers: (Timer<'static, TIM2>, Timer<'static, TIM5>),
}

/// The processor's clock over the sampling rate.
const CYCLES_PER_SAMPLE: u32 = CLOCK_HZ / NUCLEO_G474RE.sample_rate_hz;
/// Set once, before the interrupt is enabled; from then on the interrupt's own.
static SAMPLING: AtomicPtr<Sampling> = AtomicPtr::new(ptr::null_mut());

/// Begins to sample, with parameters or in safe mode without. By itself: what it takes of the stack is free afterwards.
#[inline(never)]
pub fn start(converter: Converter, active: Option<Active>, sequence: Option<Sequence>, switchgear: Switchgear) {
    static PLACE: StaticCell<Sampling> = StaticCell::new();
    const TIME: SampleTime = SampleTime::CYCLES24_5;
    if let Some(mut peripherals) = cortex_m::Peripherals::take() {
        peripherals.DCB.enable_trace();
        peripherals.DWT.enable_cycle_counter();
    }
    let Converter { adc, voltage, current, speed, timer, counter, busy } = converter;
    let counter = Timer::new(counter);
    counter.set_trigger_source(Ts::ITR1);
    counter.set_slave_mode(Sms::EXT_CLOCK_MODE);
    counter.start();
    let timer = Timer::new(timer);
    timer.set_frequency(Hertz(NUCLEO_G474RE.sample_rate_hz), RoundTo::Slower);
    timer.set_master_mode(Mms::UPDATE);
    let channels = [(voltage.degrade_adc(), TIME), (current.degrade_adc(), TIME), (speed.degrade_adc(), TIME)];
    let adc = Adc::new(adc, AdcConfig::default()).setup_injected_conversions(
        channels,
        triggers::TIM2_TRGO,
        Exten::RISING_EDGE,
        true,
    );
    let busy = Output::new(busy, Level::Low, Speed::VeryHigh);
    timer.start();
    let sampling = PLACE.init_with(|| Sampling {
        adc,
        sampler: Sampler::new(active, &SHARED, &NUCLEO_G474RE),
        station: Station::new(sequence, switchgear, &SHARED),
        busy,
        grid: Grid::new(),
        _timers: (timer, counter),
    });
    SAMPLING.store(sampling, Ordering::Release);
    // Every interrupt begins at the most urgent priority; only this one stays there. The link and the timer of the
    // executor can wait for a tick.
    interrupt::ADC1_2.set_priority(Priority::P0);
    interrupt::USART2.set_priority(Priority::P8);
    interrupt::DMA1_CHANNEL1.set_priority(Priority::P8);
    interrupt::DMA1_CHANNEL2.set_priority(Priority::P8);
    interrupt::TIM1_BRK_TIM15.set_priority(Priority::P8);
    // SAFETY: what the handler needs is there.
    unsafe { interrupt::ADC1_2.enable() };
}

/// Time since sampling began, in cycles of the timer that triggers it.
#[inline(always)]
fn time() -> u32 {
    let before = pac::TIM5.cnt().read();
    let phase = pac::TIM2.cnt().read();
    let after = pac::TIM5.cnt().read();
    Grid::<CYCLES_PER_SAMPLE>::time(before, phase, after)
}

#[interrupt]
fn ADC1_2() {
    let begin = DWT::cycle_count();
    // SAFETY: nobody else uses what it points to, and an interrupt does not interrupt itself.
    let Some(sampling) = (unsafe { SAMPLING.load(Ordering::Acquire).as_mut() }) else { return };
    sampling.busy.set_high();
    let [voltage, current, speed] = sampling.adc.read_injected_samples();
    if let Some(skipped) = sampling.grid.skipped(time()) {
        let output = sampling.sampler.sample(Counts { voltage, current, speed }, skipped);
        sampling.station.sample(&output, skipped);
    }
    SHARED.note_cycles(DWT::cycle_count().wrapping_sub(begin));
    sampling.busy.set_low();
}
