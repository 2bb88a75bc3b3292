//! What is said of files that are damaged or too large.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::table::MAX_VALUES;
use crate::error::{Error, Place};

/// A file beyond the limit.
pub(super) fn too_large(path: &Path, size: &str) -> Error {
    Error::input(
        Place::file(path),
        format!("the file is too large: {size}, the limit is {} million numbers or 2 GB", MAX_VALUES / 1_000_000),
        "cut the run into several recordings, or leave out columns and samples that are not needed",
    )
}

/// A decoder's complaint, with a hint where the content is of another format.
pub(super) fn damaged(path: &Path, format: &str, detail: impl std::fmt::Display) -> Error {
    let mut head = Vec::new();
    if let Ok(file) = File::open(path) {
        // A file that cannot be read again only loses the hint.
        let _ = file.take(4096).read_to_end(&mut head);
    }
    let detail: String =
        detail.to_string().split_whitespace().collect::<Vec<_>>().join(" ").chars().take(160).collect();
    // A hint at the extension that it has would be none.
    let own = path.extension().map(|extension| format!(".{}", extension.to_string_lossy().to_lowercase()));
    let has_own = |found: &str| own.as_deref().is_some_and(|own| found.contains(own));
    let remedy = match looks_like(&head) {
        Some(found) if has_own(found) => "copy the file again from its source, or export it anew".into(),
        Some(found) if !format.starts_with(found) && !found.starts_with(format) => {
            format!("it looks like {found}: give it that extension")
        }
        None if !head.is_empty() && head.iter().all(|&b| b >= 0x20 || matches!(b, b'\t' | b'\n' | b'\r')) => {
            "it looks like text: name it .csv".into()
        }
        _ => "copy the file again from its source, or export it anew".into(),
    };
    Error::input(Place::file(path), format!("the {format} file cannot be read ({detail})"), remedy)
}

/// The format that the first bytes belong to.
pub(super) fn looks_like(head: &[u8]) -> Option<&'static str> {
    let starts = |magic: &[u8]| head.starts_with(magic);
    match () {
        () if starts(b"PAR1") => Some("Parquet (.parquet)"),
        () if starts(b"ARROW1") => Some("Arrow (.feather)"),
        () if starts(b"\x89HDF") => Some("HDF5 (.h5)"),
        () if starts(b"MATLAB 5.0") => Some("MATLAB (.mat)"),
        () if starts(b"MATLAB 7.3") => Some("MATLAB (.mat)"),
        () if starts(b"MDF ") || starts(b"UnFinMF") => Some("MDF (.mf4)"),
        () if starts(b"TDSm") => Some("TDMS (.tdms)"),
        () if starts(b"RIFF") || starts(b"RF64") => Some("WAV (.wav)"),
        () if starts(b"CDF\x01") || starts(b"CDF\x02") || starts(b"CDF\x05") => Some("classic NetCDF (.nc)"),
        () if starts(b"\x1f\x8b") => Some("gzip (.csv.gz)"),
        () if starts(b"PK\x03\x04") => Some("a ZIP archive (.npz, or a spreadsheet: export it as .csv)"),
        () => None,
    }
}
