//! Arguments that commands on recordings share.

use std::path::PathBuf;

use serde::Serialize;

use super::stderr;
use crate::answers::next::Files;
use crate::check::{self, Purpose};
use crate::context::Context;
use crate::error::Result;
use crate::model::Kind;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};
use crate::recording::{self, MapArgs, Recording};

/// Recordings and how their columns are named.
#[derive(Debug, clap::Args)]
pub struct Input {
    /// Recordings of one motor type, in any supported format
    #[arg(required = true, value_name = "RUN")]
    pub recordings: Vec<PathBuf>,
    #[command(flatten)]
    map: MapArgs,
}

impl Input {
    /// Reads all recordings and says on stderr what is notable about them.
    ///
    /// # Errors
    /// The first recording that cannot be used.
    pub fn load(&self, ctx: &Context) -> Result<Vec<Recording>> {
        load(&self.recordings, &self.map, ctx)
    }

    /// The files, and how their columns are named.
    pub fn files(&self) -> Files {
        Files { recordings: self.recordings.clone(), map: self.map.map.clone() }
    }

    /// The names of the recordings, as the user gave them.
    pub fn names(&self) -> Vec<String> {
        self.recordings.iter().map(|p| p.display().to_string()).collect()
    }
}

/// Reads recordings and says on stderr what is notable about them.
///
/// # Errors
/// The first recording that cannot be used.
pub fn load(files: &[PathBuf], map: &MapArgs, ctx: &Context) -> Result<Vec<Recording>> {
    let recordings = recording::load_all(files, &map.mapping()?, ctx)?;
    for recording in &recordings {
        for warning in recording.warnings() {
            stderr::remark(format!("{}: {warning}", recording.path().display()));
        }
    }
    Ok(recordings)
}

/// Questions recordings before anything is asked of them, says on stderr what may spoil the answer, and undoes what
/// their purpose allows.
pub fn question(recordings: &mut [Recording], kind: Kind, purpose: Purpose) -> Vec<DataFinding> {
    let found = check::question(recordings, kind, purpose);
    tell(&found);
    found
}

/// Says on stderr what may spoil an answer.
pub fn tell(found: &[DataFinding]) {
    // Of what is masked the reader has told already.
    let told = |f: &DataFinding| f.code == Code::Clipped && f.handled == Handled::Masked;
    tell_of(found.iter().filter(|f| f.severity == Severity::Warning && !told(f)));
}

/// Says on stderr what spoils an answer that is given all the same.
pub fn tell_stops(found: &[DataFinding]) {
    tell_of(found.iter().filter(|f| f.severity == Severity::Stop));
}

fn tell_of<'a>(found: impl Iterator<Item = &'a DataFinding>) {
    for finding in found {
        stderr::remark(format!("{}: the recording: {}", finding.recording.display(), finding.sentence()));
    }
}

/// An answer with what was found about the data.
#[derive(Debug, Serialize)]
pub struct Answered<'a, T: Serialize> {
    /// The answer.
    #[serde(flatten)]
    pub answer: T,
    /// About the recordings.
    pub data_findings: &'a [DataFinding],
}
