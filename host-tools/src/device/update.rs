//! Parameters over the link: sent, written, restarted, read back.

use std::time::Duration;

use greyrig::link::message::{CHUNK, InForce, Mode, Reply, Request};
use greyrig::parameters::FINGERPRINT;
use greyrig::parameters::block::payload_crc;

use super::connection::{Connection, Device, Port, check_layout};
use crate::error::{Error, Result};
use crate::output;

/// A microcontroller that has not come back after this time will not.
const RESTART: Duration = Duration::from_secs(10);

/// Time to start in: what is asked meanwhile is lost, and asked again only after a while.
const START: Duration = Duration::from_millis(20);

/// Writes a payload, restarts the microcontroller, and checks that it runs with exactly these bytes.
///
/// # Errors
/// A refusal, a link that has gone, other bytes than were sent.
pub fn write(port: &Port, payload: &[u8]) -> Result<(Device, InForce)> {
    let (mut connection, device) = Connection::open(port)?;
    check_layout(&device)?;
    connection.stop()?;
    let bar = output::progress("writing", payload.len() as u64);
    for (n, data) in payload.chunks(CHUNK).enumerate() {
        connection.tell(Request::WriteParameters { offset: (n * CHUNK) as u16, data })?;
        bar.inc(data.len() as u64);
    }
    bar.finish_and_clear();
    let request =
        Request::CommitParameters { fingerprint: FINGERPRINT, length: payload.len() as u16, crc: payload_crc(payload) };
    let committed =
        connection.ask(request, |reply| if let Reply::Committed(block) = reply { Some(*block) } else { None })?;
    connection.tell(Request::Restart)?;
    drop(connection);
    port.clock.pause(START)?;

    let mut connection = reopen(port, &device)?;
    let status = connection.status()?;
    let back = connection.read_parameters()?;
    if status.in_force != Some(committed) || status.mode != Mode::Running || back != payload {
        return Err(Error::link(
            "the microcontroller does not run with the parameters that were written",
            "write them again; if that fails, the flash is worn or protected",
        ));
    }
    Ok((device, committed))
}

/// The same microcontroller after a restart, or after its plug was pulled.
///
/// # Errors
/// Nobody, or another one, comes back in time; Ctrl-C.
pub fn reopen(port: &Port, device: &Device) -> Result<Connection> {
    let mut wait = port.clock.wait(RESTART)?;
    loop {
        match Connection::open(port) {
            Ok((connection, again)) if again.chip == device.chip => return Ok(connection),
            Ok((_, again)) => {
                return Err(Error::link(
                    format!(
                        "another microcontroller answers on {} ({}, before {})",
                        port.name, again.chip, device.chip
                    ),
                    "connect the first one again",
                ));
            }
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(error) if wait.is_over()? => return Err(error),
            Err(_) => std::thread::sleep(Duration::from_millis(100)),
        }
        output::check_interrupt()?;
    }
}
