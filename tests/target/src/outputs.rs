//! Outputs as bits: all of them in a digest, the first ones in full.

use core::fmt;

/// So often the digest so far is written, which shows about where two machines part.
const DIGEST_EVERY: u32 = 1_000;
/// So many outputs of a scenario are written in full.
const IN_FULL: u32 = 3;

/// Takes the outputs of a scenario and writes lines `bits SCENARIO COUNT DIGEST` and `first SCENARIO INDEX BITS`.
pub struct Outputs<'a> {
    name: &'a str,
    out: &'a mut dyn fmt::Write,
    count: u32,
    digest: u64,
    result: fmt::Result,
}

impl<'a> Outputs<'a> {
    pub(crate) fn new(name: &'a str, out: &'a mut dyn fmt::Write) -> Self {
        // FNV-1a, 64 bits (Fowler, Noll and Vo): offset basis here, prime below.
        Self { name, out, count: 0, digest: 0xcbf2_9ce4_8422_2325, result: Ok(()) }
    }

    /// An output in single precision. Which of the many NaNs an operation gives is up to the processor, so all count
    /// as one.
    pub fn f32(&mut self, value: f32) {
        let value = if value.is_nan() { f32::NAN } else { value };
        self.bits(value.to_bits().into());
    }

    /// An output in double precision, likewise.
    pub fn f64(&mut self, value: f64) {
        let value = if value.is_nan() { f64::NAN } else { value };
        self.bits(value.to_bits());
    }

    /// An integer output.
    pub fn i32(&mut self, value: i32) {
        self.bits(value.cast_unsigned().into());
    }

    fn bits(&mut self, bits: u64) {
        for byte in bits.to_le_bytes() {
            self.digest = (self.digest ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
        self.count += 1;
        if self.count <= IN_FULL {
            self.write("first", bits);
        }
        if self.count.is_multiple_of(DIGEST_EVERY) {
            self.write("bits", self.digest);
        }
    }

    pub(crate) fn finish(mut self) -> fmt::Result {
        self.write("bits", self.digest);
        self.result
    }

    /// Scenarios go on after an error, which then comes out at the end.
    fn write(&mut self, what: &str, bits: u64) {
        if self.result.is_ok() {
            self.result = writeln!(self.out, "{what} {} {} {bits:016x}", self.name, self.count);
        }
    }
}
