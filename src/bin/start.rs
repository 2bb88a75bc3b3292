//! Before anything else: the code of the sampling interrupt goes to where it runs (`src/bin/hot.x`).
//!
//! In assembler, because at this point there are no statics yet and any function of the core may be among what is copied.
#![allow(unsafe_code)]

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
    // What was written has to be there before it is fetched.
    "1:",
    "dsb",
    "isb",
    "bx lr",
    ".size __pre_init, . - __pre_init",
);
