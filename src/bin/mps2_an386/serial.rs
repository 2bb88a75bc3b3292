//! The first serial port of the machine, a CMSDK APB UART (Arm DDI 0479, chapter 4.3), by polling.
#![allow(unsafe_code)]

use core::ptr;

/// Where it is (Arm DAI 0386, memory map).
const BASE: usize = 0x4000_4000;
const DATA: *mut u32 = BASE as *mut u32;
const STATE: *const u32 = (BASE + 4) as *const u32;
const CONTROL: *mut u32 = (BASE + 8) as *mut u32;
const DIVIDER: *mut u32 = (BASE + 16) as *mut u32;

const TRANSMIT_FULL: u32 = 1;
const RECEIVE_FULL: u32 = 2;
const TRANSMIT_AND_RECEIVE: u32 = 3;
/// The least that it takes; the emulator sends at once whatever stands here.
const LEAST_DIVIDER: u32 = 16;

/// The port. There is one.
pub struct Serial(());

impl Serial {
    pub fn new() -> Self {
        // SAFETY: registers of the port, which nothing else uses.
        unsafe {
            ptr::write_volatile(DIVIDER, LEAST_DIVIDER);
            ptr::write_volatile(CONTROL, TRANSMIT_AND_RECEIVE);
        }
        Self(())
    }

    fn state(&self) -> u32 {
        // SAFETY: as above; reading has no effect.
        unsafe { ptr::read_volatile(STATE) }
    }

    pub fn byte(&mut self) -> Option<u8> {
        // SAFETY: as above; reading takes the byte from the port.
        (self.state() & RECEIVE_FULL != 0).then(|| unsafe { ptr::read_volatile(DATA) } as u8)
    }

    pub fn send(&mut self, byte: u8) {
        while self.state() & TRANSMIT_FULL != 0 {}
        // SAFETY: as above.
        unsafe { ptr::write_volatile(DATA, byte.into()) };
    }

    /// Waits until all has left.
    pub fn flush(&mut self) {
        while self.state() & TRANSMIT_FULL != 0 {}
    }
}
