//! Inputs from inputs: seeds are changed in ways that break readers, and what did something new is changed further.
//!
//! There are no counters in the code under test: what an input did is known by what its target has seen of it
//! ([`Seen`]), the error's sentence above all. So nothing has to be built in a special way, and the same seed gives the
//! same inputs.

use std::collections::HashSet;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::Seen;

/// Inputs that are kept; then a new one takes the place of any.
const KEPT: usize = 2048;
/// Longest input, bytes.
const LONGEST: usize = 1 << 14;
/// Readers take lengths and counts from the begin and the end of a file.
const HEAD: usize = 256;

/// What text readers have to do with, and numbers that are none.
const TOKENS: [&[u8]; 36] = [
    b"nan",
    b"inf",
    b"-inf",
    b"-1",
    b"0",
    b"1e308",
    b"1e999",
    b"1e-320",
    b"9999999999999999999",
    b"0.1",
    b"-0.0",
    b"+",
    b"*",
    b"/",
    b"^",
    b"(",
    b")",
    b"[",
    b"]",
    b"=",
    b",",
    b";",
    b"\t",
    b"\n",
    b"\r\n",
    b"\"",
    b"#",
    b"%",
    b":",
    b" ",
    b"abs(",
    b"exp(",
    b"\xef\xbb\xbf",
    b"\xc3\xa9",
    b"\0",
    b"0x1p4",
];

/// Makes inputs.
#[derive(Debug)]
pub struct Mutator {
    random: ChaCha8Rng,
    pool: Vec<Vec<u8>>,
    seen: HashSet<Seen>,
}

impl Mutator {
    /// From a number and inputs to begin with.
    pub fn new(seed: u64, mut seeds: Vec<Vec<u8>>) -> Self {
        seeds.push(Vec::new());
        Self { random: ChaCha8Rng::seed_from_u64(seed), pool: seeds, seen: HashSet::new() }
    }

    /// How many inputs are changed further.
    pub fn kept(&self) -> usize {
        self.pool.len()
    }

    /// The next input.
    #[expect(clippy::should_implement_trait, reason = "it never ends, and its caller answers each with `tell`")]
    pub fn next(&mut self) -> Vec<u8> {
        let mut input = self.any().to_vec();
        loop {
            self.change(&mut input);
            input.truncate(LONGEST);
            // One change in half of the cases, two in a quarter …
            if self.random.random_bool(0.5) {
                return input;
            }
        }
    }

    /// What the target has seen of an input.
    pub fn tell(&mut self, input: &[u8], seen: Seen) {
        if !self.seen.insert(seen) {
            return;
        }
        if self.pool.len() < KEPT {
            self.pool.push(input.to_vec());
        } else {
            let place = self.random.random_range(0..self.pool.len());
            self.pool[place] = input.to_vec();
        }
    }

    fn any(&mut self) -> &[u8] {
        let place = self.random.random_range(0..self.pool.len());
        &self.pool[place]
    }

    /// A place in so many bytes, the end included.
    fn place(&mut self, length: usize) -> usize {
        match self.random.random_range(0..4) {
            0 => self.random.random_range(0..=length.min(HEAD)),
            1 => length - self.random.random_range(0..=length.min(HEAD)),
            _ => self.random.random_range(0..=length),
        }
    }

    /// A stretch of so many bytes, mostly short.
    fn stretch(&mut self, length: usize) -> std::ops::Range<usize> {
        let begin = self.place(length);
        let most = if self.random.random_bool(0.75) { 16 } else { length };
        begin..(begin + self.random.random_range(0..=most)).min(length)
    }

    /// A number at a border, of any width and order of bytes.
    fn border(&mut self, length: usize) -> Vec<u8> {
        let numbers =
            [0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF, length as u64];
        let number = numbers[self.random.random_range(0..numbers.len())];
        let number = number.wrapping_add([0, 1, u64::MAX][self.random.random_range(0..3)]);
        let width = [1, 2, 4, 8][self.random.random_range(0..4)];
        let bytes = if self.random.random_bool(0.5) { number } else { number | number << 32 }.to_le_bytes();
        let mut bytes = bytes[..width].to_vec();
        if self.random.random_bool(0.25) {
            bytes.reverse();
        }
        bytes
    }

    fn change(&mut self, input: &mut Vec<u8>) {
        let length = input.len();
        match self.random.random_range(0..11) {
            0 => {
                let (at, bit) = (self.place(length), self.random.random_range(0..8));
                if let Some(byte) = input.get_mut(at) {
                    *byte ^= 1 << bit;
                }
            }
            1 => {
                let (at, value) = (self.place(length), self.random.random());
                if let Some(byte) = input.get_mut(at) {
                    *byte = value;
                }
            }
            // Up or down by a little.
            2 => {
                let (at, by) = (self.place(length), self.random.random_range(1..=8_u8));
                let down = self.random.random_bool(0.5);
                if let Some(byte) = input.get_mut(at) {
                    *byte = if down { byte.wrapping_sub(by) } else { byte.wrapping_add(by) };
                }
            }
            3 | 4 => {
                let (at, number) = (self.place(length), self.border(length));
                for (byte, new) in input.iter_mut().skip(at).zip(number) {
                    *byte = new;
                }
            }
            5 => {
                let stretch = self.stretch(length);
                input.drain(stretch);
            }
            6 => {
                let (stretch, at) = (self.stretch(length), self.place(length));
                let copy = input[stretch].to_vec();
                input.splice(at..at, copy);
            }
            7 => {
                let token = TOKENS[self.random.random_range(0..TOKENS.len())];
                let at = self.place(length);
                let replaced = if self.random.random_bool(0.5) { (at + token.len()).min(length) } else { at };
                input.splice(at..replaced, token.iter().copied());
            }
            // A stretch of another input.
            8 => {
                let other = self.any().to_vec();
                let (from, to) = (self.stretch(other.len()), self.stretch(length));
                input.splice(to, other[from].iter().copied());
            }
            // Its begin, and another one's end.
            9 => {
                let other = self.any().to_vec();
                let (at, from) = (self.place(length), self.place(other.len()));
                input.truncate(at);
                input.extend_from_slice(&other[from..]);
            }
            _ => {
                let at = self.place(length);
                input.truncate(at);
            }
        }
    }
}
