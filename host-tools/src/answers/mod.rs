//! What is asked of recordings and models, and what is answered: the work behind a command, a script or a page.
//!
//! Each question is a file with a `Request`, its `Answer`, and that answer as the JSON object of the interface. Nothing
//! here reads or writes a file, knows of a terminal, or holds a state between two questions: whoever asks gives the
//! recordings and a [`Context`](crate::context::Context), and takes the answer.
//!
//! ```
//! use greyrig_host::answers::{Given, identify};
//! use greyrig_host::{check::Purpose, context::Context, model::Kind, rig::Setup};
//!
//! let recorded = Setup::new(Kind::PmDc).seconds(4.0).seed(1).run()?.recording;
//! let request = identify::Request::default();
//! let answer = request.answer(request.question(vec![recorded]), &Context::quiet())?;
//! assert_eq!(answer.identification.model.kind, Kind::PmDc, "as the recording tells");
//! assert_eq!(answer.as_json(None)?["command"], "identify");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod add;
pub mod calibrate;
pub mod check;
pub mod compare;
pub mod diagnose;
mod given;
pub mod identify;
pub mod monitor;
pub mod next;
pub mod plan;
pub mod predict;
pub mod simulate;
pub mod train;

pub use given::Given;

use serde::Serialize;
use serde_json::{Map, Value};

use crate::error::{Error, Result};

/// One JSON object, with the fields that every answer shares put first.
///
/// # Errors
/// A body that is no JSON, which none of ours is.
pub fn object(command: &str, recordings: &[String], body: impl Serialize) -> Result<Value> {
    let mut object = Map::new();
    object.insert("schema".into(), 1.into());
    object.insert("command".into(), command.into());
    object.insert("recordings".into(), recordings.into());
    match serde_json::to_value(body) {
        Ok(Value::Object(fields)) => object.extend(fields),
        Ok(other) => {
            object.insert("result".into(), other);
        }
        Err(e) => {
            return Err(Error::usage(format!("the result cannot be written as JSON: {e}"), "report this as a bug"));
        }
    }
    Ok(Value::Object(object))
}
