//! How results are printed for a person.

use anstyle::Style;

use super::paint::{BAD, DOUBT, FAINT, GOOD, STRONG, painted};
use super::table::{Cell, Column, Table};
use crate::between::Course;
use crate::compare::{Comparison, PerSignal};
use crate::identify::flux::FluxAtPeak;
use crate::identify::{Estimate, Identification};
use crate::model::Status;
use crate::monitor::test::Outcome;
pub use crate::numbers::percent_in_column as percent;
pub use crate::numbers::unit;
use crate::numbers::{self, readable_unit, with_interval};
use crate::speed_sensor::SpeedSensor;

/// The number that an answer turns on.
pub fn strong(text: impl ToString) -> Cell {
    Cell::painted(STRONG, text)
}

/// What only stands beside it.
pub fn faint(text: impl ToString) -> Cell {
    Cell::painted(FAINT, text)
}

/// Something to know beside an answer.
pub fn note(text: impl std::fmt::Display) -> String {
    format!("{}: {text}", painted(DOUBT, "note"))
}

/// How a verdict on a motor is shown.
pub const fn style_of(outcome: Outcome) -> Style {
    match outcome {
        Outcome::Pass => GOOD,
        Outcome::CannotJudge => DOUBT,
        Outcome::Fail => BAD,
    }
}

/// The verdict on a motor.
pub fn outcome(outcome: Outcome) -> Cell {
    Cell::painted(style_of(outcome), outcome.words())
}

/// The parameters with their intervals.
pub fn parameters(identification: &Identification) -> String {
    let mut table = Table::new([
        Column::text("parameter"),
        Column::figure("value"),
        Column::text("unit"),
        Column::figure("95 % interval"),
        Column::text(""),
    ]);
    for Estimate { name, value, unit, ci95, status, .. } in &identification.parameters {
        let (value, interval) = match value {
            Some(value) => {
                let (value, interval) = with_interval(*value, *ci95);
                (value, if ci95.is_some() { interval } else { String::new() })
            }
            None => (numbers::NONE.to_owned(), String::new()),
        };
        table.row([
            Cell::from(name),
            strong(value),
            Cell::from(if unit == "1" { unit.clone() } else { numbers::unit(unit) }),
            Cell::from(interval),
            match status {
                Status::Identified => Cell::default(),
                Status::Fixed => faint("fixed"),
                Status::NotIdentifiable => Cell::painted(DOUBT, "not identifiable"),
            },
        ]);
    }
    table.to_string()
}

/// The linkage at the largest current in a line.
pub fn flux(flux: &FluxAtPeak) -> String {
    let (value, interval) = with_interval(flux.value, Some(flux.ci95));
    let FluxAtPeak { current, speed, .. } = flux;
    format!("K φ = {value} V s/rad ({interval}) at {current:.2} A, the largest, and {speed:.0} rad/s")
}

/// Error-to-signal ratios next to the noise floor, recording by recording.
pub fn errors(comparison: &Comparison) -> String {
    let torque = comparison.esr.torque.is_some();
    type Pick = fn(&PerSignal) -> Option<f64>;
    let first: (&str, Pick) = if torque { ("torque", |p| p.torque) } else { ("current", |p| p.current) };
    let signals: [(&str, Pick); 2] = [first, ("speed", |p| p.speed)];
    let columns = signals.iter().flat_map(|(name, _)| [*name, "noise floor"]).map(Column::figure);
    let mut table = Table::new([Column::text("error-to-signal ratio")].into_iter().chain(columns));
    let mut row = |name: &str, esr: &PerSignal, floor: &PerSignal| {
        let figures = signals.iter().flat_map(|(_, of)| [strong(percent(of(esr))), faint(percent(of(floor)))]);
        table.row([Cell::from(name)].into_iter().chain(figures));
    };
    for r in &comparison.per_recording {
        row(&r.recording, &r.esr, &r.noise_floor);
    }
    if comparison.per_recording.len() > 1 {
        row("all", &comparison.esr, &comparison.noise_floor);
    }
    let mut text = table.to_string();
    for r in comparison.per_recording.iter().filter(|r| r.diverges) {
        text += &format!(
            "\n{}: the free run diverges; with these parameters the model is not stable on this recording",
            r.recording
        );
    }
    let mut sensors: Vec<SpeedSensor> = comparison.per_recording.iter().filter_map(|r| r.speed_sensor).collect();
    sensors.dedup();
    for sensor in sensors {
        text += &format!("\nspeed {}; the model's is shown alike", sensor.in_words());
    }
    if let Some(course) = comparison.input
        && course != Course::Smooth
    {
        text += &format!("\nvoltage between its samples: {course}");
    }
    match &comparison.noise_floor_source {
        Some(source) => text += &format!("\nnoise floor: {source}"),
        None => text += "\nnoise floor: unknown from these recordings",
    }
    if let (Some(current), Some(speed)) = (comparison.structured.current, comparison.structured.speed) {
        text += &format!(
            "\none side at a time: current {} with the measured speed, speed {} with the measured current",
            percent(Some(current)),
            percent(Some(speed))
        );
    }
    text
}

/// Where the model fails.
pub fn regions(comparison: &Comparison) -> String {
    if comparison.regions.is_empty() {
        return "no region stands out".into();
    }
    comparison.regions.iter().map(|r| format!("  {}", r.text)).collect::<Vec<_>>().join("\n")
}

/// A quantity to two digits, with its unit: 43 mV, 0.15, 1.7e-11 N m s²/(A² rad²).
pub fn quantity(value: f64, unit: &str) -> String {
    let (size, unit) = readable_unit(value, unit);
    let scaled = value / size;
    let number = if scaled == 0.0 || (1e-2..1e4).contains(&scaled.abs()) {
        let decimals = (1.0 - (1.005 * scaled.abs().max(1e-2)).log10().floor()).max(0.0) as usize;
        format!("{scaled:.decimals$}")
    } else {
        format!("{scaled:.1e}")
    };
    if unit.is_empty() { number } else { format!("{number} {unit}") }
}
