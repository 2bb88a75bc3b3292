//! The firmware of the NUCLEO-G474RE.
//!
//! ```text
//! TIM2, 10 kHz ─ TRGO ─┬► ADC1, injected sequence PA0, PA1, PC0 ─ JEOS interrupt ─► Sampler   (sampling)
//!                      └► TIM5 counts ─► numbers of the samples
//! USART2 on PA2, PA3 ─ DMA ─► Server ─► two pages at the end of bank 2                        (board)
//! NMI ─► a word of the flash that cannot be read; hard fault, panic ─► a record for the next start     (ends)
//! ```
//! The processor runs at 170 MHz from the board's 24 MHz crystal: 24/6 · 85/2. 170 MHz / 17,000 is 10 kHz exactly, as
//! exact as the crystal. Not run on silicon yet; `docs/wiring.md` has a list for the first time.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("This program is for the NUCLEO-G474RE; build it with `cargo fw`, flash and run it with `cargo fw-run`.");
    std::process::exit(2);
}

#[cfg(target_os = "none")]
#[path = "../build_id.rs"]
mod build_id;
#[cfg(target_os = "none")]
#[path = "../start.rs"]
mod start;

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
mod clocks;
#[cfg(target_os = "none")]
mod ends;
#[cfg(target_os = "none")]
mod sampling;
#[cfg(target_os = "none")]
mod switchgear;

#[cfg(target_os = "none")]
mod firmware {
    // The macros of cortex-m-rt and embassy export symbols.
    #![allow(unsafe_code)]

    use defmt_rtt as _;
    use embassy_executor::Spawner;
    use embassy_stm32::pac;
    use greyrig::app::{Server, Shared, serve};
    use greyrig::faults::Fault;
    use greyrig::incident::{Cause, Incident, Reset};

    use static_cell::ConstStaticCell;

    use crate::board::{Board, Lamps, Line};
    use crate::sampling::Converter;
    use crate::switchgear::{Switchgear, Terminals};
    use crate::{clocks, ends, sampling};

    /// What interrupt and thread share; the handler of the NMI counts here, too.
    pub static SHARED: Shared = Shared::new();

    #[embassy_executor::main]
    async fn main(_spawner: Spawner) {
        let p = embassy_stm32::init(clocks::config());
        let cause = pac::RCC.csr().read();
        if cause.iwdgrstf() {
            SHARED.raise(Fault::WatchdogReset);
        }
        ends::start(Reset { watchdog: cause.iwdgrstf(), brown_out: cause.borrstf() });
        pac::RCC.csr().modify(|register| register.set_rmvf(true));

        // Before anything that may take long: what was driven before the reset floats until then.
        let switchgear = Switchgear::new(Terminals {
            start: p.PC7,
            abort: p.PA6,
            emergency: p.PB0,
            voltage: p.PA9,
            contactor: p.PA10,
            current: p.PA7,
            timer: p.TIM1,
        });
        let line = Line { usart: p.USART2, tx: p.PA2, rx: p.PA3, tx_dma: p.DMA1_CH1, rx_dma: p.DMA1_CH2 };
        let lamps = Lamps { pass: p.PB10, alarm: p.PB5, busy: p.PB6, status: p.PA5 };
        let Some(mut board) = Board::new(p.FLASH, p.IWDG, line, lamps) else { cortex_m::peripheral::SCB::sys_reset() };
        // In its place at once: nothing of it is ever on the stack.
        static SERVER: ConstStaticCell<Server> = ConstStaticCell::new(Server::new(&SHARED));
        let server = SERVER.take();
        let active = server.load(&mut board);
        defmt::info!("{}", if active.is_some() { "running" } else { "safe mode: no usable parameters in flash" });

        let converter = Converter {
            adc: p.ADC1,
            voltage: p.PA0,
            current: p.PA1,
            speed: p.PC0,
            timer: p.TIM2,
            counter: p.TIM5,
            busy: p.PA8,
        };
        sampling::start(converter, active, server.take_sequence(), switchgear);
        board.start_watchdog();
        serve(server, &SHARED, board).await
    }

    #[panic_handler]
    fn panic(info: &core::panic::PanicInfo) -> ! {
        defmt::error!("{}", defmt::Display2Format(info));
        let incident = Incident::new(Cause::Panic, SHARED.samples());
        ends::end(match info.location() {
            Some(place) => incident.at_line(place.file(), place.line()),
            None => incident,
        })
    }
}
