//! Tests of the core against independent references.

mod butterworth;
mod butterworth_arithmetic;
mod stepper;
mod tick;
