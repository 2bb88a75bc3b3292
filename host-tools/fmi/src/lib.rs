//! The library in a functional mock-up unit (FMU): a motor's model behind the Functional Mock-up Interface, versions
//! 3.0 and 2.0, for co-simulation.
//!
//! ```text
//! model.toml ─ greyrig export ─► unit.fmu ┬─ modelDescription.xml    variables, units, start values
//!                                         ├─ binaries/…              this library
//!                                         └─ resources/motor.bin     the block that the microcontroller gets, too
//! ```
//! The model is that of the core in `f32`, as on the microcontroller: the same stepper, effects, terms and learned
//! correction, from the same block of parameters. Variables have the numbers of [`greyrig::exchange`].
//!
//! [`instance`] is the model behind the interface, [`resources`] what it is read from, [`importer`] the memory and the
//! log of the simulator, [`fmi3`] and [`fmi2`] the functions that a simulator calls.
//!
//! Sources: Modelica Association, Functional Mock-up Interface Specification, versions 3.0.2 and 2.0.5.

pub mod fmi2;
pub mod fmi3;
pub mod importer;
pub mod instance;
pub mod resources;
