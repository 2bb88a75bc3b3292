//! Host side of greyrig: the virtual rig, identification, comparison and reports.

pub mod addition;
pub mod anfis;
pub mod averaging;
pub mod challenge;
pub mod commands;
pub mod compare;
pub mod device;
pub mod diagnose;
pub mod edges;
pub mod error;
pub mod experiment;
pub mod held_out;
pub mod hybrid;
pub mod identify;
pub mod lockstep;
pub mod mains;
pub mod model;
pub mod monitor;
pub mod noise;
pub mod output;
pub mod plan;
pub mod recording;
pub mod report;
pub mod rig;
pub mod term;
