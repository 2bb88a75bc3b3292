//! Does the microcontroller compute what the host computes, and how many instructions does it take?
//!
//! Both run the code in this library: the host directly, and the program `on-target` on a Cortex-M4F that QEMU
//! emulates. The test `host_equals_target` compares what the two print. It is also the command to see the figures:
//!
//! ```text
//! cargo test --release --package greyrig-target-tests -- --nocapture
//! ```
//!
//! To compare a further computation bit by bit, add a function to [`scenarios`] that gives its outputs to
//! [`Outputs`], and a line to [`scenarios::ALL`]. To count its instructions, add a line to [`counted::all`]:
//!
//! ```text
//! counter.count("motor_step", (model, state), |(model, state)| *state = model.step(*state, black_box(230.0)));
//! ```
//!
//! The second argument is built before the measurement and handed to the third, which is what is counted. Inputs go
//! through `black_box`, lest the compiler compute the result in advance.
//!
//! An instruction is not a cycle: divisions and square roots take up to 14, and flash has wait states. The counts are
//! exact for the emulated processor, and say what changes from one version to the next; cycles on a board are not
//! measured.
#![no_std]

pub mod counted;
mod outputs;
pub mod scenarios;

use core::fmt;

pub use outputs::Outputs;

/// Runs all scenarios and writes their lines, which have to be the same on every machine.
///
/// # Errors
/// Whatever `out` refuses.
pub fn write_bits(out: &mut dyn fmt::Write) -> fmt::Result {
    for (name, run) in scenarios::ALL {
        let mut outputs = Outputs::new(name, out);
        run(&mut outputs);
        outputs.finish()?;
    }
    Ok(())
}
