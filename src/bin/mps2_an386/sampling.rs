//! The sampling interrupt: SysTick, 10,000 times a second.
#![allow(unsafe_code)]

use core::ptr;
use core::sync::atomic::{AtomicPtr, Ordering};

use cortex_m::peripheral::Peripherals;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::exception;
use greyrig::app::bench::{Bench, Trouble};
use greyrig::app::{Sampler, Shared};
use greyrig::parameters::Active;
use static_cell::StaticCell;

use crate::figures::HARDWARE;
use crate::serial::Knob;

/// SYSCLK of the machine, Hz.
const CLOCK_HZ: u32 = 25_000_000;

/// What the interrupt works with.
struct Sampling {
    sampler: Sampler<'static>,
    bench: Bench,
    knob: Knob,
}

/// Set once, before the interrupt is enabled; from then on the interrupt's own.
static SAMPLING: AtomicPtr<Sampling> = AtomicPtr::new(ptr::null_mut());

/// Begins to sample, with parameters or in safe mode without. By itself: what it takes of the stack is free afterwards.
#[inline(never)]
pub fn start(active: Option<Active>, shared: &'static Shared) {
    static PLACE: StaticCell<Sampling> = StaticCell::new();
    let (Ok(bench), Some(peripherals)) = (Bench::new(), Peripherals::take()) else { return };
    let sampler = || Sampler::new(active, shared, &HARDWARE);
    let sampling = PLACE.init_with(|| Sampling { sampler: sampler(), bench, knob: Knob::new() });
    SAMPLING.store(sampling, Ordering::Release);
    let mut timer = peripherals.SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(CLOCK_HZ / HARDWARE.sample_rate_hz - 1);
    timer.clear_current();
    timer.enable_interrupt();
    timer.enable_counter();
}

#[exception]
fn SysTick() {
    // SAFETY: nobody else uses what it points to, and an interrupt does not interrupt itself.
    let Some(sampling) = (unsafe { SAMPLING.load(Ordering::Acquire).as_mut() }) else { return };
    if let Some(trouble) = sampling.knob.byte().and_then(Trouble::from_letter) {
        sampling.bench.plan_trouble(trouble);
    }
    let counts = sampling.bench.counts();
    // The bench makes a sample when it is asked for one: none can be missed.
    sampling.sampler.sample(counts, 0);
}
