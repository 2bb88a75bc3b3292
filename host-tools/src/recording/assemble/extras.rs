//! The other columns, carried along.

use std::collections::BTreeMap;

use super::{Assembly, Use};
use crate::recording::mapping;
use crate::recording::names::{self, Role};
use crate::recording::stamps::Placement;
use crate::recording::table::Column;
use crate::recording::time_axis::TimeAxis;
use crate::recording::units::{Quantity, Unit};
use crate::recording::{Channel, Extra};

impl Assembly<'_> {
    /// Carries the other columns along; those of slower rasters hold their last value.
    pub(super) fn extras(
        &mut self,
        raster: usize,
        uses: &BTreeMap<Role, Use>,
        placement: &Placement,
        usable: &[bool],
        measured: &[Channel],
    ) -> Vec<Extra> {
        let usable_rows = placement.gather(usable.to_vec(), false);
        // What stands in an expression is carried along beside it.
        let used: Vec<usize> =
            uses.values().filter(|u| u.source.expression.is_none()).map(|u| u.source.column).collect();
        let (axis, rows) = (placement.axis, placement.rows);
        let (mut warnings, mut extras) = (Vec::new(), Vec::new());
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
                if let Some(channel) = role.filter(|c| !measured.contains(c)) {
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
            let usable = if column.raster == raster { usable } else { &usable_rows };
            let hold = values.iter().zip(usable).filter(|(x, usable)| **usable && !x.is_finite()).count();
            values.iter_mut().zip(usable).filter(|(_, usable)| !**usable).for_each(|(x, _)| *x = f64::NAN);
            if column.raster == raster {
                values = placement.gather(values, f64::NAN);
            }
            if !hold_over_gaps(&mut values) {
                warnings.push(format!("column '{}' is left out: it holds no finite value", column.name));
                continue;
            };
            if hold > 0 {
                warnings.push(format!("column '{}': {hold} missing values hold the value before them", column.name));
            }
            extras.push(Extra { name, values });
        }
        self.warnings.extend(warnings);
        extras
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

/// Replaces missing and infinite values by the last one before (the first one at the start), if there is a finite one.
fn hold_over_gaps(values: &mut [f64]) -> bool {
    let Some(mut last) = values.iter().copied().find(|x| x.is_finite()) else { return false };
    for x in values {
        if x.is_finite() {
            last = *x;
        } else {
            *x = last;
        }
    }
    true
}
