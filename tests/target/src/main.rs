//! The core on an emulated Cortex-M4F.
fn main() {}
