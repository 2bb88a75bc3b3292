//! Training tables in text: a line of names, then rows of numbers, `x1,…,xn,y`.
//!
//! The target is the column `y`, or the last one where none has that name. Lines that begin with `#` are skipped. Rows
//! are read one after the other, so a file may be larger than the memory.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use csv::{ByteRecord, ReaderBuilder};

use super::table::{Builder, Table};
use crate::context::Context;
use crate::error::{Error, Place, Result};

/// A table and the names of its columns.
#[derive(Debug)]
pub struct Named {
    /// The rows.
    pub table: Table,
    /// Names of the inputs, in order.
    pub inputs: Vec<String>,
    /// Name of the target.
    pub target: String,
}

/// Rows between two looks at the keyboard.
const LOOK_EVERY: u64 = 1 << 16;

/// Reads a table.
///
/// # Errors
/// No header, a row with another number of fields, a cell that is no finite number: with line and column (the column
/// counts the fields of the row, from one).
pub fn read(path: &Path, ctx: &Context) -> Result<Named> {
    let open = || File::open(path).map(|f| BufReader::with_capacity(1 << 18, f)).map_err(|e| Error::io(path, e));
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .delimiter(separator(path, open()?)?)
        .from_reader(open()?);
    let mut record = ByteRecord::new();
    let next = |reader: &mut csv::Reader<BufReader<File>>, record: &mut ByteRecord| {
        reader.read_byte_record(record).map_err(|e| unreadable(path, e))
    };
    let hint = "begin with a line of names, such as x1,x2,y, then rows of numbers";
    if !next(&mut reader, &mut record)? {
        return Err(Error::input(Place::file(path), "the file is empty", hint));
    }
    let header = line(&record);
    let mut names: Vec<String> = record.iter().map(|c| String::from_utf8_lossy(c.trim_ascii()).into_owned()).collect();
    // The mark that some programs put before UTF-8.
    names[0] = names[0].trim_start_matches('\u{feff}').to_owned();
    if names.iter().all(|n| n.parse::<f64>().is_ok()) {
        return Err(Error::input(Place::at(path, header, 0), "there is no header: the first row holds numbers", hint));
    }
    if names.len() < 2 {
        return Err(Error::input(Place::at(path, header, 0), "there is one column only", hint));
    }
    let target = names.iter().position(|n| n == "y").unwrap_or(names.len() - 1);
    let mut builder = Builder::new(names.len() - 1);
    let mut values = Vec::with_capacity(names.len());
    let mut rows: u64 = 0;
    while next(&mut reader, &mut record)? {
        if record.len() != names.len() {
            return Err(Error::input(
                Place::at(path, line(&record), record.len().min(names.len()) + 1),
                format!("the row has {} fields, the header {}", record.len(), names.len()),
                "give every row one field for each name",
            ));
        }
        values.clear();
        for (k, cell) in record.iter().enumerate() {
            let cell = cell.trim_ascii();
            let value = std::str::from_utf8(cell).ok().and_then(|c| c.parse::<f64>().ok());
            let Some(value) = value.filter(|v| v.is_finite()) else {
                let text: String = String::from_utf8_lossy(cell).chars().take(30).collect();
                let what = if text.is_empty() { "is missing".into() } else { format!("'{text}' is no finite number") };
                return Err(Error::input(
                    Place::at(path, line(&record), k + 1),
                    format!("column {}: {}", names[k], if text.is_empty() { format!("a value {what}") } else { what }),
                    "correct the value or leave the row out",
                ));
            };
            values.push(value);
        }
        let y = values.remove(target);
        builder.push(&values, y)?;
        rows += 1;
        if rows.is_multiple_of(LOOK_EVERY) {
            ctx.check()?;
        }
    }
    if rows == 0 {
        return Err(Error::input(Place::at(path, header, 0), "there is a header but no row", "append rows of numbers"));
    }
    let target = names.remove(target);
    Ok(Named { table: builder.finish()?, inputs: names, target })
}

/// The separator of the first line that is no comment.
fn separator(path: &Path, reader: impl BufRead) -> Result<u8> {
    for text in reader.lines() {
        let text = text.map_err(|e| match e.kind() {
            std::io::ErrorKind::InvalidData => {
                Error::input(Place::file(path), "the content is not text", "convert the table to CSV first")
            }
            _ => Error::io(path, e),
        })?;
        if !text.starts_with('#') && !text.trim().is_empty() {
            return Ok([b',', b';', b'\t'].into_iter().find(|s| text.as_bytes().contains(s)).unwrap_or(b','));
        }
    }
    Ok(b',')
}

fn line(record: &ByteRecord) -> usize {
    record.position().map_or(0, |p| p.line() as usize)
}

fn unreadable(path: &Path, error: csv::Error) -> Error {
    let at = error.position().map_or(0, |p| p.line() as usize);
    match error.into_kind() {
        csv::ErrorKind::Io(e) => Error::io(path, e),
        _ => Error::input(Place::at(path, at, 0), "the row cannot be read", "write it as numbers with commas between"),
    }
}
