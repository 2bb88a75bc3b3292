//! The first two serial ports of the machine, CMSDK APB UARTs (Arm DDI 0479), by polling.
#![allow(unsafe_code)]

use core::ptr;

const DATA: usize = 0;
const STATE: usize = 4;
const CONTROL: usize = 8;
const DIVIDER: usize = 16;

const TRANSMIT_FULL: u32 = 1;
const RECEIVE_FULL: u32 = 2;
const TRANSMIT_AND_RECEIVE: u32 = 3;
/// The least that it takes; the emulator sends at once whatever stands here.
const LEAST_DIVIDER: u32 = 16;

/// A port at an address (Arm DAI 0386, memory map).
pub struct Serial<const BASE: usize>(());

/// The link to the host.
pub type Link = Serial<0x4000_4000>;
/// What tells the motor in place of the converter to go wrong.
pub type Knob = Serial<0x4000_5000>;

impl<const BASE: usize> Serial<BASE> {
    pub fn new() -> Self {
        let port = Self(());
        port.write(DIVIDER, LEAST_DIVIDER);
        port.write(CONTROL, TRANSMIT_AND_RECEIVE);
        port
    }

    fn read(&self, register: usize) -> u32 {
        // SAFETY: a register of the port, which nothing else uses.
        unsafe { ptr::read_volatile((BASE + register) as *const u32) }
    }

    fn write(&self, register: usize, value: u32) {
        // SAFETY: as above.
        unsafe { ptr::write_volatile((BASE + register) as *mut u32, value) };
    }

    pub fn byte(&mut self) -> Option<u8> {
        (self.read(STATE) & RECEIVE_FULL != 0).then(|| self.read(DATA) as u8)
    }

    pub fn send(&mut self, byte: u8) {
        self.flush();
        self.write(DATA, byte.into());
    }

    /// Waits until all has left.
    pub fn flush(&mut self) {
        while self.read(STATE) & TRANSMIT_FULL != 0 {}
    }
}
