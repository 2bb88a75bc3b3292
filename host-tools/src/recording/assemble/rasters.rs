//! Which columns were sampled together.

use crate::recording::names::{Header, Role};
use crate::recording::table::Table;
use crate::recording::time_axis::{self, TimeAxis};
use crate::recording::units::Unit;

/// Stamps of two rasters are the same if they agree to this share of an interval: what rounding leaves.
const SAME: f64 = 1e-3;
/// A shift by a whole number of samples, to this share of an interval.
const WHOLE: f64 = 0.05;

/// The time column of a raster.
pub fn time_column(table: &Table, headers: &[Header], raster: usize) -> Option<usize> {
    let of =
        |test: &dyn Fn(usize) -> bool| (0..table.columns.len()).find(|&k| table.columns[k].raster == raster && test(k));
    of(&|k| table.columns[k].is_time).or_else(|| of(&|k| headers[k].role == Some(Role::Time)))
}

/// When a raster's samples were taken, if that is known and uniform.
pub fn axis(table: &Table, headers: &[Header], raster: usize) -> Option<TimeAxis> {
    if let Some(k) = time_column(table, headers, raster) {
        let column = &table.columns[k];
        let unit = column.unit.as_deref().or(headers[k].unit.as_deref()).and_then(Unit::parse);
        let factor = unit.map_or(1.0, |unit| unit.factor);
        let seconds: Vec<f64> = column.values.iter().map(|t| t * factor).collect();
        return time_axis::check(&seconds).ok();
    }
    let column = table.columns.iter().find(|c| c.raster == raster && c.interval_s.is_some())?;
    Some(TimeAxis { start_s: column.start_s, interval_s: column.interval_s?, jitter: 0.0 })
}

/// All rasters, in the order of their numbers.
pub fn all(table: &Table) -> Vec<usize> {
    let mut rasters: Vec<usize> = table.columns.iter().map(|c| c.raster).collect();
    rasters.sort_unstable();
    rasters.dedup();
    rasters
}

/// Takes rasters whose samples were taken at the same instants for one; of their time columns the first one is kept.
pub fn merge(table: &mut Table, headers: &mut Vec<Header>) {
    let rasters = all(table);
    let mut kept: Vec<usize> = Vec::new();
    for raster in rasters {
        let Some(time) = time_column(table, headers, raster) else {
            kept.push(raster);
            continue;
        };
        let same = kept.iter().copied().find(|&other| {
            let Some(k) = time_column(table, headers, other) else { return false };
            let (a, b) = (&table.columns[k], &table.columns[time]);
            let interval = a.values.get(..2).map_or(0.0, |t| (t[1] - t[0]).abs());
            let near = |(x, y): (&f64, &f64)| (x - y).abs() <= SAME * interval;
            a.unit == b.unit && a.values.len() == b.values.len() && a.values.iter().zip(&b.values).all(near)
        });
        match same {
            Some(other) => {
                table.columns.iter_mut().filter(|c| c.raster == raster).for_each(|c| c.raster = other);
                table.columns.remove(time);
                headers.remove(time);
            }
            None => kept.push(raster),
        }
    }
}

/// A column of another raster at the instants of the main one, where both have the same interval: shifted by whole
/// samples, or else interpolated; NaN where there is none. With it, by how much it begins later, s.
pub fn aligned(values: &[f64], from: TimeAxis, to: TimeAxis, rows: usize) -> Option<(Vec<f64>, f64)> {
    let run = rows.max(values.len()) as f64;
    if (from.interval_s / to.interval_s - 1.0).abs() * run > WHOLE {
        return None;
    }
    let later = from.start_s - to.start_s;
    let shift = later / to.interval_s;
    let at = |k: i64| usize::try_from(k).ok().and_then(|k| values.get(k).copied()).unwrap_or(f64::NAN);
    let whole = shift.round();
    let value = |k: usize| {
        if (shift - whole).abs() < WHOLE {
            return at(k as i64 - whole as i64);
        }
        let position = k as f64 - shift;
        let (below, share) = (position.floor(), position - position.floor());
        at(below as i64) * (1.0 - share) + at(below as i64 + 1) * share
    };
    Some(((0..rows).map(value).collect(), later))
}
