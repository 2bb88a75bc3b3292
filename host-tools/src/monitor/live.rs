//! A test over the link: the microcontroller judges with what is in its flash, the host shows it and records the
//! samples.
//!
//! ```text
//! look at the voltage until it is there ─► begin the test ─► periods and samples ─► time is up, or the supply is off
//! ```
//! The verdict is the microcontroller's. Its periods make the same [`Replay`] as a recording does, so that all that is
//! done with a replay can be done with a test on line.

use std::time::Duration;

use greyrig::link::message::{Judged, Message, Request, Status};

use super::replay::{Replay, Row};
use crate::context::Context;
use crate::device::capture::Capture;
use crate::device::update::reopen;
use crate::device::{Connection, Device, Error, Port, RIG, Result, Work};

/// Longest test, s.
pub const LONGEST_S: f64 = 1000.0;
/// Share of the nominal voltage from which on the supply counts as switched on.
const ON: f32 = 0.05;
/// Without voltage for so long a test without a given length is over, s.
const OVER_S: f64 = 1.0;
/// Time for the frame that the last sample is in: it takes 6.4 ms to fill.
const LAST_FRAME: Duration = Duration::from_millis(300);
/// Without a message for so long, something is wrong.
const SILENCE: Duration = Duration::from_secs(3);

/// How a test is to go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Its length, s; without, it ends when the supply has been switched off.
    pub seconds: Option<f64>,
    /// Nominal voltage, RMS, V.
    pub nominal_voltage: f64,
}

/// What happens.
#[derive(Debug, Clone, Copy)]
pub enum Event<'a> {
    /// The supply is off; its voltage is V.
    Waiting(f32),
    /// The supply is on, and the test of this number begins.
    Begun(u32),
    /// A period has been judged, at a time of the test, s.
    Period(f64, &'a Judged),
    /// The link has broken, for this reason, and is opened again.
    Broken(&'a Error),
    /// It is back; so many periods went by that the host has not seen.
    Back(u32),
}

/// A test that is over.
#[derive(Debug, Clone)]
pub struct Finished {
    /// Its periods, and its verdict.
    pub replay: Replay,
    /// Its samples.
    pub capture: Capture,
    /// Periods that the host has not seen; the microcontroller has judged them all the same.
    pub unseen: u32,
    /// How the microcontroller is.
    pub status: Status,
}

/// A test without a verdict.
#[derive(Debug)]
pub struct Early {
    /// Why it ended.
    pub error: Error,
    /// Its samples until then.
    pub capture: Capture,
}

/// Tests a motor.
///
/// # Errors
/// A microcontroller without limits, one that has restarted, a link that does not come back, an interrupt.
pub fn run(
    port: &Port,
    device: &Device,
    connection: Connection,
    plan: &Plan,
    ctx: &Context,
    tell: &mut dyn FnMut(Event),
) -> std::result::Result<Finished, Early> {
    let capture = Capture::with_room(0);
    let mut session = Session { port, device, connection, test: 0, judged: Vec::new(), capture, ctx };
    let finished = session.run(plan, tell);
    // Politeness only: the next one who asks stops it, too.
    let _ = session.connection.tell(Request::Stop);
    finished.map_err(|error| Early { error, capture: session.capture })
}

struct Session<'a> {
    port: &'a Port,
    device: &'a Device,
    connection: Connection,
    test: u32,
    judged: Vec<Judged>,
    capture: Capture,
    ctx: &'a Context,
}

impl Session<'_> {
    fn run(&mut self, plan: &Plan, tell: &mut dyn FnMut(Event)) -> Result<Finished> {
        let on = ON * plan.nominal_voltage as f32;
        self.connection.stop()?;
        self.begin()?;
        let mut last = None;
        while last.is_none_or(|voltage| voltage < on) {
            self.receive(tell)?;
            last = self.judged.drain(..).next_back().map(|j| j.period.features.voltage_rms).or(last);
            tell(Event::Waiting(last.unwrap_or(0.0)));
        }
        self.connection.tell(Request::StartCapture)?;
        self.begin()?;
        tell(Event::Begun(self.test));
        let rate = f64::from(RIG.sample_rate_hz);
        let seconds = |samples: u32| f64::from(samples) / rate;
        let mut seen_on = 0;
        loop {
            let known = self.judged.len();
            self.receive(tell)?;
            for judged in &self.judged[known..] {
                let t = judged.sample.wrapping_sub(judged.first);
                tell(Event::Period(seconds(t), judged));
                if judged.period.features.voltage_rms >= on {
                    seen_on = t;
                }
            }
            let Some(t) = self.judged.last().map(|j| j.sample.wrapping_sub(j.first)) else { continue };
            let over = match plan.seconds {
                Some(length) => seconds(t) >= length,
                None => seconds(t - seen_on) >= OVER_S || seconds(t) >= LONGEST_S,
            };
            if over {
                return self.finish();
            }
        }
    }

    /// Begins a test with a number that is not under way.
    fn begin(&mut self) -> Result<()> {
        self.test = self.connection.status()?.test.wrapping_add(1).max(1);
        self.judged.clear();
        self.connection.tell(Request::BeginTest { test: self.test })
    }

    /// Takes what has come, a period at least; opens a broken link again.
    fn receive(&mut self, tell: &mut dyn FnMut(Event)) -> Result<()> {
        let error = match self.listen() {
            Ok(()) => return Ok(()),
            Err(stop @ Error::Interrupted(_)) => return Err(stop),
            Err(error) => error,
        };
        tell(Event::Broken(&error));
        let before = self.judged.last().map(|j| j.index);
        self.connection = reopen(self.port, self.device, self.ctx)?;
        if self.connection.status()?.test != self.test {
            return Err(Error::Restarted(Work::Test));
        }
        self.connection.tell(Request::StartCapture)?;
        // The same number: the test goes on.
        self.connection.tell(Request::BeginTest { test: self.test })?;
        self.capture.reconnections += 1;
        self.listen()?;
        let now = self.judged.last().map(|j| j.index);
        let missed = before.zip(now).map_or(0, |(a, b)| b.wrapping_sub(a).saturating_sub(1));
        tell(Event::Back(missed));
        Ok(())
    }

    fn listen(&mut self) -> Result<()> {
        let Self { connection, judged, capture, test, .. } = self;
        let most = (LONGEST_S * f64::from(RIG.sample_rate_hz)) as usize;
        let came = connection.listen(SILENCE, |message| match message {
            Message::Samples(samples) => {
                capture.take(samples, most);
                None
            }
            Message::Judged(period) if period.test == *test => {
                judged.push(*period);
                Some(())
            }
            _ => None,
        })?;
        came.ok_or(Error::NothingComes)
    }

    /// The samples of the last period may be in a frame that is not full yet.
    fn wait_for_samples(&mut self) -> Result<()> {
        let Some(end) = self.judged.last().map(|j| j.sample) else { return Ok(()) };
        let Self { connection, capture, .. } = self;
        connection.listen(LAST_FRAME, |message| {
            if let Message::Samples(samples) = message {
                capture.take(samples, usize::MAX);
            }
            let next = capture.first.wrapping_add(capture.samples.len() as u32);
            (next.wrapping_sub(end).cast_signed() >= 0).then_some(())
        })?;
        Ok(())
    }

    fn finish(&mut self) -> Result<Finished> {
        self.wait_for_samples()?;
        let status = self.connection.status()?;
        if status.test != self.test {
            return Err(Error::OtherTest);
        }
        let (Some(first), Some(last)) = (self.judged.first(), self.judged.last()) else {
            return Err(Error::NoPeriod);
        };
        let unseen = (last.index + 1).saturating_sub(self.judged.len() as u32);
        // The status is newer than the last period that was counted in; what has called until then counts.
        let verdict = if unseen > 0 { status.verdict } else { last.verdict };
        let count = last.sample.wrapping_sub(first.first) as usize;
        Ok(Finished {
            replay: Replay { rows: rows(&self.judged), verdict, temperature: None },
            capture: self.capture.window(first.first, count),
            unseen,
            status,
        })
    }
}

/// The microcontroller's periods as those of a replay.
fn rows(judged: &[Judged]) -> Vec<Row> {
    judged
        .iter()
        .map(|j| Row {
            t_s: f64::from(j.sample.wrapping_sub(j.first)) / f64::from(RIG.sample_rate_hz),
            features: j.period.features,
            jumps: j.period.jumps,
            judged: j.period.judged,
            alarm: j.period.alarm,
        })
        .collect()
}
