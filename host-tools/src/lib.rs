//! Host side of greyrig: the virtual rig, identification, comparison and reports.

pub mod error;
pub mod recording;
