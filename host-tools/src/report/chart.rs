//! Static charts in SVG: a frame with axes, into which lines, bands and cells are drawn. Colours come from the style
//! sheet, so that the charts follow light, dark and print.

use maud::{Markup, PreEscaped, html};

use crate::numbers::figure;

/// An axis: what it shows and from where to where.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Name and unit.
    pub label: String,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Values with their labels; filled with round numbers by [`Axis::new`].
    pub ticks: Vec<(f64, String)>,
}

impl Axis {
    /// An axis with ticks at round numbers. Ends that are no range are widened to one.
    pub fn new(label: impl Into<String>, low: f64, high: f64) -> Self {
        let (low, high) = match (low.is_finite() && high.is_finite(), low < high) {
            (true, true) => (low, high),
            (true, false) => (low - 1.0, low + 1.0),
            _ => (0.0, 1.0),
        };
        Self { label: label.into(), low, high, ticks: round_ticks(low, high, 6) }
    }

    /// A logarithmic axis: values are decimal logarithms, ticks stand at the powers of ten (or at some values between,
    /// where the range is short).
    pub fn logarithmic(label: impl Into<String>, low: f64, high: f64) -> Self {
        let mut axis = Self::new(label, low, high);
        let decades: Vec<f64> = (axis.low.ceil() as i32..=axis.high.floor() as i32).map(f64::from).collect();
        if decades.len() >= 2 {
            let every = decades.len().div_ceil(6);
            axis.ticks = decades.iter().step_by(every).map(|&d| (d, figure(10f64.powf(d), 1))).collect();
        } else {
            axis.ticks = axis.ticks.iter().map(|&(v, _)| (v, figure(10f64.powf(v), 2))).collect();
        }
        axis
    }
}

/// Multiples of 1, 2 or 5 times a power of ten within a range, about `count` of them, labelled alike.
fn round_ticks(low: f64, high: f64, count: usize) -> Vec<(f64, String)> {
    let raw = (high - low) / count as f64;
    let power = 10f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= raw * 0.999).unwrap_or(raw);
    if !(step > 0.0 && step.is_finite()) {
        return Vec::new();
    }
    let first = (low / step).ceil();
    let decimals = (-(step.log10().floor())).max(0.0) as usize;
    (0..=2 * count)
        .map(|k| (first + k as f64) * step)
        .take_while(|v| *v <= high + 1e-9 * step)
        .map(|v| {
            // Minus zero would print its sign.
            let v = if v.abs() < 1e-9 * step { 0.0 } else { v };
            (v, if decimals > 4 || v.abs() >= 1e6 { figure(v, 3) } else { format!("{v:.decimals$}") })
        })
        .collect()
}

/// The space of a chart and its axes.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Width of the drawing in its own units (about pixels).
    pub width: f64,
    /// Height.
    pub height: f64,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
}

const LEFT: f64 = 62.0;
const RIGHT: f64 = 10.0;
const TOP: f64 = 8.0;
const BOTTOM: f64 = 42.0;

impl Frame {
    /// Horizontal place of a value.
    pub fn x(&self, value: f64) -> f64 {
        place(LEFT + (value - self.x.low) / (self.x.high - self.x.low) * (self.width - LEFT - RIGHT))
    }
    /// Vertical place of a value.
    pub fn y(&self, value: f64) -> f64 {
        place(self.height - BOTTOM - (value - self.y.low) / (self.y.high - self.y.low) * (self.height - TOP - BOTTOM))
    }
    /// Top of the plotting area.
    pub fn top(&self) -> f64 {
        TOP
    }
    /// Bottom of the plotting area.
    pub fn bottom(&self) -> f64 {
        self.height - BOTTOM
    }

    /// A polyline through points; a point that is not finite interrupts it.
    pub fn line(&self, class: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Markup {
        let mut path = String::new();
        let mut pen_down = false;
        for (x, y) in points {
            if x.is_finite() && y.is_finite() {
                path += &format!("{}{} {}", if pen_down { 'L' } else { 'M' }, self.x(x), self.y(y));
            }
            pen_down = x.is_finite() && y.is_finite();
        }
        html! { path class=(class) d=(path) {} }
    }

    /// The chart: grid, `inside`, axes. `description` is what someone who cannot see it should know.
    pub fn draw(&self, description: &str, inside: &Markup) -> Markup {
        let (bottom, right) = (self.bottom(), self.width - RIGHT);
        html! {
            svg.chart viewBox=(format!("0 0 {} {}", self.width, self.height)) role="img" aria-label=(description) {
                g.grid {
                    @for (v, _) in &self.x.ticks { line x1=(self.x(*v)) x2=(self.x(*v)) y1=(TOP) y2=(bottom) {} }
                    @for (v, _) in &self.y.ticks { line x1=(LEFT) x2=(right) y1=(self.y(*v)) y2=(self.y(*v)) {} }
                }
                (inside)
                path.frame d=(format!("M{LEFT} {TOP}V{bottom}H{right}")) {}
                g.ticks text-anchor="middle" {
                    @for (v, text) in &self.x.ticks { text x=(self.x(*v)) y=(bottom + 15.0) { (text) } }
                }
                g.ticks text-anchor="end" {
                    @for (v, text) in &self.y.ticks { text x=(LEFT - 6.0) y=(self.y(*v) + 4.0) { (text) } }
                }
                text.axis x=((LEFT + right) / 2.0) y=(self.height - 8.0) text-anchor="middle" { (self.x.label) }
                text.axis transform=(format!("translate(13 {}) rotate(-90)", (TOP + bottom) / 2.0)) text-anchor="middle" {
                    (self.y.label)
                }
            }
        }
    }
}

/// Two decimals: finer than a pixel, and short in the file.
pub fn place(v: f64) -> f64 {
    if v.is_finite() { (v.clamp(-1e6, 1e6) * 100.0).round() / 100.0 } else { 0.0 }
}

/// The pattern that marks "no data". Identifiers are global to a page: once per page is enough.
pub fn hatch_pattern() -> Markup {
    PreEscaped(
        "<svg width=\"0\" height=\"0\" aria-hidden=\"true\"><defs><pattern id=\"no-data\" width=\"6\" height=\"6\" \
         patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\"><rect class=\"no-data-ground\" width=\"6\" \
         height=\"6\"/><line class=\"no-data-line\" x1=\"0\" y1=\"0\" x2=\"0\" y2=\"6\"/></pattern></defs></svg>"
            .to_owned(),
    )
}
