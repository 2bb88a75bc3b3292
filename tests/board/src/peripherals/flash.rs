//! Flash memory in dual-bank mode (RM0440, section 3, devices of category 3): bank 1 holds the program and is only
//! read; bank 2 can be erased by pages and programmed by double words, each with check bits.
//!
//! A double word that was cut while it was programmed or erased cannot be read: ECCD is set and a non-maskable
//! interrupt raised (section 3.3.2). Times are the typical ones of data sheet DS12288.

use std::collections::BTreeSet;

use super::{Answer, NEVER, bit};
use crate::fault::Trouble;

/// Where bank 2 begins in a device of 512 KiB.
pub const BANK_2: u32 = 0x0804_0000;
/// Its length.
pub const BANK_LENGTH: usize = 0x4_0000;
/// Bytes of a page.
pub const PAGE: usize = 0x800;
/// Bytes that have check bits in common.
const WORD: usize = 8;
/// Time of programming a double word, ns.
const PROGRAM_NS: u64 = 81_700;
/// Time of erasing a page, ns.
const ERASE_NS: u64 = 22_020_000;

const PG: u32 = 0;
const PER: u32 = 1;
const BKER: u32 = 11;
const STRT: u32 = 16;
const LOCK: u32 = 31;

const EOP: u32 = 1;
const PROGERR: u32 = 1 << 3;
const PGAERR: u32 = 1 << 5;
const PGSERR: u32 = 1 << 7;
const BSY: u32 = 1 << 16;

/// What the flash is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Work {
    Program { offset: usize, value: u64 },
    Erase { offset: usize },
}

/// What stays when the power goes: the bytes of bank 2 and the double words that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Contents {
    /// Bank 2.
    pub bytes: Vec<u8>,
    /// Offsets of double words that cannot be read.
    pub unreadable: BTreeSet<usize>,
}

impl Default for Contents {
    /// Erased.
    fn default() -> Self {
        Self { bytes: vec![0xFF; BANK_LENGTH], unreadable: BTreeSet::new() }
    }
}

/// The flash and its interface.
#[derive(Debug, Clone)]
pub struct Flash {
    /// Bank 2.
    pub contents: Contents,
    acr: u32,
    cr: u32,
    sr: u32,
    eccr: u32,
    optr: u32,
    /// The first key has been given.
    half_open: bool,
    /// The first half of a double word.
    first_half: Option<(usize, u32)>,
    work: Option<(Work, u64)>,
}

impl Flash {
    /// After a reset.
    pub fn new(contents: Contents) -> Self {
        // OPTR as delivered, DBANK (22) set.
        let optr = 0xFFEF_F8AA;
        let (acr, cr) = (0x0004_0600, 1 << LOCK | 1 << 30);
        Self { contents, acr, cr, sr: 0, eccr: 0, optr, half_open: false, first_half: None, work: None }
    }

    /// Wait states of a read (ACR.LATENCY).
    pub fn wait_states(&self) -> u32 {
        self.acr & 0xF
    }

    /// When it is done.
    pub fn next(&self) -> u64 {
        self.work.map_or(NEVER, |(_, at)| at)
    }

    /// Whether it programs or erases.
    pub fn is_busy(&self) -> bool {
        self.work.is_some()
    }

    /// Time has passed.
    pub fn advance(&mut self, now: u64) {
        if now < self.next() {
            return;
        }
        match self.work.take() {
            Some((Work::Program { offset, value }, _)) => {
                self.contents.bytes[offset..offset + WORD].copy_from_slice(&value.to_le_bytes());
            }
            Some((Work::Erase { offset }, _)) => {
                self.contents.bytes[offset..offset + PAGE].fill(0xFF);
                self.contents.unreadable.retain(|at| !(offset..offset + PAGE).contains(at));
            }
            None => {}
        }
        if bit(self.cr, 24) {
            self.sr |= EOP;
        }
    }

    /// Whether its interrupt's line is high.
    pub fn interrupts(&self) -> bool {
        (bit(self.cr, 24) && self.sr & EOP != 0) || (bit(self.cr, 25) && self.sr & 0x2FA != 0)
    }

    /// The power goes. What was being done is left half done, by chance: each double word concerned is as before, or as
    /// it was to be, or cannot be read.
    pub fn cut(&mut self, mut chance: impl FnMut() -> u32) -> Contents {
        let mut leave = |contents: &mut Contents, at: usize, done: [u8; WORD]| match chance() % 3 {
            0 => {}
            1 => {
                contents.bytes[at..at + WORD].copy_from_slice(&done);
                contents.unreadable.remove(&at);
            }
            _ => {
                contents.unreadable.insert(at);
            }
        };
        match self.work.take() {
            Some((Work::Program { offset, value }, _)) => leave(&mut self.contents, offset, value.to_le_bytes()),
            Some((Work::Erase { offset }, _)) => {
                for at in (offset..offset + PAGE).step_by(WORD) {
                    leave(&mut self.contents, at, [0xFF; WORD]);
                }
            }
            None => {}
        }
        std::mem::take(&mut self.contents)
    }

    /// Reads bytes of bank 2. Gives also whether a non-maskable interrupt follows.
    ///
    /// # Errors
    /// A read while the bank is at work: the processor would stand still for that time, its interrupts included.
    pub fn read_bank(&mut self, offset: usize, bytes: usize) -> Answer<(u32, bool)> {
        if self.is_busy() {
            return Err(Trouble::used(
                "bank 2 is read while it is programmed or erased: the processor would stand still",
            ));
        }
        let mut value = [0; 4];
        value[..bytes].copy_from_slice(&self.contents.bytes[offset..offset + bytes]);
        let at = offset & !(WORD - 1);
        let unreadable = self.contents.unreadable.contains(&at);
        if unreadable {
            // ADDR_ECC, in bytes: it has as many bits as the memory; BK_ECC; ECCD.
            self.eccr = self.eccr & 1 << 24 | at as u32 | 1 << 21 | 1 << 31;
            // What is read is arbitrary: bits of the double word that are neither.
            value.iter_mut().for_each(|byte| *byte ^= 0x5A);
        }
        Ok((u32::from_le_bytes(value), unreadable))
    }

    /// A double word of bank 1 that cannot be read has been met.
    pub fn meet_unreadable(&mut self, offset: u32) {
        self.eccr = self.eccr & 1 << 24 | offset & !7 | 1 << 31;
    }

    /// Writes a word of bank 2: two of them make a double word, which is then programmed (section 3.3.7).
    ///
    /// # Errors
    /// A write while the bank is at work.
    pub fn write_bank(&mut self, offset: usize, bytes: usize, value: u32, now: u64, hclk_hz: u32) -> Answer<()> {
        if self.is_busy() {
            return Err(Trouble::used("bank 2 is written while it is at work"));
        }
        if !bit(self.cr, PG) || bit(self.cr, LOCK) {
            self.sr |= PGSERR;
            return Ok(());
        }
        if bytes != 4 {
            self.sr |= 1 << 6;
            return Ok(());
        }
        match self.first_half.take() {
            None if offset.is_multiple_of(WORD) => self.first_half = Some((offset, value)),
            Some((first, low)) if offset == first + 4 => {
                let value = u64::from(value) << 32 | u64::from(low);
                // Only zeros can be written over something (section 3.7.5, PROGERR).
                let erased = self.contents.bytes[first..first + WORD].iter().all(|&byte| byte == 0xFF);
                if (!erased && value != 0) || self.contents.unreadable.contains(&first) {
                    self.sr |= PROGERR;
                } else {
                    self.work = Some((Work::Program { offset: first, value }, now + cycles(PROGRAM_NS, hclk_hz)));
                }
            }
            _ => self.sr |= PGAERR,
        }
        Ok(())
    }

    /// Reads a register.
    ///
    /// # Errors
    /// One that is not modelled.
    pub fn read(&self, offset: u32) -> Answer<u32> {
        Ok(match offset {
            0x00 => self.acr,
            0x10 => self.sr | if self.is_busy() { BSY } else { 0 },
            0x14 => self.cr,
            0x18 => self.eccr,
            0x20 => self.optr,
            _ => return Err(Trouble::Register),
        })
    }

    /// Writes a register.
    ///
    /// # Errors
    /// One that is not modelled, what the manual forbids.
    pub fn write(&mut self, offset: u32, value: u32, now: u64, hclk_hz: u32) -> Answer<()> {
        match offset {
            0x00 => self.acr = value,
            0x08 => match (value, self.half_open) {
                (0x4567_0123, false) => self.half_open = true,
                (0xCDEF_89AB, true) => {
                    self.half_open = false;
                    self.cr &= !(1 << LOCK);
                }
                _ => return Err(Trouble::used("KEYR: a wrong key locks the flash until the next reset")),
            },
            0x10 => self.sr &= !value,
            0x14 => self.control(value, now, hclk_hz)?,
            0x18 => {
                // ECCIE; ECCC and ECCD are cleared by ones.
                self.eccr = self.eccr & !(value & (3 << 30)) & !(1 << 24) | value & 1 << 24;
            }
            _ => return Err(Trouble::Register),
        }
        Ok(())
    }

    fn control(&mut self, value: u32, now: u64, hclk_hz: u32) -> Answer<()> {
        if self.is_busy() {
            return Err(Trouble::used("CR is written while the flash is at work"));
        }
        if bit(self.cr, LOCK) {
            return if value == self.cr { Ok(()) } else { Err(Trouble::used("CR is written while it is locked")) };
        }
        if bit(value, 2) || bit(value, 15) || bit(value, 17) || bit(value, 18) || bit(value, 27) {
            return Err(Trouble::used(format!("CR = {value:#x}: only PG, PER and STRT are modelled")));
        }
        self.cr = value & !(1 << STRT);
        if bit(value, STRT) {
            if !bit(value, PER) || bit(value, PG) {
                self.sr |= PGSERR;
                return Ok(());
            }
            if !bit(value, BKER) {
                return Err(Trouble::used("a page of bank 1, which holds the program, is erased"));
            }
            let offset = (value >> 3 & 0x7F) as usize * PAGE;
            self.work = Some((Work::Erase { offset }, now + cycles(ERASE_NS, hclk_hz)));
        }
        Ok(())
    }
}

fn cycles(nanoseconds: u64, hclk_hz: u32) -> u64 {
    nanoseconds * u64::from(hclk_hz) / 1_000_000_000
}

#[cfg(test)]
mod tests {
    use super::*;

    const HZ: u32 = 170_000_000;

    fn open() -> Flash {
        let mut flash = Flash::new(Contents::default());
        for (register, value) in [(0x08, 0x4567_0123), (0x08, 0xCDEF_89AB), (0x14, 1)] {
            flash.write(register, value, 0, HZ).unwrap();
        }
        flash
    }

    /// RM0440, section 3.7.5: PROGERR if the double word is not erased, and nothing is programmed.
    #[test]
    fn a_double_word_is_programmed_once() {
        let mut flash = open();
        for (offset, value) in [(0x100, 1), (0x104, 2)] {
            flash.write_bank(offset, 4, value, 0, HZ).unwrap();
        }
        assert_eq!(flash.read(0x10), Ok(BSY));
        flash.advance(flash.next());
        assert_eq!((flash.read_bank(0x100, 4), flash.read_bank(0x104, 4)), (Ok((1, false)), Ok((2, false))));
        for (offset, value) in [(0x100, 3), (0x104, 3)] {
            flash.write_bank(offset, 4, value, 0, HZ).unwrap();
        }
        assert_eq!(flash.read(0x10), Ok(PROGERR));
        assert_eq!(flash.read_bank(0x100, 4), Ok((1, false)));
    }

    #[test]
    fn a_cut_word_cannot_be_read() {
        let mut flash = open();
        for (offset, value) in [(0x100, 1), (0x104, 2)] {
            flash.write_bank(offset, 4, value, 0, HZ).unwrap();
        }
        let mut flash = Flash::new(flash.cut(|| 2));
        let (_, interrupt) = flash.read_bank(0x104, 1).unwrap();
        assert!(interrupt);
        // ECCD, BK_ECC and the offset of the double word (section 3.7.7).
        assert_eq!(flash.read(0x18), Ok(0x8020_0100));
        flash.write(0x18, 1 << 31, 0, HZ).unwrap();
        assert_eq!(flash.read(0x18).unwrap() >> 31, 0);
    }

    #[test]
    fn it_is_locked_without_keys() {
        let mut flash = Flash::new(Contents::default());
        assert!(flash.write(0x14, 1, 0, HZ).is_err());
        assert!(flash.write(0x08, 0xCDEF_89AB, 0, HZ).is_err());
    }
}
