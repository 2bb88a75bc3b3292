//! What can be known about a firmware image without running it: its size, its deepest stack, and that its sampling
//! interrupt cannot panic.
//!
//! The compiler's own stack sizes need an unstable option, so they are read from the machine code, by a small part of a
//! disassembler for Thumb-2 (Arm DDI 0403, chapter A7): what lowers the stack pointer, and who calls whom. From that
//! follows an upper bound, provided that
//!
//! - every call through a pointer that can be reached is listed in [`report::INDIRECT`] with what it can call; one that
//!   is
//!   not, recursion, and a stack pointer moved by a register are errors, not guesses;
//! - what a function takes from the stack is the sum of all that it ever takes, on whatever path: never too little;
//! - all interrupts nest, each once, with the 108 bytes that the processor saves (Arm DDI 0403, chapter B1.5);
//! - a panic restarts the processor: what it takes from the stack until then is not counted.

pub mod code;
pub mod elf;
pub mod report;
