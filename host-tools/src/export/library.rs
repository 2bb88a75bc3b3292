//! The library that a unit carries: found, and known by what its file holds.

use std::fmt;
use std::path::{Path, PathBuf};

use greyrig::parameters::FINGERPRINT;

use crate::error::{Error, Place, Result};

/// What builds the library.
const BUILD: &str = "build it with `cargo build --release -p greyrig-fmi`";

/// Processor and system that a library is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Platform {
    processor: &'static str,
    system: System,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum System {
    Linux,
    Windows,
    Darwin,
}

impl Platform {
    /// By the head of a library's file: ELF, PE, or Mach-O.
    fn of(bytes: &[u8]) -> Option<Self> {
        let half = |at: usize| Some(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?));
        let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
        let (system, processor) = if bytes.starts_with(b"\x7fELF") {
            let processor = match half(18)? {
                0x03 => "x86",
                0x3e => "x86_64",
                0xb7 => "aarch64",
                _ => return None,
            };
            (System::Linux, processor)
        } else if bytes.starts_with(b"MZ") {
            let head = word(0x3c)? as usize;
            let processor = match (word(head)?, half(head + 4)?) {
                (0x4550, 0x014c) => "x86",
                (0x4550, 0x8664) => "x86_64",
                (0x4550, 0xaa64) => "aarch64",
                _ => return None,
            };
            (System::Windows, processor)
        } else if word(0)? == 0xfeed_facf {
            let processor = match word(4)? {
                0x0100_0007 => "x86_64",
                0x0100_000c => "aarch64",
                _ => return None,
            };
            (System::Darwin, processor)
        } else {
            return None;
        };
        Some(Self { processor, system })
    }

    /// The folder of FMI 3.0.
    pub fn tuple(self) -> String {
        let system = match self.system {
            System::Linux => "linux",
            System::Windows => "windows",
            System::Darwin => "darwin",
        };
        format!("{}-{system}", self.processor)
    }

    /// The folder of FMI 2.0, which names no processors but those of PCs; elsewhere that of FMI 3.0.
    pub fn fmi2(self) -> String {
        match (self.system, self.processor) {
            (System::Linux, "x86_64") => "linux64".to_owned(),
            (System::Linux, "x86") => "linux32".to_owned(),
            (System::Windows, "x86_64") => "win64".to_owned(),
            (System::Windows, "x86") => "win32".to_owned(),
            (System::Darwin, "x86_64") => "darwin64".to_owned(),
            _ => self.tuple(),
        }
    }

    /// What the names of libraries end in.
    pub const fn suffix(self) -> &'static str {
        match self.system {
            System::Linux => ".so",
            System::Windows => ".dll",
            System::Darwin => ".dylib",
        }
    }
}

impl fmt::Display for Platform {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.tuple())
    }
}

/// A library.
#[derive(Debug, Clone)]
pub struct Library {
    /// Where it was found.
    pub path: PathBuf,
    /// What it is for.
    pub platform: Platform,
    /// Whether it runs on every processor of that kind; else only on those that are like the one that built it.
    pub is_portable: bool,
    /// The file.
    pub bytes: Vec<u8>,
}

/// Text in the library's file, before the fingerprint of its layout of parameters and whether it is portable.
const MARK: &str = concat!("greyrig-fmi ", env!("CARGO_PKG_VERSION"), ";");

impl Library {
    /// Reads a library.
    ///
    /// # Errors
    /// A file that cannot be read, is no library, or belongs to another greyrig.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
        let wrong = |what: String| Error::input(Place::file(path), what, BUILD);
        let Some(platform) = Platform::of(&bytes) else {
            return Err(wrong("this is no library of a system and a processor that are known here".to_owned()));
        };
        let after =
            |mark: &[u8]| bytes.windows(mark.len()).position(|at| at == mark).map(|at| &bytes[at + mark.len()..]);
        let Some(&[a, b, c, d, portable, ..]) = after(MARK.as_bytes()) else {
            return Err(wrong(match after(b"greyrig-fmi ") {
                Some(_) => format!("this library is of another version than {}", env!("CARGO_PKG_VERSION")),
                None => "this is not the library of greyrig's units".to_owned(),
            }));
        };
        if u32::from_le_bytes([a, b, c, d]) != FINGERPRINT {
            return Err(wrong("this library lays parameters out differently".to_owned()));
        }
        Ok(Self { path: path.to_owned(), platform, is_portable: portable == b'p', bytes })
    }

    /// The library of this machine: beside the program, or where a checkout's release build puts it.
    ///
    /// # Errors
    /// It is not there; as [`Library::read`].
    pub fn find() -> Result<Self> {
        let name = format!(
            "{}{}{}",
            std::env::consts::DLL_PREFIX,
            super::description::IDENTIFIER,
            std::env::consts::DLL_SUFFIX
        );
        let program = std::env::current_exe().and_then(std::fs::canonicalize).unwrap_or_default();
        let beside = program.with_file_name(&name);
        let release = program.ancestors().nth(2).map(|target| target.join("release").join(&name));
        let found = [Some(beside), release].into_iter().flatten().find(|path| path.is_file());
        match found {
            Some(path) => Self::read(&path),
            None => Err(Error::usage(
                format!("the library of the unit, {name}, is not beside the program"),
                format!("{BUILD}, or name it with --library"),
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pe(machine: u16) -> Vec<u8> {
        let mut bytes = vec![0; 0x90];
        bytes[..2].copy_from_slice(b"MZ");
        bytes[0x3c..0x40].copy_from_slice(&0x80u32.to_le_bytes());
        bytes[0x80..0x84].copy_from_slice(b"PE\0\0");
        bytes[0x84..0x86].copy_from_slice(&machine.to_le_bytes());
        bytes
    }

    /// Numbers of processors as the formats' own documents have them.
    #[test]
    fn a_platform_is_known_by_the_head_of_a_file() {
        let mut elf = vec![0; 20];
        elf[..4].copy_from_slice(b"\x7fELF");
        elf[18] = 62;
        let mut macho = 0xfeed_facf_u32.to_le_bytes().to_vec();
        macho.extend(0x0100_000c_u32.to_le_bytes());
        for (bytes, three, two, suffix) in [
            (elf, "x86_64-linux", "linux64", ".so"),
            (pe(0x8664), "x86_64-windows", "win64", ".dll"),
            (macho, "aarch64-darwin", "aarch64-darwin", ".dylib"),
        ] {
            let platform = Platform::of(&bytes).unwrap();
            assert_eq!((platform.tuple().as_str(), platform.fmi2().as_str()), (three, two));
            assert_eq!(platform.suffix(), suffix);
            // Cut anywhere, it is no library.
            (0..4.min(bytes.len())).for_each(|end| assert_eq!(Platform::of(&bytes[..end]), None));
        }
        assert_eq!(Platform::of(b"#!/bin/sh\n"), None);
        assert_eq!(Platform::of(&pe(1)), None);
    }
}
