//! The recordings of a plan as commands.

use std::path::Path;

use super::next::{CommandLine, unused};
use crate::model::Kind;
use crate::plan::Take;

/// The recordings, made one after another by the virtual rig; none of none.
pub fn rehearsed(takes: &[Take], kind: Kind) -> Option<CommandLine> {
    takes.iter().map(|take| simulated(take, kind)).reduce(CommandLine::then)
}

fn simulated(take: &Take, kind: Kind) -> CommandLine {
    CommandLine::new("simulate")
        .option("--kind", [kind])
        .option("--profile", [take.profile])
        .option("--seconds", [take.seconds])
        .option("--peak-voltage", [format!("{:.1}", take.peak_voltage_v)])
        .option("--out", [unused(Path::new(&format!("{}.csv", take.profile))).display()])
}
