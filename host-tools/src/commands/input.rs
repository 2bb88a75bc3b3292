//! Arguments that commands on recordings share.

use std::path::PathBuf;

use crate::error::Result;
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
    pub fn load(&self) -> Result<Vec<Recording>> {
        load(&self.recordings, &self.map)
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
pub fn load(files: &[PathBuf], map: &MapArgs) -> Result<Vec<Recording>> {
    let recordings = recording::load_all(files, &map.mapping()?)?;
    for recording in &recordings {
        for warning in &recording.warnings {
            eprintln!("greyrig: {}: {warning}", recording.path.display());
        }
    }
    Ok(recordings)
}
