//! What the application asks of a board.

use embedded_storage::nor_flash::NorFlash;

use super::lamps::Lamps;
use crate::hardware::Hardware;

/// A board, seen from the thread. The sampling interrupt is the board's own business.
#[allow(async_fn_in_trait)]
pub trait Board {
    /// Flash that holds the parameters.
    type Flash: NorFlash;
    /// Its figures.
    const HARDWARE: Hardware;
    /// Address at which [`Board::flash`] begins.
    const FLASH: u32;

    /// The flash.
    fn flash(&mut self) -> &mut Self::Flash;
    /// The chip's own number.
    fn chip(&self) -> [u8; 12];
    /// The most that the stack has taken since the start, bytes.
    fn deepest_stack(&self) -> u32;
    /// Bytes from the host: at least one, or none after a millisecond at most.
    async fn receive(&mut self, bytes: &mut [u8]) -> usize;
    /// Sends bytes to the host. What a disconnected line does not take is lost.
    async fn send(&mut self, bytes: &[u8]);
    /// Shows the verdict.
    fn show(&mut self, lamps: Lamps);
    /// Time since some moment, µs, by a clock that is not the one of the sampling; none if there is no other.
    fn micros(&self) -> Option<u64>;
    /// Says to the watchdog that all is well.
    fn alive(&mut self);
    /// Starts again, after what was sent has left.
    fn restart(&mut self) -> !;
}
