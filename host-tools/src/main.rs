//! The `greyrig` command.
fn main() {}
