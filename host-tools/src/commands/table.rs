//! Tables for people, as wide as the terminal at most, whatever their cells hold.
//!
//! A table that is too wide gives way in this order:
//! 1. Titles are wrapped, then cells of text, the widest first, between words; figures stay whole.
//! 2. Columns of prose that would become too narrow to read go onto lines of their own below the row.
//! 3. What is too wide even so is told row by row, a line for each cell.

use std::fmt;

use anstyle::Style;
use textwrap::core::display_width;
use textwrap::{Options, WordSplitter};

use super::paint::{FAINT, STRONG, painted};
use super::stdout;

/// Between two columns.
const GAP: usize = 2;
/// On either side of a table.
const MARGIN: usize = 1;
/// By how much lines below a row stand further in.
const BELOW: usize = 2;
/// Prose in a narrower column is a tower of single words. A judgement by sight.
const READABLE: usize = 24;
/// A longer word is cut rather than all else made narrow: a path, most often. Three eighths of 80 columns.
const LONGEST_WORD: usize = 30;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Numbers with their units, on the right and never wrapped.
    Figure,
    /// Names and short texts.
    Text,
    /// Sentences, which may go below the row.
    Prose,
}

/// A column by its title.
#[derive(Debug, Clone)]
pub struct Column {
    title: String,
    kind: Kind,
}

impl Column {
    /// Numbers with their units, on the right and never wrapped.
    pub fn figure(title: impl Into<String>) -> Self {
        Self { title: title.into(), kind: Kind::Figure }
    }

    /// Names and short texts.
    pub fn text(title: impl Into<String>) -> Self {
        Self { title: title.into(), kind: Kind::Text }
    }

    /// Sentences, which may go below the row.
    pub fn prose(title: impl Into<String>) -> Self {
        Self { title: title.into(), kind: Kind::Prose }
    }
}

/// What stands in one place of a table.
#[derive(Debug, Clone, Default)]
pub struct Cell {
    text: String,
    style: Style,
}

impl Cell {
    /// A text in a style.
    pub fn painted(style: Style, text: impl ToString) -> Self {
        Self { style, ..Self::from(text.to_string()) }
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        // A tab or another control character would have a width of its own.
        let clean = |c: char| if c.is_control() && c != '\n' { ' ' } else { c };
        Self { text: text.chars().map(clean).collect(), style: Style::new() }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::from(text.to_owned())
    }
}

impl From<&String> for Cell {
    fn from(text: &String) -> Self {
        Self::from(text.clone())
    }
}

/// A table.
#[derive(Debug, Clone)]
pub struct Table {
    columns: Vec<Column>,
    rows: Vec<Vec<Cell>>,
}

impl Table {
    /// A table without rows yet.
    pub fn new(columns: impl IntoIterator<Item = Column>) -> Self {
        Self { columns: columns.into_iter().collect(), rows: Vec::new() }
    }

    /// Adds a row; what it has too few of stays empty.
    pub fn row<T: Into<Cell>>(&mut self, cells: impl IntoIterator<Item = T>) {
        let mut row: Vec<Cell> = cells.into_iter().map(Into::into).collect();
        row.resize(self.columns.len(), Cell::default());
        self.rows.push(row);
    }

    /// Adds rows.
    pub fn rows<T: Into<Cell>, R: IntoIterator<Item = T>>(&mut self, rows: impl IntoIterator<Item = R>) {
        rows.into_iter().for_each(|row| self.row(row));
    }

    /// The table in so many terminal columns; prose that there is none of takes no room.
    pub fn fitted(&self, width: usize) -> String {
        let is_there =
            |k: &usize| self.columns[*k].kind != Kind::Prose || self.rows.iter().any(|row| !row[*k].text.is_empty());
        let all: Vec<usize> = (0..self.columns.len()).filter(is_there).collect();
        let (above, below): (Vec<usize>, Vec<usize>) = all.iter().partition(|k| self.columns[**k].kind != Kind::Prose);
        let lines = if let Some(widths) = self.widths(&all, width).filter(|widths| self.is_readable(&all, widths)) {
            self.grid(&all, &widths, &[], width)
        } else if let Some(widths) = self.widths(&above, width).filter(|_| !above.is_empty()) {
            self.grid(&above, &widths, &below, width)
        } else {
            self.row_by_row(width)
        };
        lines.join("\n")
    }

    /// Widths of some columns side by side; none where they do not fit.
    fn widths(&self, columns: &[usize], width: usize) -> Option<Vec<usize>> {
        let available = width.checked_sub(2 * MARGIN + GAP * columns.len().saturating_sub(1))?;
        let mut widths = Vec::with_capacity(columns.len());
        let mut floors = Vec::with_capacity(columns.len());
        for &k in columns {
            let title = &self.columns[k].title;
            let cells = || self.rows.iter().map(|row| row[k].text.as_str());
            let longest = |text: &str| text.split_whitespace().map(display_width).max().unwrap_or(0).min(LONGEST_WORD);
            let whole = cells().flat_map(str::lines).map(display_width).max().unwrap_or(0);
            let wrapped = match self.columns[k].kind {
                Kind::Figure => whole,
                Kind::Text | Kind::Prose => cells().map(longest).max().unwrap_or(0),
            };
            widths.push(whole.max(display_width(title)));
            // Titles give way before cells do.
            floors.push([whole.max(longest(title)), wrapped.max(longest(title))]);
        }
        for stage in [0, 1] {
            while widths.iter().sum::<usize>() > available {
                let widest = (0..widths.len()).filter(|k| widths[*k] > floors[*k][stage]).max_by_key(|k| widths[*k]);
                let Some(widest) = widest else { break };
                widths[widest] -= 1;
            }
        }
        (widths.iter().sum::<usize>() <= available).then_some(widths)
    }

    /// Whether no column of prose is a tower of single words.
    fn is_readable(&self, columns: &[usize], widths: &[usize]) -> bool {
        let whole =
            |k: usize| self.rows.iter().flat_map(|row| row[k].text.lines()).map(display_width).max().unwrap_or(0);
        let mut widths = columns.iter().zip(widths);
        !widths.any(|(k, width)| self.columns[*k].kind == Kind::Prose && *width < whole(*k).min(READABLE))
    }

    /// The columns side by side, and those of `below` on lines of their own.
    fn grid(&self, columns: &[usize], widths: &[usize], below: &[usize], width: usize) -> Vec<String> {
        let titles: Vec<Cell> = self.columns.iter().map(|column| Cell::painted(STRONG, &column.title)).collect();
        let head = self.lines_of(&titles, columns, widths, below, width, true);
        let rows: Vec<Vec<String>> =
            self.rows.iter().map(|row| self.lines_of(row, columns, widths, below, width, false)).collect();
        let side_by_side = 2 * MARGIN + widths.iter().sum::<usize>() + GAP * widths.len().saturating_sub(1);
        let longest = rows.iter().flatten().chain(&head).map(|line| display_width(line)).max().unwrap_or(0);
        let rule = painted(FAINT, "─".repeat(longest.max(side_by_side).min(width)));
        let mut lines = vec![rule.clone()];
        lines.extend(head);
        lines.push(rule.clone());
        lines.extend(rows.into_iter().flatten());
        lines.push(rule);
        lines
    }

    /// The lines of a row, or of the titles.
    fn lines_of(
        &self,
        row: &[Cell],
        columns: &[usize],
        widths: &[usize],
        below: &[usize],
        width: usize,
        titles: bool,
    ) -> Vec<String> {
        let pieces: Vec<Vec<String>> =
            columns.iter().zip(widths).map(|(k, width)| wrapped(&row[*k].text, *width)).collect();
        let height = pieces.iter().map(Vec::len).max().unwrap_or(0);
        let mut lines = Vec::with_capacity(height);
        for n in 0..height {
            let mut line = " ".repeat(MARGIN);
            for (place, (k, width)) in columns.iter().zip(widths).enumerate() {
                let piece = pieces[place].get(n).map_or("", String::as_str);
                let padding = " ".repeat(width - display_width(piece).min(*width));
                let shown = painted(if piece.is_empty() { Style::new() } else { row[*k].style }, piece);
                let gap = if place == 0 { String::new() } else { " ".repeat(GAP) };
                line += &match self.columns[*k].kind {
                    Kind::Figure => format!("{gap}{padding}{shown}"),
                    Kind::Text | Kind::Prose => format!("{gap}{shown}{padding}"),
                };
            }
            lines.push(line.trim_end().to_owned());
        }
        let indent = " ".repeat(MARGIN + BELOW);
        for k in below.iter().filter(|k| !row[**k].text.is_empty()) {
            // Which of several it is, the title says.
            let title = &self.columns[*k].title;
            let named = below.len() > 1 && !titles && !title.is_empty();
            let text = if named { format!("{title}: {}", row[*k].text) } else { row[*k].text.clone() };
            let room = width.saturating_sub(indent.len() + MARGIN);
            let told = wrapped(&text, room).into_iter().map(|line| format!("{indent}{}", painted(row[*k].style, line)));
            lines.extend(told);
        }
        lines
    }

    /// A line for each cell, under the title of its column.
    fn row_by_row(&self, width: usize) -> Vec<String> {
        let most = width.saturating_sub(2 * MARGIN + GAP) / 3;
        let longest = self.columns.iter().map(|column| display_width(&column.title)).max().unwrap_or(0);
        let titles = longest.min(most).max(1);
        let room = width.saturating_sub(2 * MARGIN + GAP + titles).max(1);
        let rule = painted(FAINT, "─".repeat(width));
        let mut lines = vec![rule.clone()];
        for row in &self.rows {
            for (column, cell) in self.columns.iter().zip(row).filter(|(_, cell)| !cell.text.is_empty()) {
                let (title, text) = (wrapped(&column.title, titles), wrapped(&cell.text, room));
                for n in 0..title.len().max(text.len()) {
                    let [title, text] = [&title, &text].map(|lines| lines.get(n).map_or("", String::as_str));
                    let padding = " ".repeat(titles - display_width(title).min(titles) + GAP);
                    let (title, text) = (painted(STRONG, title), painted(cell.style, text));
                    lines.push(format!("{}{title}{padding}{text}", " ".repeat(MARGIN)).trim_end().to_owned());
                }
            }
            lines.push(rule.clone());
        }
        lines
    }
}

/// A text in lines of a width, between words where these fit.
fn wrapped(text: &str, width: usize) -> Vec<String> {
    let options = || Options::new(width).word_splitter(WordSplitter::NoHyphenation);
    text.lines().flat_map(|line| textwrap::wrap(line, options())).map(|line| line.into_owned()).collect()
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.fitted(stdout::width()))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// What stands on the terminal, without colour and weight.
    fn plain(text: &str) -> String {
        anstream::adapter::strip_str(text).to_string()
    }

    fn shown(table: &Table, width: usize) -> String {
        plain(&table.fitted(width))
    }

    #[test]
    fn what_fits_stands_side_by_side() {
        let mut table = Table::new([Column::text("name"), Column::figure("size"), Column::prose("what")]);
        table.row(["one", "1.5 A", "the first"]);
        table.row(["twelve", "12.25 A", ""]);
        let told = "\
──────────────────────────────
 name       size  what
──────────────────────────────
 one       1.5 A  the first
 twelve  12.25 A
──────────────────────────────";
        assert_eq!(shown(&table, 80), told.replace("──────────────────────────────", &"─".repeat(28)));
    }

    #[test]
    fn titles_give_way_before_cells_and_prose_goes_below() {
        let mut table =
            Table::new([Column::text("effect"), Column::figure("held-out error falls by"), Column::prose("objection")]);
        table.row(["saturation", "98.4 %", ""]);
        table.row(["hysteresis", "1.2 %", "the error on data held out hardly falls with it"]);
        let narrow = shown(&table, 40);
        let told = "\
 effect      held-out error falls by
   objection
─────────────────────────────────────
 saturation                   98.4 %
 hysteresis                    1.2 %
   the error on data held out hardly
   falls with it
";
        assert!(narrow.contains(told), "{narrow}");
        let mut figures = Table::new([Column::text("fault"), Column::figure("held-out error falls by")]);
        figures.row(["a resistance that has risen by a third", "+12.25 %"]);
        let narrow = shown(&figures, 52);
        assert!(narrow.contains("a resistance that has risen by a third") && narrow.contains(" +12.25 %"), "{narrow}");
    }

    #[test]
    fn what_is_painted_takes_no_room() {
        let mut table = Table::new([Column::text("motor"), Column::text("verdict"), Column::text("why")]);
        table.row([Cell::from("17"), Cell::painted(super::super::paint::BAD, "fail"), Cell::from("it is so")]);
        let told = table.fitted(80);
        assert!(told.contains("\u{1b}["), "{told}");
        assert!(plain(&told).contains(" 17     fail     it is so"), "{}", plain(&told));
    }

    fn cell() -> impl Strategy<Value = String> {
        prop_oneof![
            4 => "[a-z]{0,12}( [a-zµΩφ]{1,9}){0,12}",
            2 => "-?[0-9]{1,6}(\\.[0-9]{1,4})? (V|N m s/rad)",
            1 => "[a-z/_.-]{20,90}",
            1 => "\\PC{0,40}",
        ]
    }

    fn tables() -> impl Strategy<Value = Table> {
        (1_usize..9).prop_flat_map(|n| {
            let columns = prop::collection::vec((cell(), 0..3), n);
            let rows = prop::collection::vec(prop::collection::vec(cell(), n), 0..6);
            (columns, rows).prop_map(|(columns, rows)| {
                let column = |(title, kind): (String, i32)| match kind {
                    0 => Column::figure(title),
                    1 => Column::text(title),
                    _ => Column::prose(title),
                };
                let mut table = Table::new(columns.into_iter().map(column));
                table.rows(rows);
                table
            })
        })
    }

    /// Letters and how often each is there; spaces and rules aside.
    fn letters(text: &str) -> std::collections::BTreeMap<char, usize> {
        let mut counts = std::collections::BTreeMap::new();
        for letter in text.chars().filter(|c| !c.is_whitespace() && *c != '─') {
            *counts.entry(letter).or_insert(0) += 1;
        }
        counts
    }

    proptest! {
        #[test]
        fn no_line_is_wider_than_the_terminal(table in tables(), width in 40_usize..200) {
            for line in shown(&table, width).lines() {
                prop_assert!(display_width(line) <= width, "{width}: {line:?}");
            }
        }

        #[test]
        fn nothing_of_a_cell_is_lost(table in tables(), width in 40_usize..200) {
            let text = shown(&table, width);
            let there = letters(&text);
            let cells: String = table.rows.iter().flatten().map(|cell| cell.text.as_str()).collect();
            for (letter, count) in letters(&cells) {
                prop_assert!(there.get(&letter).is_some_and(|n| *n >= count), "{letter:?} of {cells:?} in\n{text}");
            }
        }

        #[test]
        fn words_that_fit_are_whole(table in tables(), width in 60_usize..200) {
            let text = shown(&table, width);
            let words: std::collections::BTreeSet<&str> = text.split_whitespace().collect();
            let short = |word: &&str| word.chars().all(char::is_alphanumeric) && display_width(word) <= 12;
            for word in table.rows.iter().flatten().flat_map(|cell| cell.text.split_whitespace()).filter(short) {
                prop_assert!(words.contains(word), "{word:?} in\n{text}");
            }
        }
    }
}
