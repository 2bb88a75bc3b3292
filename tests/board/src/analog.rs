//! What stands at the converter's pins.

/// Voltages at the pins, as the converter's counts.
pub trait Analog {
    /// The processor starts, or starts again.
    fn start(&mut self) {}
    /// A sequence of conversions begins, so many seconds after the start of the board.
    fn begin(&mut self, seconds: f64);
    /// The supply as the board commands it from the next sequence on: its contactor, and its voltage as a share of what
    /// it gives.
    fn supply(&mut self, _closed: bool, _fraction: f64) {}
    /// What an ADC1 input gives in the present sequence, 0 to 4095; none if nothing is connected to it.
    fn convert(&mut self, input: u8) -> Option<u16>;
}

/// Counts that a test gives, sample by sample, for the inputs of voltage, current and speed.
#[derive(Debug, Clone, Default)]
pub struct Counts<I> {
    samples: I,
    now: [u16; 3],
}

/// Inputs of ADC1 for voltage (PA0), current (PA1) and speed (PC0).
pub const INPUTS: [u8; 3] = [1, 2, 6];

impl<I: Iterator<Item = [u16; 3]>> Counts<I> {
    /// Takes a triple at each sequence; after the last one the inputs stay where they are.
    pub fn new(samples: I) -> Self {
        Self { samples, now: [0; 3] }
    }
}

impl<I: Iterator<Item = [u16; 3]>> Analog for Counts<I> {
    fn begin(&mut self, _seconds: f64) {
        self.now = self.samples.next().unwrap_or(self.now);
    }

    fn convert(&mut self, input: u8) -> Option<u16> {
        INPUTS.iter().position(|&own| own == input).map(|n| self.now[n])
    }
}
