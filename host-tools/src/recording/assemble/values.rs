//! Values of a column: to SI, and over gaps.

use super::{Assembly, Use};
use crate::error::Result;
use crate::recording::Channel;
use crate::recording::expression::Expression;
use crate::recording::mapping::{self, Source};
use crate::recording::names::{Bare, Role};
use crate::recording::units::{Quantity, Unit};

impl Assembly<'_> {
    /// The values of a column in SI units, and what they measure where the unit says so.
    ///
    /// What an unusable row holds is no value: NaN. A column that nothing else uses is moved, not copied.
    pub(super) fn si(
        &mut self,
        role: Role,
        found: &Use,
        interval_s: f64,
        usable: &[bool],
        used_once: bool,
    ) -> Result<(Vec<f64>, Option<Quantity>)> {
        let (mut values, quantity) = match &found.source.expression {
            Some(expression) => (self.computed(expression, usable.len(), interval_s)?, None),
            None => self.of_one_column(role, found, used_once)?,
        };
        for (x, usable) in values.iter_mut().zip(usable) {
            if !usable {
                *x = f64::NAN;
            }
        }
        if let Some(row) = values.iter().position(|x| x.is_infinite()) {
            return Err(self.at(
                row,
                Some(found.source.column),
                "the value is infinite",
                "remove the row or leave the cell empty",
            ));
        }
        Ok((values, quantity))
    }

    /// An expression of columns, each in SI by its own unit.
    fn computed(&self, expression: &Expression, rows: usize, interval_s: f64) -> Result<Vec<f64>> {
        let column = |k: usize, unit: Option<&str>| -> Result<Vec<f64>> {
            let (column, header) = (&self.table.columns[k], &self.headers[k]);
            let own = column.unit.as_deref().or(header.unit.as_deref()).and_then(Unit::parse);
            let unit = match unit {
                None => own,
                Some(text) => Some(Unit::parse(text).ok_or_else(|| {
                    self.whole(
                        format!("'{text}' behind column '{}' is no known unit", column.name),
                        "write a known unit, such as V, mA, rpm or deg, or a factor in its place",
                    )
                })?),
            };
            let (factor, shift) = unit.map_or((1.0, 0.0), |u| (u.factor, u.offset));
            Ok(column.values.iter().map(|x| x * factor + shift).collect())
        };
        expression.values(&column, rows, interval_s)
    }

    /// The values of one column, by its unit, gain and offset.
    fn of_one_column(&mut self, role: Role, found: &Use, used_once: bool) -> Result<(Vec<f64>, Option<Quantity>)> {
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
        let mut values = if used_once {
            std::mem::take(&mut self.table.columns[found.source.column].values)
        } else {
            column.values.clone()
        };
        if (gain, offset, factor, shift) != (1.0, 0.0, 1.0, 0.0) {
            values.iter_mut().for_each(|x| *x = (*x * gain + offset) * factor + shift);
        }
        // A time stamp or temperature without a unit, and a mapped column with a gain, tell nothing about the motion.
        Ok((values, unit.map(|u| u.quantity)))
    }

    /// Says how many values of a column are missing among the usable rows.
    pub(super) fn tell_gaps(&mut self, column: usize, values: &[f64], usable: &[bool]) -> Result<()> {
        let rows = usable.iter().filter(|usable| **usable).count();
        let lacking = |k: &usize| usable[*k] && values[*k].is_nan();
        let missing = (0..values.len()).filter(lacking).count();
        let Some(first) = (0..values.len()).find(lacking) else { return Ok(()) };
        let name = &self.table.columns[column].name;
        if 2 * missing > rows {
            return Err(self.at(
                first,
                Some(column),
                &format!("{missing} of {rows} values are missing"),
                "give a column with at least half of its values, or map another one",
            ));
        }
        let line = self.table.line(first);
        let place = if line > 0 { format!("line {line}") } else { format!("row {}", first + 1) };
        self.warnings.push(format!(
            "{missing} missing values in column '{name}', the first in {place}, are masked and interpolated"
        ));
        Ok(())
    }
}
