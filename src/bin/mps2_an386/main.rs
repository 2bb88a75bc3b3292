//! The firmware's twin for QEMU's machine mps2-an386 (a Cortex-M4F): the same application, with a motor in place of the
//! converter, RAM in place of the flash, and QEMU's first serial port in place of the USART. The second one makes the
//! motor go wrong, by the letters of [`greyrig::app::bench::Trouble`], and has the station's contacts: `s` presses
//! START and `S` lets go of it, `a`, `A` ABORT, `e`, `E` the emergency stop.
//!
//! ```text
//! cargo fw-qemu
//! qemu-system-arm -M mps2-an386 -nographic -monitor none -serial tcp:127.0.0.1:7000,server=on,wait=off \
//!     -icount shift=3 -kernel target/thumbv7em-none-eabihf/firmware/mps2-an386
//! ```
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("This program is for QEMU's mps2-an386; build it with `cargo fw-qemu`.");
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
mod figures;
#[cfg(target_os = "none")]
mod nor;
#[cfg(target_os = "none")]
mod sampling;
#[cfg(target_os = "none")]
mod serial;

#[cfg(target_os = "none")]
mod firmware {
    // The macros of cortex-m-rt and embassy export symbols.
    #![allow(unsafe_code)]

    use embassy_executor::Spawner;
    use greyrig::app::{Server, Shared, serve};

    use static_cell::ConstStaticCell;

    use crate::board::Board;
    use crate::sampling;

    static SHARED: Shared = Shared::new();

    #[embassy_executor::main]
    async fn main(_spawner: Spawner) {
        let mut board = Board::new();
        // In its place at once: nothing of it is ever on the stack.
        static SERVER: ConstStaticCell<Server> = ConstStaticCell::new(Server::new(&SHARED));
        let server = SERVER.take();
        let active = server.load(&mut board);
        sampling::start(active, server.take_sequence(), &SHARED);
        serve(server, &SHARED, board).await
    }

    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo) -> ! {
        cortex_m::peripheral::SCB::sys_reset()
    }
}
