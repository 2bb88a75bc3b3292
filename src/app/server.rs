//! What the thread does with bytes from the host, and what it has to send unasked.

use embedded_storage::nor_flash::NorFlash;

use super::board::Board;
use super::chain::Chain;
use super::raw::Raw;
use super::shared::Shared;
use crate::detector::Verdict;
use crate::faults::Fault;
use crate::hardware::Slots;
use crate::incident::Cause;
use crate::link::frame::{self, MAX_FRAME, Receiver};
use crate::link::load::Load;
use crate::link::message::{Asked, CHUNK, Identity, InForce, Message, Mode, PROTOCOL, Refusal, Reply, Request};
use crate::link::message::{Samples, Status};
use crate::link::packing;
use crate::parameters::block::{Header, MAX_BLOCK, MAX_PAYLOAD, SLOTS, payload_crc};
use crate::parameters::rig::{MAX_RIG, Rig};
use crate::parameters::store::{Slot, Store};
use crate::parameters::{Active, Error, FINGERPRINT, Settings, section};
use crate::sequence::{Sequence, State, Wishes};
use crate::units::Counts;

/// Version of the firmware.
const FIRMWARE: &str = env!("CARGO_PKG_VERSION");

/// The thread's side of the application.
pub struct Server<'a> {
    receiver: Receiver,
    desk: Desk<'a>,
}

/// Everything but the receiver, whose buffer the request is in while it is answered.
struct Desk<'a> {
    shared: &'a Shared,
    /// The payload in force.
    payload: [u8; MAX_PAYLOAD],
    in_force: Option<InForce>,
    /// The rig's payload in force.
    rig: heapless::Vec<u8, MAX_RIG>,
    rig_in_force: Option<InForce>,
    mode: Mode,
    /// Whether a detector runs.
    judges: bool,
    /// Where a new payload waits until it is complete.
    waiting: [u8; MAX_PAYLOAD],
    /// A sample that has been taken from the queue and belongs to the next frame.
    next: Option<Raw>,
    /// Whether the test under way may be passed.
    chain: Chain,
    /// The sequence, until the interrupt has it.
    sequence: Option<Sequence>,
    /// Samples of its profile, where there is one.
    profile: Option<u32>,
}

/// A frame to send.
#[derive(Debug, Clone)]
pub struct Outgoing {
    bytes: [u8; MAX_FRAME],
    length: usize,
    /// Whether the board has to start again once it has been sent.
    pub restart: bool,
}

impl Outgoing {
    fn new(message: &Message) -> Option<Self> {
        let mut bytes = [0; MAX_FRAME];
        let length = frame::encode(message, &mut bytes).ok()?;
        Some(Self { bytes, length, restart: false })
    }

    /// What goes over the line.
    pub fn bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }
}

impl<'a> Server<'a> {
    /// One that has not looked at the flash yet.
    pub const fn new(shared: &'a Shared) -> Self {
        let desk = Desk {
            shared,
            payload: [0; MAX_PAYLOAD],
            in_force: None,
            rig: heapless::Vec::new(),
            rig_in_force: None,
            mode: Mode::Safe,
            judges: false,
            waiting: [0; MAX_PAYLOAD],
            next: None,
            chain: Chain::new(),
            sequence: None,
            profile: None,
        };
        Self { receiver: Receiver::new(), desk }
    }

    /// Reads the parameters from flash. Without usable ones there are none, and the fault is raised.
    pub fn load<B: Board>(&mut self, board: &mut B) -> Option<Active> {
        self.desk.start(board)
    }

    /// Both.
    pub fn start<B: Board>(board: &mut B, shared: &'a Shared) -> (Self, Option<Active>) {
        let mut server = Self::new(shared);
        let active = server.load(board);
        (server, active)
    }

    /// Takes a byte from the host; at the end of a request gives the frame of the answer.
    pub fn receive<B: Board>(&mut self, byte: u8, board: &mut B) -> Option<Outgoing> {
        let Self { receiver, desk } = self;
        let fault = match receiver.push(byte)? {
            Err(_) => Fault::BadFrame,
            Ok(body) => match postcard::take_from_bytes::<Asked>(body) {
                Ok((Asked { number, request }, [])) => return desk.answer(number, request, board),
                _ => Fault::BadRequest,
            },
        };
        desk.shared.raise(fault);
        None
    }

    /// The next frame that has to be sent unasked: consecutive samples, once there are enough for a frame or a gap
    /// follows them; a judged period; or a report.
    pub fn unasked(&mut self) -> Option<Outgoing> {
        if let Some(outgoing) = self.desk.samples() {
            return Some(outgoing);
        }
        if let Some(mut judged) = self.desk.shared.judged.pop() {
            self.desk.follow_runs();
            judged.verdict = self.desk.chain.allow(judged.verdict, judged.test, self.desk.shared);
            return Outgoing::new(&Message::Judged(judged));
        }
        let window = self.desk.shared.reports.pop()?;
        Outgoing::new(&Message::Report(window.report()))
    }

    /// The sequence of the parameters in force, once, for the interrupt; none without one that the rig can do.
    pub fn take_sequence(&mut self) -> Option<Sequence> {
        self.desk.sequence.take()
    }

    /// What the sequence does, where there is one.
    pub fn state(&self) -> Option<State> {
        self.desk.profile.map(|_| self.desk.shared.state())
    }

    /// The verdict on the test under way: no pass where the measuring chain was not plausible.
    pub fn verdict(&mut self) -> Verdict {
        self.desk.verdict()
    }
}

/// A kind of block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// A motor's parameters.
    Parameters,
    /// What belongs to the rig.
    Rig,
}

impl Kind {
    /// Its slots on a board.
    fn slots<B: Board>(self) -> Slots {
        const {
            let (slots, rig) = (B::HARDWARE.slots, B::HARDWARE.rig);
            assert!(
                slots.size >= MAX_BLOCK && slots.size.is_multiple_of(B::Flash::ERASE_SIZE),
                "a slot is whole pages"
            );
            assert!(rig.size >= MAX_BLOCK && rig.size.is_multiple_of(B::Flash::ERASE_SIZE), "a slot is whole pages");
            let (low, high) = if rig.address < slots.address { (rig, slots) } else { (slots, rig) };
            assert!(low.address + (SLOTS * low.size) as u32 <= high.address, "slots of rig and parameters overlap");
            assert!(B::HARDWARE.full_scale < 1 << packing::BITS, "the link has no room for such counts");
        }
        match self {
            Self::Parameters => B::HARDWARE.slots,
            Self::Rig => B::HARDWARE.rig,
        }
    }

    fn store<B: Board>(self, board: &mut B) -> Store<&mut B::Flash> {
        let Slots { address, size } = self.slots::<B>();
        Store::new(board.flash(), address - B::FLASH, size)
    }

    /// Whether a board can use a payload.
    fn check<B: Board>(self, payload: &[u8]) -> Result<(), Error> {
        match self {
            Self::Parameters => decode::<B>(payload).map(|_| ()),
            Self::Rig if payload.len() > MAX_RIG => Err(Error::TooLong),
            Self::Rig => Rig::decode(payload).map(|_| ()),
        }
    }
}

fn described(slot: Slot, Header { length, sequence, .. }: Header, payload: &[u8]) -> InForce {
    let crc = payload_crc(payload.get(..usize::from(length)).unwrap_or_default());
    InForce { slot: slot as u8, sequence, length, crc }
}

/// The parameters of a payload, if a board can run with them.
fn decode<B: Board>(payload: &[u8]) -> Result<Settings, Error> {
    let settings = section::decode(payload)?;
    if settings.suits(&B::HARDWARE) { Ok(settings) } else { Err(Error::SampleRate) }
}

/// What runs with a payload, and with the rig's own block where it has one. By itself, so that what it takes of the
/// stack is free again afterwards.
#[inline(never)]
fn active<B: Board>(payload: &[u8], rig: Option<Rig>) -> Result<(Active, Option<Sequence>), Error> {
    let mut settings = decode::<B>(payload)?;
    if rig.is_some() {
        settings.rig = rig;
    }
    // A rig that cannot do a motor's sequence can measure it all the same.
    let sequence = settings.sequence(&B::HARDWARE).ok().flatten();
    Ok((settings.build()?, sequence))
}

impl Desk<'_> {
    #[inline(never)]
    fn start<B: Board>(&mut self, board: &mut B) -> Option<Active> {
        let kept = board.kept();
        // The watchdog has a fault of its own.
        if kept.in_a_row > 0 && kept.incident.as_ref().is_some_and(|incident| incident.cause != Cause::Watchdog) {
            self.shared.raise(Fault::Incident);
        }
        let rig = self.start_rig(board);
        let Some((slot, header)) = Kind::Parameters.store(board).load(&mut self.payload) else {
            self.shared.raise(Fault::NotConfigured);
            return None;
        };
        self.in_force = Some(described(slot, header, &self.payload));
        if kept.holds_back() {
            self.shared.raise(Fault::HeldBack);
            return None;
        }
        let payload = self.payload.get(..usize::from(header.length))?;
        match rig.and_then(|rig| active::<B>(payload, rig)) {
            Ok((active, sequence)) => {
                self.mode = Mode::Running;
                self.profile = sequence.as_ref().map(Sequence::samples);
                self.sequence = sequence;
                self.judges = active.detector.is_some();
                Some(active)
            }
            Err(_) => {
                self.shared.raise(Fault::ParametersRefused);
                None
            }
        }
    }

    /// What belongs to the rig, if it has a block of its own; one that cannot be used is an error, since no motor is
    /// run with another rig's calibration. The room for the motor's payload is free meanwhile.
    fn start_rig<B: Board>(&mut self, board: &mut B) -> Result<Option<Rig>, Error> {
        let Some((slot, header)) = Kind::Rig.store(board).load(&mut self.payload) else { return Ok(None) };
        self.rig_in_force = Some(described(slot, header, &self.payload));
        let payload = self.payload.get(..usize::from(header.length)).unwrap_or_default();
        self.rig.extend_from_slice(payload).map_err(|_| Error::TooLong)?;
        Rig::decode(payload).map(Some)
    }

    fn answer<B: Board>(&mut self, number: u8, request: Request, board: &mut B) -> Option<Outgoing> {
        if self.is_busy() && self.disturbs_a_run(&request) {
            return Outgoing::new(&Message::Reply { number, reply: Reply::Refused(Refusal::Running) });
        }
        let reply = match request {
            Request::Hello => Reply::Identity(Identity {
                protocol: PROTOCOL,
                fingerprint: FINGERPRINT,
                firmware: FIRMWARE,
                board: B::HARDWARE.board,
                chip: board.chip(),
                sample_rate_hz: B::HARDWARE.sample_rate_hz,
                skew_s: B::HARDWARE.skew_s,
                build: board.build(),
            }),
            Request::Status => Reply::Status(Status {
                mode: self.mode,
                in_force: self.in_force,
                samples: self.shared.samples(),
                faults: self.shared.faults(),
                cycles: self.shared.cycles(),
                test: self.shared.test(),
                verdict: self.verdict(),
                plausible: self.is_plausible(),
                deepest_stack: board.deepest_stack(),
                rig: self.rig_in_force,
                incident: board.kept().incident,
            }),
            Request::ReadParameters { offset } => {
                let length = self.in_force.map_or(0, |block| usize::from(block.length));
                let rest = self.payload.get(usize::from(offset)..length).unwrap_or_default();
                Reply::Parameters(rest.get(..CHUNK).unwrap_or(rest))
            }
            Request::WriteParameters { offset, data } => self.take_bytes(offset, data),
            Request::CommitParameters { fingerprint, length, crc } => {
                self.commit(Kind::Parameters, fingerprint, length, crc, board).unwrap_or_else(Reply::Refused)
            }
            Request::ReadRig => Reply::Parameters(&self.rig),
            Request::CommitRig { fingerprint, length, crc } => {
                self.commit(Kind::Rig, fingerprint, length, crc, board).unwrap_or_else(Reply::Refused)
            }
            Request::StartTelemetry { every: 1..=60_000 } if self.mode == Mode::Safe => {
                Reply::Refused(Refusal::NotConfigured)
            }
            Request::StartTelemetry { every: every @ 1..=60_000 } => self
                .if_carried::<B>(Load { every: every.into(), ..self.load() }, |desk| desk.shared.report(every.into())),
            Request::StartTelemetry { .. } => Reply::Refused(Refusal::Range),
            Request::BeginTest { .. } if self.mode == Mode::Safe => Reply::Refused(Refusal::NotConfigured),
            Request::BeginTest { .. } if !self.judges => Reply::Refused(Refusal::NoLimits),
            Request::BeginTest { test } => self.if_carried::<B>(Load { follow: true, ..self.load() }, |desk| {
                if desk.shared.test() != test {
                    desk.shared.begin_test(test);
                    desk.chain.begin(test, desk.shared);
                }
                desk.shared.follow(true);
            }),
            Request::StartCapture => self.if_carried::<B>(Load { capture: true, ..self.load() }, |desk| {
                if !desk.shared.capturing() {
                    desk.drop_samples();
                    desk.shared.capture(true);
                }
            }),
            Request::Stop => {
                self.shared.capture(false);
                self.shared.report(0);
                self.shared.follow(false);
                self.drop_samples();
                Reply::Done
            }
            Request::ClearFaults => {
                // What has come up in the test under way stays.
                self.chain.is_plausible(self.shared);
                self.shared.clear();
                self.chain.cleared();
                board.forget();
                Reply::Done
            }
            Request::Restart => Reply::Done,
            Request::RunState => match self.profile {
                Some(length) => Reply::Run(self.shared.run(length)),
                None => Reply::Refused(Refusal::NoSequence),
            },
            Request::StartRun { run } => self.start_run(run),
            Request::AbortRun => self.wish(Wishes { abort: true, ..Wishes::default() }),
            Request::Acknowledge => self.wish(Wishes { acknowledge: true, ..Wishes::default() }),
        };
        let mut outgoing = Outgoing::new(&Message::Reply { number, reply })?;
        outgoing.restart = request == Request::Restart;
        Some(outgoing)
    }

    /// A run begins a test of its own, in the interrupt.
    fn follow_runs(&mut self) {
        let test = self.shared.test();
        if self.profile.is_some() && !self.chain.is_of(test) {
            self.chain.begin(test, self.shared);
        }
    }

    fn is_plausible(&mut self) -> bool {
        self.follow_runs();
        self.chain.is_plausible(self.shared)
    }

    fn is_busy(&self) -> bool {
        self.profile.is_some() && self.shared.state().is_busy()
    }

    /// Whether a request would end a run, or take from it what its verdict rests on.
    fn disturbs_a_run(&self, request: &Request) -> bool {
        match request {
            Request::BeginTest { test } => *test != self.shared.test(),
            Request::CommitParameters { .. } | Request::CommitRig { .. } => true,
            Request::ClearFaults | Request::Restart => true,
            _ => false,
        }
    }

    fn start_run(&mut self, run: u32) -> Reply<'static> {
        let runs = self.shared.runs();
        if self.profile.is_some() && run == runs {
            return Reply::Done;
        }
        match self.shared.state() {
            _ if self.profile.is_none() => Reply::Refused(Refusal::NoSequence),
            State::Stopped(_) => Reply::Refused(Refusal::Stopped),
            state if state.is_busy() => Reply::Refused(Refusal::Running),
            _ if run != runs.wrapping_add(1) => Reply::Refused(Refusal::Range),
            _ => self.wish(Wishes { start: true, ..Wishes::default() }),
        }
    }

    fn wish(&mut self, wishes: Wishes) -> Reply<'static> {
        if self.profile.is_none() {
            return Reply::Refused(Refusal::NoSequence);
        }
        self.shared.wish(wishes);
        Reply::Done
    }

    fn verdict(&mut self) -> Verdict {
        self.follow_runs();
        self.chain.allow(self.shared.verdict(), self.shared.test(), self.shared)
    }

    /// What is sent unasked.
    fn load(&self) -> Load {
        Load { every: self.shared.report_every(), capture: self.shared.capturing(), follow: self.shared.following() }
    }

    /// Does something that makes the line carry so much, if it does.
    fn if_carried<B: Board>(&mut self, load: Load, work: impl FnOnce(&mut Self)) -> Reply<'static> {
        if !load.fits(B::HARDWARE.sample_rate_hz) {
            return Reply::Refused(Refusal::Line);
        }
        work(self);
        Reply::Done
    }

    fn take_bytes(&mut self, offset: u16, data: &[u8]) -> Reply<'static> {
        let start = usize::from(offset);
        match self.waiting.get_mut(start..start + data.len()) {
            Some(place) if data.len() <= CHUNK => {
                place.copy_from_slice(data);
                Reply::Done
            }
            _ => Reply::Refused(Refusal::Range),
        }
    }

    /// The only way to the flash. A page takes some 22 ms to be erased, in which the thread stands still and the
    /// interrupt goes on; during a capture the queue would be full.
    fn commit<B: Board>(
        &mut self,
        kind: Kind,
        fingerprint: u32,
        length: u16,
        crc: u32,
        board: &mut B,
    ) -> Result<Reply<'static>, Refusal> {
        if self.shared.capturing() {
            return Err(Refusal::Capturing);
        }
        if fingerprint != FINGERPRINT {
            return Err(Refusal::OtherLayout);
        }
        let payload = self.waiting.get(..usize::from(length)).ok_or(Refusal::Range)?;
        if payload_crc(payload) != crc {
            return Err(Refusal::OtherBytes);
        }
        kind.check::<B>(payload).map_err(|_| Refusal::Parameters)?;
        let mut store = kind.store(board);
        // What is in force stays so until the next start, and so does its copy.
        let mut scratch = [0; MAX_PAYLOAD];
        // A repetition, because the host did not get the answer, writes nothing.
        let present = store.load(&mut scratch).filter(|_| scratch.starts_with(payload));
        let (slot, header) = match present {
            Some((slot, header)) if header.length == length => (slot, header),
            _ => store.write(payload, &mut scratch).map_err(|_| {
                self.shared.raise(Fault::FlashWrite);
                Refusal::Fault(Fault::FlashWrite)
            })?,
        };
        Ok(Reply::Committed(InForce { slot: slot as u8, sequence: header.sequence, length, crc }))
    }

    fn drop_samples(&mut self) {
        while self.shared.raw.pop().is_some() {}
        self.next = None;
    }

    fn samples(&mut self) -> Option<Outgoing> {
        // One may have been taken from the queue already.
        if self.shared.raw.len() < packing::SAMPLES {
            return None;
        }
        let mut counts = heapless::Vec::<Counts, { packing::SAMPLES }>::new();
        let first = self.next.take().or_else(|| self.shared.raw.pop())?;
        let _ = counts.push(first.counts);
        while !counts.is_full() {
            let Some(raw) = self.shared.raw.pop() else { break };
            if raw.number != first.number.wrapping_add(counts.len() as u32) {
                self.next = Some(raw);
                break;
            }
            let _ = counts.push(raw.counts);
        }
        let packed = packing::pack(&counts);
        let samples = Samples { first: first.number, count: counts.len() as u8, packed: &packed };
        Outgoing::new(&Message::Samples(samples))
    }
}
