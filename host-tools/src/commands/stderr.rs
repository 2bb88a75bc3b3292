//! What is said on stderr beside an answer: one line each, which a terminal shows folded.

use std::fmt::Display;

use anstyle::Style;
use terminal_size::terminal_size_of;

use super::paint::{BAD, DOUBT, painted};
use super::stdout;

/// What may spoil an answer that is given all the same.
pub fn remark(text: impl Display) {
    say(DOUBT, text);
}

/// Why there is no answer.
pub fn trouble(text: impl Display) {
    say(BAD, text);
}

fn say(style: Style, text: impl Display) {
    let line = format!("{} {text}", painted(style, "greyrig:"));
    match terminal_size_of(std::io::stderr()) {
        Some((width, _)) if width.0 > 0 => anstream::eprintln!("{}", stdout::folded(&line, usize::from(width.0))),
        _ => anstream::eprintln!("{line}"),
    }
}
