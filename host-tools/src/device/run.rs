//! A run of the station, asked for and followed over the link. The board runs it by itself: without the host, too, and
//! when the link breaks.

use std::time::Duration;

use greyrig::link::message::{Reply, Request, Run};

use super::connection::{Connection, Device, Port, check_layout};
use super::error::{Error, Result};
use crate::context::Context;

/// Between two questions: the state of a run changes within seconds.
const GLANCE: Duration = Duration::from_millis(50);
/// A start is taken with the next sample; after this time it was not.
const GLANCES: u32 = 10;

/// Opens a port to a board that may have a sequence.
///
/// # Errors
/// Nobody there; firmware of another layout, which knows none.
pub fn open(port: &Port, ctx: &Context) -> Result<(Connection, Device)> {
    let (connection, device) = Connection::open(port, ctx)?;
    check_layout(&device)?;
    Ok((connection, device))
}

/// What the station does.
///
/// # Errors
/// No answer, a board without a sequence that its rig can do.
pub fn state(connection: &mut Connection) -> Result<Run> {
    connection.ask(Request::RunState, |reply| if let Reply::Run(run) = reply { Some(*run) } else { None })
}

/// Begins the next run, and gives its first state.
///
/// # Errors
/// A station that is stopped or at work, or that is stopped with the very start.
pub fn start(connection: &mut Connection, port: &Port, ctx: &Context) -> Result<Run> {
    let before = state(connection)?;
    let run = before.runs.wrapping_add(1);
    connection.tell(Request::StartRun { run })?;
    for _ in 0..GLANCES {
        let now = state(connection)?;
        if now.runs == run {
            return Ok(now);
        }
        port.clock.pause(GLANCE / 10, ctx)?;
    }
    Err(Error::NotStarted)
}

/// Follows a run to its end, and gives its last state; `tell` sees each on the way.
///
/// # Errors
/// A link that breaks, a board that has restarted, an interrupt.
pub fn follow(
    connection: &mut Connection,
    run: u32,
    port: &Port,
    ctx: &Context,
    tell: &mut dyn FnMut(&Run),
) -> Result<Run> {
    loop {
        let now = state(connection)?;
        if now.runs != run {
            return Err(Error::OtherRun);
        }
        tell(&now);
        if !now.state.is_busy() {
            return Ok(now);
        }
        port.clock.pause(GLANCE, ctx)?;
    }
}
