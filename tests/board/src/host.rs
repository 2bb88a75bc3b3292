//! A host in virtual time: it asks over the board's line, and waits in cycles of the processor.

use greyrig::link::frame::{MAX_FRAME, Receiver, encode};
use greyrig::link::message::{Asked, CHUNK, InForce, Judged, Message, Reply, Report, Request, Status};
use greyrig::link::packing;
use greyrig::parameters::FINGERPRINT;
use greyrig::parameters::block::payload_crc;
use greyrig::units::Counts;

use crate::board::Board;
use crate::fault::Fault;

/// How long the host waits for an answer, s: `greyrig` waits so long, too.
const PATIENCE_S: f64 = 0.5;
/// How often it asks, as `greyrig` does.
const ATTEMPTS: usize = 4;
/// How finely it looks, s.
const GLANCE_S: f64 = 0.5e-3;

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum NoAnswer {
    /// The board stopped.
    #[error(transparent)]
    Fault(#[from] Fault),
    /// Nothing came in time.
    #[error("nobody answers")]
    Silence,
    /// Something else came.
    #[error("the answer is {0}")]
    Other(String),
}

/// The host's side of the link.
#[derive(Debug, Clone, Default)]
pub struct Host {
    receiver: Receiver,
    number: u8,
    /// Raw samples that came: number and counts.
    pub samples: Vec<(u32, Counts)>,
    /// Reports that came.
    pub reports: Vec<Report>,
    /// Periods of the mains that came, judged.
    pub judged: Vec<Judged>,
    /// Frames that were none.
    pub garbled: usize,
}

impl Host {
    /// Sends a request, without waiting.
    pub fn send(&mut self, board: &mut Board, request: Request) {
        self.number = self.number.wrapping_add(1);
        let mut frame = [0; MAX_FRAME];
        // Requests of this library fit a frame.
        let length = encode(&Asked { number: self.number, request }, &mut frame).unwrap_or_default();
        board.send(&frame[..length]);
    }

    /// Takes what has come; `answer` sees the reply to the last request.
    pub fn look<T>(&mut self, board: &mut Board, mut answer: impl FnMut(&Reply) -> T) -> Option<T> {
        let mut answered = None;
        for byte in board.receive() {
            let Some(frame) = self.receiver.push(byte) else { continue };
            match frame.ok().and_then(|body| postcard::from_bytes::<Message>(body).ok()) {
                Some(Message::Reply { number, reply }) if number == self.number => answered = Some(answer(&reply)),
                Some(Message::Reply { .. }) => {}
                Some(Message::Samples(samples)) => {
                    if let Some(counts) = packing::unpack(samples.count.into(), samples.packed) {
                        self.samples.extend((samples.first..).zip(counts));
                    }
                }
                Some(Message::Report(report)) => self.reports.push(report),
                Some(Message::Judged(judged)) => self.judged.push(judged),
                None => self.garbled += 1,
            }
        }
        answered
    }

    /// Asks, and makes something of the answer.
    ///
    /// # Errors
    /// No answer, another one, a board that stopped.
    pub fn ask<T>(
        &mut self,
        board: &mut Board,
        request: Request,
        mut take: impl FnMut(&Reply) -> Option<T>,
    ) -> Result<T, NoAnswer> {
        for _ in 0..ATTEMPTS {
            self.send(board, request);
            let deadline = board.seconds() + PATIENCE_S;
            while board.seconds() < deadline {
                board.run(GLANCE_S)?;
                let answer = self.look(board, |reply| take(reply).ok_or_else(|| NoAnswer::Other(format!("{reply:?}"))));
                if let Some(answer) = answer {
                    return answer;
                }
            }
        }
        Err(NoAnswer::Silence)
    }

    /// Asks for what is merely done.
    ///
    /// # Errors
    /// As [`Host::ask`].
    pub fn tell(&mut self, board: &mut Board, request: Request) -> Result<(), NoAnswer> {
        self.ask(board, request, |reply| matches!(reply, Reply::Done).then_some(()))
    }

    /// How the firmware is.
    ///
    /// # Errors
    /// As [`Host::ask`].
    pub fn status(&mut self, board: &mut Board) -> Result<Status, NoAnswer> {
        self.ask(
            board,
            Request::Status,
            |reply| if let Reply::Status(status) = reply { Some(status.clone()) } else { None },
        )
    }

    /// Brings a payload into the firmware's waiting room.
    ///
    /// # Errors
    /// As [`Host::ask`].
    pub fn bring(&mut self, board: &mut Board, payload: &[u8]) -> Result<(), NoAnswer> {
        for (n, data) in payload.chunks(CHUNK).enumerate() {
            self.tell(board, Request::WriteParameters { offset: (n * CHUNK) as u16, data })?;
        }
        Ok(())
    }

    /// Has the waiting room written to flash.
    ///
    /// # Errors
    /// As [`Host::ask`].
    pub fn commit(&mut self, board: &mut Board, payload: &[u8]) -> Result<InForce, NoAnswer> {
        let request = commit(payload);
        self.ask(board, request, |reply| if let Reply::Committed(block) = reply { Some(*block) } else { None })
    }

    /// Writes parameters and starts the firmware with them.
    ///
    /// # Errors
    /// As [`Host::ask`].
    pub fn flash(&mut self, board: &mut Board, payload: &[u8]) -> Result<Status, NoAnswer> {
        self.bring(board, payload)?;
        self.commit(board, payload)?;
        self.tell(board, Request::Restart)?;
        board.run(0.05)?;
        self.status(board)
    }
}

/// The request that has a payload written.
pub fn commit(payload: &[u8]) -> Request<'static> {
    Request::CommitParameters { fingerprint: FINGERPRINT, length: payload.len() as u16, crc: payload_crc(payload) }
}
