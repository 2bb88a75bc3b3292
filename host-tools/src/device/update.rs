//! Parameters over the link: sent, written, restarted, read back.

use std::time::Duration;

use greyrig::link::message::{CHUNK, InForce, Mode, Reply, Request, Status};
use greyrig::parameters::FINGERPRINT;
use greyrig::parameters::block::payload_crc;

use super::connection::{Connection, Device, Port, check_layout};
use super::error::{Error, Result};
use crate::context::Context;

/// A microcontroller that has not come back after this time will not.
const RESTART: Duration = Duration::from_secs(10);

/// Time to start in: what is asked meanwhile is lost, and asked again only after a while.
const START: Duration = Duration::from_millis(20);

/// Writes a motor's payload, restarts the microcontroller, and checks that it runs with exactly these bytes.
///
/// # Errors
/// A refusal, a link that has gone, other bytes than were sent.
pub fn write(port: &Port, payload: &[u8], ctx: &Context) -> Result<(Device, InForce)> {
    let (fingerprint, length, crc) = (FINGERPRINT, payload.len() as u16, payload_crc(payload));
    let commit = Request::CommitParameters { fingerprint, length, crc };
    let in_force = |status: &Status| status.in_force.filter(|_| status.mode == Mode::Running);
    write_block(port, payload, commit, &in_force, &Connection::read_parameters, ctx)
}

/// Writes a rig's payload, likewise; the motor's parameters stay as they are.
///
/// # Errors
/// As [`write()`].
pub fn write_rig(port: &Port, payload: &[u8], ctx: &Context) -> Result<(Device, InForce)> {
    let (fingerprint, length, crc) = (FINGERPRINT, payload.len() as u16, payload_crc(payload));
    let commit = Request::CommitRig { fingerprint, length, crc };
    write_block(port, payload, commit, &|status| status.rig, &Connection::read_rig, ctx)
}

fn write_block(
    port: &Port,
    payload: &[u8],
    commit: Request,
    in_force: &dyn Fn(&Status) -> Option<InForce>,
    read: &dyn Fn(&mut Connection) -> Result<Vec<u8>>,
    ctx: &Context,
) -> Result<(Device, InForce)> {
    let (mut connection, device) = Connection::open(port, ctx)?;
    check_layout(&device)?;
    connection.stop()?;
    let steps = ctx.steps("writing", payload.len().div_ceil(CHUNK) as u64);
    for (n, data) in payload.chunks(CHUNK).enumerate() {
        connection.tell(Request::WriteParameters { offset: (n * CHUNK) as u16, data })?;
        steps.next();
    }
    let committed =
        connection.ask(commit, |reply| if let Reply::Committed(block) = reply { Some(*block) } else { None })?;
    connection.tell(Request::Restart)?;
    drop(connection);
    port.clock.pause(START, ctx)?;

    let mut connection = reopen(port, &device, ctx)?;
    let status = connection.status()?;
    let back = read(&mut connection)?;
    if in_force(&status) != Some(committed) || back != payload {
        return Err(Error::NotTaken);
    }
    Ok((device, committed))
}

/// The same microcontroller after a restart, or after its plug was pulled.
///
/// # Errors
/// Nobody, or another one, comes back in time; an interrupt.
pub fn reopen(port: &Port, device: &Device, ctx: &Context) -> Result<Connection> {
    let mut wait = port.clock.wait(RESTART)?;
    loop {
        match Connection::open(port, ctx) {
            Ok((connection, again)) if again.chip == device.chip => return Ok(connection),
            Ok((_, again)) => {
                let (port, before) = (port.name.clone(), device.chip.clone());
                return Err(Error::OtherChip { port, now: again.chip, before });
            }
            Err(stop @ Error::Interrupted(_)) => return Err(stop),
            Err(error) if wait.is_over()? => return Err(error),
            Err(_) => std::thread::sleep(Duration::from_millis(100)),
        }
        ctx.check()?;
    }
}
