//! The table of recordings: one row each.

use std::collections::BTreeMap;

use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;

use super::columns::{Cells, Columns, Parts};
use super::entry::{Content, Entry};
use super::exact::Samples;
use super::grid::Grid;
use super::table::{Key, Table, bytes, contents, text};
use crate::recording::{Channel, Motion};

/// Recordings.
#[derive(Debug)]
pub struct Recordings;

/// The columns that tell about a recording without its samples.
pub fn is_about(path: &str) -> bool {
    ["sha256", "serial", "time", "sample_time_s", "start_s", "samples", "temperature_c", "pressure_hpa"].contains(&path)
}

/// What follows the names of samples, however they stand.
const SAMPLES: &str = "
    optional double gain;
    optional double zero;
    optional double divisor;
    optional double offset;
    optional group int16 (LIST) { repeated group list { optional int32 element (INTEGER(16,true)); } }
    optional group float32 (LIST) { repeated group list { optional float element; } }
    optional group float64 (LIST) { repeated group list { optional double element; } }";

/// Groups that hold samples: the channels by name, and the list of the others.
fn channel(channel: Channel) -> &'static str {
    channel.column()
}
const OTHERS: &str = "others.list.element";

impl Table for Recordings {
    type Row = Entry;
    const FOLDER: &'static str = "recordings";
    const FULL: usize = 64;
    const KEYS: &'static [&'static str] = &["sha256"];

    fn schema() -> String {
        let flags = |name: &str| {
            format!("optional group {name} (LIST) {{ repeated group list {{ optional boolean element; }} }}\n")
        };
        let channels: String = Channel::ALL
            .iter()
            .map(|c| format!("optional group {} {{ optional binary unit (UTF8); {SAMPLES} }}\n", channel(*c)))
            .collect();
        format!(
            "message recording {{
                required binary sha256 (UTF8);
                optional binary serial (UTF8);
                optional int64 time (TIMESTAMP(MICROS,false));
                required double rate_hz;
                required double sample_time_s;
                required double start_s;
                required int32 samples;
                optional double temperature_c;
                optional double pressure_hpa;
                required binary motion (UTF8);
                required binary file (UTF8);
                required binary file_sha256 (UTF8);
                {channels}
                optional group others (LIST) {{ repeated group list {{ optional group element {{
                    optional binary name (UTF8); {SAMPLES}
                }} }} }}
                {}{}{}
                optional group metadata (MAP) {{ repeated group key_value {{
                    required binary key (UTF8);
                    optional binary value (UTF8);
                }} }}
                required binary details (UTF8);
            }}",
            flags("valid"),
            flags("rotor_locked"),
            flags("supply_open"),
        )
    }

    fn keys(columns: &Columns) -> Result<Vec<Key>, ParquetError> {
        Ok(contents(columns, "sha256")?.into_iter().map(|content| content.0).collect())
    }

    fn key(row: &Entry) -> Key {
        row.content.0
    }

    fn bytes(row: &Entry) -> usize {
        row.bytes()
    }

    fn put(row: &Entry, columns: &mut Columns) -> Result<(), ParquetError> {
        let c = columns;
        c.leaf_mut("sha256")?.put(0, Some(bytes(&row.content.to_string())), 0);
        c.leaf_mut("serial")?.put(0, row.serial.as_deref().map(bytes), 0);
        c.leaf_mut("time")?.put(0, row.time_us, 0);
        c.leaf_mut("rate_hz")?.put(0, Some(1.0 / row.sample_time_s), 0);
        c.leaf_mut("sample_time_s")?.put(0, Some(row.sample_time_s), 0);
        c.leaf_mut("start_s")?.put(0, Some(row.start_s), 0);
        let samples = i32::try_from(row.samples).map_err(|_| ParquetError::General("too many samples".into()))?;
        c.leaf_mut("samples")?.put(0, Some(samples), 0);
        c.leaf_mut("temperature_c")?.put(0, row.temperature_c, 0);
        c.leaf_mut("pressure_hpa")?.put(0, row.pressure_hpa, 0);
        let motion = if row.motion == Motion::Linear { "linear" } else { "rotary" };
        c.leaf_mut("motion")?.put(0, Some(bytes(motion)), 0);
        c.leaf_mut("file")?.put(0, Some(bytes(&row.name)), 0);
        c.leaf_mut("file_sha256")?.put(0, Some(bytes(&row.file_sha256)), 0);
        for known in Channel::ALL {
            let (group, samples) = (channel(known), row.channels.get(&known));
            let outside = i16::from(samples.is_some());
            let unit = samples.map(|_| bytes(known.unit(row.motion)));
            c.leaf_mut(&format!("{group}.unit"))?.put(0, unit, outside);
            put_samples(c, group, 0, outside, samples)?;
        }
        let mut repetition = 0;
        for (name, samples) in &row.others {
            c.leaf_mut(&format!("{OTHERS}.name"))?.put(repetition, Some(bytes(name)), 3);
            put_samples(c, OTHERS, repetition, 3, Some(samples))?;
            repetition = 1;
        }
        if row.others.is_empty() {
            c.leaf_mut::<ByteArray>(&format!("{OTHERS}.name"))?.put(0, None, 0);
            put_samples(c, OTHERS, 0, 0, None)?;
        }
        for (name, flags) in
            [("valid", &row.valid), ("rotor_locked", &row.rotor_locked), ("supply_open", &row.supply_open)]
        {
            let flags = flags.as_ref().map(|flags| flags.iter().copied().map(Some));
            c.leaf_mut(&format!("{name}.list.element"))?.put_list(0, flags, 0);
        }
        let mut repetition = 0;
        for (key, value) in &row.metadata {
            c.leaf_mut("metadata.key_value.key")?.put(repetition, Some(bytes(key)), 2);
            c.leaf_mut("metadata.key_value.value")?.put(repetition, Some(bytes(value)), 2);
            repetition = 1;
        }
        if row.metadata.is_empty() {
            c.leaf_mut::<ByteArray>("metadata.key_value.key")?.put(0, None, 1);
            c.leaf_mut::<ByteArray>("metadata.key_value.value")?.put(0, None, 1);
        }
        let details = serde_json::to_string(&row.details).map_err(|e| ParquetError::External(Box::new(e)))?;
        c.leaf_mut("details")?.put(0, Some(bytes(&details)), 0);
        Ok(())
    }

    fn take(columns: &Columns) -> Result<Vec<Result<Entry, String>>, ParquetError> {
        let c = columns;
        let sha256 = c.rows::<ByteArray>("sha256")?;
        let mut serial = c.rows::<ByteArray>("serial")?;
        let mut time = c.rows::<i64>("time")?;
        let mut sample_time = c.rows::<f64>("sample_time_s")?;
        let mut start = c.rows::<f64>("start_s")?;
        let mut samples = c.rows::<i32>("samples")?;
        let mut temperature = c.rows::<f64>("temperature_c")?;
        let mut pressure = c.rows::<f64>("pressure_hpa")?;
        let mut motion = c.rows::<ByteArray>("motion")?;
        let mut file = c.rows::<ByteArray>("file")?;
        let mut file_sha256 = c.rows::<ByteArray>("file_sha256")?;
        let mut channels = Vec::new();
        for known in Channel::ALL {
            channels.push((known, SampleRows::of(c, channel(known))?));
        }
        let mut other_names = c.rows::<ByteArray>("others.list.element.name")?;
        let mut others = SampleRows::of(c, OTHERS)?;
        let mut valid = c.rows::<bool>("valid.list.element")?;
        let mut locked = c.rows::<bool>("rotor_locked.list.element")?;
        let mut open = c.rows::<bool>("supply_open.list.element")?;
        let mut keys = c.rows::<ByteArray>("metadata.key_value.key")?;
        let mut values = c.rows::<ByteArray>("metadata.key_value.value")?;
        let mut details = c.rows::<ByteArray>("details")?;

        let mut rows = Vec::new();
        for sha256 in sha256 {
            // Every column is read on, whatever becomes of the row.
            let (serial, time, sample_time, start) = (serial.next(), time.next(), sample_time.next(), start.next());
            let (samples, temperature, pressure) = (samples.next(), temperature.next(), pressure.next());
            let (motion, file, file_sha256) = (motion.next(), file.next(), file_sha256.next());
            let mut taken = BTreeMap::new();
            let mut damaged = None;
            for (known, cells) in &mut channels {
                match cells.next().map(|cells| cells.samples(1)) {
                    Some(Ok(samples)) => taken.extend(samples.map(|samples| (*known, samples))),
                    Some(Err(what)) => damaged = Some(format!("{}: {what}", known.column())),
                    None => damaged = Some(format!("{}: the row is missing", known.column())),
                }
            }
            let mut carried = Vec::new();
            if let (Some(names), Some(cells)) = (other_names.next(), others.next())
                && names.is_there(3)
            {
                let parts = cells.parts(1);
                for (name, cells) in names.parts(1).zip(parts) {
                    match (text(&name), cells.samples(3)) {
                        (Some(name), Ok(Some(samples))) => carried.push((name, samples)),
                        (_, Err(what)) => damaged = Some(what),
                        _ => damaged = Some("a column without name or values".to_owned()),
                    }
                }
            }
            let flags = |cells: Option<Cells<'_, bool>>| -> Option<Vec<bool>> {
                cells?.list(0).map(|list| list.into_iter().map(|flag| flag.unwrap_or(false)).collect())
            };
            let (valid, locked, open) = (flags(valid.next()), flags(locked.next()), flags(open.next()));
            let mut metadata = BTreeMap::new();
            if let (Some(keys), Some(values)) = (keys.next(), values.next()) {
                let pairs = keys.parts(1).zip(values.parts(1));
                metadata.extend(pairs.filter_map(|(key, value)| Some((text(&key)?, text(&value)?))));
            }
            let details = details.next().and_then(|cell| text(&cell));
            let row = || -> Option<Entry> {
                Some(Entry {
                    content: Content::parse(&text(&sha256)?)?,
                    serial: text(&serial?),
                    time_us: time?.value().copied(),
                    sample_time_s: *sample_time?.value()?,
                    start_s: *start?.value()?,
                    samples: usize::try_from(*samples?.value()?).ok()?,
                    temperature_c: temperature?.value().copied(),
                    pressure_hpa: pressure?.value().copied(),
                    motion: if text(&motion?)? == "linear" { Motion::Linear } else { Motion::Rotary },
                    name: text(&file?)?,
                    file_sha256: text(&file_sha256?)?,
                    channels: taken,
                    others: carried,
                    valid,
                    rotor_locked: locked,
                    supply_open: open,
                    metadata,
                    details: serde_json::from_str(&details?).ok()?,
                })
            };
            rows.push(match (damaged, row()) {
                (Some(what), _) => Err(what),
                (None, None) => Err("a column holds something else".to_owned()),
                (None, Some(entry)) if entry.digest() != entry.content => {
                    Err("the samples are not those of its SHA-256".to_owned())
                }
                (None, Some(entry)) => Ok(entry),
            });
        }
        Ok(rows)
    }
}

/// Puts samples into a group, or that there are none: what encloses them is there as far as a level.
fn put_samples(
    columns: &mut Columns,
    group: &str,
    repetition: i16,
    outside: i16,
    samples: Option<&Samples>,
) -> Result<(), ParquetError> {
    let grid = samples.and_then(|s| if let Samples::Int16(grid, _) = s { Some(*grid) } else { None });
    type Part = (&'static str, fn(Grid) -> f64);
    let parts: [Part; 4] =
        [("gain", |g| g.gain), ("zero", |g| g.zero), ("divisor", |g| g.divisor), ("offset", |g| g.offset)];
    for (name, of) in parts {
        columns.leaf_mut(&format!("{group}.{name}"))?.put(repetition, grid.map(of), outside);
    }
    let (mut counts, mut floats, mut doubles) = (None, None, None);
    match samples {
        Some(Samples::Int16(_, values)) => counts = Some(values.iter().map(|x| x.map(i32::from))),
        Some(Samples::Float32(values)) => floats = Some(values.iter().copied()),
        Some(Samples::Float64(values)) => doubles = Some(values.iter().copied()),
        None => {}
    }
    columns.leaf_mut(&format!("{group}.int16.list.element"))?.put_list(repetition, counts, outside);
    columns.leaf_mut(&format!("{group}.float32.list.element"))?.put_list(repetition, floats, outside);
    columns.leaf_mut(&format!("{group}.float64.list.element"))?.put_list(repetition, doubles, outside);
    Ok(())
}

/// A group of samples, row by row.
struct SampleRows<'a> {
    grid: [Parts<'a, f64>; 4],
    counts: Parts<'a, i32>,
    floats: Parts<'a, f32>,
    doubles: Parts<'a, f64>,
}

impl<'a> SampleRows<'a> {
    fn of(columns: &'a Columns, group: &str) -> Result<Self, ParquetError> {
        let number = |name: &str| columns.rows(&format!("{group}.{name}"));
        Ok(Self {
            grid: [number("gain")?, number("zero")?, number("divisor")?, number("offset")?],
            counts: columns.rows(&format!("{group}.int16.list.element"))?,
            floats: columns.rows(&format!("{group}.float32.list.element"))?,
            doubles: columns.rows(&format!("{group}.float64.list.element"))?,
        })
    }
}

impl<'a> Iterator for SampleRows<'a> {
    type Item = SampleCells<'a>;

    fn next(&mut self) -> Option<SampleCells<'a>> {
        let [gain, zero, divisor, offset] = self.grid.each_mut().map(Iterator::next);
        let (counts, floats, doubles) = (self.counts.next(), self.floats.next(), self.doubles.next());
        Some(SampleCells {
            grid: [gain?, zero?, divisor?, offset?],
            counts: counts?,
            floats: floats?,
            doubles: doubles?,
        })
    }
}

/// The samples of one row, or of an element of its list.
#[derive(Clone, Copy)]
struct SampleCells<'a> {
    grid: [Cells<'a, f64>; 4],
    counts: Cells<'a, i32>,
    floats: Cells<'a, f32>,
    doubles: Cells<'a, f64>,
}

impl<'a> SampleCells<'a> {
    fn parts(self, level: i16) -> impl Iterator<Item = Self> {
        let [mut gain, mut zero, mut divisor, mut offset] = self.grid.map(|cells| cells.parts(level));
        let (mut counts, mut floats, mut doubles) =
            (self.counts.parts(level), self.floats.parts(level), self.doubles.parts(level));
        std::iter::from_fn(move || {
            Some(Self {
                grid: [gain.next()?, zero.next()?, divisor.next()?, offset.next()?],
                counts: counts.next()?,
                floats: floats.next()?,
                doubles: doubles.next()?,
            })
        })
    }

    /// The samples, of a group that is there from a level on; none: it is not.
    fn samples(&self, there: i16) -> Result<Option<Samples>, String> {
        if !self.counts.is_there(there) {
            return Ok(None);
        }
        let (counts, floats, doubles) = (self.counts.list(there), self.floats.list(there), self.doubles.list(there));
        match (counts, floats, doubles) {
            (Some(counts), None, None) => {
                let [gain, zero, divisor, offset] = self.grid.map(|cell| cell.value().copied());
                let grid = || Some(Grid { gain: gain?, zero: zero?, divisor: divisor?, offset: offset? });
                let grid = grid().ok_or("counts without gain and offset")?;
                let count = |count: Option<i32>| count.map(i16::try_from).transpose();
                let counts = counts.into_iter().map(count).collect::<Result<_, _>>();
                Ok(Some(Samples::Int16(grid, counts.map_err(|_| "counts beyond 16 bits")?)))
            }
            (None, Some(floats), None) => Ok(Some(Samples::Float32(floats))),
            (None, None, Some(doubles)) => Ok(Some(Samples::Float64(doubles))),
            _ => Err("samples in no form, or in more than one".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use parquet::record::Field;
    use serde_json::{Value, json};

    use super::*;
    use crate::recording::{Extra, Recording};

    fn entries() -> Vec<Entry> {
        let make = |n: u32, extras: usize, metadata: usize| {
            let values = |gain: f64| (0..20 + n).map(|k| gain * f64::from(k * 7 % 31)).collect::<Vec<_>>();
            let mut speed = values(1.0 / 3.0);
            speed[3] = f64::NAN;
            let mut builder =
                Recording::builder(1e-4).channel(Channel::Current, values(0.25)).channel(Channel::Speed, speed);
            if n.is_multiple_of(2) {
                builder = builder.channel(Channel::Voltage, values(0.1)).rotor_locked(vec![true; 20 + n as usize]);
            }
            for k in 0..extras {
                builder =
                    builder.extra(Extra { name: format!("x{k}"), values: values(f64::from(k as u32 + n).sqrt()) });
            }
            let metadata = (0..metadata).map(|k| (format!("key {k}"), format!("{n}"))).collect();
            Entry::of(&builder.metadata(metadata).build().unwrap())
        };
        vec![make(0, 0, 0), make(1, 2, 3), make(2, 0, 1), make(3, 1, 0), make(4, 3, 2)]
    }

    #[test]
    fn rows_come_back_from_their_columns() {
        let entries = entries();
        let mut columns = Columns::of(&Recordings::schema()).unwrap();
        entries.iter().try_for_each(|entry| Recordings::put(entry, &mut columns)).unwrap();
        let taken: Result<Vec<Entry>, String> = Recordings::take(&columns).unwrap().into_iter().collect();
        assert_eq!(taken.unwrap(), entries);
    }

    fn json(field: &Field) -> Value {
        match field {
            Field::Null => Value::Null,
            Field::Short(x) => json!(x),
            Field::Int(x) => json!(x),
            Field::Float(x) => json!(x),
            Field::Double(x) => json!(x),
            Field::Str(x) => json!(x),
            Field::Group(row) => row.get_column_iter().map(|(name, field)| (name.clone(), json(field))).collect(),
            Field::ListInternal(list) => list.elements().iter().map(json).collect(),
            Field::MapInternal(map) => {
                let name = |field: &Field| json(field).as_str().unwrap().to_owned();
                map.entries().iter().map(|(key, value)| (name(key), json(value))).collect()
            }
            other => json!(other.to_string()),
        }
    }

    /// The crate's own reader of nested rows knows nothing of the levels here.
    #[test]
    fn another_reader_finds_the_same_lists() {
        use parquet::file::reader::{FileReader, SerializedFileReader};

        let entries = entries();
        let mut columns = Columns::of(&Recordings::schema()).unwrap();
        entries.iter().try_for_each(|entry| Recordings::put(entry, &mut columns)).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.parquet");
        std::fs::write(&path, columns.encode(&[]).unwrap()).unwrap();
        let file = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
        let mut rows = 0;
        for (row, entry) in file.get_row_iter(None).unwrap().zip(&entries) {
            let json = json(&Field::Group(row.unwrap()));
            assert_eq!(json["sha256"], entry.content.to_string());
            for channel in Channel::ALL {
                let group = &json[channel.column()];
                let Some(samples) = entry.channels.get(&channel) else {
                    assert!(group.is_null(), "{group}");
                    continue;
                };
                let list = group[samples.name()].as_array().unwrap();
                assert_eq!(list.len(), entry.samples);
                for (n, x) in list.iter().enumerate() {
                    let part = |name: &str| group[name].as_f64().unwrap();
                    let value = match samples {
                        Samples::Int16(..) => {
                            x.as_f64().map(|x| (x + part("zero")) * part("gain") / part("divisor") + part("offset"))
                        }
                        _ => x.as_f64(),
                    };
                    assert_eq!(value, samples.value(n), "{}", channel.column());
                }
            }
            let names: Vec<&str> =
                json["others"].as_array().into_iter().flatten().map(|other| other["name"].as_str().unwrap()).collect();
            assert_eq!(names, entry.others.iter().map(|other| other.0.as_str()).collect::<Vec<_>>());
            let metadata = json["metadata"].as_object().map_or(0, |map| map.len());
            assert_eq!(metadata, entry.metadata.len());
            rows += 1;
        }
        assert_eq!(rows, entries.len());
    }

    #[test]
    fn a_row_with_other_samples_than_its_digest_is_told_alone() {
        let mut entries = entries();
        entries[1].content = entries[0].content;
        let mut columns = Columns::of(&Recordings::schema()).unwrap();
        entries.iter().try_for_each(|entry| Recordings::put(entry, &mut columns)).unwrap();
        let taken = Recordings::take(&columns).unwrap();
        let damaged: Vec<usize> = (0..taken.len()).filter(|k| taken[*k].is_err()).collect();
        assert_eq!(damaged, [1]);
    }
}
