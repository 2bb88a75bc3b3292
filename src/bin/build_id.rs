//! Which image this is: the begin of the linker's digest of it (`src/bin/build_id.x`).
#![allow(unsafe_code)]

use core::ptr;

unsafe extern "C" {
    /// The note: lengths of name and digest and the type, a word each, the name `GNU\0`, the digest.
    static _build_id: u8;
}

/// Length of what stands before the digest, bytes.
const HEAD: usize = 16;

/// The first bytes of the digest.
pub fn build_id() -> [u8; 8] {
    // SAFETY: the linker has put twenty bytes there. Volatile, because it writes them after the compiler has gone.
    core::array::from_fn(|n| unsafe { ptr::read_volatile((&raw const _build_id).add(HEAD + n)) })
}
