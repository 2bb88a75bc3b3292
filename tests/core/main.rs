//! Tests of the core against independent references.

mod anfis;
mod app;
mod butterworth;
mod butterworth_arithmetic;
mod by_hand;
mod detector;
mod effects;
mod examples;
mod faults;
mod hybrid;
mod incident;
mod link;
mod nor;
mod parameters;
mod scalar;
mod sequence;
mod station;
mod stepper;
mod store;
mod tick;
