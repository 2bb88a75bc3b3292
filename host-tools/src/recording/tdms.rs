//! TDMS (LabVIEW, DIAdem), version 4712 and 4713, after National Instruments' description "TDMS File Format Internal
//! Structure" (2023).
//!
//! Own reader, because what LabVIEW streams needs all of it: several chunks of raw data in one segment, segments that
//! only add channels to the list of the one before, interleaved samples and big-endian files. Raw data of DAQmx devices
//! are refused. Scalings (`NI_Scale[n]_*`, linear and polynomial, each of the raw values or of another scaling) are
//! applied unless the data are marked as scaled. A property that a channel lacks is its group's, or else the file's;
//! channels that begin at different times are different rasters.

use std::collections::BTreeMap;
use std::path::Path;

use super::damage::{damaged, too_large};
use super::table::{Column, LeftOut, MAX_VALUES, Table};
use crate::error::{Error, Place, Result};

const LEAD_IN: usize = 28;
/// Bits of the table of contents in the lead-in.
const HAS_METADATA: u32 = 1 << 1;
const NEW_LIST: u32 = 1 << 2;
const HAS_RAW_DATA: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
const DAQMX: u32 = 1 << 7;

#[derive(Debug, Clone, PartialEq)]
enum Value {
    Number(f64),
    Text(String),
}

/// How an object's raw data lie in a chunk.
#[derive(Debug, Clone, Copy, Default)]
struct Layout {
    kind: u32,
    count: u64,
    /// Bytes of one chunk of strings, which have no fixed size.
    text_bytes: u64,
}

#[derive(Default)]
struct Object {
    properties: BTreeMap<String, Value>,
    layout: Option<Layout>,
    values: Vec<f64>,
    text: bool,
    /// Seconds of the first time stamp: the others are counted from it, so that microseconds survive in a double.
    epoch: Option<i64>,
}

struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    big: bool,
}

type Parsed<T> = std::result::Result<T, &'static str>;

impl<'a> Cursor<'a> {
    fn take(&mut self, n: usize) -> Parsed<&'a [u8]> {
        let end = self.at.checked_add(n).ok_or("a length is out of range")?;
        let part = self.bytes.get(self.at..end).ok_or("the file ends within a segment")?;
        self.at = end;
        Ok(part)
    }
    fn array<const N: usize>(&mut self) -> Parsed<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        if self.big {
            array.reverse();
        }
        Ok(array)
    }
    fn u32(&mut self) -> Parsed<u32> {
        Ok(u32::from_le_bytes(self.array()?))
    }
    fn u64(&mut self) -> Parsed<u64> {
        Ok(u64::from_le_bytes(self.array()?))
    }
    fn text(&mut self) -> Parsed<String> {
        let n = self.u32()? as usize;
        Ok(String::from_utf8_lossy(self.take(n)?).into_owned())
    }
    /// Seconds since 1904 and the fraction: units of 2^-64 s first, in big-endian files the other way round.
    fn stamp(&mut self) -> Parsed<(i64, f64)> {
        let (a, b) = (u64::from_le_bytes(self.array()?), u64::from_le_bytes(self.array()?));
        let (fraction, seconds) = if self.big { (b, a) } else { (a, b) };
        Ok((seconds as i64, fraction as f64 / 2.0_f64.powi(64)))
    }
    /// A number of a TDMS type.
    fn number(&mut self, kind: u32) -> Parsed<f64> {
        Ok(match kind {
            1 => f64::from(self.array::<1>()?[0] as i8),
            2 => f64::from(i16::from_le_bytes(self.array()?)),
            3 => f64::from(i32::from_le_bytes(self.array()?)),
            4 => i64::from_le_bytes(self.array()?) as f64,
            5 | 0x21 => f64::from(self.array::<1>()?[0]),
            6 => f64::from(u16::from_le_bytes(self.array()?)),
            7 => f64::from(u32::from_le_bytes(self.array()?)),
            8 => u64::from_le_bytes(self.array()?) as f64,
            9 | 0x19 => f64::from(f32::from_le_bytes(self.array()?)),
            10 | 0x1a => f64::from_le_bytes(self.array()?),
            0x44 => {
                let (seconds, fraction) = self.stamp()?;
                seconds as f64 + fraction
            }
            _ => return Err("a data type is not supported"),
        })
    }
}

/// Bytes of a number; none for strings.
fn size(kind: u32) -> Parsed<Option<u64>> {
    Ok(match kind {
        1 | 5 | 0x21 => Some(1),
        2 | 6 => Some(2),
        3 | 7 | 9 | 0x19 => Some(4),
        4 | 8 | 10 | 0x1a => Some(8),
        0x44 => Some(16),
        0x20 => None,
        _ => return Err("a data type is not supported (complex, fixed-point and DAQmx data are not)"),
    })
}

/// Reads a TDMS file.
///
/// # Errors
/// Damaged or unsupported segments, too many values.
pub fn read(path: &Path) -> Result<Table> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let mut file = File { objects: BTreeMap::new(), order: Vec::new(), active: Vec::new(), values: 0, cut: false };
    match file.segments(&bytes) {
        Ok(()) => {}
        Err("too many values") => return Err(too_large(path, "too many samples")),
        Err(reason) => return Err(damaged(path, "TDMS", reason)),
    }
    file.table(path)
}

struct File {
    objects: BTreeMap<String, Object>,
    order: Vec<String>,
    /// Objects with raw data in the present segment, in the order of their data.
    active: Vec<String>,
    values: usize,
    /// A segment ends within a chunk.
    cut: bool,
}

impl File {
    fn segments(&mut self, bytes: &[u8]) -> Parsed<()> {
        let mut start = 0;
        while start < bytes.len() {
            let mut lead = Cursor { bytes, at: start, big: false };
            if lead.take(4)? != b"TDSm" {
                return Err(if start == 0 { "no TDSm at its start" } else { "a segment does not begin with TDSm" });
            }
            let contents = lead.u32()?;
            let big = contents & BIG_ENDIAN != 0;
            lead.big = big;
            lead.u32()?;
            let (next, raw) = (lead.u64()?, lead.u64()?);
            if contents & DAQMX != 0 {
                return Err("raw DAQmx data are not supported: export them scaled");
            }
            let data = start + LEAD_IN;
            // A logger that was switched off leaves the length of its last segment open.
            let end = match usize::try_from(next) {
                Ok(_) if next == u64::MAX => bytes.len(),
                Ok(next) => {
                    data.checked_add(next).filter(|&e| e <= bytes.len()).ok_or("the file ends within a segment")?
                }
                Err(_) => return Err("a length is out of range"),
            };
            let raw_at = usize::try_from(raw).ok().and_then(|r| data.checked_add(r)).filter(|&r| r <= end);
            let raw_at = raw_at.ok_or("a length is out of range")?;
            if contents & HAS_METADATA != 0 {
                self.metadata(&mut Cursor { bytes: &bytes[..raw_at], at: data, big }, contents & NEW_LIST != 0)?;
            }
            if contents & HAS_RAW_DATA != 0 {
                let cursor = Cursor { bytes: &bytes[..end], at: raw_at, big };
                self.raw(cursor, contents & INTERLEAVED != 0)?;
            }
            start = end;
        }
        Ok(())
    }

    fn metadata(&mut self, cursor: &mut Cursor<'_>, new_list: bool) -> Parsed<()> {
        if new_list {
            self.active.clear();
        }
        for _ in 0..cursor.u32()? {
            let path = cursor.text()?;
            if !self.objects.contains_key(&path) {
                self.order.push(path.clone());
            }
            let index = cursor.u32()?;
            let object = self.objects.entry(path.clone()).or_default();
            match index {
                u32::MAX => {}
                0 => {
                    if object.layout.is_none() {
                        return Err("a channel repeats a layout that it never had");
                    }
                }
                0x1269 | 0x1369 => return Err("raw DAQmx data are not supported: export them scaled"),
                _ => {
                    let kind = cursor.u32()?;
                    if cursor.u32()? != 1 {
                        return Err("arrays of more than one dimension are not supported");
                    }
                    let count = cursor.u64()?;
                    let text_bytes = if size(kind)?.is_none() { cursor.u64()? } else { 0 };
                    object.layout = Some(Layout { kind, count, text_bytes });
                }
            }
            if index == u32::MAX {
                self.active.retain(|p| *p != path);
            } else if !self.active.contains(&path) {
                self.active.push(path.clone());
            }
            for _ in 0..cursor.u32()? {
                let name = cursor.text()?;
                let kind = cursor.u32()?;
                let value =
                    if kind == 0x20 { Value::Text(cursor.text()?) } else { Value::Number(cursor.number(kind)?) };
                object.properties.insert(name, value);
            }
        }
        Ok(())
    }

    fn raw(&mut self, mut cursor: Cursor<'_>, interleaved: bool) -> Parsed<()> {
        let mut layouts = Vec::new();
        let mut chunk = 0_u64;
        for path in &self.active {
            let Some(layout) = self.objects.get(path).and_then(|o| o.layout) else { continue };
            let bytes = match size(layout.kind)? {
                Some(size) => size.checked_mul(layout.count).ok_or("a length is out of range")?,
                None => layout.text_bytes,
            };
            chunk = chunk.checked_add(bytes).ok_or("a length is out of range")?;
            layouts.push((path.clone(), layout));
        }
        if chunk == 0 {
            return Ok(());
        }
        let available = (cursor.bytes.len() - cursor.at) as u64;
        // An incomplete chunk at the end (power cut) is left out.
        self.cut |= !available.is_multiple_of(chunk);
        for _ in 0..available / chunk {
            if interleaved {
                let rows = layouts.first().map_or(0, |l| l.1.count);
                if layouts.iter().any(|l| l.1.count != rows || l.1.kind == 0x20) {
                    return Err("interleaved channels of different length");
                }
                for _ in 0..rows {
                    for (path, layout) in &layouts {
                        let value = self.value(&mut cursor, path, layout.kind)?;
                        self.push(path, &[value])?;
                    }
                }
                continue;
            }
            for (path, layout) in &layouts {
                if layout.kind == 0x20 {
                    cursor.take(usize::try_from(layout.text_bytes).map_err(|_| "a length is out of range")?)?;
                    if let Some(object) = self.objects.get_mut(path) {
                        object.text = true;
                    }
                    continue;
                }
                let mut values = Vec::new();
                for _ in 0..layout.count {
                    values.push(self.value(&mut cursor, path, layout.kind)?);
                }
                self.push(path, &values)?;
            }
        }
        Ok(())
    }

    fn value(&mut self, cursor: &mut Cursor<'_>, path: &str, kind: u32) -> Parsed<f64> {
        if kind != 0x44 {
            return cursor.number(kind);
        }
        let (seconds, fraction) = cursor.stamp()?;
        let epoch = self.objects.get_mut(path).map_or(seconds, |o| *o.epoch.get_or_insert(seconds));
        Ok(seconds.saturating_sub(epoch) as f64 + fraction)
    }

    fn push(&mut self, path: &str, values: &[f64]) -> Parsed<()> {
        self.values += values.len();
        if self.values > MAX_VALUES {
            return Err("too many values");
        }
        if let Some(object) = self.objects.get_mut(path) {
            object.values.extend_from_slice(values);
        }
        Ok(())
    }

    /// The properties of a channel, with those of its group and of the file where it has none.
    fn inherited<'a>(&'a self, object: &'a Object, parts: &[String]) -> BTreeMap<&'a str, &'a Value> {
        let mut all = BTreeMap::new();
        for (path, above) in &self.objects {
            let above_parts = split_path(path);
            if above_parts.len() < parts.len() && parts.starts_with(&above_parts) {
                // The file comes before its groups in this order.
                all.extend(above.properties.iter().map(|(key, value)| (key.as_str(), value)));
            }
        }
        all.extend(object.properties.iter().map(|(key, value)| (key.as_str(), value)));
        all
    }

    /// When the first channel began, seconds since 1904.
    fn first_start(&self) -> Option<f64> {
        let starts = self.objects.values().filter_map(|o| match o.properties.get("wf_start_time") {
            Some(Value::Number(x)) => Some(*x),
            _ => None,
        });
        starts.reduce(f64::min)
    }

    fn table(self, file: &Path) -> Result<Table> {
        let mut table = Table::default();
        if self.cut {
            table.warnings.push("the last samples are incomplete and left out; was the recording cut off?".into());
        }
        let mut paths = Vec::new();
        // Channels of one length and one interval were sampled together, whatever group they are in.
        let mut rasters: Vec<(usize, Option<u64>, u64, String)> = Vec::new();
        let first_start = self.first_start();
        for path in &self.order {
            let Some(object) = self.objects.get(path) else { continue };
            let parts = split_path(path);
            let about = self.inherited(object, &parts);
            let number = |key: &str| match about.get(key) {
                Some(Value::Number(x)) => Some(*x),
                Some(Value::Text(t)) => t.trim().parse().ok(),
                None => None,
            };
            let [group, channel] = parts.as_slice() else {
                for (key, value) in &object.properties {
                    let text = match value {
                        Value::Number(x) => x.to_string(),
                        Value::Text(t) => t.split_whitespace().collect::<Vec<_>>().join(" "),
                    };
                    table.metadata.insert(key.clone(), text);
                }
                continue;
            };
            if object.text {
                table.left_out.push(LeftOut { name: channel.clone(), reason: "it holds text".into() });
                continue;
            }
            if object.values.is_empty() {
                continue;
            }
            let interval = number("wf_increment").filter(|&dt| dt > 0.0 && dt.is_finite());
            let after_first = number("wf_start_time").zip(first_start).map_or(0.0, |(own, first)| own - first);
            let start_s = after_first + number("wf_start_offset").filter(|x| x.is_finite()).unwrap_or(0.0);
            // Without an interval the group's own time column is the only link between channels.
            let key = (
                object.values.len(),
                interval.map(f64::to_bits),
                start_s.to_bits(),
                if interval.is_some() { String::new() } else { group.clone() },
            );
            let raster = rasters.iter().position(|r| *r == key).unwrap_or_else(|| {
                rasters.push(key);
                rasters.len() - 1
            });
            let unit = ["unit_string", "NI_UnitDescription", "unit", "Unit"].into_iter().find_map(|key| {
                match about.get(key) {
                    Some(Value::Text(text)) if !text.trim().is_empty() => Some(text.trim().to_owned()),
                    _ => None,
                }
            });
            let mut values = object.values.clone();
            scale(file, channel, &about, &mut values)?;
            let kind = object.layout.map_or(0, |l| l.kind);
            if kind == 0x44 {
                let first = values[0];
                values.iter_mut().for_each(|t| *t -= first);
            }
            table.columns.push(Column {
                unit: if kind == 0x44 { Some("s".into()) } else { unit },
                raster,
                interval_s: interval,
                start_s,
                is_time: kind == 0x44,
                ..Column::new(channel.clone(), values)
            });
            paths.push(format!("{group}/{channel}"));
        }
        table.make_names_unique(&paths);
        Ok(table)
    }
}

/// `/'Group'/'Channel'`, with quotes doubled inside a name.
fn split_path(path: &str) -> Vec<String> {
    let mut parts = Vec::new();
    let mut chars = path.chars().peekable();
    while let Some(c) = chars.next() {
        if c != '\'' {
            continue;
        }
        let mut part = String::new();
        while let Some(c) = chars.next() {
            if c == '\'' {
                if chars.peek() != Some(&'\'') {
                    break;
                }
                chars.next();
            }
            part.push(c);
        }
        parts.push(part);
    }
    parts
}

/// One of the scalings of a channel.
enum Scaling {
    Linear {
        slope: f64,
        intercept: f64,
    },
    /// Coefficients, of the constant first.
    Polynomial(Vec<f64>),
}

/// Applies the chain of scalings; other kinds are refused, since raw counts must not pass for volts.
fn scale(file: &Path, channel: &str, about: &BTreeMap<&str, &Value>, values: &mut [f64]) -> Result<()> {
    /// More scalings than this are damage.
    const MOST: usize = 64;
    /// What stands for the raw values as the input of a scaling.
    const RAW: f64 = u32::MAX as f64;
    let number = |key: String| match about.get(key.as_str()) {
        Some(Value::Number(x)) => Some(*x),
        _ => None,
    };
    if matches!(about.get("NI_Scaling_Status"), Some(Value::Text(status)) if status != "unscaled") {
        return Ok(());
    }
    // Not every writer counts them.
    let scales = (0..MOST).rev().find(|k| about.contains_key(format!("NI_Scale[{k}]_Scale_Type").as_str()));
    let refuse = |kind: &str| {
        Err(Error::input(
            Place::file(file),
            format!("channel '{channel}' has a scaling of kind {kind}, which is not supported"),
            "export the file with scaled values",
        ))
    };
    let Some(last) = scales else { return Ok(()) };
    // From the last scaling back to the raw values: each says what it takes in, the one before unless told.
    let (mut chain, mut at) = (Vec::new(), Some(last));
    while let Some(k) = at {
        if chain.len() > MOST {
            return refuse("a circle of scalings");
        }
        let kind = match about.get(format!("NI_Scale[{k}]_Scale_Type").as_str()) {
            Some(Value::Text(kind)) => kind.as_str(),
            Some(Value::Number(_)) => return refuse("unknown"),
            // One without a kind, which LabVIEW counts first, stands for the raw values.
            None => break,
        };
        let input = number(format!("NI_Scale[{k}]_{kind}_Input_Source"));
        chain.push(match kind {
            "Linear" => Scaling::Linear {
                slope: number(format!("NI_Scale[{k}]_Linear_Slope")).unwrap_or(1.0),
                intercept: number(format!("NI_Scale[{k}]_Linear_Y_Intercept")).unwrap_or(0.0),
            },
            "Polynomial" => {
                let size = number(format!("NI_Scale[{k}]_Polynomial_Coefficients_Size")).unwrap_or(4.0);
                let coefficient = |j: usize| number(format!("NI_Scale[{k}]_Polynomial_Coefficients[{j}]"));
                Scaling::Polynomial((0..(size as usize).min(MOST)).map(|j| coefficient(j).unwrap_or(0.0)).collect())
            }
            other => return refuse(other),
        });
        at = match input {
            Some(input) if input == RAW => None,
            Some(input) if input >= 0.0 && (input as usize) < MOST => Some(input as usize),
            Some(_) => return refuse("an unknown input"),
            None => k.checked_sub(1),
        };
    }
    for scaling in chain.iter().rev() {
        match scaling {
            Scaling::Linear { slope, intercept } => values.iter_mut().for_each(|x| *x = *x * slope + intercept),
            Scaling::Polynomial(coefficients) => {
                values.iter_mut().for_each(|x| *x = coefficients.iter().rev().fold(0.0, |sum, c| sum * *x + c));
            }
        }
    }
    Ok(())
}
