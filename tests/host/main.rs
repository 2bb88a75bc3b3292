//! Tests of the host tool.

mod bad_input;
mod recording;
mod recording_mutation;
mod rig;
