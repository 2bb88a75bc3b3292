//! Where the model fails, in pictures: residual profiles over one quantity, and maps over current and speed.

use maud::{Markup, html};

use super::chart::{Axis, Frame, place};
use super::labels::{axis, axis_label, capital, signal};
use crate::compare::{Map, Profile, Region};
use crate::numbers::figure;
use crate::recording::Motion;

/// A residual profile: the mean as a line in a band of ± RMS. Where the line fills the band the error is systematic;
/// where it stays near zero in a wide band the error is scatter. Bars below show how many samples there are. Regions
/// in which the model fails are tinted.
pub fn profile(profile: &Profile, regions: &[Region], motion: Motion) -> Markup {
    let text = signal(profile.quantity, motion);
    let (name, unit) = axis(profile.axis, motion);
    let bins: Vec<Bin> = bins(profile);
    let (Some(first), Some(last)) = (bins.first(), bins.last()) else { return html! {} };
    let largest = bins.iter().filter(|b| b.count > 0).map(|b| b.rms.max(b.mean.abs())).fold(0.0, f64::max);
    let reach = if largest > 0.0 { largest * 1.08 } else { 1.0 };
    let most = bins.iter().map(|b| b.count).max().unwrap_or(0).max(1) as f64;
    let mut x = Axis::new(capital(&axis_label(&name, unit)), first.from, last.to);
    if profile.axis == "di_dt_sign" {
        x.ticks = [(-1.0, "falling"), (0.0, "flat"), (1.0, "rising")]
            .into_iter()
            .filter(|(v, _)| (x.low..=x.high).contains(v))
            .map(|(v, t)| (v, t.to_owned()))
            .collect();
    } else if profile.axis == "mains_phase_deg" && x.high - x.low > 300.0 {
        x.ticks = (0..=6).map(|k| 60.0 * f64::from(k)).map(|v| (v, format!("{v}"))).collect();
    }
    let frame = Frame {
        width: 380.0,
        height: 230.0,
        x,
        y: Axis::new(format!("{} error, {}", text.symbol, text.unit), -reach, reach),
    };
    let marked = regions.iter().filter(|r| r.axis == profile.axis && r.quantity == profile.quantity);
    let inside = html! {
        @for region in marked {
            @let (from, to) = (region.from.max(first.from), region.to.min(last.to));
            @if from < to {
                rect.region x=(frame.x(from)) width=(place(frame.x(to) - frame.x(from))) y=(frame.top())
                    height=(place(frame.bottom() - frame.top())) {}
            }
        }
        @for bin in &bins {
            @let (left, width) = (frame.x(bin.from), place(frame.x(bin.to) - frame.x(bin.from)));
            @if bin.count == 0 {
                rect.no-data x=(left) width=(width) y=(frame.top()) height=(place(frame.bottom() - frame.top())) {}
            } @else {
                rect.band x=(left) width=(width) y=(frame.y(bin.rms)) height=(place(frame.y(-bin.rms) - frame.y(bin.rms))) {}
                @let bar = place(24.0 * bin.count as f64 / most);
                rect.count x=(left) width=(width) y=(place(frame.bottom() - bar)) height=(bar) {}
            }
        }
        (frame.line("zero", [(frame.x.low, 0.0), (frame.x.high, 0.0)]))
        (frame.line("mean", bins.iter().flat_map(|b| {
            let mean = if b.count > 0 { b.mean } else { f64::NAN };
            [(b.from, mean), (b.to, mean)]
        })))
        @for bin in &bins {
            rect.hover data-tip=(bin.tip(&name, unit, text.unit)) x=(frame.x(bin.from))
                width=(place(frame.x(bin.to) - frame.x(bin.from))) y=(frame.top()) height=(place(frame.bottom() - frame.top())) {}
        }
    };
    let title = format!("{} error over {name}", capital(text.name));
    html! {
        figure {
            figcaption { (title) }
            (frame.draw(&format!("{title}: mean and RMS in {} bins; figures in the table below", bins.len()), &inside))
        }
    }
}

/// The figures behind the profiles of one signal.
pub fn profile_table(profiles: &[&Profile], motion: Motion) -> Markup {
    html! {
        details {
            summary { "Figures behind these plots" }
            div.scroll { table {
                thead { tr { th scope="col" { "Sorted by" } th.number scope="col" { "From" } th.number scope="col" { "To" }
                    th scope="col" { "Unit" } th.number scope="col" { "Samples" } th.number scope="col" { "Mean error" }
                    th.number scope="col" { "RMS error" } th scope="col" { "Error in" } } }
                tbody {
                    @for p in profiles {
                        @let (name, unit) = axis(p.axis, motion);
                        @for bin in bins(p) {
                            tr {
                                td { (name) } td.number { (figure(bin.from, 4)) } td.number { (figure(bin.to, 4)) } td { (unit) }
                                td.number { (bin.count) }
                                td.number { (bin.shown(bin.mean)) } td.number { (bin.shown(bin.rms)) }
                                td { (signal(p.quantity, motion).unit) }
                            }
                        }
                    }
                }
            } }
        }
    }
}

struct Bin {
    from: f64,
    to: f64,
    count: usize,
    mean: f64,
    rms: f64,
}

impl Bin {
    fn shown(&self, value: f64) -> String {
        figure(if self.count > 0 { value } else { f64::NAN }, 3)
    }
    fn tip(&self, name: &str, unit: &str, error_unit: &str) -> String {
        let place = format!("{name} {} … {} {unit}", figure(self.from, 3), figure(self.to, 3));
        if self.count == 0 {
            return format!("{}: no data", place.trim_end());
        }
        format!(
            "{}: mean {} {error_unit}, RMS {} {error_unit}, {} samples",
            place.trim_end(),
            figure(self.mean, 3),
            figure(self.rms, 3),
            self.count
        )
    }
}

/// The bins that are whole; a profile with lists of unequal length or edges that are no numbers loses the rest.
fn bins(profile: &Profile) -> Vec<Bin> {
    let figures = profile.counts.iter().zip(&profile.mean).zip(&profile.rms);
    profile
        .edges
        .windows(2)
        .zip(figures)
        .filter(|(edges, _)| edges[0] < edges[1])
        .map(|(edges, ((&count, &mean), &rms))| {
            let count = if mean.is_finite() && rms.is_finite() { count } else { 0 };
            Bin { from: edges[0], to: edges[1], count, mean, rms }
        })
        .collect()
}

/// Share of the samples whose cells lie within the colour scale; the rest is drawn in its end colours, so that a
/// single wild cell does not make all others look white.
const WITHIN_SCALE: f64 = 0.98;

/// A map of the mean residual: blue where the model is too low, red where it is too high, hatched without data.
pub fn map(map: &Map, motion: Motion) -> Markup {
    let text = signal(map.quantity, motion);
    let speed = signal(crate::compare::Signal::Speed, motion);
    let columns = map.current_edges.len().saturating_sub(1);
    let rows = map.speed_edges.len().saturating_sub(1);
    if columns == 0 || rows == 0 || map.counts.len() < columns * rows || map.mean.len() < columns * rows {
        return html! {};
    }
    let frame = Frame {
        width: 560.0,
        height: 400.0,
        x: Axis::new("Current i, A", map.current_edges[0], map.current_edges[columns]),
        y: Axis::new(format!("Speed {}, {}", speed.symbol, speed.unit), map.speed_edges[0], map.speed_edges[rows]),
    };
    let limit = scale_limit(map);
    let inside = html! {
        rect.no-data x=(frame.x(frame.x.low)) y=(frame.y(frame.y.high)) width=(place(frame.x(frame.x.high) - frame.x(frame.x.low)))
            height=(place(frame.y(frame.y.low) - frame.y(frame.y.high))) {}
        @for row in 0..rows {
            @for column in 0..columns {
                @let cell = row * columns + column;
                @if map.counts[cell] > 0 && map.mean[cell].is_finite() {
                    @let (left, right) = (frame.x(map.current_edges[column]), frame.x(map.current_edges[column + 1]));
                    @let (low, high) = (frame.y(map.speed_edges[row]), frame.y(map.speed_edges[row + 1]));
                    @let share = (map.mean[cell] / limit).clamp(-1.0, 1.0);
                    rect.cell.low[share < 0.0].high[share >= 0.0] style=(format!("--share:{}%", (share.abs() * 100.0).round()))
                        fill=(diverging(share)) x=(left) y=(high) width=(place(right - left)) height=(place(low - high))
                        data-tip=(format!("i {} … {} A, {} {} … {} {}: mean error {} {}, {} samples",
                            figure(map.current_edges[column], 3), figure(map.current_edges[column + 1], 3), speed.symbol,
                            figure(map.speed_edges[row], 3), figure(map.speed_edges[row + 1], 3), speed.unit,
                            figure(map.mean[cell], 3), text.unit, map.counts[cell])) {}
                }
            }
        }
    };
    let title = format!("{} error over current and speed", capital(text.name));
    let filled = map.counts.iter().filter(|c| **c > 0).count();
    html! {
        figure.map {
            figcaption { (title) }
            (frame.draw(&format!("{title}: mean of model − measurement in {filled} of {} cells", columns * rows), &inside))
            div.scale aria-hidden="true" {
                span { "≤ −" (figure(limit, 2)) " " (text.unit) } span.ramp {} span { "≥ " (figure(limit, 2)) " " (text.unit) }
            }
            p.key { "Blue: model too low. Red: model too high. Hatched: no data." }
        }
    }
}

fn scale_limit(map: &Map) -> f64 {
    let mut cells: Vec<(f64, usize)> = map
        .mean
        .iter()
        .zip(&map.counts)
        .filter(|(m, c)| **c > 0 && m.is_finite())
        .map(|(m, c)| (m.abs(), *c))
        .collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: usize = cells.iter().map(|(_, c)| c).sum();
    let mut sum = 0;
    let limit = cells.iter().find(|(_, c)| {
        sum += c;
        sum as f64 >= WITHIN_SCALE * all as f64
    });
    limit.map(|(m, _)| *m).filter(|m| *m > 0.0).unwrap_or(1.0)
}

/// Colour for browsers that cannot mix colours themselves: from blue over white to red.
pub(super) fn diverging(share: f64) -> String {
    let end = if share < 0.0 { [0x21, 0x66, 0xac] } else { [0xb2, 0x18, 0x2b] };
    let [r, g, b] = end.map(|c| (247.0 + (f64::from(c) - 247.0) * share.abs()).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}
