//! The core of the rig: the model that the microcontroller, the emulator and the host tool share, bit for bit.
//!
//! The modules are in the order in which a sample passes through them: counts of the converter ([`units`]), the model
//! with its effects ([`motor`], [`effects`]), the filter ([`butterworth`]), the learned correction ([`anfis`],
//! [`hybrid`]), and one tick of 100 µs that does it all ([`tick`]: the page to read first). What is left over goes to the [`detector`].
#![no_std]

pub mod scalar;

pub mod units;

pub mod motor;

pub mod effects;

pub mod butterworth;

pub mod term;

pub mod anfis;

pub mod hybrid;

pub mod tick;

pub mod detector;
