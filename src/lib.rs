//! The core of the rig: the model that the microcontroller, the emulator and the host tool share, bit for bit.
//!
//! The modules are in the order in which a sample passes through them: counts of the converter ([`units`]; what has to
//! be known of the board is in [`hardware`]), the model with its effects ([`motor`], [`effects`]), the filter
//! ([`butterworth`]), the learned correction ([`anfis`], [`hybrid`]), and one tick of 100 µs that does it all
//! ([`tick`]: the page to read first). What is left over goes to the [`detector`].
//! The [`sequence`] runs the motor meanwhile, and stops it.
//!
//! Around the tick stand what the rig needs besides: its parameters in flash ([`parameters`]), the link to the host
//! ([`link`]), what can go wrong ([`faults`], [`incident`]), and the application that both boards run ([`app`]).
//!
//! Who wants the model alone takes `default-features = false`:
//!
//! | feature | brings |
//! |---|---|
//! | `serde` | text and binary forms of settings and names |
//! | `parameters` | the parameter block, the variables for other simulators, `serde` |
//! | `link` | the link and the application, `parameters` |
#![no_std]
#![forbid(unsafe_code)]

pub mod scalar;

pub mod hardware;

pub mod units;

pub mod motor;

pub mod effects;

pub mod butterworth;

pub mod term;

pub mod anfis;

pub mod hybrid;

pub mod tick;

pub mod detector;

pub mod sequence;

pub mod faults;

#[cfg(feature = "parameters")]
pub mod parameters;

#[cfg(feature = "parameters")]
pub mod exchange;

#[cfg(feature = "link")]
pub mod incident;

#[cfg(feature = "link")]
pub mod link;

#[cfg(feature = "link")]
pub mod app;
