//! A conversation with the microcontroller: requests, their answers, and what comes unasked.

use std::collections::VecDeque;
use std::io::Write;
use std::time::Duration;

use greyrig::faults::TABLE;
use greyrig::link::frame::{MAX_FRAME, Receiver, encode};
use greyrig::link::message::{Asked, Message, Mode, PROTOCOL, Reply, Request, Status};
use greyrig::parameters::FINGERPRINT;

use super::clock::Clock;
use super::error::{Error, Result};
use super::line::{self, Line};
use crate::context::Context;

/// How long an answer is waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patience {
    /// An answer that has not come after this time is asked for again.
    pub answer: Duration,
    /// How often it is asked for in all.
    pub attempts: usize,
}

impl Patience {
    /// With a board that ought to be there. The longest answer takes two pages' erasure, 50 ms.
    pub const USUAL: Self = Self { answer: Duration::from_millis(500), attempts: 4 };
    /// With a port where nobody may be. A greeting takes no erasure; it is given a second chance, since the end of what
    /// the line has carried before may swallow the first.
    pub const SHORT: Self = Self { answer: Duration::from_millis(200), attempts: 2 };
}

/// Messages that are kept while an answer is waited for: those of four attempts of half a second, 156 frames of samples
/// a second.
const UNHEARD: usize = 512;

/// Where a device is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Port {
    /// A serial device, a pseudo-terminal, or tcp:HOST:PORT.
    pub name: String,
    /// By which time-outs are counted.
    pub clock: Clock,
}

/// Who answered.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Device {
    /// Name of the board.
    pub board: String,
    /// Version of the firmware.
    pub firmware: String,
    /// The chip's own number, in hexadecimal.
    pub chip: String,
    /// Samples per second.
    pub sample_rate_hz: u32,
    /// How much later than the voltage current and speed are sampled, s.
    pub skew_s: [f32; 2],
    /// Fingerprint of the layout of its parameters.
    pub fingerprint: u32,
}

/// An open link.
pub struct Connection {
    port: Port,
    line: Box<dyn Line>,
    receiver: Receiver,
    number: u8,
    /// What came unasked while an answer was waited for.
    unheard: VecDeque<Vec<u8>>,
    patience: Patience,
    ctx: Context,
}

impl Connection {
    /// Opens a port and asks who is there.
    ///
    /// # Errors
    /// A port that cannot be opened, nobody there, or firmware that speaks another version.
    pub fn open(port: &Port, ctx: &Context) -> Result<(Self, Device)> {
        Self::open_with(port, Patience::USUAL, ctx)
    }

    /// The same with a patience of one's own.
    ///
    /// # Errors
    /// As there.
    pub fn open_with(port: &Port, patience: Patience, ctx: &Context) -> Result<(Self, Device)> {
        let name = &port.name;
        let line = line::open(name).map_err(|source| Error::Closed { port: name.clone(), source })?;
        let mut connection = Self {
            port: port.clone(),
            line,
            receiver: Receiver::new(),
            number: 0,
            unheard: VecDeque::new(),
            patience,
            ctx: ctx.clone(),
        };
        // Ends whatever the line has carried before.
        connection.write(&[0])?;
        let (protocol, device) = connection.ask(Request::Hello, |reply| match reply {
            Reply::Identity(identity) => Some((
                identity.protocol,
                Device {
                    board: identity.board.to_owned(),
                    firmware: identity.firmware.to_owned(),
                    chip: identity.chip.iter().map(|byte| format!("{byte:02x}")).collect(),
                    sample_rate_hz: identity.sample_rate_hz,
                    skew_s: identity.skew_s,
                    fingerprint: identity.fingerprint,
                },
            )),
            _ => None,
        })?;
        if protocol != PROTOCOL {
            return Err(Error::Protocol { firmware: device.firmware, protocol });
        }
        Ok((connection, device))
    }

    /// Asks, repeatedly if need be, and takes what `take` makes of the answer.
    ///
    /// # Errors
    /// No answer, a refusal, an answer to another question, or a link that has gone.
    pub fn ask<T>(&mut self, request: Request, mut take: impl FnMut(&Reply) -> Option<T>) -> Result<T> {
        for attempt in 0..self.patience.attempts {
            if attempt > 0 {
                // Ends what may have arrived of the last one.
                self.write(&[0])?;
            }
            self.number = self.number.wrapping_add(1);
            let number = self.number;
            self.send(&Asked { number, request })?;
            let mut unheard = std::mem::take(&mut self.unheard);
            let answer = self.hear(self.patience.answer, |body, message| match message {
                Message::Reply { number: of, reply } if *of == number => Some(match reply {
                    Reply::Refused(why) => Err(Error::Refused(*why)),
                    reply => take(reply).ok_or(Error::OtherQuestion),
                }),
                Message::Reply { .. } => None,
                _ => {
                    unheard.push_back(body.to_vec());
                    None
                }
            });
            unheard.drain(..unheard.len().saturating_sub(UNHEARD));
            self.unheard = unheard;
            let answer = answer?;
            if let Some(answer) = answer {
                return answer;
            }
        }
        Err(Error::Silent(self.port.name.clone()))
    }

    /// As [`Connection::ask`], for requests that are merely done.
    ///
    /// # Errors
    /// As there.
    pub fn tell(&mut self, request: Request) -> Result<()> {
        self.ask(request, |reply| matches!(reply, Reply::Done).then_some(()))
    }

    /// Ends what a program has left running, and forgets what that has sent: nothing of it comes behind the answer.
    ///
    /// # Errors
    /// As [`Connection::ask`].
    pub fn stop(&mut self) -> Result<()> {
        self.tell(Request::Stop)?;
        self.unheard.clear();
        Ok(())
    }

    /// How it is.
    ///
    /// # Errors
    /// As [`Connection::ask`].
    pub fn status(&mut self) -> Result<Status> {
        self.ask(Request::Status, |reply| if let Reply::Status(status) = reply { Some(*status) } else { None })
    }

    /// The payload in force; none without.
    ///
    /// # Errors
    /// As [`Connection::ask`].
    pub fn read_parameters(&mut self) -> Result<Vec<u8>> {
        let mut payload = Vec::new();
        loop {
            let offset = payload.len() as u16;
            let data = self.ask(Request::ReadParameters { offset }, |reply| match reply {
                Reply::Parameters(data) => Some(data.to_vec()),
                _ => None,
            })?;
            if data.is_empty() {
                return Ok(payload);
            }
            payload.extend(data);
        }
    }

    /// The payload of the rig's own block; none without.
    ///
    /// # Errors
    /// As [`Connection::ask`].
    pub fn read_rig(&mut self) -> Result<Vec<u8>> {
        self.ask(Request::ReadRig, |reply| if let Reply::Parameters(data) = reply { Some(data.to_vec()) } else { None })
    }

    /// Gives messages to `handle` until it makes something of one, or the time is up.
    ///
    /// # Errors
    /// A link that has gone, or an interrupt.
    pub fn listen<T>(&mut self, within: Duration, mut handle: impl FnMut(&Message) -> Option<T>) -> Result<Option<T>> {
        let mut made = None;
        for body in self.unheard.drain(..) {
            if let Ok(message) = postcard::from_bytes::<Message>(&body) {
                made = handle(&message).or(made);
            }
        }
        if made.is_some() { Ok(made) } else { self.hear(within, |_, message| handle(message)) }
    }

    fn hear<T>(&mut self, within: Duration, mut handle: impl FnMut(&[u8], &Message) -> Option<T>) -> Result<Option<T>> {
        let mut bytes = [0; 4096];
        let mut wait = self.port.clock.wait(within)?;
        while !wait.is_over()? {
            self.ctx.check()?;
            let count = line::read(&mut *self.line, &mut bytes)
                .map_err(|source| Error::Broken { port: self.port.name.clone(), source })?;
            let mut made = None;
            for &byte in &bytes[..count] {
                // What is no frame has been lost on the way: samples are numbered, answers are asked for again.
                if let Some(Ok(body)) = self.receiver.push(byte)
                    && let Ok(message) = postcard::from_bytes::<Message>(body)
                {
                    made = handle(body, &message).or(made);
                }
            }
            if made.is_some() {
                return Ok(made);
            }
        }
        Ok(None)
    }

    fn send(&mut self, asked: &Asked) -> Result<()> {
        let mut frame = [0; MAX_FRAME];
        let length = encode(asked, &mut frame).map_err(|_| Error::TooLong)?;
        self.write(&frame[..length])
    }

    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        self.line
            .write_all(bytes)
            .and_then(|()| self.line.flush())
            .map_err(|source| Error::Broken { port: self.port.name.clone(), source })
    }
}

/// Fails unless parameters of this greyrig mean the same to the device.
///
/// # Errors
/// Another fingerprint.
pub fn check_layout(device: &Device) -> Result<()> {
    if device.fingerprint == FINGERPRINT {
        return Ok(());
    }
    Err(Error::Layout { firmware: device.firmware.clone(), fingerprint: device.fingerprint })
}

/// The faults that have occurred, each in a line.
pub fn faults(status: &Status) -> Vec<String> {
    TABLE
        .iter()
        .zip(status.faults)
        .filter(|(_, count)| *count > 0)
        .map(|(d, count)| format!("fault {} ({count} times): {}; {}", d.fault.number(), d.what, d.remedy))
        .collect()
}

/// What runs, in words.
pub fn mode(mode: Mode) -> &'static str {
    match mode {
        Mode::Safe => "safe mode",
        Mode::Running => "running",
    }
}
