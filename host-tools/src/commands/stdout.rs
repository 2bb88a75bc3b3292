//! What goes to stdout: lines for people, or one JSON object.

use std::io::Write;

use terminal_size::terminal_size_of;
use textwrap::{Options, WordSplitter};

use super::paint::{STRONG, painted};
use crate::answers::{self, next::CommandLine};
use crate::error::{Error, Result};

/// Columns where stdout is no terminal and nothing tells otherwise: what a page, a mail and a book have room for.
const USUAL: usize = 80;
/// Fewest columns that lines are laid out for.
const FEWEST: usize = 40;

/// Prints one JSON object on stdout, with the fields that every command shares put first.
pub fn print_json(command: &str, recordings: &[String], body: impl serde::Serialize) -> Result<()> {
    print_as_it_is(&answers::object(command, recordings, body)?.to_string())
}

/// Columns of the terminal that stdout is; if it is something else, what `COLUMNS` says, or 80.
pub fn width() -> usize {
    let terminal =
        terminal_size_of(std::io::stdout()).map(|(width, _)| usize::from(width.0)).filter(|width| *width > 0);
    let told = || std::env::var("COLUMNS").ok()?.trim().parse().ok().filter(|width| *width > 0);
    terminal.or_else(told).unwrap_or(USUAL).max(FEWEST)
}

/// Prints lines on stdout, folded where they are too long.
pub fn print_line(text: &str) -> Result<()> {
    print_as_it_is(&folded(text, width()))
}

/// Prints the command that goes on from an answer, if one does, in one line: it is there to be copied.
pub fn print_next(next: Option<&CommandLine>) -> Result<()> {
    next.map_or(Ok(()), |next| print_as_it_is(&format!("next: {}", painted(STRONG, next))))
}

/// Folds lines that are longer than a width between words, and indents what follows by two more.
pub fn folded(text: &str, width: usize) -> String {
    let fold = |line: &str| {
        let indent = " ".repeat(line.len() - line.trim_start_matches(' ').len());
        let further = format!("{indent}  ");
        let options = Options::new(width).initial_indent(&indent).subsequent_indent(&further).break_words(false);
        let options = options.word_splitter(WordSplitter::NoHyphenation);
        match textwrap::core::display_width(line) > width {
            true => textwrap::fill(line.trim_start_matches(' '), options),
            false => line.to_owned(),
        }
    };
    text.split('\n').map(fold).collect::<Vec<_>>().join("\n")
}

/// A text beside its label, both of which stand in columns of their own.
pub fn labelled(label: &str, text: &str, room: usize) -> String {
    let (first, further) = (format!("{label:<room$}"), " ".repeat(room));
    let options = Options::new(width()).initial_indent(&first).subsequent_indent(&further).break_words(false);
    textwrap::fill(text, options.word_splitter(WordSplitter::NoHyphenation))
}

/// Prints a line on stdout that a program reads, or a shell; a reader that has gone away (`| head`) is not an error.
/// Colour and weight stay out where they are not wanted.
pub fn print_as_it_is(text: &str) -> Result<()> {
    match writeln!(anstream::stdout().lock(), "{text}") {
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
