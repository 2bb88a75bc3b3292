//! Tests of the host tool.

mod rig;
