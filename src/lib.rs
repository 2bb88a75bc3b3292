//! The core of the rig: the model that the microcontroller, the emulator and the host tool share, bit for bit.
//!
//! The modules are in the order in which a sample passes through them.
#![no_std]

pub mod butterworth;
pub mod scalar;

pub mod units;

pub mod motor;

pub mod effects;
