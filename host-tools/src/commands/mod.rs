//! The subcommands: a file each. A command turns its arguments into one library call and prints the result.

pub mod simulate;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::error::Result;

/// Grey-box models of electric motors: identify, compare with the measurement, see where the model fails.
#[derive(Debug, Parser)]
#[command(name = "greyrig", version, propagate_version = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// All subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a virtual rig and write what it records.
    Simulate(simulate::Args),
}

impl Command {
    /// Runs the command.
    ///
    /// # Errors
    /// Whatever the user has to act on.
    pub fn run(&self) -> Result<ExitCode> {
        match self {
            Self::Simulate(args) => simulate::run(args),
        }
    }
}
