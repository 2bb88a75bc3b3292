//! A project's folder, `NAME.greyrig`: everything that a page has come to, saved as one works.
//!
//! ```text
//! motor.greyrig/
//!   project.json      recordings by path and hash, roles, versions with the command that makes each
//!   versions/3.toml   the model files
//!   recordings/       what was sent by the page
//!   station.toml      the model with limits by which motors are judged
//!   judged.json       the last judgement
//!   token             who knows it may use the page
//!   lock              held while the page is served
//! ```
//! Each file is replaced as a whole, so that a power cut leaves the state before or after.

use std::fs::{File, TryLockError};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tempfile::NamedTempFile;

use super::api;
use super::recordings::Kept;
use crate::error::{Error, Place, Result};
use crate::model::{Kind, Model};
use crate::output;

/// Version of the file's layout.
const SCHEMA: u32 = 1;
/// How a project's folder ends.
pub const EXTENSION: &str = "greyrig";
/// Random characters of a token: 62³² are more than 2¹⁹⁰.
const TOKEN: usize = 32;

/// What is in `project.json`.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Content {
    /// Layout.
    pub schema: u32,
    /// Kind of motor; none: what the recordings tell.
    pub kind: Option<Kind>,
    /// Recordings.
    pub recordings: Vec<Kept>,
    /// Versions of the model.
    pub versions: Vec<api::Version>,
    /// The one that is worked on.
    pub present: Option<u32>,
    /// The number that the next recording or version gets.
    pub next: u32,
    /// The built-in motor, if it is one.
    pub tour: Option<api::Tour>,
    /// What the user knows the model by which motors are judged.
    #[serde(default)]
    pub station: Option<String>,
}

impl Content {
    /// Of the present layout.
    pub fn begun() -> Self {
        Self { schema: SCHEMA, ..Self::default() }
    }
}

/// A project's folder, held by this process.
#[derive(Debug)]
pub struct Project {
    folder: PathBuf,
    token: String,
    /// Whether it was begun without a name, just now.
    is_unnamed: bool,
    _lock: File,
}

/// A folder that others cannot look into.
fn private_folder(path: &Path) -> Result<()> {
    let mut builder = std::fs::DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.create(path).map_err(|e| Error::io(path, e))
}

/// Where projects go that have no name yet.
fn state_folder() -> Result<PathBuf> {
    let set = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let home = || set("HOME").or_else(|| set("USERPROFILE")).map(|home| home.join(".local/state"));
    let base = set("XDG_STATE_HOME").or_else(home);
    let missing =
        || Error::usage("there is no HOME to keep the project in", "name a project: greyrig serve motor.greyrig");
    Ok(base.ok_or_else(missing)?.join("greyrig/projects"))
}

impl Project {
    /// Opens a project, or begins one where there is none; without a name in the user's state folder.
    ///
    /// # Errors
    /// A folder that is something else, that another process serves, or that the system refuses.
    pub fn open(folder: Option<&Path>) -> Result<(Self, Content)> {
        let is_unnamed = folder.is_none();
        let folder = match folder {
            Some(folder) => folder.to_owned(),
            None => {
                let all = state_folder()?;
                private_folder(&all)?;
                let suffix = format!(".{EXTENSION}");
                let made = tempfile::Builder::new().prefix("unnamed-").suffix(&suffix).tempdir_in(&all);
                made.map_err(|e| Error::io(&all, e))?.keep()
            }
        };
        let file = folder.join("project.json");
        let is_foreign = folder.is_dir()
            && !file.exists()
            && std::fs::read_dir(&folder)
                .map_err(|e| Error::io(&folder, e))?
                .flatten()
                .any(|e| e.file_name() != "token");
        if is_foreign && !folder.join("lock").exists() {
            let what = "this folder holds other files and no project";
            return Err(Error::input(Place::file(&folder), what, "name a new folder that ends with .greyrig"));
        }
        private_folder(&folder)?;
        for part in ["versions", "recordings"] {
            private_folder(&folder.join(part))?;
        }
        let lock = folder.join("lock");
        let held = File::create(&lock).map_err(|e| Error::io(&lock, e))?;
        match held.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let what = "another greyrig serve has this project open";
                return Err(Error::input(Place::file(&folder), what, "use its page, or end it first"));
            }
            Err(TryLockError::Error(e)) => return Err(Error::io(&lock, e)),
        }
        let content = if file.exists() { read(&file)? } else { Content::begun() };
        let token = token(&folder.join("token"))?;
        Ok((Self { folder, token, is_unnamed, _lock: held }, content))
    }

    /// Its folder, as the user named it.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Who knows it may use the page.
    pub fn token(&self) -> &str {
        &self.token
    }

    /// Saves what the page has come to.
    ///
    /// # Errors
    /// Whatever the system refuses.
    pub fn save(&self, content: &Content) -> Result<()> {
        let file = self.folder.join("project.json");
        output::write_file(&file, true, |out| serde_json::to_writer_pretty(out, content).map_err(std::io::Error::other))
    }

    /// Removes a project without a name in which nothing is.
    pub fn leave(&self, content: &Content) {
        if self.is_unnamed && content.recordings.is_empty() && content.versions.is_empty() {
            // An empty folder more does no harm.
            let _ = std::fs::remove_dir_all(&self.folder);
        }
    }

    /// The model file of a version.
    pub fn model_file(&self, version: u32) -> PathBuf {
        self.folder.join(format!("versions/{version}.toml"))
    }

    /// Saves a version's model.
    ///
    /// # Errors
    /// A model without a number for a parameter; whatever the system refuses.
    pub fn save_model(&self, version: u32, model: &Model) -> Result<()> {
        let text = model.text()?;
        output::write_file(&self.model_file(version), true, |out| out.write_all(text.as_bytes()))
    }

    fn correction_file(&self, version: u32) -> PathBuf {
        self.folder.join(format!("versions/{version}.correction.json"))
    }

    /// Saves what a version has learnt.
    ///
    /// # Errors
    /// Whatever the system refuses.
    pub fn save_correction(&self, version: u32, correction: &api::Correction) -> Result<()> {
        output::write_file(&self.correction_file(version), true, |out| {
            serde_json::to_writer(out, correction).map_err(std::io::Error::other)
        })
    }

    /// What a version has learnt, as JSON, if it has here.
    pub fn correction(&self, version: u32) -> Option<Vec<u8>> {
        std::fs::read(self.correction_file(version)).ok()
    }

    /// The model by which motors are judged.
    pub fn station_file(&self) -> PathBuf {
        self.folder.join("station.toml")
    }

    /// Saves it; what another one has judged goes.
    ///
    /// # Errors
    /// As [`save_model`](Self::save_model).
    pub fn save_station(&self, model: &Model) -> Result<()> {
        let (text, judged) = (model.text()?, self.judged_file());
        match std::fs::remove_file(&judged) {
            Err(e) if e.kind() != ErrorKind::NotFound => return Err(Error::io(&judged, e)),
            _ => {}
        }
        output::write_file(&self.station_file(), true, |out| out.write_all(text.as_bytes()))
    }

    fn judged_file(&self) -> PathBuf {
        self.folder.join("judged.json")
    }

    /// Saves a judgement in place of the one before.
    ///
    /// # Errors
    /// Whatever the system refuses.
    pub fn save_judged(&self, judged: &api::Judged) -> Result<()> {
        output::write_file(&self.judged_file(), true, |out| {
            serde_json::to_writer(out, judged).map_err(std::io::Error::other)
        })
    }

    /// The judgement that was saved, if this greyrig can read it.
    pub fn judged(&self) -> Option<api::Judged> {
        serde_json::from_slice(&std::fs::read(self.judged_file()).ok()?).ok()
    }

    /// A file for what the page sends.
    ///
    /// # Errors
    /// Whatever the system refuses.
    pub fn receive(&self) -> Result<NamedTempFile> {
        let folder = self.folder.join("recordings");
        NamedTempFile::with_prefix_in(".arriving-", &folder).map_err(|e| Error::io(folder, e))
    }

    /// Gives a file that has arrived its name, or one like it if that is taken.
    ///
    /// # Errors
    /// Whatever the system refuses.
    pub fn keep(&self, mut arrived: NamedTempFile, name: &Path) -> Result<PathBuf> {
        arrived.as_file_mut().sync_all().map_err(|e| Error::io(name, e))?;
        let part = |part: Option<&std::ffi::OsStr>| part.map(|p| p.to_string_lossy().into_owned()).unwrap_or_default();
        let (stem, ending) = (part(name.file_stem()), part(name.extension()));
        for number in 1.. {
            let tail = if number == 1 { String::new() } else { format!("-{number}") };
            let file = if ending.is_empty() { format!("{stem}{tail}") } else { format!("{stem}{tail}.{ending}") };
            let path = self.folder.join("recordings").join(file);
            match arrived.persist_noclobber(&path) {
                Ok(_) => return Ok(path),
                Err(e) if e.error.kind() == ErrorKind::AlreadyExists => arrived = e.file,
                Err(e) => return Err(Error::io(&path, e.error)),
            }
        }
        unreachable!("numbers do not end")
    }
}

fn read(file: &Path) -> Result<Content> {
    let text = std::fs::read_to_string(file).map_err(|e| Error::io(file, e))?;
    let content: Content = serde_json::from_str(&text).map_err(|e| {
        let what = format!("this is no project file: {e}");
        Error::input(Place::at(file, e.line(), e.column()), what, "name a project that greyrig serve has made")
    })?;
    if content.schema != SCHEMA {
        let what = format!("the project has layout {}, this greyrig knows {SCHEMA}", content.schema);
        return Err(Error::input(Place::file(file), what, "open it with the greyrig that has made it"));
    }
    Ok(content)
}

/// The one that is kept, or a new one.
fn token(file: &Path) -> Result<String> {
    use rand::distr::{Alphanumeric, SampleString};
    let fail = |e: std::io::Error| Error::io(file, e);
    match std::fs::read_to_string(file) {
        Ok(text) if text.len() == TOKEN && text.bytes().all(|b| b.is_ascii_alphanumeric()) => return Ok(text),
        Err(e) if e.kind() != ErrorKind::NotFound => return Err(fail(e)),
        _ => {}
    }
    let text = Alphanumeric.sample_string(&mut rand::rng(), TOKEN);
    let folder = file.parent().unwrap_or(Path::new("."));
    // A temporary file can be read by its owner alone, and keeps that when it gets its name.
    let mut made = NamedTempFile::new_in(folder).map_err(fail)?;
    made.write_all(text.as_bytes()).map_err(fail)?;
    made.as_file().sync_all().map_err(fail)?;
    made.persist(file).map_err(|e| fail(e.error))?;
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_project_is_held_once_and_keeps_its_token() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("motor.greyrig");
        let (project, mut content) = Project::open(Some(&path)).unwrap();
        content.next = 7;
        project.save(&content).unwrap();
        let refused = Project::open(Some(&path)).unwrap_err().to_string();
        assert!(refused.contains("has this project open"), "{refused}");
        let token = project.token().to_owned();
        drop(project);
        let (project, content) = Project::open(Some(&path)).unwrap();
        assert_eq!((project.token(), content.next), (token.as_str(), 7));
        #[cfg(unix)]
        for (part, mode) in [("token", 0o600), ("", 0o700)] {
            use std::os::unix::fs::PermissionsExt;
            let found = std::fs::metadata(path.join(part)).unwrap().permissions().mode() & 0o777;
            assert_eq!(found, mode, "{part}: {found:o}");
        }
    }

    #[test]
    fn what_arrives_never_replaces_what_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let (project, _) = Project::open(Some(&folder.path().join("motor.greyrig"))).unwrap();
        let names: Vec<String> = (0..3)
            .map(|_| project.keep(project.receive().unwrap(), Path::new("run.csv")).unwrap())
            .map(|path| path.file_name().unwrap().to_string_lossy().into_owned())
            .collect();
        assert_eq!(names, ["run.csv", "run-2.csv", "run-3.csv"]);
    }

    #[test]
    fn a_folder_of_something_else_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("thesis.tex"), "").unwrap();
        let refused = Project::open(Some(folder.path())).unwrap_err().to_string();
        assert!(refused.contains("other files and no project"), "{refused}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
