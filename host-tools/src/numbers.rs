//! Figures as they are printed: rounded to what is known, copyable into a spreadsheet, never NaN.

/// Stands for a figure that does not apply.
pub const NONE: &str = "–";

/// A number with so many significant digits; the dash where it is not finite.
pub fn figure(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return NONE.to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = value.abs().log10().floor() as i32;
    let digits = digits.max(1);
    if (-3..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        let decimals = digits - 1;
        format!("{value:.decimals$e}")
    }
}

/// A setting, four digits at most and no zeros at the end: 250, 0.02.
pub fn rounded(value: f64) -> String {
    let text = figure(value, 4);
    if text.contains('.') && !text.contains('e') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// A unit as it is read: m², not m2; nothing for a bare number.
pub fn unit(unit: &str) -> String {
    if unit == "1" {
        return String::new();
    }
    let mut told = String::with_capacity(unit.len());
    for c in unit.chars() {
        let is_power = told.chars().last().is_some_and(char::is_alphabetic);
        told.push(match c {
            '2' if is_power => '²',
            '3' if is_power => '³',
            '4' if is_power => '⁴',
            c => c,
        });
    }
    told
}

/// Prefixes of units down to the billionth.
const PREFIXES: [(f64, &str); 4] = [(1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n")];

/// The unit in which a value is read without leading zeros, and its size: 1e-3 and `mA` for 0.15 A.
pub fn readable_unit(value: f64, unit: &str) -> (f64, String) {
    let simple = matches!(unit, "V" | "A" | "s" | "N m" | "N" | "Ω" | "ohm" | "H");
    let fitting = PREFIXES.iter().find(|(size, _)| value.abs() >= 0.9995 * size);
    let (size, prefix) = fitting.filter(|_| simple).copied().unwrap_or(PREFIXES[0]);
    (size, format!("{prefix}{}", self::unit(unit)))
}

/// A number that may not apply, with its unit.
pub fn quantity(value: Option<f64>, unit: &str) -> String {
    match value.filter(|v| v.is_finite()) {
        Some(v) => format!("{} {unit}", figure(v, 3)),
        None => NONE.to_owned(),
    }
}

/// A ratio in per cent, three digits.
pub fn percent(ratio: Option<f64>) -> String {
    match ratio.filter(|v| v.is_finite()) {
        Some(v) => format!("{} %", figure(100.0 * v, 3)),
        None => NONE.to_owned(),
    }
}

/// A ratio in per cent for a column of a table: two decimals, three below 0.1 %.
pub fn percent_in_column(ratio: Option<f64>) -> String {
    ratio.map_or_else(
        || NONE.to_owned(),
        |r| if r < 0.001 { format!("{:.3} %", 100.0 * r) } else { format!("{:.2} %", 100.0 * r) },
    )
}

/// A value and its interval, rounded alike: to two digits of the interval's half width.
pub fn with_interval(value: f64, interval: Option<[f64; 2]>) -> (String, String) {
    let Some([low, high]) = interval.filter(|[a, b]| a.is_finite() && b.is_finite()) else {
        return (figure(value, 4), NONE.to_owned());
    };
    let half = (high - low).abs() / 2.0;
    let digits = if half > 0.0 && value != 0.0 {
        // Beyond nine digits the interval is a formality, and at least two are shown however wide it is.
        ((value.abs().log10().floor() - half.log10().floor()) as i32 + 2).clamp(2, 9) as usize
    } else {
        4
    };
    (figure(value, digits), format!("{} … {}", figure(low, digits), figure(high, digits)))
}

/// Half the width of an interval in per cent of the value.
pub fn relative_width(value: f64, interval: Option<[f64; 2]>) -> String {
    match interval {
        Some([low, high]) if value != 0.0 => {
            let text = figure((50.0 * (high - low) / value).abs(), 2);
            if text == NONE { text } else { format!("± {text} %") }
        }
        _ => NONE.to_owned(),
    }
}
