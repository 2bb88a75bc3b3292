//! The table of results: one row for each recording, model and version.

use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::columns::Columns;
use super::entry::Content;
use super::table::{Key, Table, bytes, text};

/// Results.
#[derive(Debug)]
pub struct Results;

/// A parameter that was estimated.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimated {
    /// Its name.
    pub name: String,
    /// Value, SI; none: the recording says nothing about it.
    pub value: Option<f64>,
    /// Its unit.
    pub unit: String,
    /// 95 % interval.
    pub ci95: Option<[f64; 2]>,
    /// Whether the recording determines it.
    pub identifiable: bool,
}

/// What came of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The recording.
    pub recording: Content,
    /// Its motor.
    pub serial: Option<String>,
    /// Its time on the clock, µs since the begin of 1970 there.
    pub time_us: Option<i64>,
    /// SHA-256 of the model file, or the settings in its place.
    pub model: String,
    /// Name of the model file.
    pub model_name: Option<String>,
    /// Version of greyrig.
    pub code: String,
    /// In a word: `identified`, `refused`, or the verdict.
    pub outcome: String,
    /// In a sentence.
    pub text: String,
    /// Free-run error-to-signal ratio of the current.
    pub esr_current: Option<f64>,
    /// The same of the speed.
    pub esr_speed: Option<f64>,
    /// Parameters.
    pub parameters: Vec<Estimated>,
    /// The whole answer, as the command's own JSON has it.
    pub answer: String,
}

/// The key of what would come of a recording.
pub fn key(recording: &Content, model: &str, code: &str) -> Key {
    let mut hash = Sha256::new();
    for part in [recording.to_string().as_str(), model, code] {
        hash.update(part.as_bytes());
        hash.update(b"\0");
    }
    hash.finalize().into()
}

impl Table for Results {
    type Row = Outcome;
    const FOLDER: &'static str = "results";
    const FULL: usize = 4096;
    const KEYS: &'static [&'static str] = &["recording", "model", "code"];

    fn schema() -> String {
        "message result {
            required binary recording (UTF8);
            optional binary serial (UTF8);
            optional int64 time (TIMESTAMP(MICROS,false));
            required binary model (UTF8);
            optional binary model_name (UTF8);
            required binary code (UTF8);
            required binary outcome (UTF8);
            required binary text (UTF8);
            optional double esr_current;
            optional double esr_speed;
            optional group parameters (LIST) { repeated group list { optional group element {
                optional binary name (UTF8);
                optional double value;
                optional binary unit (UTF8);
                optional double low;
                optional double high;
                optional boolean identifiable;
            } } }
            required binary answer (UTF8);
        }"
        .to_owned()
    }

    fn keys(columns: &Columns) -> Result<Vec<Key>, ParquetError> {
        let recordings = super::table::contents(columns, "recording")?;
        let (models, codes) = (columns.rows::<ByteArray>("model")?, columns.rows::<ByteArray>("code")?);
        let rows = recordings.into_iter().zip(models.zip(codes));
        Ok(rows
            .map(|(recording, (model, code))| {
                key(&recording, &text(&model).unwrap_or_default(), &text(&code).unwrap_or_default())
            })
            .collect())
    }

    fn key(row: &Outcome) -> Key {
        key(&row.recording, &row.model, &row.code)
    }

    fn bytes(row: &Outcome) -> usize {
        size_of::<Outcome>() + row.answer.len() + row.parameters.len() * size_of::<Estimated>()
    }

    fn put(row: &Outcome, c: &mut Columns) -> Result<(), ParquetError> {
        c.leaf_mut("recording")?.put(0, Some(bytes(&row.recording.to_string())), 0);
        c.leaf_mut("serial")?.put(0, row.serial.as_deref().map(bytes), 0);
        c.leaf_mut("time")?.put(0, row.time_us, 0);
        c.leaf_mut("model")?.put(0, Some(bytes(&row.model)), 0);
        c.leaf_mut("model_name")?.put(0, row.model_name.as_deref().map(bytes), 0);
        c.leaf_mut("code")?.put(0, Some(bytes(&row.code)), 0);
        c.leaf_mut("outcome")?.put(0, Some(bytes(&row.outcome)), 0);
        c.leaf_mut("text")?.put(0, Some(bytes(&row.text)), 0);
        c.leaf_mut("esr_current")?.put(0, row.esr_current, 0);
        c.leaf_mut("esr_speed")?.put(0, row.esr_speed, 0);
        c.leaf_mut("answer")?.put(0, Some(bytes(&row.answer)), 0);
        let part = |name: &str| format!("parameters.list.element.{name}");
        // A list that is there and empty ends one level above its elements.
        let none = [None];
        let some: Vec<Option<&Estimated>> = row.parameters.iter().map(Some).collect();
        let all: &[Option<&Estimated>] = if some.is_empty() { &none } else { &some };
        for (n, parameter) in all.iter().enumerate() {
            let (repetition, outside) = (i16::from(n > 0), if parameter.is_some() { 3 } else { 1 });
            c.leaf_mut(&part("name"))?.put(repetition, parameter.map(|p| bytes(&p.name)), outside);
            c.leaf_mut(&part("value"))?.put(repetition, parameter.and_then(|p| p.value), outside);
            c.leaf_mut(&part("unit"))?.put(repetition, parameter.map(|p| bytes(&p.unit)), outside);
            c.leaf_mut(&part("low"))?.put(repetition, parameter.and_then(|p| Some(p.ci95?[0])), outside);
            c.leaf_mut(&part("high"))?.put(repetition, parameter.and_then(|p| Some(p.ci95?[1])), outside);
            c.leaf_mut(&part("identifiable"))?.put(repetition, parameter.map(|p| p.identifiable), outside);
        }
        Ok(())
    }

    fn take(c: &Columns) -> Result<Vec<Result<Outcome, String>>, ParquetError> {
        let text_of = |name: &str| c.rows::<ByteArray>(name);
        let recordings = super::table::contents(c, "recording")?;
        let (mut serial, mut time) = (text_of("serial")?, c.rows::<i64>("time")?);
        let (mut model, mut model_name, mut code) = (text_of("model")?, text_of("model_name")?, text_of("code")?);
        let (mut outcome, mut told, mut answer) = (text_of("outcome")?, text_of("text")?, text_of("answer")?);
        let (mut current, mut speed) = (c.rows::<f64>("esr_current")?, c.rows::<f64>("esr_speed")?);
        let part = |name: &str| format!("parameters.list.element.{name}");
        let (mut names, mut units) = (text_of(&part("name"))?, text_of(&part("unit"))?);
        let (mut values, mut identifiable) = (c.rows::<f64>(&part("value"))?, c.rows::<bool>(&part("identifiable"))?);
        let (mut low, mut high) = (c.rows::<f64>(&part("low"))?, c.rows::<f64>(&part("high"))?);
        let mut rows = Vec::new();
        for recording in recordings {
            let (serial, time) = (serial.next(), time.next());
            let (model, model_name, code) = (model.next(), model_name.next(), code.next());
            let (outcome, told, answer) = (outcome.next(), told.next(), answer.next());
            let (current, speed) = (current.next(), speed.next());
            let (names, units, values) = (names.next(), units.next(), values.next());
            let (identifiable, low, high) = (identifiable.next(), low.next(), high.next());
            let row = || -> Option<Outcome> {
                let mut parameters = Vec::new();
                let names = names?;
                if names.is_there(3) {
                    let (mut units, mut values) = (units?.parts(1), values?.parts(1));
                    let (mut identifiable, mut low, mut high) = (identifiable?.parts(1), low?.parts(1), high?.parts(1));
                    for name in names.parts(1) {
                        let (low, high) = (low.next()?.value().copied(), high.next()?.value().copied());
                        parameters.push(Estimated {
                            name: text(&name)?,
                            value: values.next()?.value().copied(),
                            unit: text(&units.next()?)?,
                            ci95: low.zip(high).map(|(low, high)| [low, high]),
                            identifiable: *identifiable.next()?.value()?,
                        });
                    }
                }
                Some(Outcome {
                    recording,
                    serial: text(&serial?),
                    time_us: time?.value().copied(),
                    model: text(&model?)?,
                    model_name: text(&model_name?),
                    code: text(&code?)?,
                    outcome: text(&outcome?)?,
                    text: text(&told?)?,
                    esr_current: current?.value().copied(),
                    esr_speed: speed?.value().copied(),
                    parameters,
                    answer: text(&answer?)?,
                })
            };
            rows.push(row().ok_or_else(|| "a column holds something else".to_owned()));
        }
        Ok(rows)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_from_their_columns() {
        let parameter = |name: &str, value: Option<f64>| Estimated {
            name: name.into(),
            value,
            unit: "ohm".into(),
            ci95: value.map(|value| [value - 1.0, value + 1.0]),
            identifiable: value.is_some(),
        };
        let make = |n: u8, parameters: Vec<Estimated>| Outcome {
            recording: Content([n; 32]),
            serial: (n > 0).then(|| format!("S{n}")),
            time_us: (n > 1).then_some(5),
            model: "kind=universal".into(),
            model_name: None,
            code: "1".into(),
            outcome: "identified".into(),
            text: String::new(),
            esr_current: Some(0.01),
            esr_speed: None,
            parameters,
            answer: "{}".into(),
        };
        let rows = [
            make(0, vec![]),
            make(1, vec![parameter("R", Some(2.0)), parameter("L", None)]),
            make(2, vec![]),
            make(3, vec![parameter("K", None)]),
        ];
        let mut columns = Columns::of(&Results::schema()).unwrap();
        rows.iter().try_for_each(|row| Results::put(row, &mut columns)).unwrap();
        let taken: Result<Vec<Outcome>, String> = Results::take(&columns).unwrap().into_iter().collect();
        assert_eq!(taken.unwrap(), rows);
        assert_eq!(Results::keys(&columns).unwrap(), rows.each_ref().map(Results::key));
    }
}
