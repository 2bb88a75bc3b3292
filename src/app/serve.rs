//! The thread's loop.

use super::hardware::Hardware;
use super::server::Server;
use super::shared::Shared;

/// Bytes taken from the line at once.
const AT_ONCE: usize = 64;

/// Serves the host for ever. The watchdog is told that all is well only while samples come.
pub async fn serve<H: Hardware>(mut server: Server<'_>, shared: &Shared, mut hardware: H) -> ! {
    let mut bytes = [0; AT_ONCE];
    let mut samples = shared.samples();
    loop {
        let count = hardware.receive(&mut bytes).await;
        receive_all(&mut server, &mut hardware, bytes.get(..count).unwrap_or_default()).await;
        send_waiting(&mut server, &mut hardware).await;
        if samples != shared.samples() {
            samples = shared.samples();
            hardware.alive();
            hardware.show(shared.verdict());
        }
    }
}

/// Takes bytes from the host and answers what was asked in them.
pub async fn receive_all<H: Hardware>(server: &mut Server<'_>, hardware: &mut H, bytes: &[u8]) {
    for &byte in bytes {
        if let Some(outgoing) = server.receive(byte, hardware) {
            hardware.send(outgoing.bytes()).await;
            if outgoing.restart {
                hardware.restart();
            }
        }
    }
}

/// Sends what waits to be sent unasked.
pub async fn send_waiting<H: Hardware>(server: &mut Server<'_>, hardware: &mut H) {
    while let Some(outgoing) = server.unasked() {
        hardware.send(outgoing.bytes()).await;
    }
}
