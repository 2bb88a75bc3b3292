//! How results are printed for a person.

use comfy_table::{Cell, CellAlignment, ContentArrangement, LineStyle, Table, TableStyle};

use super::stdout;
use crate::between::Course;
use crate::compare::{Comparison, PerSignal};
use crate::identify::flux::FluxAtPeak;
use crate::identify::{Estimate, Identification};
use crate::model::Status;
pub use crate::numbers::percent_in_column as percent;
use crate::speed_sensor::SpeedSensor;

/// A table in the house style, as wide as the terminal at most.
pub fn table(header: &[&str]) -> Table {
    let line = LineStyle::none().fill('─').junction('─');
    let mut table = Table::new();
    table.load_style(TableStyle::new().top_border(line).header_separator(line).bottom_border(line));
    if let Some(width) = stdout::width().and_then(|width| width.try_into().ok()) {
        table.set_width(width).set_content_arrangement(ContentArrangement::Dynamic);
    }
    table.set_header(header.iter().map(Cell::new));
    table
}

fn right(text: impl ToString) -> Cell {
    Cell::new(text.to_string()).set_alignment(CellAlignment::Right)
}

fn number(x: f64) -> String {
    if x == 0.0 {
        "0".into()
    } else if (1e-3..1e5).contains(&x.abs()) {
        format!("{x:.5}")
    } else {
        format!("{x:.4e}")
    }
}

/// The parameters with their intervals.
pub fn parameters(identification: &Identification) -> String {
    let mut table = table(&["parameter", "value", "unit", "95 % interval", ""]);
    for Estimate { name, value, unit, ci95, status, .. } in &identification.parameters {
        table.add_row(vec![
            Cell::new(name),
            right(value.map_or_else(|| "–".into(), number)),
            Cell::new(unit),
            right(ci95.map_or_else(String::new, |[low, high]| format!("{} … {}", number(low), number(high)))),
            Cell::new(match status {
                Status::Identified => "",
                Status::Fixed => "fixed",
                Status::NotIdentifiable => "not identifiable",
            }),
        ]);
    }
    table.to_string()
}

/// The linkage at the largest current in a line.
pub fn flux(flux: &FluxAtPeak) -> String {
    let [low, high] = flux.ci95.map(number);
    let FluxAtPeak { current, speed, value, .. } = flux;
    format!("K phi = {} V s/rad ({low} … {high}) at {current:.2} A, the largest, and {speed:.0} rad/s", number(*value))
}

/// Error-to-signal ratios next to the noise floor, recording by recording.
pub fn errors(comparison: &Comparison) -> String {
    let torque = comparison.esr.torque.is_some();
    type Pick = fn(&PerSignal) -> Option<f64>;
    let first: (&str, Pick) = if torque { ("torque", |p| p.torque) } else { ("current", |p| p.current) };
    let signals: [(&str, Pick); 2] = [first, ("speed", |p| p.speed)];
    let mut header = vec!["error-to-signal ratio".to_owned()];
    for (name, _) in &signals {
        header.push((*name).to_owned());
        header.push("noise floor".to_owned());
    }
    let mut table = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    let mut row = |name: &str, esr: &PerSignal, floor: &PerSignal| {
        let mut cells = vec![Cell::new(name)];
        for (_, of) in &signals {
            cells.push(right(percent(of(esr))));
            cells.push(right(percent(of(floor))));
        }
        table.add_row(cells);
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
    const PREFIXES: [(f64, &str); 4] = [(1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n")];
    let simple = matches!(unit, "V" | "A" | "s" | "N m" | "N" | "Ω" | "ohm" | "H");
    let fitting = PREFIXES.iter().find(|(size, _)| value.abs() >= 0.9995 * size);
    let (size, prefix) = fitting.filter(|_| simple).copied().unwrap_or(PREFIXES[0]);
    let scaled = value / size;
    let number = if scaled == 0.0 || (1e-2..1e4).contains(&scaled.abs()) {
        let decimals = (1.0 - (1.005 * scaled.abs().max(1e-2)).log10().floor()).max(0.0) as usize;
        format!("{scaled:.decimals$}")
    } else {
        format!("{scaled:.1e}")
    };
    if unit == "1" { number } else { format!("{number} {prefix}{unit}") }
}
