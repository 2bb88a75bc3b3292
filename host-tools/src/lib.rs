//! Host side of greyrig: the virtual rig, identification, comparison and reports.

pub mod commands;
pub mod compare;
pub mod error;
pub mod identify;
pub mod model;
pub mod output;
pub mod recording;
pub mod report;
