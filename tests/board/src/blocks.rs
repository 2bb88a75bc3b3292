//! How many instructions a block has, and what in it the emulator does not tell: SEV, floating-point instructions.
//!
//! A block is a stretch of instructions without a branch. The emulator names its begin and its length in bytes; a Thumb
//! instruction has four bytes if its upper five bits are 0b11101, 0b11110 or 0b11111, else two (ARMv7-M ARM, section
//! A5.1).

/// What is known of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Block {
    /// Length, bytes; zero: not seen yet.
    bytes: u16,
    /// Instructions.
    pub instructions: u16,
    /// Whether one of them is SEV.
    pub sends_event: bool,
    /// Where its first floating-point instruction is, bytes from its begin.
    pub floats: Option<u16>,
}

/// SEV (ARMv7-M ARM, section A7.7.129).
const SEV: u16 = 0xBF40;

/// Whether a long instruction is one of coprocessors 10 and 11, the FPU (ARMv7-M ARM, sections A5.3.18 and A6.4).
fn is_float(first: u16, second: u16) -> bool {
    first & 0xEC00 == 0xEC00 && second & 0x0E00 == 0x0A00
}

impl Block {
    /// Counts in the block's halfwords.
    pub fn new(code: &[u16]) -> Self {
        let mut block = Self { bytes: 2 * code.len() as u16, ..Self::default() };
        let mut at = 0;
        while let Some(&first) = code.get(at) {
            block.instructions += 1;
            block.sends_event |= first == SEV;
            let long = first >> 11 >= 0b11101;
            if long && block.floats.is_none() && code.get(at + 1).is_some_and(|&second| is_float(first, second)) {
                block.floats = Some(2 * at as u16);
            }
            at += if long { 2 } else { 1 };
        }
        block
    }
}

/// Stretches of memory from which code runs: first address and length.
const PLACES: [(u32, u32); 3] = [(0x0800_0000, 0x4_0000), (0x1000_0000, 0x8000), (0x2000_0000, 0x1_8000)];

/// What is known of all blocks, by address.
#[derive(Debug, Clone)]
pub struct Blocks {
    known: [Vec<Block>; PLACES.len()],
}

impl Default for Blocks {
    fn default() -> Self {
        Self { known: PLACES.map(|(_, length)| vec![Block::default(); length as usize / 2]) }
    }
}

impl Blocks {
    /// The block of so many bytes at an address, if it has been seen.
    #[inline]
    pub fn get(&self, address: u32, bytes: u32) -> Option<Block> {
        let block = self.place(address).map(|(n, at)| self.known[n][at])?;
        (u32::from(block.bytes) == bytes).then_some(block)
    }

    /// Remembers a block.
    pub fn put(&mut self, address: u32, block: Block) {
        if let Some((n, at)) = self.place(address) {
            self.known[n][at] = block;
        }
    }

    #[inline]
    fn place(&self, address: u32) -> Option<(usize, usize)> {
        let n = usize::from(address >= PLACES[1].0) + usize::from(address >= PLACES[2].0);
        let (begin, length) = PLACES[n];
        let offset = address.wrapping_sub(begin);
        (offset < length).then_some((n, offset as usize / 2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_short_and_long_instructions() {
        // push {r7, lr}; movw r0, #1 (two halfwords); sev; bl … (two halfwords)
        let block = Block::new(&[0xB580, 0xF240, 0x0001, 0xBF40, 0xF000, 0xF800]);
        assert_eq!((block.instructions, block.sends_event), (4, true));
        // The second half of a long instruction is no SEV, whatever it looks like.
        assert!(!Block::new(&[0xF240, 0xBF40]).sends_event);
    }

    #[test]
    fn finds_floating_point_instructions() {
        // ldr r0, [r1]; then vmov s0, #1.0; vldr s0, [r0]; vadd.f32 s0, s0, s1; vmrs r0, fpscr
        for code in [[0xEEB7, 0x0A00], [0xED90, 0x0A00], [0xEE30, 0x0A20], [0xEEF1, 0x0A10]] {
            assert_eq!(Block::new(&[0x6808, code[0], code[1]]).floats, Some(2));
        }
        // ldr.w r0, [r1]; strex; mul; mrc of another coprocessor; the second half of movw.
        for code in [[0xF8D1, 0x0A00], [0xE840, 0x1A00], [0xFB01, 0xFA02], [0xEE10, 0x0F10], [0xF240, 0xEEB7]] {
            assert_eq!(Block::new(&code).floats, None, "{code:x?}");
        }
    }
}
