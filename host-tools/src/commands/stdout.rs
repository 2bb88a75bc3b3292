//! What goes to stdout: lines for people, or one JSON object.

use std::io::Write;

use terminal_size::terminal_size_of;
use textwrap::Options;

use crate::answers;
use crate::error::{Error, Result};

/// Prints one JSON object on stdout, with the fields that every command shares put first.
pub fn print_json(command: &str, recordings: &[String], body: impl serde::Serialize) -> Result<()> {
    print_as_it_is(&answers::object(command, recordings, body)?.to_string())
}

/// Columns of the terminal that stdout is; none, if it is something else.
pub fn width() -> Option<usize> {
    terminal_size_of(std::io::stdout()).map(|(width, _)| usize::from(width.0))
}

/// Prints a line on stdout, folded where that is a terminal.
pub fn print_line(text: &str) -> Result<()> {
    match width() {
        Some(width) => print_as_it_is(&folded(text, width)),
        None => print_as_it_is(text),
    }
}

/// Folds lines that are longer than a width between words, and indents what follows by two more.
fn folded(text: &str, width: usize) -> String {
    let fold = |line: &str| {
        let indent = " ".repeat(line.len() - line.trim_start_matches(' ').len());
        let further = format!("{indent}  ");
        let options = Options::new(width).initial_indent(&indent).subsequent_indent(&further).break_words(false);
        match textwrap::core::display_width(line) > width {
            true => textwrap::fill(line.trim_start_matches(' '), options),
            false => line.to_owned(),
        }
    };
    text.split('\n').map(fold).collect::<Vec<_>>().join("\n")
}

/// Prints a line on stdout that a program reads, or a shell; a reader that has gone away (`| head`) is not an error.
pub fn print_as_it_is(text: &str) -> Result<()> {
    match writeln!(std::io::stdout().lock(), "{text}") {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::io("standard output", e)),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_too_long_is_folded_between_words_and_goes_on_further_in() {
        assert_eq!(folded("  one two three\n─────\nfour", 9), "  one two\n    three\n─────\nfour");
        // Columns, not bytes: these are nine.
        assert_eq!(folded("µµµ µµµµµ", 9), "µµµ µµµµµ");
        // A path is not cut.
        assert_eq!(folded("a /long/path/of/a/file", 10), "a\n  /long/path/of/a/file");
        assert_eq!(folded("", 10), "");
    }
}
