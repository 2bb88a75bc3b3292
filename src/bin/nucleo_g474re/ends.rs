//! Ends: what can stop the program, and what of it the next start knows.
//!
//! - **Non-maskable interrupt** of the flash (RM0440, section 3.3.2). A double word of bank 2, the parameters', that
//!   cannot be read is what a power cut during writing leaves: the flag is cleared and read back, the fault counted,
//!   and the program goes on; the bytes read are arbitrary, and the CRC of the block rejects them. One of bank 1 is the
//!   program's own: nothing that it does can be relied on.
//! - **Hard fault**, the end of the stack included (`memory.x`): the handler takes another stack first.
//! - **Panic.**
//!
//! The last three keep a record in memory that start-up leaves alone, and reset. After three in a row the program's own
//! unreadable word resets no more: the processor stands, pass low, alarm high, and tells the watchdog that all is well,
//! or it would be a loop of resets again.
#![allow(unsafe_code)]

use core::mem::MaybeUninit;
use core::ptr;

use cortex_m::asm::dsb;
use cortex_m::peripheral::SCB;
use cortex_m_rt::exception;
use embassy_stm32::pac;
use greyrig::faults::Fault;
use greyrig::incident::{Cause, Incident, Kept, Phase, Reset, WORDS};

use crate::clocks::CLOCK_HZ;
use crate::firmware::SHARED;
use crate::switchgear;

/// What is kept, and behind it how many samples there were.
type Memory = [u32; WORDS + 1];

/// Neither loaded nor cleared at a start.
#[unsafe(link_section = ".uninit.kept")]
static mut MEMORY: MaybeUninit<Memory> = MaybeUninit::uninit();

fn read() -> ([u32; WORDS], u32) {
    // SAFETY: any words will do; the check tells whether they are arbitrary. Nobody holds a reference to it.
    let memory: Memory = unsafe { ptr::read_volatile((&raw const MEMORY).cast()) };
    let [kept @ .., samples] = memory;
    (kept, samples)
}

fn write(kept: &Kept, samples: u32) {
    // SAFETY: as above; a handler that interrupts this does not return.
    unsafe {
        ptr::write_volatile((&raw mut MEMORY).cast(), kept.to_words());
        ptr::write_volatile((&raw mut MEMORY).cast::<u32>().add(WORDS), samples);
    }
}

/// At a start: what went before becomes what is known of it.
pub fn start(reset: Reset) {
    let (words, samples) = read();
    write(&Kept::next(Kept::from_words(words), reset, samples), 0);
}

/// What is known.
pub fn kept() -> Kept {
    Kept::from_words(read().0).unwrap_or_default()
}

/// Keeps the number of samples; a settled start is a good one.
pub fn keep(samples: u32, settled: bool) {
    // SAFETY: as in `write`.
    unsafe { ptr::write_volatile((&raw mut MEMORY).cast::<u32>().add(WORDS), samples) };
    if settled {
        let kept = kept();
        if kept.in_a_row > 0 {
            write(&Kept { in_a_row: 0, ..kept }, samples);
        }
    }
}

/// Forgets the last incident.
pub fn forget() {
    let (_, samples) = read();
    write(&Kept { incident: None, ..kept() }, samples);
}

/// Keeps how the program came to an end, and begins anew.
pub fn end(incident: Incident) -> ! {
    let (kept, samples) = (kept(), incident.samples);
    let stands = kept.holds_back() && incident.cause == Cause::Program;
    let ended = kept.ended(incident);
    if stands {
        // What ends the standing is a button or the power: a start like any other.
        write(&Kept { phase: Phase::Running, ..ended }, samples);
        stand()
    }
    write(&ended, samples);
    SCB::sys_reset()
}

/// For ever, in a state that passes no motor.
fn stand() -> ! {
    cortex_m::interrupt::disable();
    switchgear::cut();
    pac::GPIOB.bsrr().write(|pins| {
        pins.set_br(10, true);
        pins.set_bs(5, true);
    });
    loop {
        // A hundredth of a second, of the half that the watchdog waits.
        cortex_m::asm::delay(CLOCK_HZ / 100);
        pac::IWDG.kr().write(|register| register.set_key(pac::iwdg::vals::Key::RESET));
    }
}

#[exception]
unsafe fn NonMaskableInt() {
    let met = pac::FLASH.eccr().read();
    let incident = |cause| {
        let (at, status) = (met.addr_ecc(), [met.0, 0]);
        Incident { at, status, ..Incident::new(cause, SHARED.samples()) }
    };
    if !met.eccd() {
        // The clock failed, or the memory's parity: nothing that a running program could mend.
        end(incident(Cause::Hardware));
    }
    // Cleared by writing a one. The write has to be there before the interrupt ends, or it comes again.
    pac::FLASH.eccr().write(|register| {
        register.set_eccie(met.eccie());
        register.set_eccd(true);
    });
    dsb();
    let cleared = !pac::FLASH.eccr().read().eccd();
    if met.bk_ecc() && !met.sysf_ecc() && cleared {
        SHARED.raise(Fault::FlashUnreadable);
    } else {
        end(incident(Cause::Program));
    }
}

// The stack may be at its end: the fault's frame is read from it if it is there, and the whole of it taken anew.
core::arch::global_asm!(
    ".section .text.HardFault, \"ax\", %progbits",
    ".global HardFault",
    ".type HardFault, %function",
    ".thumb_func",
    "HardFault:",
    "mrs r2, msp",
    "movs r0, #0",
    "movs r1, #0",
    "movw r3, #:lower16:_stack_end",
    "movt r3, #:upper16:_stack_end",
    "cmp r2, r3",
    "blo 0f",
    // Of the frame, the program counter and the link register.
    "ldr r0, [r2, #24]",
    "ldr r1, [r2, #20]",
    "0:",
    "movw r3, #:lower16:_stack_start",
    "movt r3, #:upper16:_stack_start",
    "msr msp, r3",
    "b {after}",
    ".size HardFault, . - HardFault",
    after = sym after_hard_fault,
);

/// With the fault's program counter and link register, zeros where the stack has none.
extern "C" fn after_hard_fault(at: u32, from: u32) -> ! {
    // SAFETY: registers of the system control block, which reading does not change.
    let status = unsafe { [(*SCB::PTR).cfsr.read(), (*SCB::PTR).hfsr.read()] };
    end(Incident { at, from, status, ..Incident::new(Cause::HardFault, SHARED.samples()) })
}
