//! The figures of a rig's hardware that the rest has to know. Another board has other ones; nothing else in the core
//! knows them.
//!
//! That there are three channels is no matter of a board: the model is of a voltage, a current and a speed.

/// The figures of a rig's hardware.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hardware {
    /// Name of the board.
    pub board: &'static str,
    /// Samples per second.
    pub sample_rate_hz: u32,
    /// Full scale of the converter, counts: 2ⁿ − 1 for n bits. The link has 12 bits for a count.
    pub full_scale: u16,
    /// How much later than the voltage current and speed are sampled, s.
    pub skew_s: [f32; 2],
    /// Where the parameters are kept.
    pub slots: Slots,
    /// Where what belongs to the rig is kept.
    pub rig: Slots,
}

/// Two places in flash for a block of parameters, one behind the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slots {
    /// Address of the first, as the processor and a debug probe see it.
    pub address: u32,
    /// Size of one, bytes: one page or several, a page being what is erased at once.
    pub size: usize,
}

/// The rig of A. Rakar, Đ. Juričić (2004), section 2.2, with a NUCLEO-G474RE: 10 kHz, and the 12 bits of the STM32G474.
pub const NUCLEO_G474RE: Hardware = Hardware {
    board: "NUCLEO-G474RE",
    sample_rate_hz: 10_000,
    full_scale: 4095,
    // (24.5 + 12.5) cycles of 42.5 MHz a channel (RM0440, timing of the converter).
    skew_s: [37.0 / 42.5e6, 74.0 / 42.5e6],
    // The last two pages of bank 2, of 2 KiB in dual-bank mode (RM0440, section 3.3.1), so that the program in bank 1
    // runs on while they are erased. `memory.x` keeps the program away from there.
    slots: Slots { address: 0x0807_F000, size: 2048 },
    // The two before.
    rig: Slots { address: 0x0807_E000, size: 2048 },
};
