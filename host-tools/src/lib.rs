//! Host side of greyrig: the virtual rig, identification, comparison and reports.

pub mod commands;
pub mod error;
pub mod output;
pub mod recording;
pub mod rig;
