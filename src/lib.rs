//! The core of the rig.
#![no_std]

pub mod butterworth;
pub mod scalar;
