//! The machine as the application sees it.

use cortex_m::peripheral::SCB;
use greyrig::app::{self, Lamps};
use greyrig::hardware::Hardware;

use crate::figures::HARDWARE;
use crate::nor::Nor;
use crate::serial::Link;

/// The machine.
pub struct Board {
    serial: Link,
    flash: Nor,
}

impl Board {
    pub fn new() -> Self {
        Self { serial: Link::new(), flash: Nor::new() }
    }
}

impl app::Board for Board {
    type Flash = Nor;
    const HARDWARE: Hardware = HARDWARE;
    const FLASH: u32 = HARDWARE.rig.address;

    fn flash(&mut self) -> &mut Nor {
        &mut self.flash
    }

    fn chip(&self) -> [u8; 12] {
        *b"qemu an386 0"
    }

    fn deepest_stack(&self) -> u32 {
        crate::start::deepest_stack()
    }

    async fn receive(&mut self, bytes: &mut [u8]) -> usize {
        let mut count = 0;
        for (place, byte) in bytes.iter_mut().zip(core::iter::from_fn(|| self.serial.byte())) {
            *place = byte;
            count += 1;
        }
        if count == 0 {
            // Until the next sample: there is no other task.
            cortex_m::asm::wfi();
        }
        count
    }

    async fn send(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.serial.send(byte));
    }

    fn show(&mut self, _: Lamps) {}

    fn micros(&self) -> Option<u64> {
        None
    }

    fn alive(&mut self) {}

    fn restart(&mut self) -> ! {
        self.serial.flush();
        SCB::sys_reset()
    }
}
