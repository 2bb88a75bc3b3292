//! What is wrong with recordings, and what mends it.

use serde_json::{Value, json};

use super::object;
use crate::check::check;
use crate::error::Result;
use crate::model::Kind;
use crate::recording::Recording;
use crate::recording::finding::DataFinding;

/// What the recordings will be taken for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Request {
    /// Kind of motor; by itself what they tell, or else any.
    pub kind: Option<Kind>,
}

impl Request {
    /// The answer.
    pub fn answer(&self, recordings: &[Recording]) -> Answer {
        let told = |r: &Recording| <Kind as clap::ValueEnum>::from_str(r.metadata().get("motor")?, false).ok();
        let kind = self.kind.or_else(|| recordings.iter().find_map(told));
        let names = recordings.iter().map(|r| r.path().display().to_string()).collect();
        Answer { names, findings: check(recordings, kind) }
    }
}

/// What was found.
#[derive(Debug, Clone)]
pub struct Answer {
    /// The recordings, as the user named them.
    pub names: Vec<String>,
    /// What was found.
    pub findings: Vec<DataFinding>,
}

impl Answer {
    /// The JSON object of the interface.
    ///
    /// # Errors
    /// As [`object`].
    pub fn as_json(&self) -> Result<Value> {
        object("check", &self.names, json!({ "data_findings": self.findings }))
    }
}
