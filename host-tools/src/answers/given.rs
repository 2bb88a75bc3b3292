//! Recordings of which something is asked.

use crate::check::{self, Purpose};
use crate::error::Result;
use crate::model::{Kind, Origin};
use crate::recording::Recording;
use crate::recording::finding::DataFinding;

/// Recordings, questioned: wild samples do not count, and what is wrong is known.
#[derive(Debug, Clone)]
pub struct Given {
    /// As an answer takes them.
    pub recordings: Vec<Recording>,
    /// What was found about them.
    pub findings: Vec<DataFinding>,
}

impl Given {
    /// Questions recordings of a kind of motor, and undoes what their purpose allows.
    pub fn questioned(mut recordings: Vec<Recording>, kind: Kind, purpose: Purpose) -> Self {
        let findings = check::question(&mut recordings, kind, purpose);
        Self { recordings, findings }
    }

    /// Refuses recordings from which any answer would mean nothing.
    ///
    /// # Errors
    /// The first finding that stops.
    pub fn refuse(&self) -> Result<()> {
        check::refuse(&self.findings)
    }

    /// Their names, as the user gave them.
    pub fn names(&self) -> Vec<String> {
        self.recordings.iter().map(|r| r.path().display().to_string()).collect()
    }

    /// What a report names as its source.
    pub fn origins(&self) -> Vec<Origin> {
        self.recordings.iter().map(Origin::from).collect()
    }
}
