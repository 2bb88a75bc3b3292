//! Tests of the core against independent references.

mod stepper;
