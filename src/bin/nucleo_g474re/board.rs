//! The board as the application sees it.

use cortex_m::peripheral::SCB;
use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::{DMA1_CH1, DMA1_CH2, FLASH, IWDG, PA2, PA3, PA5, PB5, PB6, PB10, USART2};
use embassy_stm32::usart::{self, RingBufferedUartRx, Uart, UartTx};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peri, bind_interrupts, dma};
use embassy_time::{Duration, Instant, with_timeout};
use greyrig::app;
use greyrig::hardware::{Hardware, NUCLEO_G474RE};
use greyrig::incident::Kept;
use greyrig::link::BAUD;
use static_cell::StaticCell;

use crate::{ends, switchgear};

bind_interrupts!(struct Interrupts {
    USART2 => usart::InterruptHandler<USART2>;
    DMA1_CHANNEL1 => dma::InterruptHandler<DMA1_CH1>;
    DMA1_CHANNEL2 => dma::InterruptHandler<DMA1_CH2>;
});

/// Where the flash begins; the driver counts from there.
const FLASH_BEGIN: u32 = 0x0800_0000;
/// Without a tick for so long the processor is restarted, µs. A page takes 22 ms to be erased, twice a commit at most.
const WATCHDOG_US: u32 = 500_000;
/// Bytes from the host that may wait while a page is erased: the host sends one request and waits for its answer.
const RECEIVE_BUFFER: usize = 1024;

/// What the line to the host is made of: the virtual serial port of the board's ST-LINK (UM2505).
pub struct Line {
    pub usart: Peri<'static, USART2>,
    pub tx: Peri<'static, PA2>,
    pub rx: Peri<'static, PA3>,
    pub tx_dma: Peri<'static, DMA1_CH1>,
    pub rx_dma: Peri<'static, DMA1_CH2>,
}

/// Where the verdict is shown, in the way of [`app::Lamps`].
pub struct Lamps {
    /// Pulses while the motor passes (D6 of the Arduino connector).
    pub pass: Peri<'static, PB10>,
    /// High: the motor fails (D4).
    pub alarm: Peri<'static, PB5>,
    /// Pulses while a run is under way (D10).
    pub busy: Peri<'static, PB6>,
    /// The board's green light LD2: lit while there is no verdict.
    pub status: Peri<'static, PA5>,
}

/// The board.
pub struct Board {
    flash: Flash<'static, Blocking>,
    tx: UartTx<'static, Async>,
    rx: RingBufferedUartRx<'static>,
    watchdog: IndependentWatchdog<'static, IWDG>,
    pass: Output<'static>,
    alarm: Output<'static>,
    busy: Output<'static>,
    status: Output<'static>,
}

impl Board {
    /// None if the driver refuses the baud rate.
    pub fn new(flash: Peri<'static, FLASH>, watchdog: Peri<'static, IWDG>, line: Line, lamps: Lamps) -> Option<Self> {
        static BUFFER: StaticCell<[u8; RECEIVE_BUFFER]> = StaticCell::new();
        let mut config = usart::Config::default();
        config.baudrate = BAUD;
        let Line { usart, tx, rx, tx_dma, rx_dma } = line;
        let (tx, rx) = Uart::new(usart, rx, tx, tx_dma, rx_dma, Interrupts, config).ok()?.split();
        Some(Self {
            flash: Flash::new_blocking(flash),
            tx,
            rx: rx.into_ring_buffered(BUFFER.init([0; RECEIVE_BUFFER])),
            watchdog: IndependentWatchdog::new(watchdog, WATCHDOG_US),
            pass: Output::new(lamps.pass, Level::Low, Speed::Low),
            alarm: Output::new(lamps.alarm, Level::Low, Speed::Low),
            busy: Output::new(lamps.busy, Level::Low, Speed::Low),
            status: Output::new(lamps.status, Level::High, Speed::Low),
        })
    }

    /// Nothing stops it any more.
    pub fn start_watchdog(&mut self) {
        self.watchdog.unleash();
    }
}

impl app::Board for Board {
    type Flash = Flash<'static, Blocking>;
    const HARDWARE: Hardware = NUCLEO_G474RE;
    const FLASH: u32 = FLASH_BEGIN;

    fn flash(&mut self) -> &mut Self::Flash {
        &mut self.flash
    }

    fn chip(&self) -> [u8; 12] {
        embassy_stm32::uid::uid()
    }

    fn deepest_stack(&self) -> u32 {
        crate::start::deepest_stack()
    }

    async fn receive(&mut self, bytes: &mut [u8]) -> usize {
        // A noisy line is an error here; the receiver finds the next frame by itself.
        with_timeout(Duration::from_millis(1), self.rx.read(bytes)).await.map_or(0, |read| read.unwrap_or(0))
    }

    async fn send(&mut self, bytes: &[u8]) {
        if let Err(error) = self.tx.write(bytes).await {
            defmt::warn!("a frame was not sent: {}", defmt::Debug2Format(&error));
        }
    }

    fn show(&mut self, lamps: app::Lamps) {
        self.pass.set_level(lamps.pass.into());
        self.alarm.set_level(lamps.alarm.into());
        self.busy.set_level(lamps.busy.into());
        self.status.set_level(lamps.status.into());
    }

    fn micros(&self) -> Option<u64> {
        Some(Instant::now().as_micros())
    }

    fn build(&self) -> [u8; 8] {
        crate::build_id::build_id()
    }

    fn kept(&self) -> Kept {
        ends::kept()
    }

    fn keep(&mut self, samples: u32, settled: bool) {
        ends::keep(samples, settled);
    }

    fn forget(&mut self) {
        ends::forget();
    }

    fn cut(&mut self) {
        switchgear::cut();
    }

    fn alive(&mut self) {
        self.watchdog.pet();
    }

    fn restart(&mut self) -> ! {
        // Whether it has left or not, the host asks again.
        let _ = self.tx.blocking_flush();
        SCB::sys_reset()
    }
}
