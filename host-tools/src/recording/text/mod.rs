//! Tables in text: CSV and its relatives, as scopes, loggers, spreadsheets and data-frame libraries write them.
//!
//! The first lines decide on the dialect (separator, decimal sign, preamble, header, row of units); the rest is read as
//! a stream, one line at a time.

mod body;
mod cell;
mod dialect;
mod lines;

use std::path::Path;

use super::table::Table;
use crate::context::Context;
use crate::error::Result;
use body::Body;
use dialect::Dialect;
use lines::Lines;

/// Lines that are looked at before the dialect is decided.
const SNIFFED_LINES: usize = 400;

/// Reads a text table.
///
/// # Errors
/// No header, a row with another number of fields, a cell that is no number: with line and column (the column counts
/// the fields of the row, from one).
pub fn read(path: &Path, gzip: bool, ctx: &Context) -> Result<Table> {
    let mut lines = Lines::open(path, gzip)?;
    let mut window: Vec<(u32, String)> = Vec::new();
    while window.len() < SNIFFED_LINES {
        match lines.next()? {
            Some(line) => window.push(line),
            None => break,
        }
    }
    let dialect = Dialect::sniff(path, &window)?;
    Body::new(path, dialect, &window).read(window, lines, ctx)
}
