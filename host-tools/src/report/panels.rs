//! Curves and marks side by side, as one SVG file that stands alone.

use maud::{Markup, PreEscaped, html};

use super::chart::{Axis, Frame};

/// An axis of a panel.
#[derive(Debug, Clone, PartialEq)]
pub enum Scale {
    /// From where to where.
    Linear(String, f64, f64),
    /// The same by powers of ten.
    Logarithmic(String, f64, f64),
    /// Names at 0, 1, 2, …
    Names(Vec<String>),
}

impl Scale {
    fn axis(&self) -> Axis {
        match self {
            Self::Linear(label, low, high) => Axis::new(label.as_str(), *low, *high),
            Self::Logarithmic(label, low, high) => Axis::logarithmic(label.as_str(), low.log10(), high.log10()),
            Self::Names(names) => {
                let ticks = names.iter().enumerate().map(|(k, name)| (k as f64, name.clone())).collect();
                Axis { label: String::new(), low: -0.5, high: names.len() as f64 - 0.5, ticks }
            }
        }
    }

    fn place(&self, value: f64) -> f64 {
        match self {
            Self::Logarithmic(..) if value > 0.0 => value.log10(),
            Self::Logarithmic(..) => f64::NAN,
            _ => value,
        }
    }
}

/// A chart among others.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// What it shows.
    pub title: String,
    /// Horizontal axis.
    pub x: Scale,
    /// Vertical axis.
    pub y: Scale,
    /// Points of each curve, in the order of the legend.
    pub curves: Vec<Vec<(f64, f64)>>,
    /// Marks in place of lines.
    pub marks: bool,
}

const WIDTH: f64 = 360.0;
const HEIGHT: f64 = 260.0;
/// Room above a panel for its title.
const TITLE: f64 = 24.0;
/// Room above all for the legend.
const LEGEND: f64 = 30.0;
/// Room for a name in it.
const ENTRY: f64 = 230.0;
/// Room that names of a vertical axis take.
const NAMES: f64 = 90.0;
const STYLE: &str = ".chart{overflow:visible}text{font:12px system-ui,'Segoe UI',Roboto,sans-serif;fill:#57606a}.title{font-weight:600}\
.grid line{stroke:#8c959f;stroke-opacity:.25}.frame{fill:none;stroke:#8c959f}path{fill:none;stroke-width:2}\
.c0{stroke:#d55e00}.c1{stroke:#0072b2}.c2{stroke:#009e73;stroke-dasharray:6 3}.c3{stroke:#cc79a7}\
circle.c0{fill:#d55e00}circle.c1{fill:#0072b2}circle.c2{fill:#009e73}circle.c3{fill:#cc79a7}\
@media(prefers-color-scheme:dark){text{fill:#adbac7}.c0{stroke:#f0883e}.c1{stroke:#56b4e9}.c2{stroke:#2fc49a}\
circle.c0{fill:#f0883e}circle.c1{fill:#56b4e9}circle.c2{fill:#2fc49a}}";

/// The file: panels in rows of so many, with a legend of the curves. `description` is what someone who cannot see it
/// should know.
pub fn panels(description: &str, legend: &[&str], panels: &[Panel], columns: usize) -> String {
    let columns = columns.clamp(1, panels.len().max(1));
    let margin = if panels.iter().any(|p| matches!(p.y, Scale::Names(_))) { NAMES } else { 0.0 };
    let (pitch, row) = (WIDTH + margin, HEIGHT + TITLE);
    let width = (columns as f64 * pitch).max(ENTRY * legend.len() as f64);
    let height = LEGEND + panels.len().div_ceil(columns) as f64 * row;
    html! {
        svg xmlns="http://www.w3.org/2000/svg" viewBox=(format!("0 0 {width:.0} {height:.0}")) width=(format!("{width:.0}"))
            role="img" aria-label=(description) {
            style { (PreEscaped(STYLE)) }
            @for (k, name) in legend.iter().enumerate() {
                @let x = 16.0 + ENTRY * k as f64;
                path class=(format!("c{k}")) d=(format!("M{x} 16h24")) {}
                text x=(x + 30.0) y="20" { (name) }
            }
            @for (k, panel) in panels.iter().enumerate() {
                @let (left, top) = ((k % columns) as f64 * pitch + margin, LEGEND + (k / columns) as f64 * row);
                text.title x=(left + 62.0) y=(top + 15.0) { (panel.title) }
                g transform=(format!("translate({left} {})", top + TITLE)) { (drawing(panel)) }
            }
        }
    }
    .into_string()
}

fn drawing(panel: &Panel) -> Markup {
    let frame = Frame { width: WIDTH, height: HEIGHT, x: panel.x.axis(), y: panel.y.axis() };
    let inside = html! {
        @for (k, curve) in panel.curves.iter().enumerate() {
            @let class = format!("c{k}");
            @let placed = curve.iter().map(|(x, y)| (panel.x.place(*x), panel.y.place(*y)));
            @if panel.marks {
                @for (x, y) in placed.filter(|(x, y)| x.is_finite() && y.is_finite()) {
                    circle class=(class) cx=(frame.x(x)) cy=(frame.y(y)) r="4.5" {}
                }
            } @else {
                (frame.line(&class, placed))
            }
        }
    };
    // A group rather than an image of its own: it is part of one.
    html! { svg width=(WIDTH) height=(HEIGHT) style="overflow:visible" { (frame.draw(&panel.title, &inside)) } }
}
