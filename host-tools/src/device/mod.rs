//! The microcontroller, seen from the host: the link, its parameters, and recordings from it.

pub mod capture;
pub mod clock;
pub mod connection;
mod error;
pub mod image;
pub mod line;
pub mod parameters;
#[cfg(feature = "probe")]
pub mod probe;
pub mod recorded;
pub mod update;

pub use connection::{Connection, Device, Port};
pub use error::{Error, Result, Work};
