//! A NOR flash with check bits, as that of the STM32G4, whose power can be cut.
//!
//! A word of 64 bits is erased, written, or poisoned: written twice, or cut while it was written. Reading a poisoned
//! word is an error. Erasing a page that is cut leaves each word of it erased, as it was, or poisoned.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

const WORD: usize = 8;
const PAGE: usize = 2048;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Erased,
    Written([u8; WORD]),
    Poisoned,
}

/// How a cut leaves what was being done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cut {
    /// As if it had not begun.
    Before,
    /// Half done: the word poisoned, of the page some words erased, some old, some poisoned.
    Within,
    /// Done, but nobody was told.
    After,
}

/// The flash; a clone is what the next start finds.
#[derive(Debug, Clone)]
pub struct Nor {
    words: Vec<Word>,
    /// Writes and erasures until the power is cut, and how.
    cut: Option<(usize, Cut)>,
    /// Writes and erasures so far.
    pub operations: usize,
}

/// Anything that the flash refuses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refused;

impl NorFlashError for Refused {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl Nor {
    pub fn erased(pages: usize) -> Self {
        Self { words: vec![Word::Erased; pages * PAGE / WORD], cut: None, operations: 0 }
    }

    /// The same flash with a power supply that fails at the operation of this number.
    pub fn cut_at(mut self, operation: usize, cut: Cut) -> Self {
        (self.operations, self.cut) = (0, Some((operation, cut)));
        self
    }

    /// The same flash after the power has come back.
    pub fn powered(mut self) -> Self {
        self.cut = None;
        self
    }

    /// Makes a word unreadable.
    pub fn poison(&mut self, offset: usize) {
        self.words[offset / WORD] = Word::Poisoned;
    }

    /// Flips a bit of a written word, which check bits would have corrected or reported: the CRC's own case.
    pub fn flip(&mut self, offset: usize, bit: u8) {
        let Word::Written(bytes) = &mut self.words[offset / WORD] else { panic!("not written") };
        bytes[offset % WORD] ^= 1 << bit;
    }

    /// How far the next operation gets; an error if the power is off before it is done.
    fn operate(&mut self) -> Option<Cut> {
        let operation = self.operations;
        self.operations += 1;
        match self.cut {
            Some((at, cut)) if operation == at => Some(cut),
            Some((at, _)) if operation > at => Some(Cut::Before),
            _ => None,
        }
    }
}

impl ErrorType for Nor {
    type Error = Refused;
}

impl ReadNorFlash for Nor {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Refused> {
        for (n, byte) in bytes.iter_mut().enumerate() {
            let at = offset as usize + n;
            *byte = match self.words.get(at / WORD).ok_or(Refused)? {
                Word::Erased => 0xFF,
                Word::Written(word) => word[at % WORD],
                Word::Poisoned => return Err(Refused),
            };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.words.len() * WORD
    }
}

impl NorFlash for Nor {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Refused> {
        let (from, to) = (from as usize, to as usize);
        if !from.is_multiple_of(PAGE) || !to.is_multiple_of(PAGE) || from >= to {
            return Err(Refused);
        }
        for page in from / PAGE..to / PAGE {
            let cut = self.operate();
            let words = self.words.get_mut(page * PAGE / WORD..(page + 1) * PAGE / WORD).ok_or(Refused)?;
            for (n, word) in words.iter_mut().enumerate() {
                match cut {
                    None | Some(Cut::After) => *word = Word::Erased,
                    Some(Cut::Before) => {}
                    Some(Cut::Within) => match n % 3 {
                        0 => {}
                        1 => *word = Word::Poisoned,
                        _ => *word = Word::Erased,
                    },
                }
            }
            if cut.is_some() {
                return Err(Refused);
            }
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refused> {
        let offset = offset as usize;
        if !offset.is_multiple_of(WORD) || !bytes.len().is_multiple_of(WORD) {
            return Err(Refused);
        }
        for (n, new) in bytes.chunks(WORD).enumerate() {
            let cut = self.operate();
            let word = self.words.get_mut(offset / WORD + n).ok_or(Refused)?;
            if cut != Some(Cut::Before) {
                *word = match word {
                    Word::Erased if cut != Some(Cut::Within) => Word::Written(new.try_into().expect("a whole word")),
                    _ => Word::Poisoned,
                };
            }
            if cut.is_some() {
                return Err(Refused);
            }
        }
        Ok(())
    }
}

#[test]
fn a_word_written_twice_cannot_be_read() {
    let mut nor = Nor::erased(1);
    nor.write(0, &[0xF0; 8]).unwrap();
    let mut bytes = [0; 8];
    nor.read(0, &mut bytes).unwrap();
    assert_eq!(bytes, [0xF0; 8]);
    nor.write(0, &[0xF0; 8]).unwrap();
    assert_eq!(nor.read(0, &mut bytes), Err(Refused));
    nor.erase(0, 2048).unwrap();
    nor.read(0, &mut bytes).unwrap();
    assert_eq!(bytes, [0xFF; 8]);
    assert_eq!(nor.write(4, &[0; 8]), Err(Refused));
}
