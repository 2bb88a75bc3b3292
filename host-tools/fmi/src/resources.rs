//! What a unit is read from: the block of parameters and the token, in the folder of its resources.

use std::path::{Path, PathBuf};

use greyrig::parameters::block::{HEADER, Header};
use greyrig::parameters::{FINGERPRINT, Settings, section};

/// The file with the block of parameters: header and payload, as a slot of the microcontroller's flash holds them.
pub const BLOCK: &str = "motor.bin";
/// The file with the token of the unit, by which a description and a library know each other.
pub const TOKEN: &str = "token.txt";

/// By these bytes in the library's file the exporter knows that it belongs to it: `greyrig-fmi VERSION;` and the
/// fingerprint of the layout of parameters, little-endian; then `p` if it runs on every processor of its kind, or else
/// `n`.
// SAFETY: no other library that a simulator loads has a symbol of this name.
#[unsafe(no_mangle)]
pub static GREYRIG_FMI: [u8; TEXT.len() + 5] = {
    // What the first processors of the kind lack is a sign that a certain one was built for.
    let is_bound = cfg!(any(target_feature = "avx", all(target_os = "linux", target_feature = "lse")));
    let mut mark = [if is_bound { b'n' } else { b'p' }; TEXT.len() + 5];
    let (text, number) = (TEXT.as_bytes(), FINGERPRINT.to_le_bytes());
    let mut n = 0;
    while n + 1 < mark.len() {
        mark[n] = if n < text.len() { text[n] } else { number[n - text.len()] };
        n += 1;
    }
    mark
};
const TEXT: &str = concat!("greyrig-fmi ", env!("CARGO_PKG_VERSION"), ";");

/// Reads the parameters of a unit.
///
/// # Errors
/// A token that is not the unit's, or a file that is not there, damaged, or of another version.
pub fn read(folder: &Path, token: &str) -> Result<Settings, String> {
    let read = |name: &str| {
        let path = folder.join(name);
        std::fs::read(&path).map_err(|error| format!("{}: {error}; export the unit again", path.display()))
    };
    if read(TOKEN)?.trim_ascii() != token.trim_ascii().as_bytes() {
        return Err("the token is not that of this unit: its description has been changed; export it again".to_owned());
    }
    let bytes = read(BLOCK)?;
    let path = folder.join(BLOCK);
    let wrong = |what: &str| format!("{}: {what}; export the unit again", path.display());
    let (header, payload) = bytes.split_first_chunk::<HEADER>().ok_or_else(|| wrong("it is too short"))?;
    Header::from_bytes(*header).and_then(|header| header.check(payload)).map_err(|_| wrong("it is damaged"))?;
    section::decode(payload).map_err(|error| wrong(&error.to_string()))
}

/// The folder that a `file:` URI names, as FMI 2.0 has it; what is no such URI is taken for a path.
pub fn folder(location: &str) -> PathBuf {
    let Some(rest) = location.strip_prefix("file:") else { return PathBuf::from(location) };
    // file:///path, file://localhost/path or file:/path.
    let path = rest.strip_prefix("//").map_or(rest, |rest| rest.strip_prefix("localhost").unwrap_or(rest));
    let mut bytes = Vec::with_capacity(path.len());
    let mut rest = path.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let code = (first == b'%').then(|| after.get(..2)).flatten();
        let code = code.and_then(|code| u8::from_str_radix(std::str::from_utf8(code).ok()?, 16).ok());
        bytes.push(code.unwrap_or(first));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    let path = String::from_utf8_lossy(&bytes).into_owned();
    // A drive of Windows: /C:/folder.
    let drive = path.strip_prefix('/').filter(|path| path.as_bytes().get(1) == Some(&b':'));
    PathBuf::from(drive.unwrap_or(&path))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_location_is_a_path() {
        for (location, path) in [
            ("file:///tmp/a%20unit/resources", "/tmp/a unit/resources"),
            ("file://localhost/tmp/r", "/tmp/r"),
            ("file:/tmp/r", "/tmp/r"),
            ("file:///C:/units/r", "C:/units/r"),
            ("file:///tmp/50%", "/tmp/50%"),
            ("file:///tmp/%C3%A4", "/tmp/ä"),
            ("/tmp/r", "/tmp/r"),
        ] {
            assert_eq!(folder(location), PathBuf::from(path), "{location}");
        }
    }
}
