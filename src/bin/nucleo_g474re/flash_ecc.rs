//! The flash's check bits: a word that cannot be read raises a non-maskable interrupt (RM0440, section 3.3.2).
//!
//! After a power cut during writing, reading the parameters may meet such a word. The handler clears the flag, counts,
//! and returns: the bytes read are arbitrary, and the CRC of the block rejects them. Without it, every start would end
//! here.
#![allow(unsafe_code)]

use cortex_m_rt::exception;
use embassy_stm32::pac;
use greyrig::faults::Fault;

use crate::firmware::SHARED;

#[exception]
unsafe fn NonMaskableInt() {
    let flash = pac::FLASH.eccr().read();
    if flash.eccd() {
        // Cleared by writing a one.
        pac::FLASH.eccr().modify(|register| register.set_eccd(true));
        SHARED.raise(Fault::FlashUnreadable);
    } else {
        // The clock failed, or the RAM's parity: nothing that a running program could mend.
        cortex_m::peripheral::SCB::sys_reset();
    }
}
