//! What belongs to a rig and not to a motor type: its name and its channels' calibration.

use greyrig::link::message::{Request, Status};
use greyrig::parameters::{self, Settings, section};

use super::connection::{Connection, Device, Port, check_layout};
use super::error::{Error, Result};
use crate::context::Context;

/// A rig, as it answers.
#[derive(Debug)]
pub struct Rig {
    /// Who it is.
    pub device: Device,
    /// How it is.
    pub status: Status,
    /// The parameters that it runs with; none in safe mode, or where this greyrig cannot read them.
    pub settings: Option<Settings>,
    /// Its name and calibration; none where it has none, and runs with the usual ranges.
    pub rig: Option<parameters::Rig>,
}

/// What a rig has of name and calibration: its own block, or what a motor's block of before holds of them.
///
/// # Errors
/// No answer, a block that this greyrig cannot read.
pub fn of(connection: &mut Connection, settings: Option<&Settings>) -> Result<Option<parameters::Rig>> {
    let payload = connection.read_rig()?;
    if payload.is_empty() {
        return Ok(settings.and_then(|settings| settings.rig.clone()));
    }
    parameters::Rig::decode(&payload).map(Some).map_err(Error::UnreadableRig)
}

/// Asks a rig what it has and how it is.
///
/// # Errors
/// Nobody who answers, another layout of parameters, an interrupt.
pub fn read(port: &Port, ctx: &Context) -> Result<Rig> {
    let (mut connection, device) = Connection::open(port, ctx)?;
    check_layout(&device)?;
    let status = connection.status()?;
    let settings = section::decode(&connection.read_parameters()?).ok();
    let rig = of(&mut connection, settings.as_ref())?;
    Ok(Rig { device, status, settings, rig })
}

/// Has a rig forget its faults and the longest of its ticks.
///
/// # Errors
/// As [`read`].
pub fn clear_faults(port: &Port, ctx: &Context) -> Result<()> {
    let (mut connection, _) = Connection::open(port, ctx)?;
    connection.tell(Request::ClearFaults)
}
