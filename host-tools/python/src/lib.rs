//! The library in Python: what its package `greyrig` stands on.
//!
//! Everything here is thin: arguments in, one question of `greyrig_host::answers`, and its answer out, as the JSON of
//! the interface, as columns and as a report. The package beside it (`greyrig/`) gives them types and names.
//!
//! - [`work`]: what takes time runs on threads of its own without the interpreter's lock, tells how far it is, and
//!   stops for Ctrl-C.
//! - [`table`]: columns in memory that numpy and Arrow read without a copy.
//! - [`recording`], [`model`], [`answers`]: what users hold in their hands.
//! - [`fleet`]: batches of a store, for engines that spread work.
//! - [`trouble`]: errors as exceptions.

use pyo3::prelude::*;

pub mod answers;
pub mod fleet;
pub mod model;
pub mod options;
pub mod recording;
pub mod table;
pub mod trouble;
pub mod work;

/// What `greyrig` stands on; users import that.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::answers::{
        Answer, add, calibrate, check, compare, diagnose, identify, monitor, predict, simulate, train,
    };
    #[pymodule_export]
    use super::fleet::{fleet_run, no_recordings};
    #[pymodule_export]
    use super::model::Model;
    #[pymodule_export]
    use super::options::write_text;
    #[pymodule_export]
    use super::recording::Recording;
    #[pymodule_export]
    use super::table::{Column, Table};
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::trouble::keep_decoders_quiet();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
