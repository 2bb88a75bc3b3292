//! From a path to a recording: the reader by extension, limits, and a fence around other people's decoders.

use std::cell::Cell;
use std::fs::File;
use std::io::Read;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::damage::too_large;
use super::mapping::Mapping;
use super::table::{MAX_VALUES, Table};
use super::{Recording, assemble};
use crate::context::Context;
use crate::error::{Error, Place, Result};

/// A larger file holds more than [`MAX_VALUES`] numbers in any format: text needs at most 24 bytes and a separator
/// each.
const MAX_BYTES: u64 = 2 << 30;

const KNOWN: &str = "known are .csv .tsv .txt .dat (each also .gz), .parquet, .mat, .h5 .hdf5, .mf4 .mdf .dat (MDF), .tdms, .wav, .feather .arrow, .npz .npy, .lvm, .nc";

/// The formats, by extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Text { gzip: bool },
    Parquet,
    Arrow,
    Mat,
    Hdf5,
    ClassicNetCdf,
    Mdf,
    Tdms,
    Wav,
    Npz,
}

impl Format {
    fn of(path: &Path) -> Result<Self> {
        let name = path.file_name().map(|n| n.to_string_lossy().to_lowercase()).unwrap_or_default();
        let (stem, gzip) = match name.strip_suffix(".gz") {
            Some(stem) => (stem, true),
            None => (name.as_str(), false),
        };
        let extension = stem.rsplit_once('.').map_or("", |(_, e)| e);
        match extension {
            "csv" | "tsv" | "txt" | "tab" | "lvm" => Ok(Self::Text { gzip }),
            // INCA and CANape call MDF files .dat, too; the content tells.
            "dat" if !gzip && starts_with(path, b"MDF ") => Ok(Self::Mdf),
            "dat" => Ok(Self::Text { gzip }),
            _ if gzip => Err(unknown(path, &format!("{extension}.gz"))),
            "parquet" | "pq" => Ok(Self::Parquet),
            "feather" | "arrow" | "ipc" => Ok(Self::Arrow),
            "mat" => Ok(Self::Mat),
            "nc" | "nc3" | "nc4" | "cdf" if starts_with(path, b"CDF") => Ok(Self::ClassicNetCdf),
            "h5" | "hdf5" | "hdf" | "nc" | "nc3" | "nc4" | "cdf" => Ok(Self::Hdf5),
            "mf4" | "mdf" | "mf3" => Ok(Self::Mdf),
            "tdms" => Ok(Self::Tdms),
            "wav" => Ok(Self::Wav),
            "npz" | "npy" => Ok(Self::Npz),
            _ => Err(unknown(path, extension)),
        }
    }
}

fn unknown(path: &Path, extension: &str) -> Error {
    let what = if extension.is_empty() {
        "the name has no extension that tells the format".into()
    } else {
        format!("no reader for '.{extension}'")
    };
    Error::input(Place::file(path), what, KNOWN)
}

/// Loads a recording from any supported file, chosen by extension.
///
/// # Errors
/// Whatever keeps the file from being one run of one motor, uniformly sampled; each error says where and what to do.
///
/// # Examples
/// ```
/// use greyrig_host::{context::Context, recording::{Channel, Mapping, load}};
///
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("run.csv");
/// let rows: String = (0..100).map(|n| format!("{:.4},{},1.5,300\n", f64::from(n) * 1e-4, n % 7)).collect();
/// std::fs::write(&path, format!("t_s,u_v,i_a,omega_rad_s\n{rows}"))?;
/// let recording = load(&path, &Mapping::default(), &Context::quiet())?;
/// assert_eq!(recording.len(), 100);
/// assert_eq!(recording.channel(Channel::Current).map(|current| current[0]), Some(1.5));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn load(path: &Path, mapping: &Mapping, ctx: &Context) -> Result<Recording> {
    let about = std::fs::metadata(path).map_err(|e| Error::io(path, e))?;
    if about.is_dir() {
        return Err(Error::io(path, std::io::Error::from(std::io::ErrorKind::IsADirectory)));
    }
    if !about.is_file() {
        return Err(Error::input(Place::file(path), "this is no regular file", "save the recording to a file first"));
    }
    let format = Format::of(path)?;
    File::open(path).map_err(|e| Error::io(path, e))?;
    if about.len() == 0 {
        return Err(Error::input(Place::file(path), "the file is empty", "record again, or copy the file again"));
    }
    if about.len() > MAX_BYTES {
        return Err(too_large(path, &format!("{:.1} GB", about.len() as f64 / 1e9)));
    }
    let table = fence(path, || read(path, format, ctx))?;
    let values: usize = table.columns.iter().map(|c| c.values.len()).sum();
    if values > MAX_VALUES {
        return Err(too_large(path, &format!("{values} numbers")));
    }
    let sha256 = checksum(path, ctx)?;
    assemble::assemble(path, table, mapping, sha256)
}

/// Takes columns that are in memory for a recording, as [`load`] takes those of a file: names and units are recognised
/// or mapped, time is checked, invalid samples are masked.
///
/// # Errors
/// As [`load`]; `name` stands for the file.
///
/// # Examples
/// ```
/// use greyrig_host::recording::{Channel, Mapping, table::{Column, Table}, take};
///
/// let time = (0..100).map(|n| f64::from(n) * 1e-3).collect();
/// let columns = vec![Column::new("t_s", time), Column::new("Current [mA]", vec![1500.0; 100])];
/// let recording = take("bench 3", Table { columns, ..Table::default() }, &Mapping::default())?;
/// assert_eq!(recording.channel(Channel::Current).map(|current| current[0]), Some(1.5));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn take(name: impl AsRef<Path>, table: Table, mapping: &Mapping) -> Result<Recording> {
    let values: usize = table.columns.iter().map(|c| c.values.len()).sum();
    if values > MAX_VALUES {
        return Err(too_large(name.as_ref(), &format!("{values} numbers")));
    }
    assemble::assemble(name.as_ref(), table, mapping, String::new())
}

/// The same of the record batches of another program's memory.
///
/// # Errors
/// A batch that cannot be had; as [`take`].
#[cfg(feature = "arrow")]
pub fn take_batches(
    name: impl AsRef<Path>,
    schema: &arrow_schema::Schema,
    batches: impl Iterator<Item = std::result::Result<arrow_array::RecordBatch, arrow_schema::ArrowError>>,
    mapping: &Mapping,
) -> Result<Recording> {
    take(&name, super::arrow::table(name.as_ref(), schema, batches)?, mapping)
}

/// Loads a set of recordings of one motor type.
///
/// # Errors
/// As [`load`], for the first file that fails.
pub fn load_all(paths: &[PathBuf], mapping: &Mapping, ctx: &Context) -> Result<Vec<Recording>> {
    paths.iter().map(|path| load(path, mapping, ctx)).collect()
}

fn read(path: &Path, format: Format, ctx: &Context) -> Result<Table> {
    match format {
        Format::Text { gzip } => super::text::read(path, gzip, ctx),
        #[cfg(feature = "parquet")]
        Format::Parquet => super::parquet::read(path),
        #[cfg(not(feature = "parquet"))]
        Format::Parquet => Err(not_built(path, "Parquet")),
        #[cfg(feature = "arrow")]
        Format::Arrow => super::arrow::read(path),
        #[cfg(not(feature = "arrow"))]
        Format::Arrow => Err(not_built(path, "Arrow and Feather")),
        // MATLAB 7.3 is HDF5 behind a block of text.
        Format::Mat if starts_with(path, b"MATLAB 7.3") || starts_with(path, b"\x89HDF") => {
            super::hdf5::read(path, "MATLAB 7.3")
        }
        Format::Mat => super::mat::read(path),
        Format::Hdf5 => super::hdf5::read(path, "HDF5"),
        Format::ClassicNetCdf => super::netcdf::read(path),
        Format::Mdf => super::mdf::read(path),
        Format::Tdms => super::tdms::read(path),
        Format::Wav => super::wav::read(path),
        Format::Npz => super::npz::read(path),
    }
}

/// What a build without a reader says.
#[cfg(not(all(feature = "parquet", feature = "arrow")))]
pub(super) fn not_built(path: &Path, what: &str) -> Error {
    Error::input(
        Place::file(path),
        format!("this build does not handle {what} files"),
        "use the full build (in a checkout: cargo greyrig-full …), or convert the file to CSV",
    )
}

fn starts_with(path: &Path, magic: &[u8]) -> bool {
    let mut head = vec![0; magic.len()];
    File::open(path).and_then(|mut f| f.read_exact(&mut head)).is_ok() && head == magic
}

fn checksum(path: &Path, ctx: &Context) -> Result<String> {
    let mut file = File::open(path).map_err(|e| Error::io(path, e))?;
    let mut hash = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        ctx.check()?;
        match file.read(&mut buffer).map_err(|e| Error::io(path, e))? {
            0 => break,
            n => hash.update(&buffer[..n]),
        }
    }
    Ok(hash.finalize().iter().map(|b| format!("{b:02x}")).collect())
}

thread_local! {
    static FENCED: Cell<bool> = const { Cell::new(false) };
}

/// Whether this thread is within a decoder whose panic becomes an error: a program's panic hook need not tell of it,
/// too.
pub fn is_decoding() -> bool {
    FENCED.get()
}

/// Turns a panic of a decoder into an error. The decoders of binary formats are other people's crates; a damaged file
/// must not take the program down with them, whatever they assume.
pub(crate) fn fence<T>(path: &Path, work: impl FnOnce() -> Result<T>) -> Result<T> {
    FENCED.set(true);
    let result = catch_unwind(AssertUnwindSafe(work));
    FENCED.set(false);
    result.unwrap_or_else(|_| {
        Err(Error::input(
            Place::file(path),
            "the content is damaged: its decoder gave up",
            "copy the file again from its source, or export it anew",
        ))
    })
}
