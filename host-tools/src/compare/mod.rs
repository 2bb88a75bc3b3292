//! Model against measurement: how far apart, and where.

mod result;

pub use result::{Comparison, Map, PerSignal, Profile, RecordingComparison, Region, Signal, Traces};
