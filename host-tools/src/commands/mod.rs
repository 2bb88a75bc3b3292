//! The subcommands: a file each. A command turns its arguments into one library call and prints the result.

pub mod add;
pub mod anfis;
mod answer;
pub mod board;
pub mod calibrate;
pub mod challenge;
pub mod check;
pub mod compare;
pub mod completions;
pub mod convert;
pub mod demo;
pub mod diagnose;
pub mod effects;
pub mod export;
pub mod flash;
pub mod identify;
mod input;
mod kept;
pub mod master;
pub mod monitor;
mod paint;
pub mod plan;
pub mod ports;
pub mod predict;
pub mod record;
pub mod rig;
pub mod run;
pub mod serve;
pub mod simulate;
mod stderr;
mod stdout;
#[cfg(feature = "parquet")]
pub mod store;
mod table;
pub mod terminal;
pub mod train;
pub mod trouble;
mod words;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::error::Result;
use terminal::Terminal;

/// Grey-box models of electric motors: identify, compare with the measurement, see where the model fails.
#[derive(Debug, Parser)]
#[command(name = "greyrig", version, propagate_version = true, term_width = stdout::width())]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// All subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// The whole story on built-in data, without hardware.
    Demo(demo::Args),
    /// Physical parameters from recordings, with 95 % intervals.
    Identify(identify::Args),
    /// What is wrong with recordings, and what mends it.
    Check(check::Args),
    /// Model against measurement, and where it fails.
    Compare(compare::Args),
    /// The model's free run on any voltage, with bands.
    Predict(predict::Args),
    /// Adds effects to a model and shows the error fall on data held out.
    Add(add::Args),
    /// Which physical effect is missing, how sure, and the experiment that would tell.
    Diagnose(diagnose::Args),
    /// From what size on recordings would have revealed each effect.
    Challenge(challenge::Args),
    /// The recording that would best tell rival effects apart.
    Plan(plan::Args),
    /// The same loop in the browser, on this machine alone.
    Serve(serve::Args),
    /// Learn a correction of what the model leaves over.
    Train(train::Args),
    /// Learn the detector's limits from runs of healthy motors.
    Calibrate(calibrate::Args),
    /// Judge motors: alarms, and a verdict.
    Monitor(monitor::Args),
    /// Test the golden motor: drift and repeatability of the rig.
    Master(master::Args),
    /// Train a fuzzy network (ANFIS) on any table.
    Anfis(anfis::Args),
    /// The catalogue of physical effects, explained.
    Effects(effects::Args),
    /// Any supported recording to CSV or Parquet, in SI units.
    Convert(convert::Args),
    /// A store of many recordings, and what came of them.
    #[cfg(feature = "parquet")]
    Store(store::Args),
    /// The model for other simulators.
    Export(export::Args),
    /// Completion script for a shell.
    Completions(completions::Args),
    /// Run a virtual rig and write what it records.
    Simulate(simulate::Args),
    /// Write a model to the microcontroller, verified by reading back.
    Flash(flash::Args),
    /// Record raw samples from the microcontroller.
    Record(record::Args),
    /// Boards that are connected.
    Ports(ports::Args),
    /// What belongs to a rig: name, calibration, the motor type on board, how it is.
    Rig(rig::Args),
    /// Have the board run its sequence: the profile, the rotor's rest, the verdict.
    Run(run::Args),
    /// A virtual board that runs the flashed image, behind a pseudo-terminal.
    Board(board::Args),
}

impl Command {
    /// Runs the command.
    ///
    /// # Errors
    /// Whatever the user has to act on.
    pub fn run(&self, terminal: &Terminal) -> Result<ExitCode> {
        match self {
            Self::Demo(args) => demo::run(args, terminal),
            Self::Identify(args) => identify::run(args, terminal),
            Self::Check(args) => check::run(args, terminal),
            Self::Compare(args) => compare::run(args, terminal),
            Self::Predict(args) => predict::run(args, terminal),
            Self::Add(args) => add::run(args, terminal),
            Self::Diagnose(args) => diagnose::run(args, terminal),
            Self::Challenge(args) => challenge::run(args, terminal),
            Self::Plan(args) => plan::run(args, terminal),
            Self::Serve(args) => serve::run(args, terminal),
            Self::Train(args) => train::run(args, terminal),
            Self::Calibrate(args) => calibrate::run(args, terminal),
            Self::Monitor(args) => monitor::run(args, terminal),
            Self::Master(args) => master::run(args, terminal),
            Self::Anfis(args) => anfis::run(args, terminal),
            Self::Effects(args) => effects::run(args, terminal),
            Self::Export(args) => export::run(args),
            Self::Completions(args) => completions::run(args),
            Self::Convert(args) => convert::run(args, terminal),
            #[cfg(feature = "parquet")]
            Self::Store(args) => store::run(args, terminal),
            Self::Simulate(args) => simulate::run(args, terminal),
            Self::Flash(args) => flash::run(args, terminal),
            Self::Record(args) => record::run(args, terminal),
            Self::Rig(args) => rig::run(args, terminal),
            Self::Run(args) => run::run(args, terminal),
            Self::Ports(args) => ports::run(args, terminal),
            Self::Board(args) => board::run(args),
        }
    }
}

/// The command line, with one `--map` for each mapping (several may follow one `--map`).
pub fn arguments() -> Vec<OsString> {
    crate::recording::mapping::spread(std::env::args_os())
}
