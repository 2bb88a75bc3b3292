//! Exceptions and unmodelled registers, with programs of a few instructions.

use greyrig_board::analog::Counts;
use greyrig_board::machine::Pace;
use greyrig_board::peripherals::flash::Contents;
use greyrig_board::{Board, Image};

const FLASH: u32 = 0x0800_0000;
const RAM: u32 = 0x2000_0000;
const PROGRAM: u32 = 0x200;
const HANDLER: u32 = 0x300;
/// Number of PendSV (ARMv7-M ARM, section B1.5.2).
const PEND_SV: usize = 14;

fn board(program: &[u16], handler: &[u16]) -> Board {
    let mut vectors = vec![0_u32; 16 + 102];
    (vectors[0], vectors[1], vectors[PEND_SV]) = (RAM + 0x1000, FLASH + PROGRAM + 1, FLASH + HANDLER + 1);
    let code = |halfwords: &[u16]| halfwords.iter().flat_map(|half| half.to_le_bytes()).collect::<Vec<u8>>();
    let segments = vec![
        (FLASH, vectors.iter().flat_map(|word| word.to_le_bytes()).collect()),
        (FLASH + PROGRAM, code(program)),
        (FLASH + HANDLER, code(handler)),
    ];
    let pins = Box::new(Counts::new(std::iter::empty()));
    Board::new(&Image { segments }, Contents::default(), pins, Pace::ONE).unwrap()
}

/// A thread with floating-point numbers in its registers is interrupted between a comparison and its branch, by a
/// handler that changes every register that the entry stacks. Encodings by LLVM's assembler.
#[test]
fn an_exception_leaves_no_trace() {
    let program = [
        0xF64E, 0x5788, 0xF2CE, 0x0700, 0xF44F, 0x0070,
        0x6038, // r7 = 0xE000ED88 (CPACR); r0 = 0xF00000; str r0, [r7]
        0xF3BF, 0x8F4F, 0xF3BF, 0x8F6F, // dsb; isb
        0xF64E, 0x5704, 0xF2CE, 0x0700, // r7 = 0xE000ED04 (ICSR)
        0xF04F, 0x5080, // mov r0, #0x10000000 (PENDSVSET)
        0x2102, 0x2203, 0x2304, // movs r1, #2; movs r2, #3; movs r3, #4
        0xF04F, 0x0C0C, // mov r12, #12
        0xEEB7, 0x0A00, 0xEEF0, 0x7A00, // vmov s0, #1.0; vmov s15, #2.0
        0x2902, // cmp r1, #2
        0x6038, // str r0, [r7]
        0xE7FF, // b to the next instruction: here it is interrupted
        0xD000, 0xDE00, // beq over udf
        0xEE10, 0x5A10, 0xEE17, 0x6A90, // vmov r5, s0; vmov r6, s15
        0xF04F, 0x5900, 0xE889, 0x117F, // stm of r0 … r6, r8, r12 to 0x20000000
        0xBF20, 0xE7FD, // wfe, for ever
    ];
    let handler = [
        0x4674, 0xF3EF, 0x8805, // mov r4, lr; mrs r8, ipsr
        0x2000, 0x2100, 0x2200, 0x2300, 0xF04F, 0x0C00, // r0 … r3, r12 = 0
        0xEE00, 0x0A10, 0xEE07, 0x0A90, // s0, s15 = 0
        0x2001, 0x4770, // movs r0, #1 (clears Z); bx lr
    ];
    let mut board = board(&program, &handler);
    board.run(1e-4).unwrap();
    let stored: Vec<u32> = (0..9).map(|n| board.word(RAM + 4 * n).unwrap()).collect();
    // 0xFFFFFFE9: to thread mode, main stack, extended frame (ARMv7-M ARM, section B1.5.8).
    let [one, two] = [1.0_f32, 2.0].map(f32::to_bits);
    assert_eq!(stored, [0x1000_0000, 2, 3, 4, 0xFFFF_FFE9, one, two, 14, 12]);
}

/// ARMv7-M ARM, section B1.5.7: the frame has room for the floating-point registers, which are written there only when
/// the handler uses its first.
#[test]
fn floats_are_stacked_when_the_handler_uses_some() {
    let program = [
        0xF64E, 0x5788, 0xF2CE, 0x0700, 0xF44F, 0x0070, 0x6038, 0xF3BF, 0x8F4F, 0xF3BF, 0x8F6F, // CPACR as above
        0xEEB7, 0x0A00, // vmov s0, #1.0
        0xF64E, 0x5704, 0xF2CE, 0x0700, 0xF04F, 0x5080, 0x6038, // PENDSVSET
        0xE7FF, // b to the next instruction: here it is interrupted
        0xEE10, 0x5A10, // vmov r5, s0
        0xF04F, 0x5900, 0xF8C9, 0x5020, // r9 = 0x20000000; str r5, [r9, #0x20]
        0xBF20, 0xE7FD, // wfe, for ever
    ];
    let handler = [
        0xF64E, 0x7034, 0xF2CE, 0x0000, // r0 = 0xE000EF34 (FPCCR)
        0x6804, 0x6845, 0x682E, // r4 = FPCCR; r5 = FPCAR; r6 = what is there
        0xE7FF, // b to the next instruction
        0x2100, 0xEE00, 0x1A10, // s0 = 0
        0x6829, 0x6802, // r1 = what is there now; r2 = FPCCR
        0xF04F, 0x5300, 0xE883, 0x0076, // stm of r1, r2, r4, r5, r6 to 0x20000000
        0x4770, // bx lr
    ];
    let mut board = board(&program, &handler);
    board.run(1e-4).unwrap();
    let stored: Vec<u32> = (0..5).map(|n| board.word(RAM + 4 * n).unwrap()).collect();
    let one = 1.0_f32.to_bits();
    // LSPACT while they are not there; RAM without power holds a pattern.
    assert_eq!(stored, [one, 0xC000_0000, 0xC000_0001, RAM + 0x1000 - 0x68 + 0x20, 0xC3C3_C3C3]);
    assert_eq!(board.word(RAM + 0x20), Some(one));
}

/// movs r0, #1; vmov s0, #1.0
#[test]
fn the_fpu_is_off_until_it_is_enabled() {
    let error = board(&[0x2001, 0xEEB7, 0x0A00, 0xE7FE], &[]).run(1e-4).unwrap_err().to_string();
    assert!(error.contains("at 0x08000202") && error.contains("NOCP"), "{error}");
}

/// ldrex, an exception or none, strex: 1 where it has failed.
#[test]
fn an_exception_ends_an_exclusive_access() {
    for (pend, failed) in [([0xF04F, 0x5380], 1), ([0xF04F, 0x0300], 0)] {
        let program = [
            0xF64E, 0x5704, 0xF2CE, 0x0700, // r7 = 0xE000ED04 (ICSR)
            0xF04F, 0x5000, // mov r0, #0x20000000
            pend[0], pend[1], // mov r3, #0x10000000 (PENDSVSET), or 0
            0xE850, 0x1F00, // ldrex r1, [r0]
            0x603B, 0xE7FF, // str r3, [r7]; b to the next instruction
            0xE840, 0x1200, // strex r2, r1, [r0]
            0x6042, // str r2, [r0, #4]
            0xBF20, 0xE7FD, // wfe, for ever
        ];
        let mut board = board(&program, &[0x4770]);
        board.run(1e-4).unwrap();
        assert_eq!(board.word(RAM + 4), Some(failed));
    }
}

/// A loop of two instructions that counts in r0, until the run ends.
#[test]
fn instructions_are_counted() {
    // movs r0, #0; adds r0, #1; b back to adds … with r0 stored each time: str r0, [r1], r1 = RAM.
    let program = [0x2000, 0xF04F, 0x5100, 0x3001, 0x6008, 0xE7FC];
    let mut board = board(&program, &[]);
    board.run_until(3002).unwrap();
    // Two instructions before the loop of three.
    let rounds = board.word(RAM).unwrap();
    assert!((999..=1001).contains(&rounds), "{rounds}");
}

/// An undefined instruction leads to the hard fault, one in its handler to lockup (ARMv7-M ARM, section B1.5.15).
#[test]
fn faults_are_not_lost() {
    let program = [0xDE00];
    let vectors_alone = board(&program, &[]).run(1e-4).unwrap_err().to_string();
    assert!(vectors_alone.contains("exception 3 has no handler"), "{vectors_alone}");
    let mut vectors = [0_u32; 16];
    (vectors[0], vectors[1], vectors[3]) = (RAM + 0x1000, FLASH + PROGRAM + 1, FLASH + PROGRAM + 1);
    let segments = vec![
        (FLASH, vectors.iter().flat_map(|word| word.to_le_bytes()).collect()),
        (FLASH + PROGRAM, program.iter().flat_map(|half: &u16| half.to_le_bytes()).collect()),
    ];
    let pins = Box::new(Counts::new(std::iter::empty()));
    let mut board = Board::new(&Image { segments }, Contents::default(), pins, Pace::ONE).unwrap();
    let lockup = board.run(1e-4).unwrap_err().to_string();
    assert!(lockup.contains("lockup"), "{lockup}");
}

/// ldr r0, [r1]; then for ever.
fn reads(address: u32) -> String {
    let immediate = |value: u32, high: bool| {
        let [i, imm4, imm3, imm8] = [value >> 11 & 1, value >> 12 & 0xF, value >> 8 & 7, value & 0xFF];
        let first = if high { 0xF2C0 } else { 0xF240 } | i << 10 | imm4;
        [first as u16, (imm3 << 12 | 1 << 8 | imm8) as u16]
    };
    let [a, b] = immediate(address & 0xFFFF, false);
    let [c, d] = immediate(address >> 16, true);
    board(&[a, b, c, d, 0x6808, 0xE7FE], &[]).run(1e-4).unwrap_err().to_string()
}

#[test]
fn what_is_not_modelled_is_an_error_that_names_the_register() {
    // TIM3, an offset of RCC that is reserved, a port whose clock is off, memory that is not there.
    for (address, words) in [
        (0x4000_0400, "0x40000400 is not modelled"),
        (0x4002_1014, "RCC: the register at 0x40021014 is not modelled"),
        (0x4800_0010, "GPIO: 0x48000010 is read while its clock is off"),
        (0x6000_0000, "no memory at 0x60000000 (read"),
    ] {
        let error = reads(address);
        assert!(error.contains(words) && error.contains("program counter 0x0800020"), "{error}");
    }
}
