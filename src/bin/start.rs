//! Before anything else: the code of the sampling interrupt goes to where it runs (`src/bin/hot.x`), and the stack is
//! painted, so that [`deepest_stack`] can tell later how far it ever got.
//!
//! In assembler, because at this point there are no statics yet and any function of the core may be among what is
//! copied.
#![allow(unsafe_code)]

use core::ptr;

/// What the unused stack is filled with.
const PAINT: u32 = 0xA5A5_5A5A;

unsafe extern "C" {
    /// Where the stack may grow to.
    static _stack_end: u32;
    /// Where the stack begins.
    static _stack_start: u32;
}

/// The most that the stack has taken since the start, bytes. What was reserved and never written does not count.
pub fn deepest_stack() -> u32 {
    let (mut at, top) = (&raw const _stack_end, &raw const _stack_start);
    // SAFETY: words between two symbols of the linker, within RAM; volatile, because the stack changes behind the
    // compiler's back.
    unsafe {
        while at < top && ptr::read_volatile(at) == PAINT {
            at = at.add(1);
        }
    }
    (top as usize - at as usize) as u32
}

core::arch::global_asm!(
    ".section .text.__pre_init, \"ax\", %progbits",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    "movw r0, #:lower16:_hot_start",
    "movt r0, #:upper16:_hot_start",
    "movw r1, #:lower16:_hot_end",
    "movt r1, #:upper16:_hot_end",
    "movw r2, #:lower16:_hot_load",
    "movt r2, #:upper16:_hot_load",
    "0:",
    "cmp r0, r1",
    "bhs 1f",
    "ldr r3, [r2], #4",
    "str r3, [r0], #4",
    "b 0b",
    "1:",
    "movw r0, #:lower16:_warm_start",
    "movt r0, #:upper16:_warm_start",
    "movw r1, #:lower16:_warm_end",
    "movt r1, #:upper16:_warm_end",
    "movw r2, #:lower16:_warm_load",
    "movt r2, #:upper16:_warm_load",
    "4:",
    "cmp r0, r1",
    "bhs 5f",
    "ldr r3, [r2], #4",
    "str r3, [r0], #4",
    "b 4b",
    "5:",
    "movw r0, #:lower16:_stack_end",
    "movt r0, #:upper16:_stack_end",
    "movw r3, #0x5A5A",
    "movt r3, #0xA5A5",
    "2:",
    "cmp r0, sp",
    "bhs 3f",
    "str r3, [r0], #4",
    "b 2b",
    // What was written has to be there before it is fetched.
    "3:",
    "dsb",
    "isb",
    "bx lr",
    ".size __pre_init, . - __pre_init",
);
