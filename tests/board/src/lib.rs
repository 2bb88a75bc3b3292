//! A virtual NUCLEO-G474RE: it runs the very ELF file that is flashed.
//!
//! ```text
//! Board ─┬─ Processor: Unicorn's Cortex-M4F; exceptions, sleep, counting of instructions
//!        ├─ Machine: bus, interrupt controller, peripherals; virtual time in cycles of the processor
//!        └─ Analog: what stands at the converter's pins (a closed loop with the virtual rig, or anything else)
//! ```
//! Sections are those of ST's reference manual RM0440 and of the ARMv7-M Architecture Reference Manual (DDI 0403), from
//! memory of their contents. What is not modelled is an error that names peripheral and register, never a silent zero.

pub mod analog;
pub mod blocks;
pub mod board;
pub mod controller;
pub mod exceptions;
pub mod fault;
pub mod host;
pub mod image;
pub mod machine;
pub mod peripherals;
pub mod processor;
pub mod rig;
#[cfg(unix)]
pub mod terminal;

pub use analog::Analog;
pub use board::Board;
pub use fault::Fault;
pub use image::Image;
