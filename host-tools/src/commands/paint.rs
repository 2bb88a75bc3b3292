//! Colour and weight on a terminal: few, and the same everywhere. Where nobody wants them, on a pipe or with
//! `NO_COLOR`, [`super::stdout`] leaves them out.

use std::fmt::Display;

use anstyle::{AnsiColor, Style};

/// The number or the name that matters.
pub const STRONG: Style = Style::new().bold();
/// What only divides or accompanies.
pub const FAINT: Style = Style::new().dimmed();
/// All is well.
pub const GOOD: Style = AnsiColor::Green.on_default().bold();
/// Something to look at.
pub const DOUBT: Style = AnsiColor::Yellow.on_default().bold();
/// Something is wrong.
pub const BAD: Style = AnsiColor::Red.on_default().bold();

/// A text in a style.
pub fn painted(style: Style, text: impl Display) -> String {
    if style.is_plain() { text.to_string() } else { format!("{style}{text}{style:#}") }
}
