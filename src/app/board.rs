//! What the application asks of a board.

use embedded_storage::nor_flash::NorFlash;

use super::lamps::Lamps;
use crate::hardware::Hardware;
use crate::incident::Kept;
use crate::sequence::Contacts;

/// What the station switches and is switched by, seen from the sampling interrupt.
pub trait Switchgear {
    /// The contacts, as they are now.
    fn contacts(&mut self) -> Contacts;
    /// Whether the hardware has cut the supply since it was armed.
    fn has_tripped(&mut self) -> bool;
    /// Arms the hardware's trip anew.
    fn arm(&mut self);
    /// The counts of the current between which the hardware does not trip, the lower first.
    fn trip_outside(&mut self, counts: [u16; 2]);
    /// The supply: its contactor, and its voltage as a fraction of what it gives, 0 to 1.
    fn supply(&mut self, closed: bool, fraction: f32);
}

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
    /// Which image of the program runs; zeros where the linker does not say.
    fn build(&self) -> [u8; 8] {
        [0; 8]
    }
    /// What has been kept over the last reset.
    fn kept(&self) -> Kept {
        Kept::default()
    }
    /// Keeps how many samples there are, and whether the start is a good one.
    fn keep(&mut self, _samples: u32, _settled: bool) {}
    /// Forgets the last incident.
    fn forget(&mut self) {}
    /// Cuts the supply, whatever the sampling interrupt does: it does not come any more.
    fn cut(&mut self) {}
    /// Says to the watchdog that all is well.
    fn alive(&mut self);
    /// Starts again, after what was sent has left.
    fn restart(&mut self) -> !;
}
