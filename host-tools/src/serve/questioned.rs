//! The recordings of a page, questioned as every command questions them.

use crate::check::{self, Purpose};
use crate::model::Kind;
use crate::recording::Recording;
use crate::recording::finding::DataFinding;

/// Recordings, and what is wrong with them.
pub struct Questioned {
    /// As they were read: what is masked depends on none of the others, what is found does.
    read: Vec<Recording>,
    /// As tasks take them: wild samples do not count.
    pub usable: Vec<Recording>,
    /// What was found.
    pub findings: Vec<DataFinding>,
}

impl Questioned {
    /// Questions recordings that were read, of a kind of motor or of the one that they tell themselves.
    pub fn new(read: Vec<Recording>, kind: Option<Kind>) -> Self {
        let mut usable = read.clone();
        let kind = Kind::of(kind, &usable);
        let findings = check::question(&mut usable, kind, Purpose::Fit);
        Self { read, usable, findings }
    }

    /// These and another one, all of them questioned anew.
    pub fn with(&self, added: Recording, kind: Option<Kind>) -> Self {
        Self::new(self.read.iter().cloned().chain([added]).collect(), kind)
    }

    /// These but the one at a place, questioned anew; none: there is no such one.
    pub fn without(&self, place: usize, kind: Option<Kind>) -> Option<Self> {
        let mut read = self.read.clone();
        (place < read.len()).then(|| read.remove(place))?;
        Some(Self::new(read, kind))
    }
}
