//! What is flashed: the loadable parts of an ELF file.

use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader, ProgramHeader};
use object::{Endian, Endianness};

use crate::fault::Fault;

/// Bytes and where they go, by load address: initial values of statics and the code for the CCM-SRAM lie in flash.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Address and bytes.
    pub segments: Vec<(u32, Vec<u8>)>,
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// Another format, a damaged file.
    pub fn parse(bytes: &[u8]) -> Result<Self, Fault> {
        let wrong = |e: object::Error| Fault::Image(e.to_string());
        let header = FileHeader32::<Endianness>::parse(bytes).map_err(wrong)?;
        let endian = header.endian().map_err(wrong)?;
        if endian.is_big_endian() || header.e_machine(endian) != object::elf::EM_ARM {
            return Err(Fault::Image("it is not for a little-endian Arm processor".to_owned()));
        }
        let mut segments = Vec::new();
        for segment in header.program_headers(endian, bytes).map_err(wrong)? {
            if segment.p_type(endian) != PT_LOAD || segment.p_filesz(endian) == 0 {
                continue;
            }
            let data = segment.data(endian, bytes).map_err(|()| Fault::Image("it is cut off".to_owned()))?;
            segments.push((segment.p_paddr(endian), data.to_vec()));
        }
        Ok(Self { segments })
    }
}
