//! Values of a column: to SI, and over gaps.

use super::{Assembly, Use};
use crate::error::Result;
use crate::recording::Channel;
use crate::recording::mapping::{self, Source};
use crate::recording::names::{Bare, Role};
use crate::recording::units::{Quantity, Unit};

impl Assembly<'_> {
    /// The values of a column in SI units, and what they measure where the unit says so.
    pub(super) fn si(&mut self, role: Role, found: &Use) -> Result<(Vec<f64>, Option<Quantity>)> {
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
    pub(super) fn fill_gaps(&mut self, column: usize, values: &mut [f64], valid: &mut [bool]) -> Result<()> {
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
}
