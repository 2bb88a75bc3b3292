//! Arguments that commands on recordings share.

use std::path::PathBuf;

use serde::Serialize;

use super::next::CommandLine;
use crate::check::{self, Purpose};
use crate::context::Context;
use crate::error::{Error, Place, Result};
use crate::model::Kind;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};
use crate::recording::{self, Channel, MapArgs, Recording};

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

    /// A command on the same recordings, read in the same way.
    pub fn again(&self, command: CommandLine) -> CommandLine {
        self.again_with(command, "")
    }

    /// The same with the option that mends them: a channel is mapped once.
    pub fn again_with(&self, command: CommandLine, remedy: &str) -> CommandLine {
        let words = shlex::split(remedy).unwrap_or_default();
        let mapped = |map: &&String| {
            let target = map.split('=').next().unwrap_or_default();
            words.iter().any(|word| word.split('=').next() == Some(target))
        };
        let others = self.map.map.iter().filter(|map| !mapped(map));
        command.files(&self.recordings).option("--map", others).with(&words)
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
            eprintln!("greyrig: {}: {warning}", recording.path().display());
        }
    }
    Ok(recordings)
}

/// Questions recordings before anything is asked of them, says on stderr what may spoil the answer, and undoes what
/// their purpose allows.
pub fn question(recordings: &mut [Recording], kind: Kind, purpose: Purpose) -> Vec<DataFinding> {
    let found = check::question(recordings, kind, purpose);
    // Of what is masked the reader has told already.
    let told = |f: &DataFinding| f.code == Code::Clipped && f.handled == Handled::Masked;
    for finding in found.iter().filter(|f| f.severity == Severity::Warning && !told(f)) {
        eprintln!("greyrig: {}: the recording: {}", finding.recording.display(), finding.sentence());
    }
    found
}

/// Questions the input of a prediction. With a measured current or speed it is a recording, as in a comparison; a
/// voltage alone is what somebody wants to know about, and stays as it is. Nothing refuses it: what is wrong with a
/// measured channel does not change what the model makes of the voltage.
pub fn question_an_input(recordings: &mut [Recording], kind: Kind) -> Vec<DataFinding> {
    let measured = [Channel::Current, Channel::Speed, Channel::Angle];
    let is_recorded = |r: &Recording| measured.iter().any(|channel| r.channel(*channel).is_some());
    let found = if recordings.iter().any(is_recorded) {
        question(recordings, kind, Purpose::Fit)
    } else {
        let mut found = check::check(recordings, Some(kind));
        let as_it_is =
            |f: &&mut DataFinding| matches!(f.handled, Handled::Masked | Handled::Corrected) && f.code != Code::TimeGap;
        found.iter_mut().filter(as_it_is).for_each(|f| f.handled = Handled::None);
        found
    };
    for finding in found.iter().filter(|f| f.severity == Severity::Stop) {
        eprintln!("greyrig: {}: the recording: {}", finding.recording.display(), finding.sentence());
    }
    found
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

/// Refuses recordings from which any answer would mean nothing.
///
/// # Errors
/// The first finding that stops.
pub fn refuse(findings: &[DataFinding]) -> Result<()> {
    let Some(stop) = check::stop(findings) else { return Ok(()) };
    let remedy = stop.remedy.clone().unwrap_or_else(|| "record again; `greyrig check` tells more".to_owned());
    Err(Error::input(Place::file(&stop.recording), &stop.text, remedy))
}
