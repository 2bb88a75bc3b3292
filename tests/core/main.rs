//! Tests of the core against independent references.

mod anfis;
mod butterworth;
mod butterworth_arithmetic;
mod detector;
mod effects;
mod hybrid;
mod stepper;
mod tick;
