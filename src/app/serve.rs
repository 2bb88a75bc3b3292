//! The thread's loop.

use super::board::Board;
use super::lamps::Lamps;
use super::server::Server;
use super::shared::Shared;
use super::time_base::TimeBase;
use crate::faults::Fault;
use crate::incident::SETTLED_S;
use crate::sequence::State;

/// Bytes taken from the line at once.
const AT_ONCE: usize = 64;
/// Frames sent in a turn at most, so that whatever waits to be sent, the host is heard and the watchdog told: 27 ms of
/// the line.
pub const FRAMES_A_TURN: usize = 8;

/// Without a sample for so long, the thread cuts the supply of a run, µs: thirty samples, of which none may be missing.
/// Judgement: the interrupt itself takes a tenth of a sample, and no turn is so quick that it sees less.
pub const STILL_US: u64 = 3_000;

/// Serves the host for ever. The watchdog is told that all is well only while samples come.
pub async fn serve<B: Board>(server: &mut Server<'_>, shared: &Shared, mut board: B) -> ! {
    let mut bytes = [0; AT_ONCE];
    let mut samples = shared.samples();
    let mut since = board.micros();
    let mut time_base = TimeBase::new(B::HARDWARE.sample_rate_hz);
    loop {
        let count = board.receive(&mut bytes).await;
        receive_all(server, &mut board, bytes.get(..count).unwrap_or_default()).await;
        send_waiting(server, &mut board).await;
        if samples != shared.samples() {
            samples = shared.samples();
            board.alive();
            board.keep(samples, samples >= SETTLED_S * B::HARDWARE.sample_rate_hz);
            board.show(match server.state() {
                Some(state) => Lamps::of_run(state, samples, &B::HARDWARE),
                None => Lamps::of(server.verdict(), samples, &B::HARDWARE),
            });
            since = board.micros();
        } else if server.state().is_some_and(State::is_busy)
            && board.micros().zip(since).is_some_and(|(now, since)| now.wrapping_sub(since) > STILL_US)
        {
            board.cut();
            shared.stand_still();
        }
        if board.micros().is_some_and(|micros| time_base.disagrees(shared.samples(), micros)) {
            shared.raise(Fault::TimeBase);
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

/// Sends what waits to be sent unasked, `FRAMES_A_TURN` at most: while they leave, more may come.
pub async fn send_waiting<B: Board>(server: &mut Server<'_>, board: &mut B) {
    for _ in 0..FRAMES_A_TURN {
        let Some(outgoing) = server.unasked() else { return };
        board.send(outgoing.bytes()).await;
    }
}
