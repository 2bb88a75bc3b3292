//! When the samples were taken.

use std::collections::BTreeMap;

use super::{Assembly, Use};
use crate::error::Result;
use crate::recording::gaps;
use crate::recording::mapping::Mapping;
use crate::recording::names::Role;
use crate::recording::time_axis::{self, TimeAxis};

impl Assembly<'_> {
    pub(super) fn time(
        &mut self,
        raster: usize,
        rows: usize,
        uses: &BTreeMap<Role, Use>,
        usable: &[bool],
        mapping: &Mapping,
    ) -> Result<TimeAxis> {
        if let Some(interval_s) = mapping.sample_time_s {
            return Ok(TimeAxis { start_s: 0.0, interval_s, jitter: 0.0 });
        }
        let stated = time_axis::from_metadata(&self.table).map_err(|(what, remedy)| self.whole(what, remedy))?;
        if let Some(found) = uses.get(&Role::Time) {
            let every_row = vec![true; rows];
            let (t, _) = self.si(Role::Time, found, 1.0, &every_row, false)?;
            let mut axis = time_axis::check(&without_fill(t, usable))
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
}

/// Stamps in which those of unusable rows lie on the line between their neighbours, where it is they that break the
/// order.
fn without_fill(t: Vec<f64>, usable: &[bool]) -> Vec<f64> {
    let ordered = |t: &[f64]| t.windows(2).all(|w| w[1] > w[0]);
    if ordered(&t) || usable.iter().all(|usable| *usable) {
        return t;
    }
    let known: Vec<(usize, f64)> = t.iter().copied().enumerate().filter(|(k, _)| usable[*k]).collect();
    let [(first, start), .., (last, end)] = known.as_slice() else { return t };
    let interval = (end - start) / (last - first) as f64;
    let mut filled: Vec<f64> = t.iter().zip(usable).map(|(t, usable)| if *usable { *t } else { f64::NAN }).collect();
    gaps::bridge(&mut filled);
    for (k, t) in filled.iter_mut().enumerate() {
        if k < *first {
            *t = start - (first - k) as f64 * interval;
        } else if k > *last {
            *t = end + (k - last) as f64 * interval;
        }
    }
    filled
}
