//! Tests of the host tool, a module per subject.

mod anfis;
mod bad_input;
mod board;
mod browser;
mod check;
mod commands;
mod conditions;
mod context;
mod diagnose;
mod docs;
mod effects_by_data;
mod examples;
mod export;
mod firmware;
mod foreign;
mod identify;
#[path = "../image.rs"]
mod image;
mod lockstep;
mod lot;
mod master;
mod monitor;
mod monitor_live;
mod plan_and_challenge;
mod predict;
mod program;
mod random;
mod rates;
mod real_data;
mod recording;
mod recording_mutation;
mod report;
mod rig;
mod run;
mod sequence;
mod serve;
mod stamps;
#[cfg(feature = "parquet")]
mod store;
mod swallowed;
mod synthetic_comparison;
mod terminal;
mod train;
