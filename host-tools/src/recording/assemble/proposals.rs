//! Columns that may be what the user means, for the end of an error message.

use std::collections::BTreeMap;

use super::{Assembly, Use};
use crate::error::{Error, Result};
use crate::recording::Channel;
use crate::recording::mapping;
use crate::recording::names::{self, Role};
use crate::recording::units::Unit;

impl Assembly<'_> {
    /// A free column that may hold a channel, by its unit or else by a word of its name; one that never changes is
    /// none.
    fn plausible(&self, channel: Channel) -> Option<&str> {
        let free = |k: &usize| {
            let column = &self.table.columns[*k];
            let first = column.values.first();
            self.headers[*k].role.is_none()
                && !column.is_time
                && !names::is_row_index(&column.label, &column.values)
                && column.values.iter().any(|x| Some(x) != first)
        };
        let by_unit = |k: &usize| {
            let unit = self.table.columns[*k].unit.as_deref().or(self.headers[*k].unit.as_deref());
            unit.and_then(Unit::parse).is_some_and(|u| Role::Channel(channel).quantities().contains(&u.quantity))
        };
        let by_name = |k: &usize| names::hints_at(&self.headers[*k].base, channel);
        let all = || (0..self.headers.len()).filter(free);
        let found = all().find(by_unit).or_else(|| all().find(by_name))?;
        Some(&self.table.columns[found].name)
    }

    /// What was left out, for the end of a sentence.
    pub(super) fn left_out(&self) -> String {
        let all: Vec<String> =
            self.table.left_out.iter().take(4).map(|l| format!("'{}': {}", l.name, l.reason)).collect();
        if all.is_empty() { String::new() } else { format!(" (left out are {})", all.join("; ")) }
    }

    /// No channel was found.
    pub(super) fn nothing_recognised(&self) -> Error {
        if self.table.columns.is_empty() {
            return self.whole(
                format!("there is no column of numbers{}", self.left_out()),
                "give a file with columns such as t_s, u_v, i_a, omega_rad_s",
            );
        }
        let examples: Vec<String> = [Channel::Voltage, Channel::Current, Channel::Speed, Channel::Angle]
            .into_iter()
            .filter_map(|channel| Some(mapping::example(channel, self.plausible(channel)?)))
            .collect();
        self.whole(
            format!(
                "no voltage, current, speed, angle or torque is recognised among the columns {}{}",
                self.column_list(),
                self.left_out()
            ),
            if examples.is_empty() {
                "name them: --map u_v=COLUMN i_a=COLUMN omega_rad_s=COLUMN".to_owned()
            } else {
                format!("name them, for example {}", examples.join(" "))
            },
        )
    }

    /// A converter stands between the supply and the motor; which of the two a column shows, the user must say.
    pub(super) fn ask_for_the_motors_voltage(&self, uses: &BTreeMap<Role, Use>) -> Result<()> {
        if uses.contains_key(&Role::Channel(Channel::Voltage)) {
            return Ok(());
        }
        let name = |test: fn(&str) -> bool| {
            let found = (0..self.headers.len()).find(|&k| test(&self.headers[k].base))?;
            Some(self.table.columns[found].name.as_str())
        };
        let Some(supply) = name(names::is_supply) else { return Ok(()) };
        let own = mapping::example(Channel::Voltage, supply);
        let remedy = match name(names::is_duty) {
            Some(duty) => format!(
                "write {} for the motor's, or {own} if it is measured at the motor's terminals",
                mapping::example(Channel::Voltage, &format!("{duty}*{supply}"))
            ),
            None => format!("write {own} if it is measured at the motor's terminals; else map the voltage that is"),
        };
        Err(self.whole(format!("column '{supply}' may be the supply's voltage, ahead of a converter"), remedy))
    }
}
