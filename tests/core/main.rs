//! Tests of the core against independent references.

mod anfis;
mod butterworth;
mod butterworth_arithmetic;
mod effects;
mod stepper;
mod tick;
