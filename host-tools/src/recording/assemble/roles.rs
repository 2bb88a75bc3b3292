//! Which column has which role.

use std::collections::BTreeMap;

use super::{Assembly, Use};
use crate::error::{Error, Place, Result};
use crate::recording::Channel;
use crate::recording::mapping::{self, Source};
use crate::recording::names::Role;

impl Assembly<'_> {
    /// The raster with most of voltage, current and speed; then with most further channels; then with most samples.
    pub(super) fn main_raster(&self, mapped: &BTreeMap<Role, Source>) -> usize {
        let mut best = ((0, 0, 0), 0);
        let mut rasters: Vec<usize> = self.table.columns.iter().map(|c| c.raster).collect();
        rasters.sort_unstable();
        rasters.dedup();
        for raster in rasters.into_iter().rev() {
            let has = |channel: Channel| match mapped.get(&Role::Channel(channel)) {
                Some(source) => source.columns().iter().all(|&k| self.table.columns[k].raster == raster),
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
    pub(super) fn choose(&mut self, raster: usize, mapped: BTreeMap<Role, Source>) -> Result<BTreeMap<Role, Use>> {
        let mut uses: BTreeMap<Role, Use> = BTreeMap::new();
        for (role, source) in mapped {
            let elsewhere = source.columns().into_iter().find(|&k| self.table.columns[k].raster != raster);
            if let Some(column) = elsewhere.map(|k| &self.table.columns[k]) {
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
            let taken: Vec<usize> = uses.values().flat_map(|u| u.source.columns()).collect();
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
                    uses.insert(role, Use { source: Source::plain(*column), mapped: false });
                }
                // A second temperature, or the same time again, decides nothing; the first is as good.
                [first, others @ ..]
                    if role == Role::Temperature
                        || role == Role::Time
                            && others
                                .iter()
                                .all(|k| self.table.columns[*k].values == self.table.columns[*first].values) =>
                {
                    uses.insert(role, Use { source: Source::plain(*first), mapped: false });
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
    pub(super) fn refuse_phase_currents(&self, uses: &BTreeMap<Role, Use>) -> Result<()> {
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
}
