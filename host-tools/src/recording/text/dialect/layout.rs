//! Separator, decimal sign and number of columns.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::Window;
use crate::recording::text::cell::{Cell, Separator, cell, split};

/// Lines of data by which the layout of a file is decided, unless the file is shorter than the lines that are looked
/// at.
const SAMPLE: usize = 50;
/// Lines from which on their last ones are certainly data.
const CERTAINLY_DATA: usize = 60;

const SEPARATORS: [Separator; 5] =
    [Separator::Char('\t'), Separator::Char(';'), Separator::Char(','), Separator::Char('|'), Separator::Blanks];

/// How the rows of a table are written.
#[derive(Debug, Clone, Copy)]
pub struct Layout {
    /// What stands between cells.
    pub separator: Separator,
    /// Whether decimals follow a comma.
    pub decimal_comma: bool,
    /// Number of columns.
    pub width: usize,
}

impl Layout {
    /// The one whose columns hold the most numbers.
    pub fn of(window: &Window, content: &[usize]) -> Self {
        let sample = &content[content.len() - if content.len() > CERTAINLY_DATA { SAMPLE } else { content.len() }..];
        let mut best = (-1.0, Self { separator: Separator::Char(','), decimal_comma: false, width: 1 });
        for separator in SEPARATORS {
            for decimal_comma in [false, true] {
                if decimal_comma && separator == Separator::Char(',') {
                    continue;
                }
                let rows: Vec<Vec<Cow<'_, str>>> = sample.iter().map(|&k| split(&window[k].1, separator)).collect();
                let Some(width) = usual_width(&rows) else { continue };
                let layout = Self { separator, decimal_comma, width };
                let score = layout.score(&rows);
                if score > best.0 + 1e-9 {
                    best = (score, layout);
                }
            }
        }
        best.1
    }

    /// Share of the cells that hold numbers, and a little for each column.
    fn score(self, rows: &[Vec<Cow<'_, str>>]) -> f64 {
        let is_good = |row: &Vec<_>, text: &str| row.len() == self.width && self.cell(text) != Cell::Text;
        let all = rows.iter().map(Vec::len).sum::<usize>();
        let good = rows.iter().map(|row| row.iter().filter(|text| is_good(row, text)).count()).sum::<usize>();
        let share = if all > 0 { good as f64 / all as f64 } else { 0.0 };
        // One column is a last resort; a plain header counts by its width.
        share + if self.width > 1 { 1e-3 * (self.width.min(50) as f64) } else { -0.5 }
    }

    /// Splits a line.
    pub fn split(self, line: &str) -> Vec<Cow<'_, str>> {
        split(line, self.separator)
    }

    /// Reads a cell.
    pub fn cell(self, text: &str) -> Cell {
        cell(text, self.decimal_comma)
    }

    /// The place, among the lines that are neither comments nor empty, of the first row of data.
    pub fn first_row(self, window: &Window, content: &[usize]) -> Option<usize> {
        let line = |k: usize| window[k].1.as_str();
        let begins = |(j, &k): (usize, &usize)| {
            let next = content.get(j + 1);
            self.is_row(line(k))
                && [self.width, self.width + 1].contains(&self.split(line(k)).len())
                && next.is_none_or(|&next| self.is_row(line(next)))
        };
        content.iter().enumerate().position(begins)
    }

    fn is_row(self, line: &str) -> bool {
        let cells = self.split(line);
        let kinds: Vec<Cell> = cells.iter().map(|c| self.cell(c)).collect();
        let numbers = kinds
            .iter()
            .filter(|c| matches!(c, Cell::Number(_) | Cell::Infinite | Cell::Stamp(..) | Cell::Date))
            .count();
        // A row of empty cells is a gap of a logger, not a header.
        kinds.first().is_some_and(|c| *c != Cell::Text)
            && 2 * numbers >= cells.iter().filter(|c| !c.is_empty()).count()
            && numbers > 0
    }
}

/// The most frequent number of cells; of equally frequent ones the larger.
fn usual_width(rows: &[Vec<Cow<'_, str>>]) -> Option<usize> {
    let mut widths: BTreeMap<usize, usize> = BTreeMap::new();
    for row in rows {
        *widths.entry(row.len()).or_default() += 1;
    }
    widths.iter().max_by_key(|&(width, rows)| (*rows, *width)).map(|(width, _)| *width)
}
