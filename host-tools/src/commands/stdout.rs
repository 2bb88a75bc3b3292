//! What goes to stdout: lines for people, or one JSON object.

use std::io::Write;

use crate::error::{Error, Result};

/// Prints one JSON object on stdout, with the fields that every command shares put first.
pub fn print_json(command: &str, recordings: &[String], body: impl serde::Serialize) -> Result<()> {
    let mut object = serde_json::Map::new();
    object.insert("schema".into(), 1.into());
    object.insert("command".into(), command.into());
    object.insert("recordings".into(), recordings.into());
    match serde_json::to_value(body) {
        Ok(serde_json::Value::Object(fields)) => object.extend(fields),
        Ok(other) => {
            object.insert("result".into(), other);
        }
        Err(e) => {
            return Err(Error::usage(format!("the result cannot be written as JSON: {e}"), "report this as a bug"));
        }
    }
    print_line(&serde_json::Value::Object(object).to_string())
}

/// Prints a line on stdout; a reader that has gone away (`| head`) is not an error.
pub fn print_line(text: &str) -> Result<()> {
    match writeln!(std::io::stdout().lock(), "{text}") {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::io("standard output", e)),
        _ => Ok(()),
    }
}
