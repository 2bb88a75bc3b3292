//! The microcontroller, seen from the host: the link, its parameters, and recordings from it.

pub mod capture;
pub mod clock;
pub mod connection;
mod error;
pub mod image;
pub mod line;
pub mod parameters;
pub mod ports;
#[cfg(feature = "probe")]
pub mod probe;
pub mod recorded;
pub mod rig;
pub mod run;
pub mod sequence;
pub mod update;

use greyrig::hardware::{Hardware, NUCLEO_G474RE};

pub use connection::{Connection, Device, Patience, Port};
pub use error::{Error, Result, Work};

/// The hardware of the rigs that this program makes parameters for and records from.
pub const RIG: Hardware = NUCLEO_G474RE;
