//! One comparison: what is read first, then the model, where it fails, and the plots.

use greyrig::motor::BaseParameter;
use maud::{Markup, PreEscaped, html};
use serde::Serialize;

use super::labels::{capital, printed_unit, signal};
use super::residuals;
use super::signals::{Budget, Signals};
use crate::compare::{Comparison, PerSignal, Profile, RecordingComparison, Signal};
use crate::model::{Model, Parameter, Status};
use crate::numbers::{self, figure, percent, quantity, relative_width};
use crate::recording::Motion;

const SIGNALS: [Signal; 3] = [Signal::Current, Signal::Speed, Signal::Torque];

fn of(figures: &PerSignal, signal: Signal) -> Option<f64> {
    match signal {
        Signal::Current => figures.current,
        Signal::Speed => figures.speed,
        Signal::Torque => figures.torque,
    }
    .filter(|v| v.is_finite())
}

/// The whole section.
pub fn markup(number: usize, comparison: &Comparison, model: &Model, budget: Budget) -> Markup {
    let motion = model.motion;
    html! {
        (headline(comparison, motion))
        (warnings(comparison))
        h3 { "Recording by recording" }
        (figures(comparison, motion))
        h3 { "Parameters" }
        (parameters(model))
        h3 { "Where it fails" }
        (regions(comparison, motion))
        h3 { "Signals" }
        @for (k, recording) in comparison.per_recording.iter().enumerate() {
            (plots(&format!("signals-{number}-{k}"), recording, motion, budget))
        }
        @if comparison.per_recording.is_empty() { p.note { "No recording was compared." } }
        @if !comparison.maps.is_empty() {
            h3 { "Error over current and speed" }
            div.figures { @for map in &comparison.maps { (residuals::map(map, motion)) } }
        }
        @if !comparison.profiles.is_empty() {
            h3 { "Error over one quantity at a time" }
            p.key { span class="swatch mean" {} "mean of model − measurement " span class="swatch band" {} "± RMS "
                span class="swatch count" {} "samples " span class="swatch region" {} "a region named above. "
                "Where the line fills the band, the error is systematic: the model lacks something there. A flat line in a wide \
                 band is scatter." }
            @for quantity in SIGNALS {
                @let of_signal: Vec<&Profile> = comparison.profiles.iter().filter(|p| p.quantity == quantity).collect();
                @if !of_signal.is_empty() {
                    h4 { (capital(signal(quantity, motion).name)) }
                    div.figures { @for profile in &of_signal { (residuals::profile(profile, &comparison.regions, motion)) } }
                    (residuals::profile_table(&of_signal, motion))
                }
            }
        }
    }
}

/// A card per signal: the error-to-signal ratio large, and what to hold against it.
fn headline(comparison: &Comparison, motion: Motion) -> Markup {
    html! {
        div.cards {
            @for quantity in SIGNALS {
                @let esr = of(&comparison.esr, quantity);
                @if esr.is_some() || (quantity != Signal::Torque && of(&comparison.noise_floor, quantity).is_some()) {
                    (card(comparison, quantity, esr, motion))
                }
            }
        }
        p.key { "Error-to-signal ratio: RMS of model − measurement over RMS of the measurement, in free run, over all recordings. "
            @match &comparison.noise_floor_source {
                Some(source) => { "The noise floor is what a perfect model would show: " (source.trim_end_matches('.')) "." }
                None => "The noise floor, what a perfect model would show, is not known for these data.",
            }
        }
    }
}

fn card(comparison: &Comparison, quantity_: Signal, esr: Option<f64>, motion: Motion) -> Markup {
    let name = signal(quantity_, motion).name;
    let floor = of(&comparison.noise_floor, quantity_);
    let structured = of(&comparison.structured, quantity_);
    let against_floor = match (esr, floor) {
        (None, Some(_)) => "too little signal above the noise for a ratio".to_owned(),
        (Some(esr), Some(floor)) if floor > 0.0 && esr <= 1.2 * floor => {
            "at the noise floor: nothing is left to explain".to_owned()
        }
        (Some(esr), Some(floor)) if floor > 0.0 => format!("{} times the noise floor", figure(esr / floor, 2)),
        _ => String::new(),
    };
    let given = match quantity_ {
        Signal::Current => "with measured speed imposed",
        Signal::Speed => "with measured current imposed",
        Signal::Torque => "with measured motion imposed",
    };
    html! {
        div.card {
            p.what { (capital(name)) " error to signal" }
            p.value { (percent(esr)) }
            // Bar and mark share a logarithmic scale from 0.01 % to 100 %.
            @if let Some(esr) = esr {
                @let share = |ratio: f64| figure(((ratio.max(1e-9).log10() + 4.0) / 4.0 * 100.0).clamp(0.5, 100.0), 3);
                div.gauge aria-hidden="true" {
                    span.fill style=(format!("width:{}%", share(esr))) {}
                    @if let Some(floor) = floor.filter(|f| *f > 0.0) { span.mark style=(format!("left:{}%", share(floor))) {} }
                }
                div.gauge-scale aria-hidden="true" { span { "0.01 %" } span { "1 %" } span { "100 %" } }
            }
            p { "Noise floor " (percent(floor)) @if !against_floor.is_empty() { " · " strong { (against_floor) } } }
            @if structured.is_some() { p.muted { (percent(structured)) " " (given) } }
        }
    }
}

fn warnings(comparison: &Comparison) -> Markup {
    let all: Vec<(&str, &str)> = comparison
        .per_recording
        .iter()
        .flat_map(|r| r.warnings.iter().map(move |w| (r.recording.as_str(), w.as_str())))
        .collect();
    html! {
        @if !all.is_empty() {
            div.warnings role="note" {
                p { strong { "About these data" } }
                ul { @for (recording, text) in &all { li { span.file { (recording) } ": " (text) } } }
            }
        }
    }
}

fn regions(comparison: &Comparison, motion: Motion) -> Markup {
    if comparison.regions.is_empty() {
        return html! { p { "The error is spread evenly: no region stands out." } };
    }
    html! {
        div.scroll { table {
            caption { "Worst first" }
            thead { tr {
                th scope="col" { "Region" } th scope="col" { "Signal" } th.number scope="col" { "RMS error" } th.number scope="col" { "Mean error" }
                th.number scope="col" { "Times average" } th.number scope="col" { "Share of squared error" }
            } }
            tbody { @for region in &comparison.regions {
                @let text = signal(region.quantity, motion);
                tr {
                    th scope="row" { (region.text) }
                    td { (text.name) }
                    td.number { (quantity(Some(region.error_rms), text.unit)) }
                    td.number { (quantity(Some(region.error_mean), text.unit)) }
                    td.number { (figure(region.times_average, 2)) }
                    td.number.share { (percent(Some(region.share)))
                        @if region.share.is_finite() {
                            span.bar aria-hidden="true" style=(format!("--share:{}%", figure((100.0 * region.share).clamp(0.0, 100.0), 3))) {}
                        }
                    }
                }
            } }
        } }
    }
}

/// The place where the page's script draws the signals, with the signals beside it.
fn plots(id: &str, recording: &RecordingComparison, motion: Motion, budget: Budget) -> Markup {
    html! {
        @match Signals::of(recording, motion, budget) {
            Some(signals) => div.signals id=(id) tabindex="0" role="group"
                aria-label=(format!("Plots of {}: measured and modelled signals over time", recording.recording)) {
                h4 { span.file { (recording.recording) } }
                script type="application/json" { (json(&signals)) }
            },
            None => p.note { span.file { (recording.recording) } ": no signals were kept for plots." },
        }
    }
}

/// JSON that cannot end the script element that it stands in: no `<` is left.
fn json(value: &impl Serialize) -> PreEscaped<String> {
    let text = serde_json::to_string(value).unwrap_or_else(|_| "null".to_owned());
    PreEscaped(text.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026"))
}

fn parameters(model: &Model) -> Markup {
    let base = BaseParameter::ALL.into_iter().filter_map(|base| Some((base, model.base_parameter(base)?)));
    html! {
        div.scroll { table {
            caption { "Kind " (model.kind) @if let Some(motor) = &model.motor { ", motor type " (motor) } }
            thead { tr {
                th scope="col" { "Parameter" } th scope="col" { "Meaning" } th.number scope="col" { "Value" } th.number scope="col" { "95 % interval" }
                th.number scope="col" { "Half width" } th scope="col" { "Unit" } th scope="col" { "Status" }
            } }
            tbody {
                @for (base, parameter) in base { (parameter_row(base.name(), meaning(base, model.motion), parameter)) }
                @for entry in &model.effects {
                    @let d = entry.id.description();
                    tr.effect { th colspan="7" scope="rowgroup" {
                        "Effect " (entry.id)
                        ": " (d.name) ", " span.equation { (d.equation) }
                    } }
                    @for (name, parameter) in &entry.parameters {
                        @let meaning = d.parameters.iter().find(|p| p.name == name).map_or("", |p| p.meaning);
                        (parameter_row(name, meaning, parameter))
                    }
                }
            }
        } }
        @if model.parameters.is_empty() { p.note { "The model has no parameters of its own." } }
    }
}

fn parameter_row(name: &str, meaning: &str, parameter: &Parameter) -> Markup {
    let (value, interval) = numbers::with_interval(parameter.value, parameter.ci95);
    let (class, status) = match parameter.status {
        Status::Identified => ("identified", "identified"),
        Status::Fixed => ("fixed", "given"),
        Status::NotIdentifiable => ("not-identifiable", "not identifiable from these data"),
    };
    html! { tr {
        th scope="row" { (name) } td { (meaning) } td.number { (value) } td.number { (interval) }
        td.number { (relative_width(parameter.value, parameter.ci95)) }
        td { (printed_unit(&parameter.unit)) } td class=(class) { (status) }
    } }
}

fn meaning(parameter: BaseParameter, motion: Motion) -> &'static str {
    match (parameter, motion) {
        (BaseParameter::R, _) => "resistance",
        (BaseParameter::L, _) => "inductance",
        (BaseParameter::K, _) => "flux coefficient",
        (BaseParameter::J, Motion::Rotary) => "inertia",
        (BaseParameter::J, Motion::Linear) => "moving mass",
        (BaseParameter::Mu0, _) => "dry friction",
        (BaseParameter::Mu1, _) => "viscous friction",
        (BaseParameter::Mu2, _) => "turbulent friction",
    }
}

fn figures(comparison: &Comparison, motion: Motion) -> Markup {
    let shown: Vec<Signal> = SIGNALS
        .into_iter()
        .filter(|s| {
            of(&comparison.esr, *s).is_some()
                || comparison.per_recording.iter().any(|r| of(&r.esr, *s).is_some() || of(&r.rms, *s).is_some())
        })
        .collect();
    html! {
        div.scroll { table.wide {
            caption { "Free run: only the voltage drives the model. Structured: the other measured signal is imposed." }
            thead {
                tr { th rowspan="2" scope="col" { "Recording" } @for s in &shown {
                    th colspan="4" scope="colgroup" { (capital(signal(*s, motion).name)) } } }
                tr { @for s in &shown {
                    th.number scope="col" { "RMS, " (signal(*s, motion).unit) } th.number scope="col" { "Free run" } th.number scope="col" { "Structured" }
                    th.number scope="col" { "Noise floor" }
                } }
            }
            tbody {
                @for r in &comparison.per_recording { tr {
                    th.file scope="row" { (r.recording) }
                    @for s in &shown {
                        td.number { (of(&r.rms, *s).map_or(numbers::NONE.to_owned(), |v| figure(v, 3))) }
                        td.number { (percent(of(&r.esr, *s))) } td.number { (percent(of(&r.structured, *s))) }
                        td.number { (percent(of(&r.noise_floor, *s))) }
                    }
                } }
                tr.total {
                    th scope="row" { "All together" }
                    @for s in &shown {
                        td.number { (numbers::NONE) }
                        td.number { (percent(of(&comparison.esr, *s))) } td.number { (percent(of(&comparison.structured, *s))) }
                        td.number { (percent(of(&comparison.noise_floor, *s))) }
                    }
                }
            }
        } }
        @if comparison.one_step != PerSignal::default() {
            p { "One step ahead, the voltage balance is off by " (percent(of(&comparison.one_step, Signal::Current)))
                " of the voltage's RMS, and the " (signal(Signal::Torque, motion).name) " balance by "
                (percent(of(&comparison.one_step, Signal::Speed))) " of the " (signal(Signal::Torque, motion).name) "'s." }
        }
    }
}
