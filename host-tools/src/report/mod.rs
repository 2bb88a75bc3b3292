//! The one place that draws: a report as a single HTML file that opens without a network.
//!
//! A [`Report`] is put together from sections, in the order in which they shall be read:
//!
//! ```no_run
//! # use greyrig_host::{compare::Comparison, error::Result, model::Model};
//! # fn demo(before: &Comparison, model: &Model) -> Result<()> {
//! use greyrig_host::report::Report;
//! Report::new("Vacuum-cleaner unit, type 462")
//!     .lead("The base model leaves 18 % of the current unexplained.")
//!     .comparison("Base model", before, model)
//!     .write("report.html".as_ref(), false)
//! # }
//! ```
//!
//! What is in the file: the page, its style and its scripts (uPlot draws the signals; everything else is static SVG
//! and can be read without scripts), and the signals. A content security policy forbids all loading from elsewhere and
//! every script but the two that belong to the report. The same input gives the same bytes.
//!
//! # Size
//! [`SIGNAL_BUDGET`] bounds the signals of the whole report, whatever the number and length of the recordings. A
//! quarter of it goes to overviews (the smallest and the largest sample of each of up to 2000 buckets per trace), the
//! rest to samples at full rate: first the stretches with the largest and with typical errors, then block by block, the
//! largest error first. 60 s of voltage, current and speed at 10 kHz behind a 250 Hz filter fit whole. Where a stretch
//! is not stored at full rate, the plots say so.

mod chart;
mod comparison;
mod extremes;
pub mod figures;
mod full_rate;
mod labels;
pub mod panels;
mod residuals;
mod signals;
mod surface;
pub mod training;

use std::path::Path;

use base64::Engine;
use maud::{DOCTYPE, Markup, PreEscaped, html};
use sha2::{Digest, Sha256};

pub use extremes::{Extremes, extremes};
pub use figures::Step;
pub use surface::Surface;

use crate::compare::{Comparison, PerSignal};
use crate::error::Result;
use crate::model::{Model, Origin};
use crate::numbers::{percent, rounded};
use crate::output;
use chart::{Axis, Frame};
use signals::Budget;

const UPLOT_JS: &str = include_str!("../../assets/uPlot.iife.min.js");
const UPLOT_CSS: &str = include_str!("../../assets/uPlot.min.css");
const UPLOT_LICENCE: &str = include_str!("../../assets/uPlot.LICENSE.txt");
const REPORT_JS: &str = include_str!("../../assets/report.js");
const REPORT_CSS: &str = include_str!("../../assets/report.css");

/// Characters that the signals of a report take at most (with many hundred recordings, the smallest overviews more).
pub const SIGNAL_BUDGET: usize = 4_200_000;

/// A table of any content; the first column names the row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Column titles, with units.
    pub columns: Vec<String>,
    /// Rows of as many cells.
    pub rows: Vec<Vec<String>>,
}

/// Curves over a common axis, such as training and checking error over epochs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curves {
    /// What it shows.
    pub caption: String,
    /// Name and unit of the horizontal axis.
    pub x: String,
    /// Name and unit of the vertical axis.
    pub y: String,
    /// Vertical axis by powers of ten; values that are not positive leave a gap.
    pub logarithmic: bool,
    /// Names with their points. Up to six are told apart.
    pub curves: Vec<(String, Vec<(f64, f64)>)>,
}

enum Section<'a> {
    Comparison(&'a Comparison, &'a Model),
    Steps(Vec<Step>, PerSignal),
    Table(Table),
    Curves(Curves),
    Surface(Surface),
    Text(String),
}

/// A report in the making.
#[must_use = "a report appears only when it is written"]
pub struct Report<'a> {
    title: String,
    lead: Vec<String>,
    sections: Vec<(String, Section<'a>)>,
    recordings: Vec<Origin>,
    facts: Vec<(String, String)>,
}

impl<'a> Report<'a> {
    /// An empty report.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), lead: Vec::new(), sections: Vec::new(), recordings: Vec::new(), facts: Vec::new() }
    }

    /// Adds a sentence to what is read first, under the title.
    pub fn lead(mut self, text: impl Into<String>) -> Self {
        self.lead.push(text.into());
        self
    }

    /// Adds a model against measurements: headline figures, parameters, where it fails, plots and tables. With several
    /// comparisons the report begins with a table that sets them side by side.
    pub fn comparison(self, heading: impl Into<String>, comparison: &'a Comparison, model: &'a Model) -> Self {
        self.section(heading, Section::Comparison(comparison, model))
    }

    /// Adds bars of the error falling from step to step.
    pub fn waterfall(self, heading: impl Into<String>, steps: &[Step], floor: PerSignal) -> Self {
        self.section(heading, Section::Steps(steps.to_vec(), floor))
    }

    /// Adds a table.
    pub fn table(self, heading: impl Into<String>, table: Table) -> Self {
        self.section(heading, Section::Table(table))
    }

    /// Adds a plot of curves.
    pub fn curves(self, heading: impl Into<String>, curves: Curves) -> Self {
        self.section(heading, Section::Curves(curves))
    }

    /// Adds a map of a function of two variables.
    pub fn surface(self, heading: impl Into<String>, surface: Surface) -> Self {
        self.section(heading, Section::Surface(surface))
    }

    /// Adds text; an empty line begins a new paragraph.
    pub fn text(self, heading: impl Into<String>, text: impl Into<String>) -> Self {
        self.section(heading, Section::Text(text.into()))
    }

    /// Names recordings that the report rests on, with their hashes.
    pub fn recordings(mut self, recordings: &[Origin]) -> Self {
        self.recordings.extend_from_slice(recordings);
        self
    }

    /// Adds a line to "Where this comes from", such as the command.
    pub fn fact(mut self, name: impl Into<String>, value: impl Into<String>) -> Self {
        self.facts.push((name.into(), value.into()));
        self
    }

    fn section(mut self, heading: impl Into<String>, section: Section<'a>) -> Self {
        self.sections.push((heading.into(), section));
        self
    }

    /// Writes the report, whole or not at all.
    ///
    /// # Errors
    /// An existing file without `force`, or what the system refuses.
    pub fn write(&self, path: &Path, force: bool) -> Result<()> {
        output::refuse_overwrite(path, force)?;
        let page = self.html();
        output::write_file(path, force, |out| out.write_all(page.as_bytes()))
    }

    /// The report as the text of an HTML file.
    pub fn html(&self) -> String {
        let budget = self.budget();
        let policy = format!(
            "default-src 'none'; base-uri 'none'; form-action 'none'; style-src 'unsafe-inline'; img-src data: blob:; \
             script-src '{}' '{}'",
            source_hash(UPLOT_JS),
            source_hash(REPORT_JS)
        );
        html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta http-equiv="Content-Security-Policy" content=(policy);
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    meta name="generator" content=(format!("greyrig {}", env!("CARGO_PKG_VERSION")));
                    title { (self.title) }
                    style { (PreEscaped(UPLOT_CSS)) }
                    style { (PreEscaped(REPORT_CSS)) }
                }
                body {
                    (chart::hatch_pattern())
                    header {
                        h1 { (self.title) }
                        @for text in &self.lead { p.lead { (text) } }
                        @if self.sections.len() > 1 {
                            nav aria-label="Sections" {
                                @for (number, (heading, _)) in self.sections.iter().enumerate() {
                                    a href=(format!("#section-{number}")) { (heading) }
                                }
                                a href="#origin" { "Where this comes from" }
                            }
                        }
                        noscript { p.note { "Scripts are off: the plots of the signals do not appear. All figures, profiles and \
                            maps can be read nevertheless." } }
                    }
                    main {
                        (self.side_by_side())
                        @for (number, (heading, section)) in self.sections.iter().enumerate() {
                            section id=(format!("section-{number}")) {
                                h2 { (heading) }
                                (section.markup(number, budget))
                            }
                        }
                        (self.origin())
                    }
                    footer { p { "Made by greyrig " (env!("CARGO_PKG_VERSION")) "." } }
                    div #tip role="status" hidden {}
                    script { (PreEscaped(UPLOT_JS)) }
                    script { (PreEscaped(REPORT_JS)) }
                }
            }
        }
        .into_string()
    }

    fn comparisons(&self) -> impl Iterator<Item = (&str, &'a Comparison, &'a Model)> {
        self.sections.iter().filter_map(|(heading, section)| match section {
            Section::Comparison(comparison, model) => Some((heading.as_str(), *comparison, *model)),
            _ => None,
        })
    }

    /// Shares the budget evenly between all recordings of all comparisons.
    fn budget(&self) -> Budget {
        let recordings = self.comparisons().map(|(_, c, _)| c.per_recording.len()).sum::<usize>().max(1);
        let each = SIGNAL_BUDGET / recordings;
        // Up to 15 traces (3 rows, measured, modelled and residual, some of them averaged), 5.4 characters a point.
        let points = (each / 4 / 81).clamp(200, 4000);
        Budget { points, full_rate: each * 3 / 4 }
    }

    fn side_by_side(&self) -> Markup {
        let all: Vec<_> = self.comparisons().collect();
        if all.len() < 2 {
            return html! {};
        }
        let torque = all.iter().any(|(_, c, _)| c.esr.torque.is_some());
        html! {
            section {
                h2 { "At a glance" }
                div.scroll { table {
                    caption { "Error-to-signal ratio in free run, and the noise floor" }
                    thead { tr {
                        th scope="col" { "Model" }
                        th.number scope="col" { "Current" } th.number scope="col" { "its floor" }
                        th.number scope="col" { "Speed" } th.number scope="col" { "its floor" }
                        @if torque { th.number scope="col" { "Torque or force" } th.number scope="col" { "its floor" } }
                        th scope="col" { "Fails most" }
                    } }
                    tbody { @for (heading, c, _) in &all { tr {
                        th scope="row" { (heading) }
                        td.number { (percent(c.esr.current)) } td.number { (percent(c.noise_floor.current)) }
                        td.number { (percent(c.esr.speed)) } td.number { (percent(c.noise_floor.speed)) }
                        @if torque { td.number { (percent(c.esr.torque)) } td.number { (percent(c.noise_floor.torque)) } }
                        td { (c.regions.first().map_or("nowhere in particular", |r| r.text.as_str())) }
                    } } }
                } }
            }
        }
    }

    fn origin(&self) -> Markup {
        html! {
            section #origin {
                h2 { "Where this comes from" }
                dl.facts {
                    @for (name, value) in &self.facts { dt { (name) } dd { (value) } }
                    dt { "Written by" } dd { "greyrig " (env!("CARGO_PKG_VERSION")) }
                }
                (origins("Recordings of this report", &self.recordings))
                @for (heading, _, model) in self.comparisons() {
                    h3 { "Model of “" (heading) "”" }
                    dl.facts {
                        dt { "Kind" } dd { (model.kind) }
                        @if let Some(motor) = &model.motor { dt { "Motor type" } dd { (motor) } }
                        dt { "Filter" }
                        dd { "Butterworth low-pass of order " (model.filter.order) ", cut-off " (rounded(model.filter.cutoff_hz)) " Hz" }
                        @if !model.provenance.method.is_empty() { dt { "Identified by" } dd { (model.provenance.method) } }
                        @if !model.provenance.greyrig.is_empty() { dt { "Model written by" } dd { "greyrig " (model.provenance.greyrig) } }
                    }
                    (origins("Recordings that the parameters come from", &model.provenance.recordings))
                }
                h3 { "Licence of the plotting library" }
                details { summary { "uPlot 1.6.32, MIT" } pre { (UPLOT_LICENCE) } }
            }
        }
    }
}

impl Section<'_> {
    fn markup(&self, number: usize, budget: Budget) -> Markup {
        match self {
            Self::Comparison(comparison, model) => comparison::markup(number, comparison, model, budget),
            Self::Steps(steps, floor) => html! {
                figure { div.scroll { (figures::drawing(steps, *floor, false)) } }
            },
            Self::Table(content) => table(content),
            Self::Curves(content) => curves(content),
            Self::Surface(content) => surface::markup(content),
            Self::Text(text) => html! { @for paragraph in text.split("\n\n") { p { (paragraph) } } },
        }
    }
}

fn origins(caption: &str, recordings: &[Origin]) -> Markup {
    if recordings.is_empty() {
        return html! {};
    }
    html! {
        div.scroll { table {
            caption { (caption) }
            thead { tr { th scope="col" { "File" } th.number scope="col" { "Samples" } th.number scope="col" { "Interval" } th scope="col" { "SHA-256" } } }
            tbody { @for r in recordings { tr {
                th scope="row" { (r.file) }
                td.number { (r.samples) }
                td.number { (rounded(r.sample_time_s * 1e6)) " µs" }
                td.hash { (r.sha256) }
            } } }
        } }
    }
}

fn table(table: &Table) -> Markup {
    let numeric = |k: usize| {
        let sign_or_digit = |c: char| c.is_ascii_digit() || "+-−–<>≤≥".contains(c);
        k > 0
            && table.rows.iter().filter_map(|r| r.get(k)).all(|cell| cell.is_empty() || cell.starts_with(sign_or_digit))
    };
    let class = |k: usize| numeric(k).then_some("number");
    html! {
        div.scroll { table {
            caption { (table.caption) }
            thead { tr { @for (k, column) in table.columns.iter().enumerate() { th scope="col" class=[class(k)] { (column) } } } }
            tbody { @for row in &table.rows { tr { @for (k, cell) in row.iter().enumerate() {
                @if k == 0 { th scope="row" { (cell) } } @else { td class=[class(k)] { (cell) } }
            } } } }
        } }
    }
}

fn curves(content: &Curves) -> Markup {
    let height = |y: f64| match content.logarithmic {
        true if y > 0.0 => y.log10(),
        true => f64::NAN,
        false => y,
    };
    let points = || content.curves.iter().flat_map(|(_, p)| p.iter().map(|&(x, y)| (x, height(y))));
    let range = |pick: fn((f64, f64)) -> f64| {
        points()
            .map(pick)
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
    };
    let ((left, right), (low, high)) = (range(|p| p.0), range(|p| p.1));
    let pad = if high > low { 0.05 * (high - low) } else { 0.5 };
    let y = if content.logarithmic { Axis::logarithmic } else { Axis::new };
    let frame = Frame {
        width: 720.0,
        height: 320.0,
        x: Axis::new(content.x.as_str(), left, right),
        y: y(content.y.clone(), low - pad, high + pad),
    };
    let inside = html! { @for (k, (_, points)) in content.curves.iter().enumerate() {
        (frame.line(&format!("curve c{}", k % 6), points.iter().map(|&(x, y)| (x, height(y)))))
    } };
    let names: Vec<&str> = content.curves.iter().map(|(name, _)| name.as_str()).collect();
    html! {
        figure.curves {
            figcaption { (content.caption) }
            p.key { @for (k, name) in names.iter().enumerate() { span class=(format!("swatch c{}", k % 6)) {} (name) " " } }
            (frame.draw(&format!("{}: {} over {}", content.caption, names.join(", "), content.x), &inside))
        }
    }
}

/// What a content security policy calls a script by.
fn source_hash(script: &str) -> String {
    format!("sha256-{}", base64::engine::general_purpose::STANDARD.encode(Sha256::digest(script.as_bytes())))
}
