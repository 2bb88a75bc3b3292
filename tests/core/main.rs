//! Tests of the core.

mod butterworth;
mod butterworth_arithmetic;
