//! The rows below the header.

use std::collections::BTreeMap;
use std::path::Path;

use super::cell::{Cell, cell, comment, split};
use super::dialect::{Dialect, LABVIEW_TIME};
use super::lines::Lines;
use crate::context::Context;
use crate::error::{Error, Place, Result};
use crate::recording::damage::too_large;
use crate::recording::names::{self, Role};
use crate::recording::table::{Column, MAX_VALUES, Table};
use crate::recording::time_axis;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Numbers,
    Stamps,
    Text,
}

/// Times as LabVIEW writes them: in one column, in one for each channel, or in none beside the interval in the header.
struct LabView {
    /// Columns that say nothing of their own.
    dropped: Vec<usize>,
    /// The first column whose times are not those of the first.
    differs: Option<usize>,
}

impl LabView {
    fn of(dialect: &Dialect, columns: &[Vec<f64>]) -> Self {
        let times: Vec<usize> = (0..columns.len()).filter(|&k| dialect.names[k] == LABVIEW_TIME).collect();
        let empty = |k: &usize| columns[*k].iter().all(|x| x.is_nan());
        if times.iter().all(empty) {
            let dropped = if dialect.metadata.contains_key("Delta_X") { times } else { Vec::new() };
            return Self { dropped, differs: None };
        }
        let others = times.get(1..).unwrap_or(&[]).to_vec();
        let differs = others
            .iter()
            .copied()
            .find(|&k| columns[k].iter().zip(&columns[times[0]]).any(|(a, b)| a != b && !(a.is_nan() && b.is_nan())));
        Self { dropped: others, differs }
    }
}

/// The rows below the header.
pub struct Body<'a> {
    path: &'a Path,
    dialect: Dialect,
    kinds: Vec<Kind>,
    columns: Vec<Vec<f64>>,
    lines: Vec<u32>,
    /// Whole seconds of the first time stamp.
    epoch: Option<i64>,
    /// A time stamp holds a date.
    dated: bool,
    values: usize,
}

impl<'a> Body<'a> {
    /// Prepares the columns, by the first lines.
    pub fn new(path: &'a Path, dialect: Dialect, window: &[(u32, String)]) -> Self {
        let width = dialect.names.len();
        let mut seen = vec![(0_usize, 0_usize, 0_usize); width];
        for (_, line) in window[dialect.first_row..].iter().filter(|(_, l)| comment(l).is_none()) {
            for (k, text) in split(line, dialect.separator).iter().enumerate().take(width) {
                match cell(text, dialect.decimal_comma) {
                    Cell::Missing => {}
                    Cell::Number(_) | Cell::Infinite => seen[k].0 += 1,
                    Cell::Stamp(..) => seen[k].1 += 1,
                    Cell::Date | Cell::Text => seen[k].2 += 1,
                }
            }
        }
        let kinds = seen
            .iter()
            .zip(&dialect.names)
            .map(|(&(numbers, stamps, texts), name)| {
                let role = names::header(name).role;
                if numbers == 0 && stamps > 0 && (texts == 0 || role == Some(Role::Time)) {
                    Kind::Stamps
                } else if numbers == 0 && texts > 0 && role.is_none() {
                    Kind::Text
                } else {
                    Kind::Numbers
                }
            })
            .collect();
        Self {
            path,
            columns: vec![Vec::new(); width],
            dialect,
            kinds,
            lines: Vec::new(),
            epoch: None,
            dated: false,
            values: 0,
        }
    }

    /// Reads to the end.
    ///
    /// # Errors
    /// A row with another number of fields, a cell that is no number: with line and column.
    pub fn read(mut self, window: Vec<(u32, String)>, mut lines: Lines<'_>, ctx: &Context) -> Result<Table> {
        let first = self.dialect.first_row;
        let (mut rows, mut incomplete) = (window.into_iter().skip(first).peekable(), None);
        loop {
            let (next, is_last_read) = match rows.next() {
                Some(next) => (Some(next), rows.peek().is_none()),
                None => (lines.next()?, true),
            };
            let Some((number, line)) = next else { break };
            if is_last_read && !lines.ended() && self.is_short(&line) {
                incomplete = Some(number);
                break;
            }
            self.row(number, &line)?;
            if number & 0xffff == 0 {
                ctx.check()?;
            }
        }
        let cut = !lines.ended();
        let mut table = self.finish()?;
        if let Some(last) = incomplete {
            table.warnings.push(format!("line {last}, the last one, is cut off and left out"));
        } else if let (true, Some(last)) = (cut, table.lines.last()) {
            table.warnings.push(format!(
                "line {last}, the last one, has no line end: if the file was cut off, its last value may be incomplete"
            ));
        }
        Ok(table)
    }

    /// Whether a line has too few fields, and is none of those that are passed over.
    fn is_short(&self, line: &str) -> bool {
        let fields = split(line, self.dialect.separator).len();
        !line.trim().is_empty() && comment(line).is_none() && fields < self.columns.len()
    }

    fn row(&mut self, number: u32, line: &str) -> Result<()> {
        if line.trim().is_empty() || comment(line).is_some() {
            return Ok(());
        }
        let Dialect { separator, decimal_comma, .. } = self.dialect;
        let at = |column: usize| Place::at(self.path, number as usize, column);
        let width = self.columns.len();
        let cells = split(line, separator);
        let trailing = cells.len() == width + 1 && (cells[width].is_empty() || self.dialect.remarks);
        if cells.len() != width && !trailing {
            return Err(Error::input(
                at(cells.len().min(width) + usize::from(cells.len() > width)),
                format!("the row has {} fields, the header {width}", cells.len()),
                "complete or delete this row, or cut the file here if another table begins",
            ));
        }
        for (k, text) in cells.iter().enumerate().take(width) {
            let name = || format!("column {}", self.dialect.names[k]);
            let shown = || text.chars().take(40).collect::<String>();
            let value = match (self.kinds[k], cell(text, decimal_comma)) {
                (Kind::Text, _) => continue,
                (_, Cell::Missing) => f64::NAN,
                (Kind::Numbers, Cell::Number(x)) => x,
                (Kind::Stamps, Cell::Stamp(seconds, part)) => {
                    self.dated |= seconds.abs() > 2 * 86_400;
                    let epoch = *self.epoch.get_or_insert(seconds);
                    (seconds - epoch) as f64 + part
                }
                (_, Cell::Infinite) => {
                    return Err(Error::input(
                        at(k + 1),
                        format!("{} holds '{}', which is no finite number", name(), shown()),
                        "leave the cell empty or delete the row",
                    ));
                }
                (Kind::Stamps, _) => {
                    return Err(Error::input(
                        at(k + 1),
                        format!("{} holds '{}', which is no time stamp", name(), shown()),
                        "write it as the other rows do, for example 2026-03-01T08:00:00.0001",
                    ));
                }
                (Kind::Numbers, _) => {
                    return Err(Error::input(
                        at(k + 1),
                        format!("{} holds '{}', which is not a number", name(), shown()),
                        "correct the cell, or leave it empty if the value is missing",
                    ));
                }
            };
            self.columns[k].push(value);
        }
        self.lines.push(number);
        self.values += width;
        if self.values > MAX_VALUES {
            return Err(too_large(self.path, &format!("more than {} rows of {width} columns", self.lines.len())));
        }
        Ok(())
    }

    fn finish(self) -> Result<Table> {
        let labview = LabView::of(&self.dialect, &self.columns);
        if let Some(k) = labview.differs {
            return Err(Error::input(
                Place::at(self.path, self.dialect.header_line as usize, k + 1),
                "the channels have times of their own, which differ",
                "write the file with one X column, or a file for each channel",
            ));
        }
        let mut table = Table { metadata: self.dialect.metadata, lines: self.lines, ..Table::default() };
        if table.lines.is_empty() {
            return Err(Error::input(
                Place::at(self.path, self.dialect.header_line as usize, 0),
                "there is a header but no row of numbers",
                "append the samples, one row each",
            ));
        }
        let has_time = self.dialect.names.iter().any(|n| names::header(n).role == Some(Role::Time));
        let mut seen: BTreeMap<String, usize> = BTreeMap::new();
        let parts = self.columns.into_iter().zip(self.dialect.names).zip(self.dialect.units).zip(self.kinds);
        for (k, (((values, label), unit), kind)) in parts.enumerate() {
            if kind == Kind::Text {
                table.leave_out(label, "it holds text");
                continue;
            }
            if labview.dropped.contains(&k) {
                continue;
            }
            // A separator at the end of each line makes a column without name and content.
            if label.is_empty() && values.iter().all(|x| x.is_nan()) {
                continue;
            }
            let count = seen.entry(label.clone()).or_default();
            *count += 1;
            let name = match (label.is_empty(), *count) {
                (true, _) => format!("column {}", k + 1),
                (false, 1) => label.clone(),
                (false, n) => format!("{label}#{n}"),
            };
            let mut values = values;
            if kind == Kind::Stamps && !self.dated {
                time_axis::over_midnight(&mut values);
            }
            let is_time = kind == Kind::Stamps && (!has_time || names::header(&label).role == Some(Role::Time));
            let unit = if kind == Kind::Stamps { Some("s".into()) } else { unit };
            table.columns.push(Column { name, label, unit, values, is_time, position: k + 1, ..Column::default() });
        }
        Ok(table)
    }
}
