<<<<<<< HEAD
//! Tests of the core against independent references.

mod stepper;
=======
//! Tests of the core.

mod butterworth;
mod butterworth_arithmetic;
>>>>>>> fixed
