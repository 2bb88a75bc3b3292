//! Tests of the core against independent references.

mod app;
mod butterworth;
mod butterworth_arithmetic;
mod effects;
mod faults;
mod link;
mod nor;
mod parameters;
mod stepper;
mod store;
mod tick;
