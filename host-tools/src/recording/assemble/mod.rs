//! The one path from a table to a recording: roles, units, time, gaps, masks.

mod extras;
mod proposals;
mod rasters;
mod roles;
mod time;
mod values;

use std::collections::BTreeMap;
use std::path::Path;

use crate::error::{Error, Place, Result};
use crate::recording::expression;
use crate::recording::finding::DataFinding;
use crate::recording::mapping::{Mapping, Source};
use crate::recording::names::{self, Header, Role};
use crate::recording::table::Table;
use crate::recording::time_axis;
use crate::recording::units::Quantity;
use crate::recording::{Builder, Channel, Motion, Recording, SourceColumn, clipping};

/// A column that was given a role.
struct Use {
    source: Source,
    mapped: bool,
}

struct Assembly<'a> {
    path: &'a Path,
    table: Table,
    headers: Vec<Header>,
    warnings: Vec<String>,
    findings: Vec<DataFinding>,
}

/// Turns a table into a recording.
///
/// # Errors
/// No usable channel, an ambiguous name, an unknown unit, a time axis that is not uniform, too many missing values.
pub fn assemble(path: &Path, mut table: Table, mapping: &Mapping, sha256: String) -> Result<Recording> {
    let mut headers = table.columns.iter().map(|c| names::header(&c.label)).collect();
    rasters::merge(&mut table, &mut headers);
    let warnings = std::mem::take(&mut table.warnings);
    Assembly { path, table, headers, warnings, findings: Vec::new() }.run(mapping, sha256)
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
            let source = rule.resolve(&self.table.columns, &self.table.left_out);
            mapped.insert(rule.role, source.map_err(|(what, remedy)| self.whole(what, remedy))?);
        }
        let raster = self.main_raster(&mapped);
        self.align(raster);
        let uses = self.choose(raster, mapped)?;
        self.leave_out_doubled(raster, &uses);
        let rows = self.rows(raster);
        if rows == 0 {
            let what = format!("there are no samples{}", self.left_out());
            return Err(self.whole(what, "record at least two samples"));
        }
        self.refuse_phase_currents(&uses)?;
        self.ask_for_the_motors_voltage(&uses)?;

        if !uses.keys().any(|role| matches!(role, Role::Channel(_))) {
            return Err(self.nothing_recognised());
        }
        let usable = self.marks(&uses, Role::Valid).unwrap_or_else(|| vec![true; rows]);
        let placement = self.time(raster, rows, &uses, &usable, mapping)?;
        let axis = placement.axis;
        let mut motion_seen: Vec<(Channel, Motion)> = Vec::new();
        let mut channels = BTreeMap::new();
        for channel in Channel::ALL {
            let Some(found) = uses.get(&Role::Channel(channel)) else { continue };
            let uses_of = uses.values().flat_map(|u| u.source.columns()).filter(|k| *k == found.source.column);
            let used_once = uses_of.count() == 1;
            let (mut values, quantity) = self.si(Role::Channel(channel), found, axis.interval_s, &usable, used_once)?;
            let turns = channel == Channel::Angle && quantity != Some(Quantity::Length);
            if turns && expression::unwrap_turns(&mut values) {
                let name = &self.table.columns[found.source.column].name;
                self.warnings.push(format!("column '{name}' begins anew at each turn; it is taken to go on"));
            }
            match quantity {
                Some(Quantity::LinearSpeed | Quantity::Length | Quantity::Force) => {
                    motion_seen.push((channel, Motion::Linear));
                }
                Some(Quantity::AngularSpeed | Quantity::Frequency | Quantity::Angle | Quantity::Torque) => {
                    motion_seen.push((channel, Motion::Rotary));
                }
                _ => {}
            }
            self.tell_gaps(found.source.column, &values, &usable)?;
            if found.source.expression.is_some() {
                // It may hold a rate of change.
                placement.borders().into_iter().for_each(|n| values[n] = f64::NAN);
            }
            channels.insert(channel, values);
        }
        let motion = self.motion(&motion_seen)?;
        let flags =
            self.states(&uses, rows).map(|flags| if flags.is_empty() { flags } else { placement.gather(flags, false) });
        let [rotor_locked, supply_open] = flags;
        let measured: Vec<Channel> = channels.keys().copied().collect();
        self.at_rows(&placement, &mut channels);
        let extras = self.extras(raster, &uses, &placement, &usable, &measured);
        let usable = placement.gather(usable, false);
        if axis.interval_s > 0.1 && mapping.sample_time_s.is_none() {
            self.warnings.push(format!(
                "the sampling interval is {} s; if the time is in ms, write --map 't_s={}[ms]'",
                time_axis::short(axis.interval_s),
                uses.get(&Role::Time).map_or("time", |u| self.table.columns[u.source.column].name.as_str())
            ));
        }
        let mut metadata = self.table.metadata.clone();
        // These are fields of the recording; a stale copy would contradict them.
        metadata.retain(|key, _| key != "motion" && !time_axis::is_interval_key(key));
        let builder = Recording::builder(axis.interval_s)
            .path(self.path)
            .sha256(sha256)
            .start_s(axis.start_s)
            .motion(motion)
            .valid(usable)
            .gaps(placement.gaps)
            .findings(std::mem::take(&mut self.findings))
            .rotor_locked(rotor_locked)
            .supply_open(supply_open)
            .metadata(metadata);
        let builder = channels.into_iter().fold(builder, |b, (channel, values)| b.channel(channel, values));
        let builder = extras.into_iter().fold(builder, Builder::extra);
        let builder = uses.iter().fold(builder, |b, (role, found)| b.source(role.column(), self.source(found)));
        let mut recording = builder.build().map_err(|e| {
            self.whole(e.to_string(), "give a recording with values that can be used, or map other columns")
        })?;
        for channel in measured {
            // What bridges missing samples is no value that rests.
            let masked = recording.masked(channel);
            let bridged = |n: &usize| masked.binary_search(n).is_ok() || recording.gaps().iter().any(|g| g.contains(n));
            let at: Vec<usize> = (0..recording.len()).filter(|n| !bridged(n)).collect();
            let all = recording.channel(channel).unwrap_or_default();
            let values: Vec<f64> = at.iter().map(|n| all[*n]).collect();
            for clipped in clipping::find(channel, &values) {
                self.warnings.push(format!(
                    "{} is clipped at {} {}: {} samples are masked",
                    channel.column(),
                    time_axis::short(clipped.level),
                    channel.unit(motion),
                    clipped.samples.len()
                ));
                // They keep their values: the limit is the best that is known of them.
                recording.exclude(clipped.samples.into_iter().map(|k| at[k]));
            }
        }
        Ok(recording.with_warnings(self.warnings))
    }

    fn source(&self, found: &Use) -> SourceColumn {
        let Source { column, gain, offset, unit, .. } = &found.source;
        SourceColumn {
            name: self.table.columns[*column].name.clone(),
            gain: *gain,
            offset: *offset,
            unit: unit.clone(),
        }
    }

    fn rows(&self, raster: usize) -> usize {
        self.table.columns.iter().filter(|c| c.raster == raster).map(|c| c.values.len()).next().unwrap_or(0)
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

    /// Brings channels of other rasters with the same interval to the instants of the main one.
    fn align(&mut self, main: usize) {
        let Some(to) = rasters::axis(&self.table, &self.headers, main) else { return };
        let rows = self.rows(main);
        for raster in rasters::all(&self.table) {
            let wanted: Vec<usize> = (0..self.headers.len())
                .filter(|&k| {
                    let role = self.headers[k].role;
                    let here = |k: usize| self.table.columns[k].raster == main && self.headers[k].role == role;
                    self.table.columns[k].raster == raster
                        && matches!(role, Some(Role::Channel(_)))
                        && !(0..self.headers.len()).any(here)
                })
                .collect();
            if raster == main || wanted.is_empty() {
                continue;
            }
            let Some(from) = rasters::axis(&self.table, &self.headers, raster) else { continue };
            for k in wanted {
                let column = &mut self.table.columns[k];
                let Some((values, later)) = rasters::aligned(&column.values, from, to, rows) else { continue };
                column.values = values;
                column.raster = main;
                self.warnings.push(format!(
                    "column '{}' was sampled apart from the others and begins {} s {}; it is aligned with them by its time",
                    column.name,
                    time_axis::short(later.abs()),
                    if later < 0.0 { "earlier" } else { "later" }
                ));
            }
        }
    }

    fn column_list(&self) -> String {
        let mut names: Vec<&str> = self.table.columns.iter().map(|c| c.name.as_str()).collect();
        let more = if names.len() > 16 { format!(" and {} more", names.len() - 16) } else { String::new() };
        names.truncate(16);
        if names.is_empty() { "no columns".into() } else { format!("{}{more}", names.join(", ")) }
    }

    /// A column of flags; a missing flag is not set.
    fn marks(&self, uses: &BTreeMap<Role, Use>, role: Role) -> Option<Vec<bool>> {
        let found = uses.get(&role)?;
        Some(self.table.columns[found.source.column].values.iter().map(|&x| x != 0.0 && !x.is_nan()).collect())
    }

    /// Where the rotor is held, and where the supply is open.
    fn states(&mut self, uses: &BTreeMap<Role, Use>, rows: usize) -> [Vec<bool>; 2] {
        let mut states = [Role::RotorLocked, Role::SupplyOpen].map(|role| self.marks(uses, role).unwrap_or_default());
        let state = |key: &str| self.table.metadata.get(key).map(|v| v.trim().to_lowercase());
        let mut odd = Vec::new();
        for ((key, on, off), mask) in
            [("rotor", "locked", "free"), ("supply", "open", "connected")].into_iter().zip(&mut states)
        {
            match state(key) {
                Some(value) if value == on => *mask = vec![true; rows],
                Some(value) if value != off && key == "rotor" => {
                    odd.push(format!("'# {key}: {value}' is not understood; '# {key}: {on}' or '# {key}: {off}' are"));
                }
                _ => {}
            }
        }
        self.warnings.extend(odd);
        states
    }
}
