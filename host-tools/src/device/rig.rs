//! What belongs to a rig and not to a motor type: its name and its channels' calibration.

use greyrig::link::message::{Request, Status};
use greyrig::parameters::{Settings, section};

use super::connection::{Connection, Device, Port, check_layout};
use super::error::Result;
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
    Ok(Rig { device, status, settings })
}

/// Has a rig forget its faults and the longest of its ticks.
///
/// # Errors
/// As [`read`].
pub fn clear_faults(port: &Port, ctx: &Context) -> Result<()> {
    let (mut connection, _) = Connection::open(port, ctx)?;
    connection.tell(Request::ClearFaults)
}
