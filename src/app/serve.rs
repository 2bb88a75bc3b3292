//! The thread's loop.

use super::board::Board;
use super::server::Server;
use super::shared::Shared;

/// Bytes taken from the line at once.
const AT_ONCE: usize = 64;

/// Serves the host for ever. The watchdog is told that all is well only while samples come.
pub async fn serve<B: Board>(mut server: Server<'_>, shared: &Shared, mut board: B) -> ! {
    let mut bytes = [0; AT_ONCE];
    let mut samples = shared.samples();
    loop {
        let count = board.receive(&mut bytes).await;
        receive_all(&mut server, &mut board, bytes.get(..count).unwrap_or_default()).await;
        send_waiting(&mut server, &mut board).await;
        if samples != shared.samples() {
            samples = shared.samples();
            board.alive();
            board.show(shared.verdict());
        }
    }
}

/// Takes bytes from the host and answers what was asked in them.
pub async fn receive_all<B: Board>(server: &mut Server<'_>, board: &mut B, bytes: &[u8]) {
    for &byte in bytes {
        if let Some(outgoing) = server.receive(byte, board) {
            board.send(outgoing.bytes()).await;
            if outgoing.restart {
                board.restart();
            }
        }
    }
}

/// Sends what waits to be sent unasked.
pub async fn send_waiting<B: Board>(server: &mut Server<'_>, board: &mut B) {
    while let Some(outgoing) = server.unasked() {
        board.send(outgoing.bytes()).await;
    }
}
