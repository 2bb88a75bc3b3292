//! Figures that stand alone as SVG: they need no style sheet and suit light and dark pages.

use maud::{Markup, html};

use super::labels::capital;
use crate::compare::{PerSignal, Signal};
use crate::numbers::percent;

/// A state of the model on the way to a better one.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// What was added, such as `+ saturation`.
    pub label: String,
    /// Error-to-signal ratio then, as fractions.
    pub esr: PerSignal,
}

/// The error falling: a bar for each step's error-to-signal ratio, by signal, against the noise floor, as the text of
/// an SVG file.
pub fn error_falling(steps: &[Step], floor: PerSignal) -> String {
    drawing(steps, floor, true).into_string()
}

const STYLE: &str = "text{font:13px system-ui,'Segoe UI',Roboto,sans-serif;fill:#57606a}\
.name{font-weight:600}.bar{fill:#0072b2}.bar.last{fill:#009e73}.floor{stroke:#d55e00;stroke-width:2;stroke-dasharray:5 3}\
.floor-text{fill:#d55e00}.ground{stroke:#8c959f}\
@media(prefers-color-scheme:dark){text{fill:#adbac7}.bar{fill:#56b4e9}.bar.last{fill:#2fc49a}.floor{stroke:#f0883e}\
.floor-text{fill:#f0883e}}";

const BAR: f64 = 20.0;
const PITCH: f64 = 30.0;
const TOP: f64 = 34.0;
const PANEL: f64 = 300.0;
/// Room to the right of the longest bar for its figure.
const FIGURE: f64 = 70.0;

fn name(signal: Signal) -> &'static str {
    match signal {
        Signal::Current => "current",
        Signal::Speed => "speed",
        Signal::Torque => "torque or force",
    }
}

/// The drawing, with its own style sheet where it stands alone.
pub(super) fn drawing(steps: &[Step], floor: PerSignal, alone: bool) -> Markup {
    type Get = fn(&PerSignal) -> Option<f64>;
    let signals: [(Signal, Get); 3] =
        [(Signal::Current, |p| p.current), (Signal::Speed, |p| p.speed), (Signal::Torque, |p| p.torque)];
    let finite = |v: Option<f64>| v.filter(|v| v.is_finite() && *v >= 0.0);
    let shown: Vec<(Signal, Get)> =
        signals.into_iter().filter(|(_, get)| steps.iter().any(|s| finite(get(&s.esr)).is_some())).collect();
    // Characters of the label font are 7 units wide on average.
    let margin = 16.0 + 7.2 * steps.iter().map(|s| s.label.chars().count()).max().unwrap_or(0) as f64;
    let width = margin + shown.len() as f64 * (PANEL + 20.0);
    let height = TOP + PITCH * steps.len() as f64 + 26.0;
    let described: Vec<String> = steps
        .iter()
        .map(|s| {
            let values: Vec<String> = shown
                .iter()
                .map(|(signal_, get)| format!("{} {}", name(*signal_), percent(finite(get(&s.esr)))))
                .collect();
            format!("{}: {}", s.label, values.join(", "))
        })
        .collect();
    html! {
        svg.steps xmlns="http://www.w3.org/2000/svg" viewBox=(format!("0 0 {width:.0} {height:.0}")) width=(format!("{width:.0}"))
            role="img" aria-label=(format!("Error-to-signal ratio. {}", described.join("; "))) {
            @if alone { style { (maud::PreEscaped(STYLE)) } }
            @for (row, step) in steps.iter().enumerate() {
                text x=(format!("{:.0}", margin - 10.0)) y=(TOP + PITCH * row as f64 + 15.0) text-anchor="end" { (step.label) }
            }
            @for (panel, (quantity, get)) in shown.iter().enumerate() {
                @let left = margin + panel as f64 * (PANEL + 20.0);
                @let largest = steps.iter().filter_map(|s| finite(get(&s.esr))).chain(finite(get(&floor))).fold(0.0, f64::max);
                @let scale = if largest > 0.0 { (PANEL - FIGURE) / largest } else { 0.0 };
                g transform=(format!("translate({left:.1} 0)")) {
                    text.name x="0" y="18" { (capital(name(*quantity))) " error to signal" }
                    @for (row, step) in steps.iter().enumerate() {
                        @let y = TOP + PITCH * row as f64;
                        @match finite(get(&step.esr)) {
                            Some(value) => {
                                rect.bar.last[row + 1 == steps.len()] x="0" y=(y) height=(BAR) width=(format!("{:.1}", (value * scale).max(0.5))) {}
                                text x=(format!("{:.1}", value * scale + 6.0)) y=(y + 15.0) { (percent(Some(value))) }
                            }
                            None => text x="6" y=(y + 15.0) { "–" },
                        }
                    }
                    line.ground x1="0" x2="0" y1=(TOP - 6.0) y2=(height - 24.0) {}
                    @if let Some(value) = finite(get(&floor)) {
                        @let x = format!("{:.1}", value * scale);
                        line.floor x1=(x) x2=(x) y1=(TOP - 6.0) y2=(height - 24.0) {}
                        text.floor-text x=(x) y=(height - 8.0) { "noise floor " (percent(Some(value))) }
                    }
                }
            }
        }
    }
}
