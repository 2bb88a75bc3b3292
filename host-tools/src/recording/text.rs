//! Tables in text: CSV and its relatives, as scopes, loggers, spreadsheets and data-frame libraries write them.
//!
//! The first lines decide on the dialect (separator, decimal sign, preamble, header, row of units); the rest is read as
//! a stream, one line at a time.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::Path;

use super::names::{self, Role};
use super::table::{Column, MAX_VALUES, Table};
use super::units::Unit;
use crate::error::{Error, Place, Result};
use crate::output;

/// Lines that are looked at before the dialect is decided.
const SNIFFED_LINES: usize = 400;
/// A longer line is no table.
const LONGEST_LINE: u64 = 1 << 20;
/// Texts in UTF-16 are converted in memory.
const LONGEST_UTF16: u64 = 512 << 20;

/// Reads a text table.
///
/// # Errors
/// No header, a row with another number of fields, a cell that is no number: with line and column (the column counts
/// the fields of the row, from one).
pub fn read(path: &Path, gzip: bool) -> Result<Table> {
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    let mut reader: Box<dyn BufRead> = Box::new(BufReader::with_capacity(1 << 16, file));
    if gzip {
        reader = Box::new(BufReader::with_capacity(1 << 16, flate2::bufread::MultiGzDecoder::new(reader)));
    }
    let reader = decode_utf16(path, reader)?;
    let mut lines = Lines { path, reader, number: 0, gzip };
    let mut window: Vec<(u32, String)> = Vec::new();
    while window.len() < SNIFFED_LINES {
        match lines.next()? {
            Some(line) => window.push(line),
            None => break,
        }
    }
    let dialect = Dialect::sniff(path, &window)?;
    Body::new(path, dialect, &window)?.read(window, lines)
}

fn decode_utf16(path: &Path, mut reader: Box<dyn BufRead>) -> Result<Box<dyn BufRead>> {
    let head = reader.fill_buf().map_err(|e| unreadable(path, &e))?;
    let big = match head {
        [0xff, 0xfe, ..] => false,
        [0xfe, 0xff, ..] => true,
        [0xef, 0xbb, 0xbf, ..] => {
            reader.consume(3);
            return Ok(reader);
        }
        _ => return Ok(reader),
    };
    let mut bytes = Vec::new();
    reader.take(LONGEST_UTF16 + 1).read_to_end(&mut bytes).map_err(|e| unreadable(path, &e))?;
    if bytes.len() as u64 > LONGEST_UTF16 {
        return Err(Error::input(Place::file(path), "the UTF-16 text is larger than 512 MB", "save it as UTF-8"));
    }
    let units = bytes[2..]
        .chunks_exact(2)
        .map(|b| if big { u16::from_be_bytes([b[0], b[1]]) } else { u16::from_le_bytes([b[0], b[1]]) });
    let text: String = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect();
    Ok(Box::new(Cursor::new(text.into_bytes())))
}

fn unreadable(path: &Path, error: &std::io::Error) -> Error {
    use std::io::ErrorKind as K;
    match error.kind() {
        K::InvalidInput | K::InvalidData | K::UnexpectedEof => Error::input(
            Place::file(path),
            format!("the compressed data are damaged or cut off ({error})"),
            "copy the file again from its source",
        ),
        _ => Error::io(path, std::io::Error::new(error.kind(), error.to_string())),
    }
}

struct Lines<'a> {
    path: &'a Path,
    reader: Box<dyn BufRead>,
    number: u32,
    gzip: bool,
}

impl Lines<'_> {
    /// The next line without its end, with its number.
    fn next(&mut self) -> Result<Option<(u32, String)>> {
        let mut bytes = Vec::new();
        let read = (&mut self.reader).take(LONGEST_LINE).read_until(b'\n', &mut bytes);
        let read = read.map_err(|e| unreadable(self.path, &e))?;
        if read == 0 {
            return Ok(None);
        }
        self.number += 1;
        if bytes.contains(&0) || (read as u64 == LONGEST_LINE && bytes.last() != Some(&b'\n')) {
            let what = if self.gzip { "the unpacked content is not text" } else { "the content is not text" };
            return Err(Error::input(
                Place::at(self.path, self.number as usize, 0),
                what,
                super::looks_like(&bytes).map_or_else(
                    || "give the file the extension of its format".into(),
                    |format| format!("it looks like {format}: give it that extension"),
                ),
            ));
        }
        while matches!(bytes.last(), Some(b'\n' | b'\r')) {
            bytes.pop();
        }
        let text = match String::from_utf8(bytes) {
            Ok(text) => text,
            // Windows programs write "°" and "µ" as single bytes; Latin-1 maps every byte to the character of its number.
            Err(e) => e.into_bytes().iter().map(|&b| char::from(b)).collect(),
        };
        Ok(Some((self.number, text)))
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Separator {
    Char(char),
    Blanks,
}

/// Splits a line into trimmed cells, honouring quotes.
fn split(line: &str, separator: Separator) -> Vec<Cow<'_, str>> {
    match separator {
        Separator::Blanks if !line.contains('"') => line.split_whitespace().map(Cow::Borrowed).collect(),
        Separator::Char(c) if !line.contains('"') => line.split(c).map(|cell| Cow::Borrowed(cell.trim())).collect(),
        _ => {
            let mut cells = Vec::new();
            let (mut cell, mut quoted, mut was_quoted) = (String::new(), false, false);
            let mut chars = line.chars().peekable();
            let ends = |c: char| match separator {
                Separator::Char(s) => c == s,
                Separator::Blanks => c.is_whitespace(),
            };
            while let Some(c) = chars.next() {
                match c {
                    '"' if quoted && chars.peek() == Some(&'"') => {
                        cell.push('"');
                        chars.next();
                    }
                    '"' => {
                        quoted = !quoted;
                        was_quoted = true;
                    }
                    c if !quoted && ends(c) => {
                        if separator != Separator::Blanks || was_quoted || !cell.is_empty() {
                            cells.push(Cow::Owned(std::mem::take(&mut cell).trim().to_owned()));
                        }
                        was_quoted = false;
                    }
                    c => cell.push(c),
                }
            }
            if separator != Separator::Blanks || was_quoted || !cell.is_empty() {
                cells.push(Cow::Owned(cell.trim().to_owned()));
            }
            cells
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Cell {
    Number(f64),
    Missing,
    Infinite,
    /// Seconds since an arbitrary day, split so that microseconds survive.
    Stamp(i64, f64),
    Text,
}

fn cell(text: &str, decimal_comma: bool) -> Cell {
    if text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.')) && !text.contains(':') {
        let parsed = if decimal_comma && text.contains(',') {
            // `1,` and `1,2,3` are lists, not numbers.
            let (_, digits) = text.split_once(',').unwrap_or(("", ""));
            if !digits.starts_with(|c: char| c.is_ascii_digit()) || text.contains('.') {
                return Cell::Text;
            }
            text.replacen(',', ".", 1).parse::<f64>()
        } else {
            text.parse::<f64>()
        };
        match parsed {
            Ok(x) if x.is_infinite() => return Cell::Infinite,
            Ok(x) if x.is_nan() => return Cell::Missing,
            Ok(x) => return Cell::Number(x),
            Err(_) => {}
        }
    }
    match text.to_lowercase().as_str() {
        "" | "nan" | "-nan" | "na" | "n/a" | "#n/a" | "<na>" | "null" | "none" | "nil" | "-" | "--" => Cell::Missing,
        "inf" | "+inf" | "-inf" | "infinity" | "+infinity" | "-infinity" => Cell::Infinite,
        "true" => Cell::Number(1.0),
        "false" => Cell::Number(0.0),
        _ => stamp(text, decimal_comma).map_or(Cell::Text, |(s, f)| Cell::Stamp(s, f)),
    }
}

/// `2026-03-01T08:00:00.0001+01:00`, `2026-03-01 08:00:00`, `01.03.2026 08:00:00,5` or `08:00:00.5`.
fn stamp(text: &str, decimal_comma: bool) -> Option<(i64, f64)> {
    if !text.is_ascii() || text.len() > 40 {
        return None;
    }
    let (date, time) = match text.split_once(['T', ' ']) {
        Some((date, time)) => (Some(date), time.trim()),
        None => (None, text),
    };
    let days = match date {
        None => 0,
        Some(date) => {
            let (separator, backwards) = if date.contains('.') {
                ('.', true)
            } else if date.contains('/') {
                ('/', false)
            } else {
                ('-', false)
            };
            let parts: Vec<i64> = date.split(separator).map(|p| p.parse().ok()).collect::<Option<_>>()?;
            let [a, month, b] = parts[..] else { return None };
            let (year, day) = if backwards { (b, a) } else { (a, b) };
            if !(1..=12).contains(&month) || !(1..=31).contains(&day) || !(1..=9999).contains(&year) {
                return None;
            }
            days_from_civil(year, month, day)
        }
    };
    let (time, zone) = if let Some(time) = time.strip_suffix(['Z', 'z']) {
        (time, 0)
    } else if let Some(at) = time.rfind(['+', '-']).filter(|_| date.is_some()) {
        let (h, m) = time[at + 1..].split_once(':').unwrap_or((&time[at + 1..], "0"));
        let minutes = h.parse::<i64>().ok()? * 60 + m.parse::<i64>().ok()?;
        (&time[..at], if time[at..].starts_with('-') { -minutes } else { minutes })
    } else {
        (time, 0)
    };
    let mut parts = time.trim().split(':');
    let (h, m, s) = (parts.next()?, parts.next()?, parts.next().unwrap_or("0"));
    if parts.next().is_some() {
        return None;
    }
    let s = if decimal_comma || s.contains(',') { s.replacen(',', ".", 1) } else { s.to_owned() };
    let (h, m): (i64, i64) = (h.parse().ok()?, m.parse().ok()?);
    let whole: i64 = s.split('.').next()?.parse().ok()?;
    let part: f64 = match s.split_once('.') {
        Some((_, digits)) if digits.chars().all(|c| c.is_ascii_digit()) => format!("0.{digits}").parse().ok()?,
        Some(_) => return None,
        None => 0.0,
    };
    if !(0..=24).contains(&h) || !(0..60).contains(&m) || !(0..=60).contains(&whole) {
        return None;
    }
    Some((days * 86_400 + h * 3600 + m * 60 + whole - zone * 60, part))
}

/// Days since 1970-01-01 of the Gregorian calendar (the year is counted from March, so that the leap day comes last).
fn days_from_civil(year: i64, month: i64, day: i64) -> i64 {
    let y = if month <= 2 { year - 1 } else { year };
    let from_march = (month + 9) % 12;
    let day_of_year = (153 * from_march + 2) / 5 + day - 1;
    365 * y + y.div_euclid(4) - y.div_euclid(100) + y.div_euclid(400) + day_of_year - 719_468
}

fn comment(line: &str) -> Option<&str> {
    let line = line.trim_start();
    line.strip_prefix('#').or_else(|| line.strip_prefix('%')).or_else(|| line.strip_prefix("//"))
}

fn key_value(text: &str) -> Option<(String, String)> {
    let at = text.find([':', '='])?;
    let (key, value) = (text[..at].trim(), text[at + 1..].trim());
    (!key.is_empty() && key.len() <= 80).then(|| (key.to_owned(), value.to_owned()))
}

/// How a file is written.
struct Dialect {
    separator: Separator,
    decimal_comma: bool,
    names: Vec<String>,
    units: Vec<Option<String>>,
    metadata: BTreeMap<String, String>,
    /// Line number of the header.
    header_line: u32,
    /// Index of the first row of data in the window.
    first_row: usize,
}

impl Dialect {
    fn sniff(path: &Path, window: &[(u32, String)]) -> Result<Self> {
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

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Numbers,
    Stamps,
    Text,
}

/// The rows below the header.
struct Body<'a> {
    path: &'a Path,
    dialect: Dialect,
    kinds: Vec<Kind>,
    columns: Vec<Vec<f64>>,
    lines: Vec<u32>,
    /// Whole seconds of the first time stamp.
    epoch: Option<i64>,
    values: usize,
}

impl<'a> Body<'a> {
    fn new(path: &'a Path, dialect: Dialect, window: &[(u32, String)]) -> Result<Self> {
        let width = dialect.names.len();
        let mut seen = vec![(0_usize, 0_usize, 0_usize); width];
        for (_, line) in window[dialect.first_row..].iter().filter(|(_, l)| comment(l).is_none()) {
            for (k, text) in split(line, dialect.separator).iter().enumerate().take(width) {
                match cell(text, dialect.decimal_comma) {
                    Cell::Missing => {}
                    Cell::Number(_) | Cell::Infinite => seen[k].0 += 1,
                    Cell::Stamp(..) => seen[k].1 += 1,
                    Cell::Text => seen[k].2 += 1,
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
        Ok(Self { path, columns: vec![Vec::new(); width], dialect, kinds, lines: Vec::new(), epoch: None, values: 0 })
    }

    fn read(mut self, window: Vec<(u32, String)>, mut lines: Lines<'_>) -> Result<Table> {
        let first = self.dialect.first_row;
        for (number, line) in window.into_iter().skip(first) {
            self.row(number, &line)?;
        }
        while let Some((number, line)) = lines.next()? {
            self.row(number, &line)?;
            if number & 0xffff == 0 {
                output::check_interrupt()?;
            }
        }
        self.finish()
    }

    fn row(&mut self, number: u32, line: &str) -> Result<()> {
        if line.trim().is_empty() || comment(line).is_some() {
            return Ok(());
        }
        let Dialect { separator, decimal_comma, .. } = self.dialect;
        let at = |column: usize| Place::at(self.path, number as usize, column);
        let width = self.columns.len();
        let cells = split(line, separator);
        let trailing = cells.len() == width + 1 && cells[width].is_empty();
        if cells.len() != width && !trailing {
            return Err(Error::input(
                at(cells.len().min(width) + usize::from(cells.len() > width)),
                format!("the row has {} fields, the header {width}", cells.len()),
                "complete or delete this row",
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
            return Err(super::too_large(
                self.path,
                &format!("more than {} rows of {width} columns", self.lines.len()),
            ));
        }
        Ok(())
    }

    fn finish(self) -> Result<Table> {
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
                table.warnings.push(format!("column '{label}' holds text and is left out"));
                table.text_columns.push(label);
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
            let is_time = kind == Kind::Stamps && (!has_time || names::header(&label).role == Some(Role::Time));
            let unit = if kind == Kind::Stamps { Some("s".into()) } else { unit };
            table.columns.push(Column { name, label, unit, values, is_time, position: k + 1, ..Column::default() });
        }
        Ok(table)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_stamps() {
        // 2026-03-01 is day 20513 (date -u -d 2026-03-01 +%s gives 1772323200).
        assert_eq!(stamp("2026-03-01T00:00:00Z", false), Some((1_772_323_200, 0.0)));
        assert_eq!(stamp("2026-03-01 09:00:00.25+01:00", false), Some((1_772_352_000, 0.25)));
        assert_eq!(stamp("01.03.2026 08:00:00,25", true), Some((1_772_352_000, 0.25)));
        assert_eq!(stamp("08:00:01.5", false), Some((28_801, 0.5)));
        for bad in ["2026-13-01 00:00:00", "abc", "12:61:00", "1:2:3:4", ""] {
            assert_eq!(stamp(bad, false), None, "{bad}");
        }
    }

    #[test]
    fn quoted_cells() {
        assert_eq!(split("\"a, b\",\"say \"\"x\"\"\", 3", Separator::Char(',')), ["a, b", "say \"x\"", "3"]);
        assert_eq!(split("  1   2\t3 ", Separator::Blanks), ["1", "2", "3"]);
        assert_eq!(split("\"a b\" c", Separator::Blanks), ["a b", "c"]);
    }
}
