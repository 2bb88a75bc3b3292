//! The sampling interrupt: SysTick, 10,000 times a second.
#![allow(unsafe_code)]

use core::ptr;
use core::sync::atomic::{AtomicPtr, Ordering};

use cortex_m::peripheral::Peripherals;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::exception;
use greyrig::app::bench::{Bench, PEAK, Trouble};
use greyrig::app::{Sampler, Shared, Station, Switchgear};
use greyrig::parameters::Active;
use greyrig::sequence::{Contacts, Sequence};
use greyrig::units::Counts;
use static_cell::StaticCell;

use crate::figures::HARDWARE;
use crate::serial::Knob;

/// SYSCLK of the machine, Hz.
const CLOCK_HZ: u32 = 25_000_000;

/// What the interrupt works with.
struct Sampling {
    sampler: Sampler<'static>,
    station: Station<'static, Modelled>,
    /// Whether a sequence commands the motor's supply.
    commanded: bool,
    bench: Bench,
    knob: Knob,
}

/// Contacts, supply and trip of a station that is a struct.
struct Modelled {
    contacts: Contacts,
    /// Its voltage, V.
    peak: f32,
    /// Counts of the current that do not trip.
    allowed: [u16; 2],
    armed: bool,
    tripped: bool,
}

impl Modelled {
    const fn new() -> Self {
        let contacts = Contacts { start: false, abort_closed: true, emergency_closed: true };
        Self { contacts, peak: 0.0, allowed: [0, u16::MAX], armed: false, tripped: false }
    }

    fn turn(&mut self, letter: u8) {
        match letter {
            b's' | b'S' => self.contacts.start = letter == b's',
            b'a' | b'A' => self.contacts.abort_closed = letter == b'A',
            b'e' | b'E' => self.contacts.emergency_closed = letter == b'E',
            _ => {}
        }
    }

    /// As the comparators do.
    fn watch(&mut self, counts: Counts) {
        let [low, high] = self.allowed;
        if self.armed && !(low..=high).contains(&counts.current) {
            (self.tripped, self.armed) = (true, false);
        }
    }
}

impl Switchgear for Modelled {
    fn contacts(&mut self) -> Contacts {
        self.contacts
    }

    fn has_tripped(&mut self) -> bool {
        self.tripped
    }

    fn arm(&mut self) {
        (self.tripped, self.armed) = (false, true);
    }

    fn trip_outside(&mut self, counts: [u16; 2]) {
        self.allowed = counts;
    }

    fn supply(&mut self, closed: bool, fraction: f32) {
        self.peak = if closed { PEAK * fraction } else { 0.0 };
    }
}

/// Set once, before the interrupt is enabled; from then on the interrupt's own.
static SAMPLING: AtomicPtr<Sampling> = AtomicPtr::new(ptr::null_mut());

/// Begins to sample, with parameters or in safe mode without. By itself: what it takes of the stack is free afterwards.
#[inline(never)]
pub fn start(active: Option<Active>, sequence: Option<Sequence>, shared: &'static Shared) {
    static PLACE: StaticCell<Sampling> = StaticCell::new();
    let (Ok(bench), Some(peripherals)) = (Bench::new(), Peripherals::take()) else { return };
    let sampler = || Sampler::new(active, shared, &HARDWARE);
    let commanded = sequence.is_some();
    let sampling = PLACE.init_with(|| Sampling {
        sampler: sampler(),
        station: Station::new(sequence, Modelled::new(), shared),
        commanded,
        bench,
        knob: Knob::new(),
    });
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
    if let Some(letter) = sampling.knob.byte() {
        sampling.station.switchgear().turn(letter);
        if let Some(trouble) = Trouble::from_letter(letter) {
            sampling.bench.plan_trouble(trouble);
        }
    }
    let gear = sampling.station.switchgear();
    let peak = if gear.tripped { 0.0 } else { gear.peak };
    let counts = if sampling.commanded { sampling.bench.counts_at(peak) } else { sampling.bench.counts() };
    gear.watch(counts);
    // The bench makes a sample when it is asked for one: none can be missed.
    let output = sampling.sampler.sample(counts, 0);
    sampling.station.sample(&output, 0);
}
