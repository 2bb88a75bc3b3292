//! What ends a run.

/// Something that the model does not have, or that a microcontroller would not forgive.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// The image is none for this microcontroller.
    #[error("the image cannot be loaded: {0}")]
    Image(String),
    /// A register that is not modelled was accessed.
    #[error("{peripheral}: the register at {address:#010x} is not modelled ({access}, program counter {pc:#010x})")]
    Register {
        /// Whose register.
        peripheral: &'static str,
        /// Its address.
        address: u32,
        /// How it was accessed.
        access: String,
        /// Where the program was, to a block of instructions.
        pc: u32,
    },
    /// A peripheral was used in a way that the reference manual forbids or that is not modelled.
    #[error("{peripheral}: {what} (program counter {pc:#010x})")]
    Use {
        /// Which.
        peripheral: &'static str,
        /// How.
        what: String,
        /// Where the program was, to a block of instructions.
        pc: u32,
    },
    /// Memory that is not there was accessed.
    #[error("there is no memory at {address:#010x} ({access}, program counter {pc:#010x})")]
    Memory {
        /// The address.
        address: u32,
        /// How it was accessed.
        access: &'static str,
        /// Where the program was, to a block of instructions.
        pc: u32,
    },
    /// The processor could not go on.
    #[error("the processor stopped at {pc:#010x}: {what}")]
    Processor {
        /// Where.
        pc: u32,
        /// Why.
        what: String,
    },
}

/// What goes wrong in a peripheral; the machine adds the place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Trouble {
    /// No such register.
    Register,
    /// A use that is forbidden or not modelled.
    Use(String),
}

impl Trouble {
    /// A use that is forbidden or not modelled.
    pub fn used(what: impl Into<String>) -> Self {
        Self::Use(what.into())
    }
}
