//! A function of two variables as a map of colours.

use maud::{Markup, html};

use super::chart::{Axis, Frame, place};
use super::residuals::diverging;
use crate::numbers::figure;

/// Values on a grid.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surface {
    /// What it shows.
    pub caption: String,
    /// Name of the horizontal axis, from where to where.
    pub x: (String, f64, f64),
    /// Name of the vertical axis, from where to where.
    pub y: (String, f64, f64),
    /// Name of the values.
    pub value: String,
    /// Cells in a row.
    pub columns: usize,
    /// Values row by row, from the lower left.
    pub values: Vec<f64>,
}

/// The map: blue below zero, red above.
pub fn markup(surface: &Surface) -> Markup {
    let columns = surface.columns;
    if columns == 0 || surface.values.len() < columns {
        return html! {};
    }
    let rows = surface.values.len() / columns;
    let ((x, left, right), (y, low, high)) = (&surface.x, &surface.y);
    let frame = Frame {
        width: 560.0,
        height: 400.0,
        x: Axis::new(x.as_str(), *left, *right),
        y: Axis::new(y.as_str(), *low, *high),
    };
    let limit = surface.values.iter().filter(|v| v.is_finite()).fold(0.0_f64, |m, v| m.max(v.abs()));
    let limit = if limit > 0.0 { limit } else { 1.0 };
    let at = |range: (f64, f64), k: usize, of: usize| range.0 + (range.1 - range.0) * k as f64 / of as f64;
    let inside = html! {
        @for row in 0..rows {
            @for column in 0..columns {
                @let value = surface.values[row * columns + column];
                @if value.is_finite() {
                    @let (x0, x1) = (at((*left, *right), column, columns), at((*left, *right), column + 1, columns));
                    @let (y0, y1) = (at((*low, *high), row, rows), at((*low, *high), row + 1, rows));
                    @let share = value / limit;
                    rect.cell.low[share < 0.0].high[share >= 0.0] style=(format!("--share:{}%", (share.abs() * 100.0).round()))
                        fill=(diverging(share)) x=(frame.x(x0)) y=(frame.y(y1)) width=(place(frame.x(x1) - frame.x(x0)))
                        height=(place(frame.y(y0) - frame.y(y1)))
                        data-tip=(format!("{x} {}, {y} {}: {} {}", figure((x0 + x1) / 2.0, 3), figure((y0 + y1) / 2.0, 3),
                            surface.value, figure(value, 3))) {}
                }
            }
        }
    };
    html! {
        figure.map {
            figcaption { (surface.caption) }
            (frame.draw(&format!("{}: {} over {x} and {y}", surface.caption, surface.value), &inside))
            div.scale aria-hidden="true" {
                span { "≤ −" (figure(limit, 2)) } span.ramp {} span { "≥ " (figure(limit, 2)) }
            }
            p.key { "Blue: " (surface.value) " below zero. Red: above." }
        }
    }
}
