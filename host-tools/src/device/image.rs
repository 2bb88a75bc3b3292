//! The two slots as a file, for any programmer: `.bin` is to be written to their [address](RIG), `.hex` knows it.

use std::path::Path;

use greyrig::hardware::Slots;
use greyrig::parameters::block::{HEADER, Header, SLOTS};
use ihex::Record;

use super::RIG;
use crate::error::{Error, Place, Result};
use crate::output;

/// Where the slots are.
const ALL: Slots = RIG.slots;
/// Bytes of a line of Intel HEX.
const LINE: usize = 16;

/// The block in the first slot, the other erased. It counts whatever was there, since all of that is replaced.
pub fn slots(payload: &[u8]) -> Vec<u8> {
    let mut bytes = vec![0xFF; SLOTS * ALL.size];
    bytes[..HEADER].copy_from_slice(&Header::seal(1, payload).to_bytes());
    bytes[HEADER..HEADER + payload.len()].copy_from_slice(payload);
    bytes
}

/// Writes the slots, in the format of the file's extension.
///
/// # Errors
/// Another extension, an existing file without `force`, whatever the system refuses.
pub fn write(payload: &[u8], path: &Path, force: bool) -> Result<()> {
    let slots = slots(payload);
    let bytes = match path.extension().and_then(|e| e.to_str()) {
        Some("bin") => slots,
        Some("hex") => hex(&slots)?.into_bytes(),
        _ => {
            return Err(Error::input(Place::file(path), "images are .bin or .hex", "name the file accordingly"));
        }
    };
    output::write_file(path, force, |out| out.write_all(&bytes))
}

/// Intel HEX of bytes from the first slot on; they must not cross a border of 64 KiB.
fn hex(bytes: &[u8]) -> Result<String> {
    const { assert!((ALL.address & 0xFFFF) as usize + SLOTS * ALL.size <= 0x1_0000) }
    let mut records = vec![Record::ExtendedLinearAddress((ALL.address >> 16) as u16)];
    for (n, line) in bytes.chunks(LINE).enumerate() {
        let offset = (ALL.address & 0xFFFF) as u16 + (n * LINE) as u16;
        records.push(Record::Data { offset, value: line.to_vec() });
    }
    records.push(Record::EndOfFile);
    ihex::create_object_file_representation(&records)
        .map_err(|e| Error::usage(format!("the image cannot be written as Intel HEX: {e}"), "report this as a bug"))
}
