//! What goes wrong, as exceptions with the sentences of the command line.

use greyrig_host::error::Error;
use greyrig_host::recording::is_decoding;
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;

/// The exception of an error: those of `greyrig._errors`, or `KeyboardInterrupt` where the user has stopped the work.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let class = match error {
        Error::Input { .. } => "InputError",
        Error::Insufficient { .. } => "InsufficientError",
        Error::Usage { .. } => "UsageError",
        Error::Io { .. } => "FileError",
        Error::Link { .. } => "LinkError",
        Error::Interrupted => return PyKeyboardInterrupt::new_err(error.to_string()),
    };
    let made = py.import("greyrig._errors").and_then(|errors| errors.getattr(class)).and_then(|class| {
        class.call1((error.to_string(), error.place(), error.what(), error.remedy(), error.exit_code()))
    });
    made.map_or_else(|error| error, PyErr::from_value)
}

/// The same of a result.
///
/// # Errors
/// Its error.
pub fn raised<T>(py: Python<'_>, result: Result<T, Error>) -> PyResult<T> {
    result.map_err(|error| exception(py, &error))
}

/// A panic, which is a fault of ours.
pub fn fault(what: &(dyn std::any::Any + Send)) -> PyErr {
    let said = what.downcast_ref::<String>().map(String::as_str).or(what.downcast_ref::<&str>().copied());
    PyRuntimeError::new_err(format!("greyrig has a fault, please report it: {}", said.unwrap_or("unknown")))
}

/// Keeps the messages of decoders to themselves that give up on a damaged file: the exception says it. The hook is that
/// of this module alone, which links a standard library of its own.
pub fn keep_decoders_quiet() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if !is_decoding() {
            usual(info);
        }
    }));
}
