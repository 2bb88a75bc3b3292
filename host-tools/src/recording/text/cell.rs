//! Cells of a line, and what stands in them.

use std::borrow::Cow;

/// What stands between two cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Separator {
    /// A character.
    Char(char),
    /// Any number of blanks and tabs.
    Blanks,
}

/// Splits a line into trimmed cells, honouring quotes.
pub fn split(line: &str, separator: Separator) -> Vec<Cow<'_, str>> {
    match separator {
        Separator::Blanks if !line.contains('"') => line.split_whitespace().map(Cow::Borrowed).collect(),
        Separator::Char(c) if !line.contains('"') => line.split(c).map(|cell| Cow::Borrowed(cell.trim())).collect(),
        _ => {
            let mut cells = Vec::new();
            let (mut cell, mut quoted, mut was_quoted) = (String::new(), false, false);
            let mut chars = line.chars().peekable();
            let ends = |c: char| match separator {
                Separator::Char(s) => c == s,
                Separator::Blanks => c.is_whitespace(),
            };
            while let Some(c) = chars.next() {
                match c {
                    '"' if quoted && chars.peek() == Some(&'"') => {
                        cell.push('"');
                        chars.next();
                    }
                    '"' => {
                        quoted = !quoted;
                        was_quoted = true;
                    }
                    c if !quoted && ends(c) => {
                        if separator != Separator::Blanks || was_quoted || !cell.is_empty() {
                            cells.push(Cow::Owned(std::mem::take(&mut cell).trim().to_owned()));
                        }
                        was_quoted = false;
                    }
                    c => cell.push(c),
                }
            }
            if separator != Separator::Blanks || was_quoted || !cell.is_empty() {
                cells.push(Cow::Owned(cell.trim().to_owned()));
            }
            cells
        }
    }
}

/// What a cell holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell {
    /// A finite number.
    Number(f64),
    /// Nothing, or a word for nothing.
    Missing,
    /// A number without bounds.
    Infinite,
    /// Seconds since an arbitrary day, split so that microseconds survive.
    Stamp(i64, f64),
    /// A day, without a time.
    Date,
    /// Anything else.
    Text,
}

/// Reads a cell.
pub fn cell(text: &str, decimal_comma: bool) -> Cell {
    if text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.')) && !text.contains(':') {
        let parsed = if decimal_comma && text.contains(',') {
            // `1,` and `1,2,3` are lists, not numbers.
            let (_, digits) = text.split_once(',').unwrap_or(("", ""));
            if !digits.starts_with(|c: char| c.is_ascii_digit()) || text.contains('.') {
                return Cell::Text;
            }
            text.replacen(',', ".", 1).parse::<f64>()
        } else {
            text.parse::<f64>()
        };
        match parsed {
            Ok(x) if x.is_infinite() => return Cell::Infinite,
            Ok(x) if x.is_nan() => return Cell::Missing,
            Ok(x) => return Cell::Number(x),
            Err(_) => {}
        }
    }
    match text.to_lowercase().as_str() {
        "" | "nan" | "-nan" | "na" | "n/a" | "#n/a" | "<na>" | "null" | "none" | "nil" | "-" | "--" => Cell::Missing,
        "inf" | "+inf" | "-inf" | "infinity" | "+infinity" | "-infinity" => Cell::Infinite,
        "true" => Cell::Number(1.0),
        "false" => Cell::Number(0.0),
        _ => match stamp(text, decimal_comma) {
            Some((seconds, part)) => Cell::Stamp(seconds, part),
            None if day(text).is_some() => Cell::Date,
            None => Cell::Text,
        },
    }
}

/// `2026-03-01T08:00:00.0001+01:00`, `2026-03-01 08:00:00`, `01.03.2026 08:00:00,5` or `08:00:00.5`.
fn stamp(text: &str, decimal_comma: bool) -> Option<(i64, f64)> {
    if !text.is_ascii() || text.len() > 40 {
        return None;
    }
    let half = text.len().checked_sub(2).and_then(|at| text.get(at..));
    let afternoon = half.and_then(|half| match half.to_ascii_uppercase().as_str() {
        "AM" => Some(false),
        "PM" => Some(true),
        _ => None,
    });
    let text = if afternoon.is_some() { text[..text.len() - 2].trim_end() } else { text };
    // The time follows the last blank before it; a date in words has blanks of its own. An offset follows a colon.
    let before_time = text.find(':').and_then(|colon| text[..colon].rfind(['T', ' ']));
    let (date, time) = match before_time {
        Some(at) => (Some(text[..at].trim_end()), text[at + 1..].trim()),
        None => (None, text),
    };
    let days = match date {
        None => 0,
        Some(date) => day(date)?,
    };
    let (time, zone) = if let Some(time) = time.strip_suffix(['Z', 'z']) {
        (time, 0)
    } else if let Some(at) = time.rfind(['+', '-']).filter(|_| date.is_some()) {
        let (h, m) = time[at + 1..].split_once(':').unwrap_or((&time[at + 1..], "0"));
        let minutes = h.parse::<i64>().ok()? * 60 + m.parse::<i64>().ok()?;
        (&time[..at], if time[at..].starts_with('-') { -minutes } else { minutes })
    } else {
        (time, 0)
    };
    let mut parts = time.trim().split(':');
    let (h, m, s) = (parts.next()?, parts.next()?, parts.next().unwrap_or("0"));
    // Some loggers write a colon before the milliseconds, too.
    let with_milliseconds = match parts.next() {
        Some(digits) if digits.len() == 3 && is_digits(digits) && is_digits(s) => format!("{s}.{digits}"),
        Some(_) => return None,
        None => s.to_owned(),
    };
    if parts.next().is_some() {
        return None;
    }
    let s = with_milliseconds.as_str();
    let s = if decimal_comma || s.contains(',') { s.replacen(',', ".", 1) } else { s.to_owned() };
    let (h, m): (i64, i64) = (h.parse().ok()?, m.parse().ok()?);
    let h = match afternoon {
        Some(_) if !(1..=12).contains(&h) => return None,
        Some(afternoon) => h % 12 + if afternoon { 12 } else { 0 },
        None => h,
    };
    let whole: i64 = s.split('.').next()?.parse().ok()?;
    let part: f64 = match s.split_once('.') {
        Some((_, digits)) if digits.chars().all(|c| c.is_ascii_digit()) => format!("0.{digits}").parse().ok()?,
        Some(_) => return None,
        None => 0.0,
    };
    if !(0..=24).contains(&h) || !(0..60).contains(&m) || !(0..=60).contains(&whole) {
        return None;
    }
    Some((days * 86_400 + h * 3600 + m * 60 + whole - zone * 60, part))
}

/// `2026-03-01`, `01.03.2026`, `3/1/2026`, `01-Mar-2026`, `20260301`: days since 1970.
fn day(date: &str) -> Option<i64> {
    if let Some((year, rest)) = date.split_at_checked(4).filter(|_| date.len() == 8 && is_digits(date)) {
        return calendar_day(year.parse().ok()?, rest[..2].parse().ok()?, rest[2..].parse().ok()?);
    }
    let (separator, backwards) = match date.chars().find(|c| !c.is_ascii_alphanumeric())? {
        '.' => ('.', true),
        '/' => ('/', false),
        // As people write it in words.
        ' ' => (' ', true),
        _ => ('-', false),
    };
    let parts: Vec<&str> = date.split(separator).collect();
    let [a, b, c] = parts[..] else { return None };
    if let Some(month) = month(b) {
        let (a, c) = (a.parse().ok()?, c.parse().ok()?);
        return if c > 31 { calendar_day(c, month, a) } else { calendar_day(a, month, c) };
    }
    let (a, month, b): (i64, i64, i64) = (a.parse().ok()?, b.parse().ok()?, c.parse().ok()?);
    // A year at the end: the month comes first after slashes, and the day otherwise or where it can be none.
    let (year, month, day) = match (backwards, b > 31) {
        (true, _) => (b, month, a),
        (false, false) => (a, month, b),
        (false, true) if separator == '/' && a <= 12 => (b, a, month),
        (false, true) => (b, month, a),
    };
    calendar_day(year, month, day)
}

fn is_digits(text: &str) -> bool {
    text.bytes().all(|b| b.is_ascii_digit())
}

/// The number of a month by its English or German name, of which three letters count.
fn month(name: &str) -> Option<i64> {
    const NAMES: [&[&str]; 12] = [
        &["jan"],
        &["feb"],
        &["mar", "m\u{e4}r", "mrz"],
        &["apr"],
        &["may", "mai"],
        &["jun"],
        &["jul"],
        &["aug"],
        &["sep"],
        &["oct", "okt"],
        &["nov"],
        &["dec", "dez"],
    ];
    let start: String = name.to_lowercase().chars().take(3).collect();
    let place = NAMES.iter().position(|names| names.contains(&start.as_str()))?;
    Some(place as i64 + 1)
}

fn calendar_day(year: i64, month: i64, day: i64) -> Option<i64> {
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) || !(1..=9999).contains(&year) {
        return None;
    }
    Some(days_from_civil(year, month, day))
}

/// Days since 1970-01-01 of the Gregorian calendar (the year is counted from March, so that the leap day comes last).
fn days_from_civil(year: i64, month: i64, day: i64) -> i64 {
    let y = if month <= 2 { year - 1 } else { year };
    let from_march = (month + 9) % 12;
    let day_of_year = (153 * from_march + 2) / 5 + day - 1;
    365 * y + y.div_euclid(4) - y.div_euclid(100) + y.div_euclid(400) + day_of_year - 719_468
}

/// What a line of comment says.
pub fn comment(line: &str) -> Option<&str> {
    let line = line.trim_start();
    line.strip_prefix('#').or_else(|| line.strip_prefix('%')).or_else(|| line.strip_prefix("//"))
}

/// `key: value` or `key = value`.
pub fn key_value(text: &str) -> Option<(String, String)> {
    let at = text.find([':', '='])?;
    let (key, value) = (text[..at].trim(), text[at + 1..].trim());
    (!key.is_empty() && key.len() <= 80).then(|| (key.to_owned(), value.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_stamps() {
        // 2026-03-01 is day 20513 (date -u -d 2026-03-01 +%s gives 1772323200).
        assert_eq!(stamp("2026-03-01T00:00:00Z", false), Some((1_772_323_200, 0.0)));
        assert_eq!(stamp("2026-03-01 09:00:00.25+01:00", false), Some((1_772_352_000, 0.25)));
        assert_eq!(stamp("01.03.2026 08:00:00,25", true), Some((1_772_352_000, 0.25)));
        assert_eq!(stamp("08:00:01.5", false), Some((28_801, 0.5)));
        assert_eq!(stamp("3/1/2026 8:00:00 AM", false), Some((1_772_352_000, 0.0)));
        assert_eq!(stamp("01-03-2026 08:00:00", false), Some((1_772_352_000, 0.0)));
        assert_eq!(stamp("12:30:00 PM", false), Some((45_000, 0.0)));
        for same in ["01-Mar-2026 08:00:00", "1 March 2026 08:00:00", "20260301 08:00:00", "1-Mrz-2026 08:00"] {
            assert_eq!(stamp(same, false), Some((1_772_352_000, 0.0)), "{same}");
        }
        assert_eq!(stamp("2026-03-01 08:00:00:250", false), Some((1_772_352_000, 0.25)));
        assert_eq!(day("20260301"), Some(20_513));
        for bad in ["2026-13-01 00:00:00", "abc", "12:61:00", "1:2:3:4", ""] {
            assert_eq!(stamp(bad, false), None, "{bad}");
        }
    }

    #[test]
    fn quoted_cells() {
        assert_eq!(split("\"a, b\",\"say \"\"x\"\"\", 3", Separator::Char(',')), ["a, b", "say \"x\"", "3"]);
        assert_eq!(split("  1   2\t3 ", Separator::Blanks), ["1", "2", "3"]);
        assert_eq!(split("\"a b\" c", Separator::Blanks), ["a b", "c"]);
    }
}
