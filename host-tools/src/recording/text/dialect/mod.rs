//! How a file is written: separator, decimal sign, preamble, header, row of units.

mod heading;
mod layout;

use std::collections::BTreeMap;
use std::path::Path;

use super::cell::{Separator, comment};
use crate::error::{Error, Place, Result};
use heading::{Heading, Line};
use layout::Layout;

const HEADER_HINT: &str = "write one line of names first, such as t_s,u_v,i_a,omega_rad_s, then rows of numbers";

/// What LabVIEW calls the time of a channel.
pub const LABVIEW_TIME: &str = "X_Value";

/// Numbered lines from the beginning of a file.
pub type Window = [(u32, String)];

/// How a file is written.
pub struct Dialect {
    /// What stands between cells.
    pub separator: Separator,
    /// Whether decimals follow a comma.
    pub decimal_comma: bool,
    /// Names of the columns.
    pub names: Vec<String>,
    /// Their units, where a row of them is there.
    pub units: Vec<Option<String>>,
    /// What the lines before the table say.
    pub metadata: BTreeMap<String, String>,
    /// Line number of the header.
    pub header_line: u32,
    /// Index of the first row of data in the window.
    pub first_row: usize,
    /// Rows may end in a remark, which the header announces.
    pub remarks: bool,
}

impl Dialect {
    /// Decides by the first lines.
    ///
    /// # Errors
    /// No header, or no row of numbers.
    pub fn sniff(path: &Path, window: &Window) -> Result<Self> {
        let fail = |line: u32, what: &str, remedy: &str| Error::input(Place::at(path, line as usize, 0), what, remedy);
        let Some((last_line, _)) = window.last() else {
            return Err(Error::input(Place::file(path), "the file is empty", HEADER_HINT));
        };
        let content: Vec<usize> =
            (0..window.len()).filter(|&k| comment(&window[k].1).is_none() && !window[k].1.trim().is_empty()).collect();
        let Some(&first) = content.first() else {
            return Err(fail(*last_line, "there are comments but no data", HEADER_HINT));
        };
        let layout = Layout::of(window, &content);
        let Some(position) = layout.first_row(window, &content) else {
            let (line, text) = &window[first];
            if content.len() <= 2 {
                return Err(fail(*line, "there is a header but no row of numbers", "append the samples, one row each"));
            }
            let start: String = text.chars().take(40).collect();
            return Err(fail(*line, &format!("no row of numbers is found after '{start}'"), HEADER_HINT));
        };
        let first_row = content[position];
        let (mut metadata, named_by_comment) = heading::in_comments(&window[..first_row], layout);
        let cells = |&k: &usize| (window[k].0, layout.split(&window[k].1).iter().map(ToString::to_string).collect());
        let above: Vec<Line> = content[..position].iter().map(cells).collect();
        let heading = Heading::of(&above, layout);
        let preamble = &content[..position - heading.as_ref().map_or(0, |heading| heading.lines)];
        metadata.extend(preamble.iter().filter_map(|&k| heading::in_preamble(&window[k].1, layout)));
        let Some(heading) = heading.or_else(|| Some(Heading::in_comment(named_by_comment?, layout))) else {
            return Err(no_header(path, above.last(), window[first_row].0, layout.width));
        };
        let (header_line, mut names) = heading.names;
        let mut units = heading.units;
        // LabVIEW writes units on a line of their own, one for each channel: not for the times beside them.
        let stated = preamble.iter().map(|&k| layout.split(&window[k].1)).find(|cells| cells[0] == "Y_Unit_Label");
        let channels = units.iter_mut().zip(&names).filter(|(_, name)| *name != LABVIEW_TIME);
        for ((unit, _), stated) in channels.zip(stated.iter().flatten().skip(1)) {
            *unit = unit.take().or_else(|| Some(stated.to_string()).filter(|stated| !stated.is_empty()));
        }
        let remarks = names.len() == layout.width + 1 && names.last().is_some_and(|name| heading::is_remark(name));
        names.resize(layout.width, String::new());
        Ok(Self {
            separator: layout.separator,
            decimal_comma: layout.decimal_comma,
            names,
            units,
            metadata,
            header_line,
            first_row,
            remarks,
        })
    }
}

fn no_header(path: &Path, above: Option<&Line>, first_row_line: u32, width: usize) -> Error {
    if let Some((line, names)) = above.filter(|(_, names)| names.len() > 1 || width == 1) {
        return Error::input(
            Place::at(path, *line as usize, 0),
            format!("the header has {} names, the rows have {width} fields", names.len()),
            "give each column one name",
        );
    }
    let example: Vec<_> = ["t_s", "u_v", "i_a", "omega_rad_s"].into_iter().take(width).collect();
    Error::input(
        Place::at(path, first_row_line as usize, 0),
        "there is no header: the first row holds numbers",
        format!("put a line with the names of the {width} columns before it, such as {}", example.join(",")),
    )
}
