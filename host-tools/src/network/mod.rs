//! A first-order Takagi–Sugeno network (ANFIS) of any size: its parameters, its output, and its file. What trains it is
//! [`crate::anfis`], what evaluates it on the microcontroller [`greyrig::anfis`].

mod file;
mod net;

pub use file::{FORMAT, File, FiringName, Input, Rule, ShapeName, Training};
pub use net::{Net, Scale};
