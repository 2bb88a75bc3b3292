//! What stands above the rows: names, units, and what a preamble says.

use std::collections::BTreeMap;

use super::Window;
use super::layout::Layout;
use crate::recording::text::cell::{Cell, comment, key_value};
use crate::recording::units::Unit;

/// Longest unit that a preamble gives behind a value, letters.
const LONGEST_UNIT: usize = 7;

/// The cells of a line, and its number.
pub type Line = (u32, Vec<String>);

/// Names of the columns and their units.
pub struct Heading {
    /// Number of the line with the names, and those.
    pub names: Line,
    /// Units, where a row of them is there.
    pub units: Vec<Option<String>>,
    /// Lines that they take.
    pub lines: usize,
}

impl Heading {
    /// The last lines above the rows: names, and below them units, if any.
    pub fn of(above: &[Line], layout: Layout) -> Option<Self> {
        let width = layout.width;
        let fits = |cells: &[String]| {
            cells.len() == width
                || (cells.len() == width + 1 && cells.last().is_some_and(|c| c.is_empty() || is_remark(c)))
        };
        let are_units =
            |cells: &[String]| fits(cells) && cells.iter().all(|c| is_unit(c)) && cells.iter().any(|c| !c.is_empty());
        let has_names =
            |cells: &[String]| fits(cells) && cells.iter().any(|c| !c.is_empty() && layout.cell(c) == Cell::Text);
        match above {
            [.., names, (_, units)] if are_units(units) && has_names(&names.1) => {
                let unit = |c: &String| Some(without_brackets(c).to_owned()).filter(|unit| !unit.is_empty());
                Some(Self { names: names.clone(), units: units.iter().take(width).map(unit).collect(), lines: 2 })
            }
            [.., names] if fits(&names.1) => Some(Self { names: names.clone(), units: vec![None; width], lines: 1 }),
            _ => None,
        }
    }

    /// Names in a comment.
    pub fn in_comment(names: Line, layout: Layout) -> Self {
        Self { names, units: vec![None; layout.width], lines: 0 }
    }
}

/// Whether a column holds remarks, which most rows leave out together with their separator.
pub fn is_remark(name: &str) -> bool {
    name.eq_ignore_ascii_case("comment")
}

fn is_unit(cell: &str) -> bool {
    let bare = without_brackets(cell);
    bare.is_empty() || bare == "-" || Unit::parse(bare).is_some()
}

fn without_brackets(cell: &str) -> &str {
    cell.trim_matches(['[', ']', '(', ')', ' '])
}

/// What comments say: keys with values, and names of columns.
pub fn in_comments(window: &Window, layout: Layout) -> (BTreeMap<String, String>, Option<Line>) {
    let (mut metadata, mut names) = (BTreeMap::new(), None);
    for (line, text) in window {
        let Some(body) = comment(text) else { continue };
        if let Some((key, value)) = key_value(body) {
            metadata.insert(key, value);
            continue;
        }
        let cells = layout.split(body.trim());
        if cells.len() == layout.width && cells.iter().all(|c| layout.cell(c) == Cell::Text) {
            names = Some((*line, cells.iter().map(ToString::to_string).collect()));
        }
    }
    (metadata, names)
}

/// What a line above the heading says: a key, its value and perhaps a unit, in cells or as `key: value`.
pub fn in_preamble(line: &str, layout: Layout) -> Option<(String, String)> {
    let cells = layout.split(line);
    let mut full = cells.iter().filter(|c| !c.is_empty());
    let (Some(key), Some(value)) = (full.next(), full.next()) else { return key_value(line) };
    let is_unit = |unit: &str| unit.len() <= LONGEST_UNIT && layout.cell(unit) == Cell::Text;
    let unit = full.next().filter(|unit| is_unit(unit)).map(|unit| format!(" {unit}")).unwrap_or_default();
    let value = match layout.cell(value) {
        Cell::Number(number) if layout.decimal_comma => number.to_string(),
        _ => value.to_string(),
    };
    Some((key.trim_end_matches([':', '=']).trim().to_owned(), format!("{value}{unit}")))
}
