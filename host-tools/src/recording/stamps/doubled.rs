//! Rows that stand twice in a file.

use crate::recording::table::{Column, Table};

/// Share of the other neighbouring rows that may be alike: at a standstill without noise many are, and then a stamp
/// that stands twice tells of coarse stamps.
const MOST_ALIKE: f64 = 0.5;

/// Rows that were left out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Doubled {
    /// How many.
    pub rows: usize,
    /// The first one, from zero, of the rows as they were.
    pub first: usize,
}

/// Leaves out rows that hold the same stamp and the same values as the one before, where every row with the stamp of
/// the one before does so.
pub fn leave_out(table: &mut Table, raster: usize, time: usize) -> Option<Doubled> {
    let t = &table.columns[time].values;
    let same_stamp: Vec<bool> = (0..t.len()).map(|n| n > 0 && t[n] == t[n - 1]).collect();
    let count = same_stamp.iter().filter(|same| **same).count();
    if count == 0 {
        return None;
    }
    let of_raster = |c: &&Column| c.raster == raster && c.values.len() == t.len();
    let bits = |x: f64| if x.is_nan() { u64::MAX } else { x.to_bits() };
    let alike = |n: usize| {
        let others = table.columns.iter().enumerate().filter(|(k, _)| *k != time).map(|(_, c)| c);
        others.filter(of_raster).all(|c| bits(c.values[n]) == bits(c.values[n - 1]))
    };
    if (1..t.len()).any(|n| same_stamp[n] && !alike(n)) {
        return None;
    }
    let others = (1..t.len()).filter(|n| !same_stamp[*n]);
    if others.clone().filter(|n| alike(*n)).count() as f64 > MOST_ALIKE * others.count() as f64 {
        return None;
    }
    let first = same_stamp.iter().position(|same| *same)?;
    let length = same_stamp.len();
    let keep = |n: &mut usize| {
        *n += 1;
        !same_stamp[*n - 1]
    };
    for column in table.columns.iter_mut().filter(|c| c.raster == raster && c.values.len() == length) {
        let mut n = 0;
        column.values.retain(|_| keep(&mut n));
    }
    if table.lines.len() == length {
        let mut n = 0;
        table.lines.retain(|_| keep(&mut n));
    }
    Some(Doubled { rows: count, first })
}
