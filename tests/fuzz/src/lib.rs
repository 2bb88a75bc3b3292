//! Fuzz targets: a function of bytes for each thing that reads what others have made. None may panic, hang or take
//! memory without bound, whatever the bytes; most check more than that.
//!
//! `corpus/TARGET/` holds seeds, `reproducers/TARGET/` inputs that once failed. `tests/corpus.rs` runs all of them with
//! every `cargo test`; `cargo xtask fuzz --seconds N [TARGET]…` looks for more.

mod journal;
mod link;
mod model;
pub mod mutate;
// Its own test belongs to the core's.
#[allow(dead_code)]
#[path = "../../core/nor.rs"]
mod nor;
mod parameters;
mod recordings;
mod server;
mod term;

use std::hash::{DefaultHasher, Hash, Hasher};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, Once};

/// What a target did with an input, as far as that tells inputs apart: those that did something new are mutated
/// further.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Seen(u64);

impl Seen {
    /// From anything that tells what was done.
    fn of(what: impl Hash) -> Self {
        let mut hasher = DefaultHasher::new();
        what.hash(&mut hasher);
        Self(hasher.finish())
    }

    /// From an error's sentence without its figures and quotations, which are the input's own.
    fn error(text: &str) -> Self {
        let outside = text.split(['"', '\'']).step_by(2);
        Self::of(outside.flat_map(str::chars).filter(|c| c.is_alphabetic()).collect::<String>())
    }
}

/// A fuzz target.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Its name, and that of its folders.
    pub name: &'static str,
    run: fn(&[u8]) -> Seen,
}

const fn new(name: &'static str, run: fn(&[u8]) -> Seen) -> Target {
    Target { name, run }
}

/// All targets.
pub const TARGETS: &[Target] = &[
    new("csv", |data| recordings::load("run.csv", data)),
    new("gzip", |data| recordings::load("run.csv.gz", data)),
    new("parquet", |data| recordings::load("run.parquet", data)),
    new("arrow", |data| recordings::load("run.feather", data)),
    new("mat", |data| recordings::load("run.mat", data)),
    new("hdf5", |data| recordings::load("run.h5", data)),
    new("netcdf", |data| recordings::load("run.nc", data)),
    new("mdf", |data| recordings::load("run.mf4", data)),
    new("tdms", |data| recordings::load("run.tdms", data)),
    new("wav", |data| recordings::load("run.wav", data)),
    new("npz", |data| recordings::load("run.npz", data)),
    new("map", recordings::mapped),
    new("table", recordings::table),
    new("frame", link::frames),
    new("message", link::messages),
    new("server", server::receive),
    new("section", parameters::section),
    new("term", term::parse),
    new("model", model::load),
    new("calibration", model::calibration),
    new("journal", journal::open),
];

/// The target of a name.
pub fn target(name: &str) -> Option<&'static Target> {
    TARGETS.iter().find(|target| target.name == name)
}

/// Folder of this package.
fn home() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Seeds and reproducers of a target that are in the tree.
///
/// # Errors
/// A folder that cannot be read.
pub fn inputs(target: &Target) -> std::io::Result<Vec<PathBuf>> {
    let mut all = Vec::new();
    for kind in ["corpus", "reproducers"] {
        match std::fs::read_dir(home().join(kind).join(target.name)) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
            Err(e) => return Err(e),
            Ok(entries) => {
                for entry in entries {
                    all.push(entry?.path());
                }
            }
        }
    }
    all.sort();
    Ok(all)
}

/// The panic of our own code that was last seen. The fence that `recording::load` puts around the decoders of others
/// turns panics into errors about a damaged file; those of our own code show here all the same.
static PANIC: Mutex<Option<String>> = Mutex::new(None);

fn last_panic() -> Option<String> {
    PANIC.lock().unwrap_or_else(std::sync::PoisonError::into_inner).take()
}

/// Notes panics of our own code instead of printing them.
fn note_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        std::panic::set_hook(Box::new(move |info| {
            let place = info.location().map(ToString::to_string).unwrap_or_default();
            if ["host-tools/", "src/", "tests/"].iter().any(|folder| place.starts_with(folder)) {
                *PANIC.lock().unwrap_or_else(std::sync::PoisonError::into_inner) =
                    Some(info.to_string().replace('\n', " "));
            }
        }));
    });
}

impl Target {
    /// Runs an input.
    ///
    /// # Errors
    /// The panic, with its place.
    pub fn run(&self, data: &[u8]) -> Result<Seen, String> {
        note_panics();
        let seen = catch_unwind(AssertUnwindSafe(|| (self.run)(data)));
        match (last_panic(), seen) {
            (Some(panic), _) => Err(panic),
            (None, Err(_)) => Err("a panic in another crate, outside of the fence".to_owned()),
            (None, Ok(seen)) => Ok(seen),
        }
    }
}

/// A file of a name with a content, for what reads files. On a disk in memory where there is one; the same file again
/// and again.
fn with_file<T>(name: &str, content: &[u8], work: impl FnOnce(&Path) -> T) -> T {
    thread_local! {
        static FOLDER: tempfile::TempDir = {
            let memory = Path::new("/dev/shm");
            let folder = if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() };
            folder.expect("a temporary folder")
        };
    }
    FOLDER.with(|folder| {
        let path = folder.path().join(name);
        std::fs::write(&path, content).expect("a file");
        work(&path)
    })
}
