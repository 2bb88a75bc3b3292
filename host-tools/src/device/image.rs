//! Slots as a file, for any programmer: `.bin` is to be written to the [address](Image::address), `.hex` knows it.

use std::path::Path;

use greyrig::hardware::Slots;
use greyrig::parameters::block::{HEADER, Header, SLOTS};
use ihex::Record;

use super::RIG;
use crate::error::{Error, Place, Result};
use crate::output;

/// Bytes of a line of Intel HEX.
const LINE: usize = 16;

/// What is to be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Of a motor's parameters.
    pub parameters: Vec<u8>,
    /// Of the rig, if it is to be written, too.
    pub rig: Option<Vec<u8>>,
}

impl Image {
    /// Where it begins.
    pub fn address(&self) -> u32 {
        if self.rig.is_some() { RIG.rig.address } else { RIG.slots.address }
    }

    /// Its bytes: each block in the first of its slots, the other erased. They count whatever was there, since all of that
    /// is replaced.
    pub fn bytes(&self) -> Vec<u8> {
        // One image: the rig's slots lie just before those of the parameters.
        const { assert!(RIG.rig.address + (SLOTS * RIG.rig.size) as u32 == RIG.slots.address) }
        let rig = self.rig.iter().flat_map(|payload| slots(payload, RIG.rig));
        rig.chain(slots(&self.parameters, RIG.slots)).collect()
    }
}

fn slots(payload: &[u8], slots: Slots) -> Vec<u8> {
    let mut bytes = vec![0xFF; SLOTS * slots.size];
    bytes[..HEADER].copy_from_slice(&Header::seal(1, payload).to_bytes());
    bytes[HEADER..HEADER + payload.len()].copy_from_slice(payload);
    bytes
}

/// Writes an image, in the format of the file's extension.
///
/// # Errors
/// Another extension, an existing file without `force`, whatever the system refuses.
pub fn write(image: &Image, path: &Path, force: bool) -> Result<()> {
    let slots = image.bytes();
    let bytes = match path.extension().and_then(|e| e.to_str()) {
        Some("bin") => slots,
        Some("hex") => hex(image.address(), &slots)?.into_bytes(),
        _ => {
            return Err(Error::input(Place::file(path), "images are .bin or .hex", "name the file accordingly"));
        }
    };
    output::write_file(path, force, |out| out.write_all(&bytes))
}

/// Intel HEX of bytes from an address on; they must not cross a border of 64 KiB.
fn hex(address: u32, bytes: &[u8]) -> Result<String> {
    const {
        assert!((RIG.slots.address & 0xFFFF) as usize + SLOTS * RIG.slots.size <= 0x1_0000);
        assert!(RIG.rig.address >> 16 == RIG.slots.address >> 16);
    }
    let mut records = vec![Record::ExtendedLinearAddress((address >> 16) as u16)];
    for (n, line) in bytes.chunks(LINE).enumerate() {
        let offset = (address & 0xFFFF) as u16 + (n * LINE) as u16;
        records.push(Record::Data { offset, value: line.to_vec() });
    }
    records.push(Record::EndOfFile);
    ihex::create_object_file_representation(&records)
        .map_err(|e| Error::usage(format!("the image cannot be written as Intel HEX: {e}"), "report this as a bug"))
}
