//! How a file is written: separator, decimal sign, preamble, header, row of units.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use super::cell::{Cell, Separator, cell, comment, key_value, split};
use crate::error::{Error, Place, Result};
use crate::recording::units::Unit;

/// How a file is written.
pub struct Dialect {
    /// What stands between cells.
    pub separator: Separator,
    /// Whether decimals follow a comma.
    pub decimal_comma: bool,
    /// Names of the columns.
    pub names: Vec<String>,
    /// Their units, where a row of them is there.
    pub units: Vec<Option<String>>,
    /// What the lines before the table say.
    pub metadata: BTreeMap<String, String>,
    /// Line number of the header.
    pub header_line: u32,
    /// Index of the first row of data in the window.
    pub first_row: usize,
}

impl Dialect {
    /// Decides by the first lines.
    ///
    /// # Errors
    /// No header, or no row of numbers.
    pub fn sniff(path: &Path, window: &[(u32, String)]) -> Result<Self> {
        let fail =
            |line: u32, what: &str, remedy: &str| Err(Error::input(Place::at(path, line as usize, 0), what, remedy));
        let content: Vec<usize> =
            (0..window.len()).filter(|&k| comment(&window[k].1).is_none() && !window[k].1.trim().is_empty()).collect();
        let header_hint = "write one line of names first, such as t_s,u_v,i_a,omega_rad_s, then rows of numbers";
        if window.is_empty() {
            return Err(Error::input(Place::file(path), "the file is empty", header_hint));
        }
        let Some(&last) = content.last() else {
            return fail(window[window.len() - 1].0, "there are comments but no data", header_hint);
        };
        let (separator, decimal_comma, width) = Self::separator(window, &content);
        let is_row = |k: usize| {
            let cells = split(&window[k].1, separator);
            let kinds: Vec<Cell> = cells.iter().map(|c| cell(c, decimal_comma)).collect();
            let numbers =
                kinds.iter().filter(|c| matches!(c, Cell::Number(_) | Cell::Infinite | Cell::Stamp(..))).count();
            // A row of empty cells is a gap of a logger, not a header.
            kinds.first().is_some_and(|c| *c != Cell::Text)
                && 2 * numbers >= cells.iter().filter(|c| !c.is_empty()).count()
                && numbers > 0
        };
        let right_width = |k: usize| {
            let n = split(&window[k].1, separator).len();
            n == width || n == width + 1
        };
        let found = content.iter().enumerate().position(|(j, &k)| {
            is_row(k) && right_width(k) && content.get(j + 1).is_none_or(|&next| is_row(next) || k == last)
        });
        let Some(position) = found else {
            // One line of names, or a text that is no table.
            let (line, text) = &window[content[0]];
            if content.len() <= 2 {
                return fail(*line, "there is a header but no row of numbers", "append the samples, one row each");
            }
            let start: String = text.chars().take(40).collect();
            return fail(*line, &format!("no row of numbers is found after '{start}'"), header_hint);
        };
        let first_row = content[position];

        let mut metadata = BTreeMap::new();
        let mut named_by_comment: Option<(u32, Vec<String>)> = None;
        for (line, text) in &window[..first_row] {
            let Some(body) = comment(text) else { continue };
            if let Some((key, value)) = key_value(body) {
                metadata.insert(key, value);
                continue;
            }
            let cells = split(body.trim(), separator);
            if cells.len() == width && cells.iter().all(|c| cell(c, decimal_comma) == Cell::Text) {
                named_by_comment = Some((*line, cells.iter().map(|c| c.to_string()).collect()));
            }
        }
        let above = |back: usize| -> Option<(u32, Vec<String>)> {
            let k = content[position.checked_sub(back)?];
            Some((window[k].0, split(&window[k].1, separator).iter().map(|c| c.to_string()).collect()))
        };
        let is_unit = |c: &String| {
            let bare = c.trim_matches(['[', ']', '(', ')', ' ']);
            c.is_empty() || bare == "-" || bare.is_empty() || Unit::parse(bare).is_some()
        };
        let fits = |cells: &[String]| {
            cells.len() == width || (cells.len() == width + 1 && cells.last().is_some_and(String::is_empty))
        };
        let (mut used, mut units) = (0, vec![None; width]);
        let header = match (above(1), above(2)) {
            (Some((_, unit_row)), Some((line, names)))
                if fits(&unit_row)
                    && fits(&names)
                    && unit_row.iter().all(is_unit)
                    && unit_row.iter().any(|c| !c.is_empty())
                    && names.iter().any(|c| !c.is_empty() && cell(c, decimal_comma) == Cell::Text) =>
            {
                used = 2;
                let bare = |c: &String| c.trim_matches(['[', ']', '(', ')', ' ']).to_owned();
                units = unit_row.iter().take(width).map(|c| Some(bare(c)).filter(|u| !u.is_empty())).collect();
                Some((line, names))
            }
            (Some((line, names)), _) if fits(&names) => {
                used = 1;
                Some((line, names))
            }
            _ => None,
        };
        for &k in &content[..position - used] {
            let cells = split(&window[k].1, separator);
            let mut full = cells.iter().filter(|c| !c.is_empty());
            if let (Some(key), Some(value)) = (full.next(), full.next()) {
                let more = full.next().filter(|u| u.len() < 8).map(|u| format!(" {u}")).unwrap_or_default();
                metadata.insert(key.trim_end_matches([':', '=']).trim().to_owned(), format!("{value}{more}"));
            } else if let Some((key, value)) = key_value(&window[k].1) {
                metadata.insert(key, value);
            }
        }
        let (header_line, mut names) = match (header, named_by_comment) {
            (Some(header), _) | (None, Some(header)) => header,
            (None, None) => {
                let line = window[first_row].0;
                if let Some((at, names)) = above(1).filter(|(_, names)| names.len() > 1 || width == 1) {
                    return Err(Error::input(
                        Place::at(path, at as usize, 0),
                        format!("the header has {} names, the rows have {width} fields", names.len()),
                        "give each column one name",
                    ));
                }
                let example: Vec<_> = ["t_s", "u_v", "i_a", "omega_rad_s"].into_iter().take(width).collect();
                return fail(
                    line,
                    "there is no header: the first row holds numbers",
                    &format!(
                        "put a line with the names of the {width} columns before it, such as {}",
                        example.join(",")
                    ),
                );
            }
        };
        names.resize(width, String::new());
        Ok(Self { separator, decimal_comma, names, units, metadata, header_line, first_row })
    }

    /// The separator whose columns hold the most numbers, the decimal sign, and the number of columns.
    fn separator(window: &[(u32, String)], content: &[usize]) -> (Separator, bool, usize) {
        // The end of the window is certainly data, unless the file is short.
        let sample = &content[content.len().saturating_sub(if content.len() > 60 { 50 } else { content.len() })..];
        let mut best = (-1.0, Separator::Char(','), false, 1);
        let candidates = [
            Separator::Char('\t'),
            Separator::Char(';'),
            Separator::Char(','),
            Separator::Char('|'),
            Separator::Blanks,
        ];
        for separator in candidates {
            for decimal_comma in [false, true] {
                if decimal_comma && separator == Separator::Char(',') {
                    continue;
                }
                let rows: Vec<Vec<Cow<'_, str>>> = sample.iter().map(|&k| split(&window[k].1, separator)).collect();
                let mut widths: BTreeMap<usize, usize> = BTreeMap::new();
                for row in &rows {
                    *widths.entry(row.len()).or_default() += 1;
                }
                // The most frequent width; of equally frequent ones the larger.
                let Some((&width, _)) = widths.iter().max_by_key(|&(w, n)| (*n, *w)) else { continue };
                let (mut all, mut good) = (0.0, 0.0);
                for row in &rows {
                    for text in row {
                        all += 1.0;
                        let kind = cell(text, decimal_comma);
                        if row.len() == width
                            && matches!(kind, Cell::Number(_) | Cell::Missing | Cell::Infinite | Cell::Stamp(..))
                        {
                            good += 1.0;
                        }
                    }
                }
                let mut score: f64 = if all > 0.0 { good / all } else { 0.0 };
                // One column is a last resort; a plain header counts by its width.
                score += if width > 1 { 1e-3 * (width.min(50) as f64) } else { -0.5 };
                if score > best.0 + 1e-9 {
                    best = (score, separator, decimal_comma, width);
                }
            }
        }
        (best.1, best.2, best.3)
    }
}
