//! What a function does to the stack pointer, and whom it calls. Encodings: Arm DDI 0403, chapter A7.

use super::elf::Function;

/// What matters about a function.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// All that it ever takes from the stack, bytes.
    pub stack: u32,
    /// Addresses that it calls or jumps to, outside itself.
    pub calls: Vec<u32>,
    /// Calls and jumps through a register.
    pub indirect: u32,
    /// The stack pointer moves by an amount that is not in the code.
    pub unbounded: bool,
}

/// Setting the stack pointer from a register ends a function or aligns the stack to 8 bytes.
const ALIGNMENT: u32 = 8;

/// Reads a function.
pub fn facts(function: &Function) -> Facts {
    let mut facts = Facts::default();
    for (begin, halfwords) in &function.code {
        let mut at = 0;
        // The address that a veneer loads into r12 by movw and movt.
        let mut r12 = None;
        while let Some(&first) = halfwords.get(at) {
            let address = begin + 2 * at as u32;
            // 0b11101, 0b11110 and 0b11111 begin an instruction of 32 bits.
            if first >> 11 >= 0b11101 {
                let Some(&second) = halfwords.get(at + 1) else { break };
                wide(first, second, address, function, &mut facts, &mut r12);
                at += 2;
            } else {
                narrow(first, address, function, &mut facts, r12);
                at += 1;
            }
        }
    }
    facts.calls.sort_unstable();
    facts.calls.dedup();
    facts
}

fn narrow(code: u16, address: u32, function: &Function, facts: &mut Facts, r12: Option<u32>) {
    let (low, branch) = (u32::from(code & 0xFF), |offset: i32| address.wrapping_add(4).wrapping_add_signed(offset));
    match code >> 8 {
        // PUSH {registers, lr}.
        0xB4 | 0xB5 => facts.stack += 4 * (low.count_ones() + u32::from(code >> 8 & 1)),
        // SUB sp, #imm7.
        0xB0 if code & 0x80 != 0 => facts.stack += 4 * (low & 0x7F),
        // B<c> and B.
        0xD0..=0xDD => jump(branch(i32::from(low as i8) * 2), function, facts),
        0xE0..=0xE7 => jump(branch(i32::from((code << 5) as i16 >> 5) * 2), function, facts),
        // BLX and BX.
        0x47 => match (code >> 7 & 1, code >> 3 & 0xF, r12) {
            (0, 14, _) => {}
            (0, 12, Some(target)) => facts.calls.push(target & !1),
            _ => facts.indirect += 1,
        },
        // MOV sp, register.
        0x46 if code & 0x87 == 0x85 => facts.stack += ALIGNMENT,
        // ADD sp, register.
        0x44 if code & 0x87 == 0x85 => facts.unbounded = true,
        _ => {}
    }
}

fn wide(first: u16, second: u16, address: u32, function: &Function, facts: &mut Facts, r12: &mut Option<u32>) {
    let (hw1, hw2) = (u32::from(first), u32::from(second));
    match first {
        // STMDB sp!.
        0xE92D => facts.stack += 4 * hw2.count_ones(),
        // STR register, [sp, #-imm8]!.
        0xF84D if second & 0x0F00 == 0x0D00 => facts.stack += hw2 & 0xFF,
        // STRD registers, [sp, #-imm8]!.
        0xE96D => facts.stack += 4 * (hw2 & 0xFF),
        // VPUSH.
        0xED2D | 0xED6D => facts.stack += 4 * (hw2 & 0xFF),
        // SUB.W sp, sp, #const.
        0xF1AD | 0xF5AD if second >> 8 & 0xF == 13 => facts.stack += expanded(hw1, hw2),
        // SUBW sp, sp, #imm12.
        0xF2AD | 0xF6AD if second >> 8 & 0xF == 13 => facts.stack += twelve_bits(hw1, hw2),
        // SUB.W sp, sp, register.
        0xEBAD if second >> 8 & 0xF == 13 => facts.unbounded = true,
        // MOVW and MOVT r12.
        _ if first & 0xFBF0 == 0xF240 && second >> 8 & 0xF == 12 => *r12 = Some(sixteen_bits(hw1, hw2)),
        _ if first & 0xFBF0 == 0xF2C0 && second >> 8 & 0xF == 12 => {
            *r12 = r12.map(|low| low & 0xFFFF | sixteen_bits(hw1, hw2) << 16);
        }
        // Branches.
        _ if first >> 11 == 0b11110 && second & 0x8000 != 0 => {
            let sign = hw1 >> 10 & 1;
            let (j1, j2) = (hw2 >> 13 & 1, hw2 >> 11 & 1);
            let target = |offset: u32, bits: u32| {
                let offset = (offset << (32 - bits)).cast_signed() >> (32 - bits);
                address.wrapping_add(4).wrapping_add_signed(offset)
            };
            let far = || {
                let (i1, i2) = (1 ^ j1 ^ sign, 1 ^ j2 ^ sign);
                let offset = sign << 24 | i1 << 23 | i2 << 22 | (hw1 & 0x3FF) << 12 | (hw2 & 0x7FF) << 1;
                target(offset, 25)
            };
            match second & 0xD000 {
                // BL.
                0xD000 => facts.calls.push(far()),
                // B.W.
                0x9000 => jump(far(), function, facts),
                // B<c>.W; what has a condition of 111x is no branch.
                0x8000 if hw1 >> 7 & 7 != 7 => {
                    let offset = sign << 20 | j2 << 19 | j1 << 18 | (hw1 & 0x3F) << 12 | (hw2 & 0x7FF) << 1;
                    jump(target(offset, 21), function, facts);
                }
                _ => {}
            }
        }
        // LDR pc, […]: a jump through memory, unless it is a return, LDR pc, [sp], #4.
        _ if first & 0xFF70 == 0xF850 && second >> 12 == 15 && first & 0xF != 13 => facts.indirect += 1,
        _ => {}
    }
}

/// A jump out of a function is a call at its end.
fn jump(target: u32, function: &Function, facts: &mut Facts) {
    if !function.range.contains(&target) {
        facts.calls.push(target);
    }
}

/// i:imm3:imm8 as a plain number.
fn twelve_bits(hw1: u32, hw2: u32) -> u32 {
    (hw1 >> 10 & 1) << 11 | (hw2 >> 12 & 7) << 8 | hw2 & 0xFF
}

/// imm4:i:imm3:imm8.
fn sixteen_bits(hw1: u32, hw2: u32) -> u32 {
    (hw1 & 0xF) << 12 | twelve_bits(hw1, hw2)
}

/// i:imm3:imm8 as a modified immediate constant (section A5.3.2).
fn expanded(hw1: u32, hw2: u32) -> u32 {
    let number = twelve_bits(hw1, hw2);
    let byte = number & 0xFF;
    match number >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte * 0x0101_0101,
        _ => (0x80 | number & 0x7F).rotate_right(number >> 7),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(code: &[u16]) -> Facts {
        let range = 0x1000..0x1000 + 2 * code.len() as u32;
        facts(&Function { name: String::new(), range, code: vec![(0x1000, code.to_vec())] })
    }

    /// Encodings by `llvm-mc -triple=thumbv7em-none-eabihf -mattr=+vfp4d16sp -show-encoding` (LLVM 14).
    #[test]
    fn what_takes_from_the_stack() {
        let cases: [(&[u16], u32); 9] = [
            (&[0xB5F0], 20),                        // push {r4-r7, lr}
            (&[0xB084], 16),                        // sub sp, #16
            (&[0xE92D, 0x4FF0], 36),                // stmdb sp!, {r4-r11, lr}
            (&[0xF84D, 0xBD04], 4),                 // str r11, [sp, #-4]!
            (&[0xE96D, 0x4504], 16),                // strd r4, r5, [sp, #-16]!
            (&[0xED2D, 0x8B10], 64),                // vpush {d8-d15}
            (&[0xF5AD, 0x7D00], 512),               // sub.w sp, sp, #512
            (&[0xF6AD, 0x0D08], 2056),              // subw sp, sp, #2056
            (&[0xB004, 0xBDF0, 0xECBD, 0x8B10], 0), // add sp, #16; pop; vpop
        ];
        for (code, stack) in cases {
            assert_eq!(read(code), Facts { stack, ..Facts::default() }, "{code:04x?}");
        }
        assert!(read(&[0xEBAD, 0x0D03]).unbounded); // sub.w sp, sp, r3
    }

    #[test]
    fn who_is_called() {
        // bl .+4, forward and back by 16 MiB at most; b.w; beq.w; a branch within the function is none.
        assert_eq!(read(&[0xF000, 0xF800]).calls, [0x1004]);
        assert_eq!(read(&[0xF000, 0xF802]).calls, [0x1008]);
        assert_eq!(read(&[0xF7FF, 0xFFFE]).calls, [0x1000]);
        assert_eq!(read(&[0xF000, 0xB880]).calls, [0x1104]);
        assert_eq!(read(&[0xF000, 0x8080]).calls, [0x1104]);
        assert!(read(&[0xE7FE]).calls.is_empty());
        assert_eq!(read(&[0xE07E]).calls, [0x1100]);
        assert_eq!(read(&[0x4780]).indirect, 1); // blx r0
        assert_eq!(read(&[0x4770]).indirect, 0); // bx lr
        // movw r12, #0x1234; movt r12, #0x1000; bx r12
        let veneer = read(&[0xF241, 0x2C34, 0xF2C1, 0x0C00, 0x4760]);
        assert_eq!((veneer.calls, veneer.indirect), (vec![0x1000_1234], 0));
    }
}
