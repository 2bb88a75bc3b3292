//! The recordings of a project: what each is for, and what is wrong with it. A file that cannot be used stays among
//! them, with what is wrong.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::api::{self, Role};
use crate::check::{self, Purpose};
use crate::context::Context;
use crate::error;
use crate::mains;
use crate::model::Kind;
use crate::recording::finding::DataFinding;
use crate::recording::{self, Channel, Mapping, Recording};

/// What a project keeps of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    /// Its number.
    pub id: u32,
    /// As the user knows it.
    pub name: PathBuf,
    /// Its file.
    pub path: PathBuf,
    /// SHA-256 of the file, in hexadecimal; empty of one that cannot be read.
    pub sha256: String,
    /// What it is for.
    pub role: Role,
    /// Rules of `--map`.
    pub map: Vec<String>,
}

/// A recording, or why it is none.
#[derive(Debug, Clone)]
pub struct Entry {
    /// What is kept of it.
    pub kept: Kept,
    /// As it was read: what is masked depends on none of the others, what is found does.
    pub read: Result<Arc<Recording>, String>,
}

impl Entry {
    /// Reads a file; one that has changed since it was kept is told, and so is what cannot be read.
    pub fn read(mut kept: Kept, ctx: &Context) -> Self {
        let loaded = Mapping::parse(&kept.map).and_then(|map| recording::load(&kept.path, &map, ctx));
        let read = loaded.map_err(|e| named(e, &kept.path, &kept.name).to_string()).and_then(|r| {
            if kept.sha256.is_empty() || kept.sha256 == r.sha256() {
                return Ok(Arc::new(r.named(&kept.name)));
            }
            let name = kept.name.display();
            Err(format!("{name}: the file has changed since it was added; remove it here and add it again"))
        });
        if let Ok(recording) = &read {
            kept.sha256 = recording.sha256().to_owned();
        }
        Self { kept, read }
    }

    fn is_of_use(&self) -> bool {
        self.read.is_ok() && self.kept.role != Role::Off
    }
}

/// An error with the name that the user knows a file by.
pub fn named(error: error::Error, path: &Path, name: &Path) -> error::Error {
    use error::Error as E;
    match error {
        E::Input { mut place, what, remedy } if place.path == path => {
            place.path = name.to_owned();
            E::Input { place, what, remedy }
        }
        E::Io { source, remedy, .. } => E::Io { path: name.to_owned(), source, remedy },
        other => other,
    }
}

/// The recordings of a project, questioned as every command questions them.
#[derive(Debug, Default)]
pub struct Recordings {
    /// All of them.
    pub entries: Vec<Entry>,
    /// Those with a role, as tasks take them: wild samples do not count, and what judges stands last.
    pub usable: Vec<Recording>,
    /// Their numbers.
    pub ids: Vec<u32>,
    /// What was found about them.
    pub findings: Vec<DataFinding>,
}

impl Recordings {
    /// Questions recordings, of a kind of motor or of the one that they tell themselves.
    pub fn new(entries: Vec<Entry>, kind: Option<Kind>) -> Self {
        let mut chosen: Vec<&Entry> = entries.iter().filter(|e| e.is_of_use()).collect();
        chosen.sort_by_key(|e| e.kept.role == Role::Judge);
        let ids = chosen.iter().map(|e| e.kept.id).collect();
        let mut usable: Vec<Recording> = chosen.iter().filter_map(|e| e.read.as_deref().ok().cloned()).collect();
        let kind = Kind::of(kind, &usable);
        let findings = check::question(&mut usable, kind, Purpose::Fit);
        Self { entries, usable, ids, findings }
    }

    /// What another one is for: the second judges, if none does yet.
    pub fn role_of_next(&self) -> Role {
        let has = |role| self.entries.iter().any(|e| e.read.is_ok() && e.kept.role == role);
        if has(Role::Fit) && !has(Role::Judge) { Role::Judge } else { Role::Fit }
    }

    /// These and others.
    pub fn with(&self, added: impl IntoIterator<Item = Entry>, kind: Option<Kind>) -> Self {
        Self::new(self.entries.iter().cloned().chain(added).collect(), kind)
    }

    /// These but one; none: there is no such one.
    pub fn without(&self, id: u32, kind: Option<Kind>) -> Option<Self> {
        let mut entries = self.entries.clone();
        let place = entries.iter().position(|e| e.kept.id == id)?;
        entries.remove(place);
        Some(Self::new(entries, kind))
    }

    /// These with another role of one; one alone judges. None: there is no such one.
    pub fn with_role(&self, id: u32, role: Role, kind: Option<Kind>) -> Option<Self> {
        let mut entries = self.entries.clone();
        let place = entries.iter().position(|e| e.kept.id == id)?;
        if role == Role::Judge {
            entries.iter_mut().filter(|e| e.kept.role == Role::Judge).for_each(|e| e.kept.role = Role::Fit);
        }
        entries[place].kept.role = role;
        Some(Self::new(entries, kind))
    }

    /// The one of a number.
    pub fn entry(&self, id: u32) -> Option<&Entry> {
        self.entries.iter().find(|e| e.kept.id == id)
    }

    /// The one of a number, as tasks take it.
    pub fn usable(&self, id: u32) -> Option<&Recording> {
        self.usable.get(self.ids.iter().position(|other| *other == id)?)
    }

    /// Samples of those with a role.
    pub fn samples(&self) -> usize {
        self.usable.iter().map(Recording::len).sum()
    }

    /// Which they are, and what for: what rests on others cannot be compared with what rests on these.
    pub fn basis(&self) -> String {
        let judge = self.ids.len().wrapping_sub(1);
        let short = |(k, r): (usize, &Recording)| {
            let hash = r.sha256().get(..12).unwrap_or_default();
            if k == judge { format!("judge:{hash}") } else { hash.to_owned() }
        };
        self.usable.iter().enumerate().map(short).collect::<Vec<_>>().join(" ")
    }

    /// The files of those with a role, what judges last, as a command takes them; and their mapping.
    pub fn arguments(&self) -> Vec<String> {
        let entries = || self.ids.iter().filter_map(|id| self.entry(*id));
        let mut words: Vec<String> = entries().map(|e| e.kept.path.display().to_string()).collect();
        let mut rules: Vec<&String> = Vec::new();
        for rule in entries().flat_map(|e| &e.kept.map) {
            if !rules.contains(&rule) {
                rules.push(rule);
                words.extend(["--map".to_owned(), rule.clone()]);
            }
        }
        words
    }

    /// As the page shows them.
    pub fn told(&self) -> Vec<api::Recording> {
        let last = self.ids.last();
        self.entries.iter().map(|e| told(e, last == Some(&e.kept.id), &self.findings)).collect()
    }
}

fn told(entry: &Entry, judges: bool, findings: &[DataFinding]) -> api::Recording {
    let Kept { id, name, role, map, .. } = &entry.kept;
    let r = entry.read.as_ref().ok();
    let channels = |r: &Arc<Recording>| -> Vec<api::Signal> {
        let signal = |c: &Channel| api::Signal { column: c.column().to_owned(), unit: c.unit(r.motion()).to_owned() };
        r.channels().keys().map(signal).collect()
    };
    let of_this = |f: &&DataFinding| *role != Role::Off && f.recording == *name;
    api::Recording {
        id: *id,
        name: name.display().to_string(),
        role: *role,
        judges,
        unusable: entry.read.as_ref().err().cloned(),
        start_s: r.map_or(0.0, |r| r.start_s()),
        seconds: r.map_or(0.0, |r| r.duration_s()),
        sample_time_s: r.map_or(0.0, |r| r.sample_time_s()),
        samples: r.map_or(0, |r| u32::try_from(r.len()).unwrap_or(u32::MAX)),
        channels: r.map_or_else(Vec::new, channels),
        mains_s: r.and_then(|r| mains::period_s(r.channel(Channel::Voltage)?, r.sample_time_s())),
        map: map.clone(),
        warnings: r.map_or_else(Vec::new, |r| r.warnings().to_vec()),
        findings: findings.iter().filter(of_this).map(Into::into).collect(),
    }
}
