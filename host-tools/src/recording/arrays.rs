//! Arrays by their path, as formats without tables hold them: what becomes a column, a unit or metadata.

use std::collections::BTreeMap;

use super::table::{Column, LeftOut, MAX_VALUES, Table};

/// What is said of a file beyond the limit.
pub(super) const TOO_MANY: &str = "too many values";

/// A matrix with more columns than this is no set of channels.
const WIDEST: usize = 64;

/// Everything found, by path (`rec/u`).
#[derive(Default)]
pub(super) struct Found {
    pub(super) arrays: Vec<(Vec<String>, Vec<f64>)>,
    pub(super) units: BTreeMap<Vec<String>, String>,
    pub(super) texts: Vec<(Vec<String>, String)>,
    /// Names of the columns of a matrix, where they are told.
    pub(super) names: BTreeMap<Vec<String>, Vec<String>>,
    /// Arrays that are declared to be times.
    pub(super) times: Vec<Vec<String>>,
    /// What a table by itself does not say.
    pub(super) warnings: Vec<String>,
    left_out: Vec<LeftOut>,
    count: usize,
}

impl Found {
    /// An array of `rows` x `columns`, stored column by column.
    pub(super) fn matrix(
        &mut self,
        path: &[String],
        rows: usize,
        columns: usize,
        values: Vec<f64>,
    ) -> std::result::Result<(), &'static str> {
        self.count = self.count.saturating_add(values.len());
        if self.count > MAX_VALUES {
            return Err(TOO_MANY);
        }
        if values.is_empty() {
            return Ok(());
        }
        if rows == 1 || columns == 1 {
            let mut path = path.to_vec();
            if let Some([name]) = self.names.get(&path).map(Vec::as_slice) {
                path.push(name.clone());
            }
            self.arrays.push((path, values));
            return Ok(());
        }
        // Channels are the short side, whichever way the matrix lies.
        let (length, width, by_column) = if rows >= columns { (rows, columns, true) } else { (columns, rows, false) };
        if width > WIDEST || length.checked_mul(width) != Some(values.len()) {
            self.leave_out(path, &format!("{rows} x {columns} numbers are no set of channels"));
            return Ok(());
        }
        let told = self.names.get(path).filter(|names| names.len() == width).cloned();
        for k in 0..width {
            let mut name = path.to_vec();
            match (&told, name.last_mut()) {
                (Some(told), _) => name.push(told[k].clone()),
                (None, Some(last)) => *last = format!("{last}_{}", k + 1),
                (None, None) => {}
            }
            let column = (0..length).map(|j| if by_column { values[k * length + j] } else { values[j * width + k] });
            self.arrays.push((name, column.collect()));
        }
        Ok(())
    }

    /// Leaves an array out, and says so.
    pub(super) fn leave_out(&mut self, path: &[String], reason: &str) {
        self.left_out.push(LeftOut { name: path.join("/"), reason: reason.into() });
    }

    pub(super) fn text(&mut self, path: &[String], text: String) {
        let text = text.trim().to_owned();
        // `unit.u`, `units.u` or `u_unit` beside `u`.
        let mut unit_of = path.to_vec();
        match path {
            [.., group, _] if matches!(group.to_lowercase().as_str(), "unit" | "units" | "einheit" | "einheiten") => {
                unit_of.remove(path.len() - 2);
                self.units.insert(unit_of, text);
            }
            _ => {
                if let Some(base) = path.last().and_then(|n| n.strip_suffix("_unit")) {
                    let last = unit_of.len() - 1;
                    unit_of[last] = base.to_owned();
                    self.units.insert(unit_of, text.clone());
                }
                self.texts.push((path.to_vec(), text));
            }
        }
    }

    pub(super) fn table(self) -> Table {
        let mut table = Table { warnings: self.warnings, ..Table::default() };
        for LeftOut { name, reason } in self.left_out {
            table.leave_out(name, reason);
        }
        let mut paths = Vec::new();
        let mut lengths: Vec<usize> = Vec::new();
        for (path, text) in self.texts {
            if let Some(key) = path.last() {
                table.metadata.insert(key.clone(), text.split_whitespace().collect::<Vec<_>>().join(" "));
            }
        }
        for (path, values) in self.arrays {
            let Some(name) = path.last().cloned() else { continue };
            if values.len() == 1 {
                table.metadata.insert(name, format!("{}", values[0]));
                continue;
            }
            // These formats do not say what was sampled together; the length does.
            let raster = lengths.iter().position(|&n| n == values.len()).unwrap_or_else(|| {
                lengths.push(values.len());
                lengths.len() - 1
            });
            let unit = self.units.get(&path).cloned();
            let is_time = self.times.contains(&path);
            table.columns.push(Column { raster, unit, is_time, ..Column::new(name, values) });
            paths.push(path.join("/"));
        }
        table.make_names_unique(&paths);
        table
    }
}
