//! `--map TARGET=SOURCE[*GAIN][+OFFSET]`: adapts foreign column names and units; the source may be an expression of
//! columns.

use std::ffi::OsString;

use super::Channel;
use super::expression::Expression;
use super::names::{self, Role};
use super::table::{Column, LeftOut};
use super::units::Unit;
use crate::error::{Error, Result};
use crate::spelling;

/// Columns of a file that an error names.
const NAMED: usize = 12;

/// `--map`, shared by every command that reads recordings.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct MapArgs {
    /// Take a channel from a column of the file: `u_v=VoltageCh1*0.01`, `omega_rad_s=Speed[rpm]`, `i_a=Ch2*10+0.5`.
    ///
    /// The channels are t_s, u_v, i_a, omega_rad_s, angle_rad, torque_n_m (v_m_s, q_m, force_n of a linear drive),
    /// rotor_locked, supply_open, valid and temp_c. Gain and offset apply to the number in the file; a unit in square
    /// brackets, or else the column's own unit, converts the result to SI. Columns can be joined by + - * / and
    /// brackets, and ddt(...) is the rate of change: `u_v=duty_cycle*input_voltage`, `omega_rad_s=ddt(angle[deg])`;
    /// then each column is converted by its own unit and the result is SI. `sample_time_s=1e-4` gives the sampling
    /// interval to a file without a time column. Several `A=B` may follow one `--map`; the first argument without `=`
    /// ends them, so recordings may stand before or after.
    #[arg(long = "map", value_name = "TARGET=SOURCE", allow_hyphen_values = true)]
    pub map: Vec<String>,
}

impl MapArgs {
    /// The mapping.
    ///
    /// # Errors
    /// A piece without `=`, an unknown or repeated target, an unusable sampling interval.
    pub fn mapping(&self) -> Result<Mapping> {
        Mapping::parse(&self.map)
    }
}

/// Lets several `A=B` follow one `--map`: each further argument of the form `name=…` gets a `--map` of its own, up to
/// the first other argument. Values counted by the parser itself would swallow the recordings that follow.
pub fn spread(arguments: impl IntoIterator<Item = OsString>) -> Vec<OsString> {
    let mut out: Vec<OsString> = Vec::new();
    let (mut inside, mut literal) = (false, false);
    for argument in arguments {
        let text = argument.to_string_lossy().into_owned();
        if literal {
            out.push(argument);
            continue;
        }
        literal = text == "--";
        let assigns = text
            .split_once('=')
            .is_some_and(|(name, _)| !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_'));
        let after_map = out.last().is_some_and(|last| last == "--map");
        if inside && !after_map && assigns {
            out.push("--map".into());
        }
        inside = text == "--map" || text.starts_with("--map=") || (inside && (assigns || after_map));
        out.push(argument);
    }
    out
}

/// One `TARGET=SOURCE` pair.
#[derive(Debug, Clone, PartialEq)]
pub struct Rule {
    /// What the column becomes.
    pub role: Role,
    /// The target as written.
    pub target: String,
    /// The right side as written; it is taken apart when the columns are known, since names may hold `*`, `+` or `[`.
    pub source: String,
}

/// All rules of a command line.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mapping {
    /// In the order given.
    pub rules: Vec<Rule>,
    /// Sampling interval given by `sample_time_s=…`, s.
    pub sample_time_s: Option<f64>,
}

/// A rule applied to a file's columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Index of the column; of an expression, the first one.
    pub column: usize,
    /// What is computed from several columns, or of another form than a straight line of one.
    pub expression: Option<Expression>,
    /// Factor on the number in the file.
    pub gain: f64,
    /// Added after the gain.
    pub offset: f64,
    /// Unit given in the mapping.
    pub unit: Option<String>,
    /// Whether a gain or offset was given.
    pub scaled: bool,
}

impl Source {
    /// A column as it is.
    pub const fn plain(column: usize) -> Self {
        Self { column, expression: None, gain: 1.0, offset: 0.0, unit: None, scaled: false }
    }

    /// All columns that it takes in.
    pub fn columns(&self) -> Vec<usize> {
        self.expression.as_ref().map_or_else(|| vec![self.column], Expression::columns)
    }
}

impl Mapping {
    /// Parses `TARGET=SOURCE` pieces.
    ///
    /// # Errors
    /// See [`MapArgs::mapping`].
    pub fn parse(pieces: &[impl AsRef<str>]) -> Result<Self> {
        let mut mapping = Self::default();
        for piece in pieces {
            let piece = piece.as_ref();
            let Some((target, source)) = piece.split_once('=').map(|(t, s)| (t.trim(), s.trim())) else {
                return Err(Error::usage(
                    format!("--map {piece} holds no '='"),
                    "write TARGET=SOURCE, for example --map u_v=VoltageCh1*0.01",
                ));
            };
            if target == "sample_time_s" {
                mapping.sample_time_s = Some(interval(source).ok_or_else(|| {
                    Error::usage(
                        format!("--map {piece}: the sampling interval is not a positive number"),
                        "write it in seconds, for example --map sample_time_s=1e-4",
                    )
                })?);
                continue;
            }
            let Some(&(_, role)) = Role::TARGETS.iter().find(|(name, _)| *name == target) else {
                let known = Role::TARGETS.iter().map(|t| t.0).chain(["sample_time_s"]);
                return Err(Error::usage(
                    format!("--map {piece}: there is no channel '{target}'"),
                    spelling::advice(target, known, "choose one of"),
                ));
            };
            if source.is_empty() {
                return Err(Error::usage(
                    format!("--map {piece} names no column"),
                    "write TARGET=SOURCE, for example --map u_v=VoltageCh1*0.01",
                ));
            }
            if mapping.rules.iter().any(|r| r.role == role) {
                return Err(Error::usage(format!("--map gives {target} twice"), "give each channel one column"));
            }
            mapping.rules.push(Rule { role, target: target.into(), source: source.into() });
        }
        Ok(mapping)
    }
}

/// `1e-4` or `100[us]`, in seconds.
fn interval(text: &str) -> Option<f64> {
    let (number, unit) = strip_unit(text);
    let factor = match unit {
        Some(unit) => Unit::parse(unit).filter(|u| u.quantity == super::units::Quantity::Time)?.factor,
        None => 1.0,
    };
    let value = number.trim().parse::<f64>().ok()? * factor;
    (value.is_finite() && value > 0.0).then_some(value)
}

fn strip_unit(text: &str) -> (&str, Option<&str>) {
    match (text.strip_suffix(']'), text.rfind('[')) {
        (Some(_), Some(at)) => (text[..at].trim_end(), Some(text[at + 1..text.len() - 1].trim())),
        _ => (text, None),
    }
}

/// `+1.5`, `-0.3` at the end; not the exponent of a number.
fn strip_offset(text: &str) -> Option<(&str, f64)> {
    text.char_indices().rev().filter(|&(i, c)| i > 0 && (c == '+' || c == '-')).find_map(|(at, _)| {
        let value: f64 = number(&text[at..])?;
        let before = text[..at].trim_end();
        // `Ch*2e-3`: the minus belongs to the exponent.
        let exponent =
            before.ends_with(['e', 'E']) && before[..before.len() - 1].ends_with(|c: char| c.is_ascii_digit());
        (!exponent).then_some((before, value))
    })
}

fn strip_gain(text: &str) -> Option<(&str, f64)> {
    let at = text.rfind(['*', '/'])?;
    let value = number(&text[at + 1..])?;
    let gain = if text[at..].starts_with('/') { 1.0 / value } else { value };
    (at > 0 && gain.is_finite()).then(|| (text[..at].trim_end(), gain))
}

fn number(text: &str) -> Option<f64> {
    // "inf" and "nan" parse as numbers, too.
    let compact: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    if !compact.ends_with(|c: char| c.is_ascii_digit() || c == '.') {
        return None;
    }
    compact.parse().ok().filter(|v: &f64| v.is_finite())
}

impl Rule {
    /// Finds the column that the rule names: the longest reading of the source that is a column wins, so a column
    /// called `u [V]` or `a+b` can be named as it is.
    ///
    /// # Errors
    /// No such column: the file's columns, nearest spelling first. Several columns of that name: all of them.
    pub fn resolve(&self, columns: &[Column], left_out: &[LeftOut]) -> std::result::Result<Source, (String, String)> {
        let mut readings: Vec<(&str, f64, f64, Option<&str>, bool)> = Vec::new();
        let (inner, outer_unit) = strip_unit(&self.source);
        for (text, unit) in [(self.source.as_str(), None), (inner, outer_unit)] {
            let offsets = [Some((text, 0.0)), strip_offset(text)];
            for (k, (text, offset)) in offsets.into_iter().enumerate().filter_map(|(k, o)| Some((k, o?))) {
                readings.push((text, 1.0, offset, unit, k > 0));
                let scaled = strip_gain(text);
                if let Some((text, gain)) = scaled {
                    readings.push((text, gain, offset, unit, true));
                }
                let text = scaled.map_or(text, |s| s.0);
                if let (text, Some(inner)) = strip_unit(text) {
                    readings.push((text, scaled.map_or(1.0, |s| s.1), offset, Some(inner), k > 0 || scaled.is_some()));
                }
            }
        }
        readings.sort_by_key(|r| std::cmp::Reverse(r.0.len()));
        for &(text, gain, offset, unit, scaled) in &readings {
            let found = find(text, columns)?;
            if let Some(column) = found {
                let unit = unit.map(Into::into);
                return Ok(Source { column, expression: None, gain, offset, unit, scaled });
            }
            if let Some(LeftOut { reason, .. }) = left_out.iter().find(|l| l.name == text) {
                return Err((
                    format!("--map {}={}: column '{text}' is left out: {reason}", self.target, self.source),
                    "name a column of numbers".into(),
                ));
            }
        }
        if self.source.contains(['*', '/', '+', '-', '(']) {
            let named = |name: &str| find(name, columns).ok().flatten();
            match Expression::parse(&self.source, columns, &named) {
                Ok(expression) => {
                    if let Some(&column) = expression.columns().first() {
                        return Ok(Source { expression: Some(expression), scaled: true, ..Source::plain(column) });
                    }
                }
                // A name that holds such a sign by itself is looked for as a whole.
                Err(fault) if columns.iter().any(|c| self.source.contains(&c.label)) => {
                    return Err((
                        format!("--map {}={}: {fault}", self.target, self.source),
                        nearest(columns, &self.source),
                    ));
                }
                Err(_) => {}
            }
        }
        let wanted = readings.last().map_or(self.source.as_str(), |r| r.0);
        Err((format!("--map {}={}: there is no column '{wanted}'", self.target, self.source), nearest(columns, wanted)))
    }
}

/// The columns of a file, and the one that was meant.
fn nearest(columns: &[Column], wanted: &str) -> String {
    let names = || columns.iter().map(|column| column.name.as_str());
    let more = if columns.len() > NAMED { format!(" and {} more", columns.len() - NAMED) } else { String::new() };
    let near = spelling::nearest_first(wanted, names());
    let told = spelling::advice(wanted, near.into_iter().take(NAMED), "the file has");
    format!("{told}{more}")
}

/// By full name, then by the name inside its group, then without the unit in the header.
fn find(text: &str, columns: &[Column]) -> std::result::Result<Option<usize>, (String, String)> {
    let tests: [&dyn Fn(&Column) -> bool; 3] =
        [&|c| c.name == text, &|c| c.label == text, &|c| names::header(&c.label).base == text];
    for test in tests {
        let hits: Vec<usize> = (0..columns.len()).filter(|&k| test(&columns[k])).collect();
        match hits.as_slice() {
            [] => {}
            [one] => return Ok(Some(*one)),
            several => {
                let names: Vec<_> = several.iter().map(|&k| columns[k].name.as_str()).collect();
                return Err((
                    format!("--map: '{text}' names several columns"),
                    format!("write one of {}", names.join(", ")),
                ));
            }
        }
    }
    Ok(None)
}

/// A `--map` argument for a channel, quoted for the shell where it has to be.
pub fn example(channel: Channel, source: &str) -> String {
    example_for(channel.column(), source)
}

/// A `--map` argument for any target.
pub fn example_for(target: &str, source: &str) -> String {
    let plain = source.chars().all(|c| c.is_alphanumeric() || "_-./".contains(c));
    if plain { format!("--map {target}={source}") } else { format!("--map '{target}={source}'") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(names: &[&str]) -> Vec<Column> {
        names.iter().map(|n| Column::new(*n, vec![])).collect()
    }

    fn resolve(rule: &str, names: &[&str]) -> (usize, f64, f64, Option<String>) {
        let mapping = Mapping::parse(&[rule]).expect("a rule");
        let s = mapping.rules[0].resolve(&columns(names), &[]).expect("a column");
        (s.column, s.gain, s.offset, s.unit)
    }

    #[test]
    fn rules_are_taken_apart() {
        assert_eq!(resolve("u_v=Ch1", &["x", "Ch1"]), (1, 1.0, 0.0, None));
        assert_eq!(resolve("u_v=Ch1*0.01", &["Ch1"]), (0, 0.01, 0.0, None));
        assert_eq!(resolve("u_v=Ch1*2e-3+0.5", &["Ch1"]), (0, 2e-3, 0.5, None));
        assert_eq!(resolve("u_v=Ch1*2e-3", &["Ch1"]), (0, 2e-3, 0.0, None));
        assert_eq!(resolve("u_v=Ch1*-2-1", &["Ch1"]), (0, -2.0, -1.0, None));
        assert_eq!(resolve("u_v=Ch1/4", &["Ch1"]), (0, 0.25, 0.0, None));
        assert_eq!(resolve("i_a=Ch1-2.5", &["Ch1"]), (0, 1.0, -2.5, None));
        assert_eq!(resolve("omega_rad_s=Speed[rpm]", &["Speed"]), (0, 1.0, 0.0, Some("rpm".into())));
        assert_eq!(resolve("omega_rad_s=Speed[rpm]*2", &["Speed"]), (0, 2.0, 0.0, Some("rpm".into())));
        assert_eq!(resolve("omega_rad_s=Speed*2[rpm]", &["Speed"]), (0, 2.0, 0.0, Some("rpm".into())));
        // A name is taken as it stands before any of its signs is read as an operation.
        assert_eq!(resolve("u_v=a+1", &["a", "a+1"]), (1, 1.0, 0.0, None));
        assert_eq!(resolve("u_v=u [V]*2", &["u [V]"]), (0, 2.0, 0.0, None));
        assert_eq!(resolve("u_v=u*2", &["u [V]"]), (0, 2.0, 0.0, None));
    }

    #[test]
    fn map_takes_several_pairs_and_leaves_the_recordings() {
        let spread = |text: &str| -> Vec<String> {
            super::spread(text.split(' ').map(OsString::from))
                .iter()
                .map(|a| a.to_string_lossy().into_owned())
                .collect()
        };
        assert_eq!(
            spread("greyrig identify --map u_v=a i_a=b run.csv --fix R=1"),
            ["greyrig", "identify", "--map", "u_v=a", "--map", "i_a=b", "run.csv", "--fix", "R=1"]
        );
        assert_eq!(
            spread("g c run.csv --map u_v=a --out x=1"),
            ["g", "c", "run.csv", "--map", "u_v=a", "--out", "x=1"]
        );
        assert_eq!(spread("g c --map=u_v=a i_a=b f"), ["g", "c", "--map=u_v=a", "--map", "i_a=b", "f"]);
        assert_eq!(spread("g c --map u_v=a -- i_a=b"), ["g", "c", "--map", "u_v=a", "--", "i_a=b"]);
    }

    #[test]
    fn intervals() {
        assert_eq!(Mapping::parse(&["sample_time_s=1e-4"]).expect("valid").sample_time_s, Some(1e-4));
        assert!(
            (Mapping::parse(&["sample_time_s=100[us]"]).expect("valid").sample_time_s.unwrap_or(0.0) - 1e-4).abs()
                < 1e-18
        );
        for bad in
            ["sample_time_s=0", "sample_time_s=-1", "sample_time_s=inf", "sample_time_s=x", "u_v", "foo=bar", "u_v="]
        {
            assert!(Mapping::parse(&[bad]).is_err(), "{bad}");
        }
    }
}
