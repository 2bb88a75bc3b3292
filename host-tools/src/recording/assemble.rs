//! The one path from a table to a recording: roles, units, time, gaps, masks.

use std::collections::BTreeMap;
use std::path::Path;

use super::mapping::{self, Mapping, Source};
use super::names::{self, Bare, Header, Role};
use super::table::{Column, Table};
use super::time_axis::{self, TimeAxis};
use super::units::{Quantity, Unit};
use super::{Channel, Extra, Motion, Recording, clipping};
use crate::error::{Error, Place, Result};

/// A column that was given a role.
struct Use {
    source: Source,
    mapped: bool,
}

struct Assembly<'a> {
    path: &'a Path,
    table: &'a Table,
    headers: Vec<Header>,
    warnings: Vec<String>,
}

/// Turns a table into a recording.
///
/// # Errors
/// No usable channel, an ambiguous name, an unknown unit, a time axis that is not uniform, too many missing values.
pub fn assemble(path: &Path, table: &Table, mapping: &Mapping, sha256: String) -> Result<Recording> {
    let headers = table.columns.iter().map(|c| names::header(&c.label)).collect();
    Assembly { path, table, headers, warnings: table.warnings.clone() }.run(mapping, sha256)
}

impl Assembly<'_> {
    fn whole(&self, what: impl Into<String>, remedy: impl Into<String>) -> Error {
        Error::input(Place::file(self.path), what, remedy)
    }

    /// An error at a row of a column: line and column in a text file, else the row's number in words.
    fn at(&self, row: usize, column: Option<usize>, what: &str, remedy: impl Into<String>) -> Error {
        let (line, position) = (self.table.line(row), column.map_or(0, |c| self.table.columns[c].position));
        let name = column.map(|c| format!("column {}, ", self.table.columns[c].name)).unwrap_or_default();
        if line > 0 {
            let name = name.replace(", ", ": ");
            Error::input(Place::at(self.path, line, position), format!("{name}{what}"), remedy)
        } else {
            self.whole(format!("{name}row {}: {what}", row + 1), remedy)
        }
    }

    fn run(mut self, mapping: &Mapping, sha256: String) -> Result<Recording> {
        let mut mapped: BTreeMap<Role, Source> = BTreeMap::new();
        for rule in &mapping.rules {
            let source = rule.resolve(&self.table.columns, &self.table.text_columns);
            mapped.insert(rule.role, source.map_err(|(what, remedy)| self.whole(what, remedy))?);
        }
        let raster = self.main_raster(&mapped);
        let uses = self.choose(raster, mapped)?;
        let rows = self.rows(raster);
        if rows == 0 {
            return Err(self.whole("there are no samples", "record at least two samples"));
        }
        self.refuse_phase_currents(&uses)?;

        let mut motion_seen: Vec<(Channel, Motion)> = Vec::new();
        let mut channels = BTreeMap::new();
        let mut valid = vec![true; rows];
        for channel in Channel::ALL {
            let Some(found) = uses.get(&Role::Channel(channel)) else { continue };
            let (mut values, quantity) = self.si(Role::Channel(channel), found)?;
            match quantity {
                Some(Quantity::LinearSpeed | Quantity::Length | Quantity::Force) => {
                    motion_seen.push((channel, Motion::Linear));
                }
                Some(Quantity::AngularSpeed | Quantity::Frequency | Quantity::Angle | Quantity::Torque) => {
                    motion_seen.push((channel, Motion::Rotary));
                }
                _ => {}
            }
            self.fill_gaps(found.source.column, &mut values, &mut valid)?;
            channels.insert(channel, values);
        }
        if channels.is_empty() {
            return Err(self.nothing_recognised());
        }
        let motion = self.motion(&motion_seen)?;
        let axis = self.time(raster, rows, &uses, mapping)?;

        let mut recording = Recording {
            path: self.path.to_owned(),
            sha256,
            start_s: axis.start_s,
            sample_time_s: axis.interval_s,
            motion,
            valid,
            metadata: self.table.metadata.clone(),
            ..Recording::default()
        };
        for (&channel, values) in &channels {
            for clipped in clipping::find(channel, values) {
                self.warnings.push(format!(
                    "{} is clipped at {} {}: {} samples are masked",
                    channel.column(),
                    time_axis::short(clipped.level),
                    channel.unit(motion),
                    clipped.samples.len()
                ));
                for k in clipped.samples {
                    recording.valid[k] = false;
                }
            }
        }
        recording.channels = channels;
        self.masks(&uses, &mut recording);
        self.extras(raster, &uses, axis, &mut recording);
        // These are fields of the recording from here on; a stale copy would contradict them.
        recording.metadata.retain(|key, _| key != "motion" && !time_axis::is_interval_key(key));
        if axis.interval_s > 0.1 && mapping.sample_time_s.is_none() {
            self.warnings.push(format!(
                "the sampling interval is {} s; if the time is in ms, write --map 't_s={}[ms]'",
                time_axis::short(axis.interval_s),
                uses.get(&Role::Time).map_or("time", |u| self.table.columns[u.source.column].name.as_str())
            ));
        }
        recording.warnings = self.warnings;
        Ok(recording)
    }

    fn rows(&self, raster: usize) -> usize {
        self.table.columns.iter().filter(|c| c.raster == raster).map(|c| c.values.len()).next().unwrap_or(0)
    }

    /// The raster with most of voltage, current and speed; then with most further channels; then with most samples.
    fn main_raster(&self, mapped: &BTreeMap<Role, Source>) -> usize {
        let mut best = ((0, 0, 0), 0);
        let mut rasters: Vec<usize> = self.table.columns.iter().map(|c| c.raster).collect();
        rasters.sort_unstable();
        rasters.dedup();
        for raster in rasters.into_iter().rev() {
            let has = |channel: Channel| match mapped.get(&Role::Channel(channel)) {
                Some(source) => self.table.columns[source.column].raster == raster,
                None => (0..self.headers.len()).any(|k| {
                    self.table.columns[k].raster == raster && self.headers[k].role == Some(Role::Channel(channel))
                }),
            };
            let main = [Channel::Voltage, Channel::Current, Channel::Speed].into_iter().filter(|&c| has(c)).count();
            let other = [Channel::Angle, Channel::Torque].into_iter().filter(|&c| has(c)).count();
            let score = (main, other, self.rows(raster));
            if score >= best.0 {
                best = (score, raster);
            }
        }
        best.1
    }

    /// Gives each role its column: by `--map`, else by name.
    fn choose(&mut self, raster: usize, mapped: BTreeMap<Role, Source>) -> Result<BTreeMap<Role, Use>> {
        let mut uses: BTreeMap<Role, Use> = BTreeMap::new();
        for (role, source) in mapped {
            let column = &self.table.columns[source.column];
            if column.raster != raster {
                return Err(self.whole(
                    format!(
                        "--map {}={} has {} samples, the other channels have {}",
                        role.column(),
                        column.name,
                        column.values.len(),
                        self.rows(raster)
                    ),
                    "map channels of one sampling rate, or resample before",
                ));
            }
            uses.insert(role, Use { source, mapped: true });
        }
        let mut roles: Vec<Role> = Role::TARGETS.iter().map(|t| t.1).collect();
        roles.sort_unstable();
        roles.dedup();
        for role in roles {
            if uses.contains_key(&role) {
                continue;
            }
            let taken: Vec<usize> = uses.values().map(|u| u.source.column).collect();
            let mut candidates: Vec<usize> = (0..self.table.columns.len())
                .filter(|&k| {
                    let column = &self.table.columns[k];
                    column.raster == raster
                        && !taken.contains(&k)
                        && (self.headers[k].role == Some(role) && !column.is_time
                            || role == Role::Time && column.is_time)
                })
                .collect();
            if candidates.len() > 1 {
                let decided =
                    |k: &&usize| self.headers[**k].exact || role == Role::Time && self.table.columns[**k].is_time;
                let exact: Vec<usize> = candidates.iter().filter(decided).copied().collect();
                if exact.len() == 1 {
                    candidates = exact;
                }
            }
            match candidates.as_slice() {
                [] => {}
                [column] => {
                    let source = Source { column: *column, gain: 1.0, offset: 0.0, unit: None, scaled: false };
                    uses.insert(role, Use { source, mapped: false });
                }
                // A second time column or temperature decides nothing; the first is as good.
                [first, ..] if role == Role::Temperature => {
                    let source = Source { column: *first, gain: 1.0, offset: 0.0, unit: None, scaled: false };
                    uses.insert(role, Use { source, mapped: false });
                }
                several => {
                    let list: Vec<String> =
                        several.iter().map(|&k| format!("'{}'", self.table.columns[k].name)).collect();
                    let example = mapping::example_for(role.column(), &self.table.columns[several[0]].name);
                    return Err(Error::input(
                        Place::file(self.path),
                        format!("columns {} could each be {}", list.join(" and "), role.noun()),
                        format!("choose one, for example {example}"),
                    ));
                }
            }
        }
        Ok(uses)
    }

    /// `i_a` beside `i_b` and `i_c` is a phase current, not "the current in A".
    fn refuse_phase_currents(&self, uses: &BTreeMap<Role, Use>) -> Result<()> {
        for (channel, letter) in [(Channel::Current, 'i'), (Channel::Voltage, 'u'), (Channel::Voltage, 'v')] {
            let Some(found) = uses.get(&Role::Channel(channel)).filter(|u| !u.mapped) else { continue };
            let plain = |k: usize| self.headers[k].base.to_lowercase().replace('_', "");
            let first = plain(found.source.column) == format!("{letter}a");
            let second = (0..self.headers.len()).find(|&k| plain(k) == format!("{letter}b"));
            if let (true, Some(second)) = (first, second) {
                let (a, b) = (&self.table.columns[found.source.column].name, &self.table.columns[second].name);
                return Err(self.whole(
                    format!("columns '{a}' and '{b}' look like the phases of a three-phase motor"),
                    format!(
                        "name the column that is {} with {}",
                        Role::Channel(channel).noun(),
                        mapping::example(channel, a)
                    ),
                ));
            }
        }
        Ok(())
    }

    /// The values of a column in SI units, and what they measure where the unit says so.
    fn si(&mut self, role: Role, found: &Use) -> Result<(Vec<f64>, Option<Quantity>)> {
        let column = &self.table.columns[found.source.column];
        let header = &self.headers[found.source.column];
        let stated = found.source.unit.clone().or_else(|| column.unit.clone().filter(|u| !u.trim().is_empty()));
        let stated = stated.or_else(|| header.unit.clone());
        let known = Unit::known(role.quantities());
        let name = &column.name;
        let example = |unit: &str| mapping::example_for(role.column(), &format!("{name}[{unit}]"));
        let unit = match (&stated, header.bare) {
            (Some(text), _) if matches!(text.trim(), "-" | "1" | "none" | "None" | "n/a") => None,
            (Some(text), _) => match Unit::parse(text) {
                None if found.mapped && found.source.scaled => None,
                None => {
                    return Err(self.whole(
                        format!("column '{name}': '{text}' is no known unit of {}", &role.noun()[4..]),
                        format!(
                            "known are {known}; or give the gain to SI, for example {}",
                            mapping::example_for(role.column(), &format!("{name}*0.01"))
                        ),
                    ));
                }
                Some(unit) if !role.quantities().contains(&unit.quantity) => {
                    // With a gain in the mapping the user has said how to get to the quantity.
                    if found.mapped && found.source.scaled && found.source.unit.is_none() {
                        None
                    } else {
                        return Err(self.whole(
                            format!("column '{name}' is in {text}, which is no unit of {}", &role.noun()[4..]),
                            format!(
                                "known are {known}; or give the gain to SI, for example {}",
                                mapping::example_for(role.column(), &format!("{name}*10"))
                            ),
                        ));
                    }
                }
                Some(unit) => Some(unit),
            },
            (None, _) if found.mapped => None,
            (None, Bare::Unit(text)) => Unit::parse(text),
            (None, Bare::Ask) => {
                return Err(self.whole(
                    format!("column '{name}' states no unit"),
                    format!(
                        "write {} or {}",
                        example(if role == Role::Channel(Channel::Speed) { "rpm" } else { "ms" }),
                        example(role.quantities().first().map_or("1", |q| q.si()))
                    ),
                ));
            }
            (None, Bare::Assumed) => {
                let si = role.quantities().first().map_or("", |q| q.si());
                self.warnings.push(format!("column '{name}' states no unit; {si} is assumed"));
                None
            }
            (None, Bare::Si) => None,
        };
        let Source { gain, offset, .. } = found.source;
        let (factor, shift) = unit.map_or((1.0, 0.0), |u| (u.factor, u.offset));
        let values = if (gain, offset, factor, shift) == (1.0, 0.0, 1.0, 0.0) {
            column.values.clone()
        } else {
            column.values.iter().map(|x| (x * gain + offset) * factor + shift).collect()
        };
        if let Some(row) = values.iter().position(|x| x.is_infinite()) {
            return Err(self.at(
                row,
                Some(found.source.column),
                "the value is infinite",
                "remove the row or leave the cell empty",
            ));
        }
        // A time stamp or temperature without a unit, and a mapped column with a gain, tell nothing about the motion.
        Ok((values, unit.map(|u| u.quantity)))
    }

    /// Replaces missing values by a straight line between their neighbours and masks them.
    fn fill_gaps(&mut self, column: usize, values: &mut [f64], valid: &mut [bool]) -> Result<()> {
        let missing = values.iter().filter(|x| x.is_nan()).count();
        if missing == 0 {
            return Ok(());
        }
        let name = &self.table.columns[column].name;
        let first = values.iter().position(|x| x.is_nan()).unwrap_or(0);
        if 2 * missing > values.len() {
            return Err(self.at(
                first,
                Some(column),
                &format!("{missing} of {} values are missing", values.len()),
                "give a column with at least half of its values, or map another one",
            ));
        }
        for (k, ok) in valid.iter_mut().enumerate() {
            *ok &= !values[k].is_nan();
        }
        let mut last: Option<usize> = None;
        for k in 0..values.len() {
            if values[k].is_nan() {
                continue;
            }
            match last {
                None => {
                    let first = values[k];
                    values[..k].fill(first);
                }
                Some(from) => {
                    let (a, b) = (values[from], values[k]);
                    for (step, x) in values[from + 1..k].iter_mut().enumerate() {
                        *x = a + (b - a) * (step + 1) as f64 / (k - from) as f64;
                    }
                }
            }
            last = Some(k);
        }
        if let Some(from) = last {
            let end = values[from];
            values[from + 1..].fill(end);
        }
        let line = self.table.line(first);
        let place = if line > 0 { format!("line {line}") } else { format!("row {}", first + 1) };
        self.warnings.push(format!(
            "{missing} missing values in column '{name}', the first in {place}, are masked and interpolated"
        ));
        Ok(())
    }

    fn motion(&self, seen: &[(Channel, Motion)]) -> Result<Motion> {
        let linear = seen.iter().find(|s| s.1 == Motion::Linear);
        let rotary = seen.iter().find(|s| s.1 == Motion::Rotary);
        match (linear, rotary) {
            (Some(l), Some(r)) => Err(self.whole(
                format!("{} is in units of a linear drive and {} in units of a rotary one", l.0.column(), r.0.column()),
                "map both with gains to one kind of motion, for example --map 'omega_rad_s=v*628.3[rad/s]'",
            )),
            (Some(_), None) => Ok(Motion::Linear),
            (None, Some(_)) => Ok(Motion::Rotary),
            (None, None) => match self.table.metadata.get("motion").map(|m| m.trim()) {
                Some("linear") => Ok(Motion::Linear),
                _ => Ok(Motion::Rotary),
            },
        }
    }

    fn time(&mut self, raster: usize, rows: usize, uses: &BTreeMap<Role, Use>, mapping: &Mapping) -> Result<TimeAxis> {
        if let Some(interval_s) = mapping.sample_time_s {
            return Ok(TimeAxis { start_s: 0.0, interval_s, jitter: 0.0 });
        }
        let stated = time_axis::from_metadata(self.table).map_err(|(what, remedy)| self.whole(what, remedy))?;
        if let Some(found) = uses.get(&Role::Time) {
            let (t, _) = self.si(Role::Time, found)?;
            let mut axis = time_axis::check(&t)
                .map_err(|f| self.at(f.row, Some(found.source.column), &f.what, f.remedy.clone()))?;
            if let Some(interval) = stated {
                // Stamps are rounded, the statement is not: take it where both agree.
                let off = (axis.interval_s / interval - 1.0).abs() * (rows - 1) as f64;
                if off < 0.5 && axis.jitter < 0.5 {
                    axis.interval_s = interval;
                } else {
                    self.warnings.push(format!(
                        "the metadata state a sampling interval of {} s, the time column {} s; the time column is used",
                        time_axis::short(interval),
                        time_axis::short(axis.interval_s)
                    ));
                }
            }
            if axis.jitter > 0.05 {
                self.warnings.push(format!(
                    "the time stamps jitter by up to {:.0} % of the sampling interval; uniform sampling is assumed",
                    100.0 * axis.jitter
                ));
            }
            return Ok(axis);
        }
        let own =
            self.table.columns.iter().filter(|c| c.raster == raster).find_map(|c| Some((c.interval_s?, c.start_s)));
        if let Some((interval_s, start_s)) = own {
            return Ok(TimeAxis { start_s, interval_s, jitter: 0.0 });
        }
        if rows < 2 {
            return Err(self.whole("there is only one sample", "record at least two samples"));
        }
        match stated {
            Some(interval_s) => Ok(TimeAxis { start_s: 0.0, interval_s, jitter: 0.0 }),
            None => Err(self.whole(
                format!("there is no time column among {}", self.column_list()),
                "add a column t_s, or give the interval with --map sample_time_s=1e-4 (in CSV also '# sample_time_s: 1e-4' before the header)",
            )),
        }
    }

    fn column_list(&self) -> String {
        let mut names: Vec<&str> = self.table.columns.iter().map(|c| c.name.as_str()).collect();
        let more = if names.len() > 16 { format!(" and {} more", names.len() - 16) } else { String::new() };
        names.truncate(16);
        if names.is_empty() { "no columns".into() } else { format!("{}{more}", names.join(", ")) }
    }

    fn nothing_recognised(&self) -> Error {
        let free =
            (0..self.headers.len()).filter(|&k| self.headers[k].role.is_none() && !self.table.columns[k].is_time);
        let names = free.map(|k| self.table.columns[k].name.as_str());
        let example = names.take(3).zip(["u_v", "i_a", "omega_rad_s"]);
        let example: Vec<String> = example.map(|(name, target)| mapping::example_for(target, name)).collect();
        if example.is_empty() {
            return self
                .whole("there is no column of numbers", "give a file with columns such as t_s, u_v, i_a, omega_rad_s");
        }
        self.whole(
            format!(
                "no voltage, current, speed, angle or torque is recognised among the columns {}",
                self.column_list()
            ),
            format!("name them, for example {}", example.join(" ")),
        )
    }

    fn masks(&mut self, uses: &BTreeMap<Role, Use>, recording: &mut Recording) {
        let marks = |role: Role| -> Option<Vec<bool>> {
            let found = uses.get(&role)?;
            Some(self.table.columns[found.source.column].values.iter().map(|&x| x != 0.0 && !x.is_nan()).collect())
        };
        if let Some(valid) = marks(Role::Valid) {
            for (ok, mark) in recording.valid.iter_mut().zip(valid) {
                *ok &= mark;
            }
        }
        recording.rotor_locked = marks(Role::RotorLocked).unwrap_or_default();
        recording.supply_open = marks(Role::SupplyOpen).unwrap_or_default();
        let rows = recording.valid.len();
        let state = |key: &str| self.table.metadata.get(key).map(|v| v.trim().to_lowercase());
        let mut odd = Vec::new();
        for (key, on, off, mask) in [
            ("rotor", "locked", "free", &mut recording.rotor_locked),
            ("supply", "open", "connected", &mut recording.supply_open),
        ] {
            match state(key) {
                Some(value) if value == on => *mask = vec![true; rows],
                Some(value) if value != off && key == "rotor" => {
                    odd.push(format!("'# {key}: {value}' is not understood; '# {key}: {on}' or '# {key}: {off}' are"));
                }
                _ => {}
            }
        }
        self.warnings.extend(odd);
    }

    /// Carries the other columns along; those of slower rasters hold their last value.
    fn extras(&mut self, raster: usize, uses: &BTreeMap<Role, Use>, axis: TimeAxis, recording: &mut Recording) {
        let used: Vec<usize> = uses.values().map(|u| u.source.column).collect();
        let rows = recording.valid.len();
        let mut warnings = Vec::new();
        for (k, column) in self.table.columns.iter().enumerate() {
            let temperature = uses.get(&Role::Temperature).filter(|u| u.source.column == k);
            if used.contains(&k) && temperature.is_none() {
                continue;
            }
            if column.is_time || names::is_row_index(&column.label, &column.values) {
                continue;
            }
            let mut values = column.values.clone();
            if column.raster != raster {
                if self.headers[k].role == Some(Role::Time) {
                    continue;
                }
                match self.resample(column, axis, rows) {
                    Some(resampled) => {
                        warnings.push(format!(
                            "column '{}' has another sampling rate ({} samples); it is carried along, holding its last value",
                            column.name,
                            column.values.len()
                        ));
                        values = resampled;
                    }
                    None => {
                        warnings.push(format!(
                            "column '{}' is left out: it has {} samples and no time of its own",
                            column.name,
                            column.values.len()
                        ));
                        continue;
                    }
                }
            } else if self.headers[k].role.is_none() {
                // Said once per column, because a wrong choice among similar columns is hard to notice later.
                let unit = column.unit.as_deref().or(self.headers[k].unit.as_deref()).and_then(Unit::parse);
                let role = unit.and_then(|u| {
                    Channel::ALL.into_iter().find(|c| Role::Channel(*c).quantities().contains(&u.quantity))
                });
                if let Some(channel) = role.filter(|c| !recording.channels.contains_key(c)) {
                    warnings.push(format!(
                        "column '{}' is carried along but not used; if it is {}, write {}",
                        column.name,
                        Role::Channel(channel).noun(),
                        mapping::example(channel, &column.name)
                    ));
                }
            }
            let mut name = column.name.clone();
            if temperature.is_some() {
                let unit = column.unit.as_deref().or(self.headers[k].unit.as_deref()).and_then(Unit::parse);
                if let Some(unit) = unit.filter(|u| u.quantity == Quantity::Temperature) {
                    values.iter_mut().for_each(|x| *x = *x * unit.factor + unit.offset);
                }
                name = Role::Temperature.column().into();
            }
            let Some(hold) = hold_over_gaps(&mut values) else {
                warnings.push(format!("column '{}' is left out: it holds no finite value", column.name));
                continue;
            };
            if hold > 0 {
                warnings.push(format!("column '{}': {hold} missing values hold the value before them", column.name));
            }
            recording.extras.push(Extra { name, values });
        }
        self.warnings.extend(warnings);
    }

    /// Sample and hold onto the main time axis.
    fn resample(&self, column: &Column, axis: TimeAxis, rows: usize) -> Option<Vec<f64>> {
        let time = self
            .table
            .columns
            .iter()
            .enumerate()
            .find(|(k, c)| c.raster == column.raster && (c.is_time || self.headers[*k].role == Some(Role::Time)));
        let own: Vec<f64> = match (time, column.interval_s) {
            (Some((k, time)), _) => {
                let unit = time.unit.as_deref().or(self.headers[k].unit.as_deref()).and_then(Unit::parse);
                time.values.iter().map(|x| x * unit.map_or(1.0, |u| u.factor)).collect()
            }
            (None, Some(interval)) => (0..column.values.len()).map(|k| column.start_s + k as f64 * interval).collect(),
            (None, None) => return None,
        };
        if own.is_empty() || own.len() != column.values.len() || own.windows(2).any(|w| w[1] <= w[0] || w[0].is_nan()) {
            return None;
        }
        let mut at = 0;
        // Half a sample of tolerance: stamps of two rasters agree to rounding only.
        let now = |k: usize| axis.start_s + (k as f64 + 0.5) * axis.interval_s;
        Some(
            (0..rows)
                .map(|k| {
                    while at + 1 < own.len() && own[at + 1] <= now(k) {
                        at += 1;
                    }
                    column.values[at]
                })
                .collect(),
        )
    }
}

/// Replaces missing and infinite values by the last one before (the first one at the start); how many, or none if there
/// is no finite value at all.
fn hold_over_gaps(values: &mut [f64]) -> Option<usize> {
    let mut last = *values.iter().find(|x| x.is_finite())?;
    let mut count = 0;
    for x in values {
        if x.is_finite() {
            last = *x;
        } else {
            *x = last;
            count += 1;
        }
    }
    Some(count)
}
