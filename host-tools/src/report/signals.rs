//! What a report keeps of the signals of a recording: an overview, averages over a mains period, and every sample
//! where the budget allows it.

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use serde::Serialize;

use super::extremes::{extremes, step};
use super::full_rate::{self, BLOCK, Scale};
use super::labels::{self, SignalText};
use crate::compare::{RecordingComparison, Signal, Traces};
use crate::numbers;
use crate::recording::Motion;

/// Averaging window on DC, s: the mains period at 50 Hz, so that AC and DC runs look alike.
const DC_WINDOW_S: f64 = 0.02;
/// Width of the stretches that the report offers to jump to, s.
const STRETCH_S: f64 = 0.2;

/// How much a recording may take in the file.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    /// Points of a trace that shows the whole recording.
    pub points: usize,
    /// Characters for samples at full rate.
    pub full_rate: usize,
}

/// The signals of one recording, as the page reads them. Arrays of numbers are little-endian `f32` in base64.
#[derive(Debug, Serialize)]
pub struct Signals {
    name: String,
    start_s: f64,
    sample_time_s: f64,
    samples: usize,
    /// Samples from one point of the overview to the next.
    step: f64,
    average: Average,
    rows: Vec<Row>,
    /// Stretches that the figures leave out, s.
    uncounted_s: Vec<[f64; 2]>,
    /// Stretches worth a look.
    stretches: Vec<Stretch>,
    full_rate: FullRate,
}

/// How the averages were taken.
#[derive(Debug, Serialize)]
struct Average {
    label: String,
    window_s: f64,
    /// Windows from one point to the next.
    step: f64,
}

/// One signal, measured and modelled. A row without a model (the voltage) has no residual.
#[derive(Debug, Serialize)]
struct Row {
    key: &'static str,
    name: String,
    symbol: &'static str,
    unit: &'static str,
    column: &'static str,
    measured: String,
    modelled: Option<String>,
    residual: Option<String>,
    measured_average: String,
    modelled_average: Option<String>,
    residual_rms: Option<String>,
    residual_mean: Option<String>,
    /// `RMS` or `mean`: what the averages of measured and modelled are.
    average: &'static str,
}

#[derive(Debug, Serialize)]
struct Stretch {
    label: String,
    from_s: f64,
    to_s: f64,
}

/// Samples at full rate: for each row measured, then (where modelled) the residual.
#[derive(Debug, Serialize)]
struct FullRate {
    block: usize,
    scales: Vec<Scale>,
    blocks: Vec<Option<String>>,
}

/// A signal before it is reduced.
struct Source<'a> {
    key: &'static str,
    text: SignalText,
    measured: &'a [f64],
    modelled: &'a [f64],
    residual: Vec<f64>,
    alternating: bool,
}

impl Signals {
    /// Prepares a recording's signals; `None` where it has none.
    pub fn of(recording: &RecordingComparison, motion: Motion, budget: Budget) -> Option<Self> {
        let traces = &recording.traces;
        let sources = sources(traces, motion);
        let samples = sources.iter().map(|s| s.measured.len()).max()?;
        let dt = traces.sample_time_s;
        if !(dt > 0.0 && dt.is_finite()) || samples < 2 {
            return None;
        }
        let window_s = traces.mains_period_s.filter(|p| p.is_finite() && *p > dt).unwrap_or(DC_WINDOW_S);
        let window = ((window_s / dt).round() as usize).clamp(1, samples);
        let stretches = stretches(&sources, traces, samples);
        let rows = sources.iter().map(|s| row(s, window, samples, budget.points)).collect();
        Some(Self {
            name: recording.recording.clone(),
            start_s: traces.start_s,
            sample_time_s: dt,
            samples,
            step: step(samples, budget.points),
            average: Average {
                label: match traces.mains_period_s {
                    Some(_) => format!("over a mains period ({} ms)", numbers::rounded(window_s * 1e3)),
                    None => format!("over {} ms", numbers::rounded(window_s * 1e3)),
                },
                window_s: window as f64 * dt,
                step: step(samples / window, budget.points),
            },
            rows,
            uncounted_s: uncounted(traces, samples),
            full_rate: full_rate(&sources, traces, samples, &stretches, budget.full_rate),
            stretches,
        })
    }
}

fn sources(traces: &Traces, motion: Motion) -> Vec<Source<'_>> {
    let on_mains = traces.mains_period_s.is_some();
    let pair = |signal, key, measured, modelled, alternating| Source {
        key,
        text: labels::signal(signal, motion),
        measured,
        modelled,
        residual: residual(measured, modelled),
        alternating,
    };
    let voltage = SignalText { name: "voltage", symbol: "u", unit: "V", column: "u_v" };
    let mut all = vec![Source {
        key: "voltage",
        text: voltage,
        measured: &traces.voltage,
        modelled: &[],
        residual: Vec::new(),
        alternating: on_mains,
    }];
    all.push(pair(Signal::Current, "current", &traces.measured_current, &traces.modelled_current, on_mains));
    all.push(pair(Signal::Speed, "speed", &traces.measured_speed, &traces.modelled_speed, false));
    all.push(pair(Signal::Torque, "torque", &traces.measured_torque, &traces.modelled_torque, false));
    all.retain(|s| !s.measured.is_empty());
    all
}

fn residual(measured: &[f64], modelled: &[f64]) -> Vec<f64> {
    if modelled.is_empty() {
        return Vec::new();
    }
    // A model that stopped early leaves the rest of the residual missing.
    (0..measured.len()).map(|k| modelled.get(k).map_or(f64::NAN, |m| m - measured[k])).collect()
}

fn encode(values: &[f32]) -> String {
    BASE64.encode(values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>())
}

/// The signal at full length: the page relies on all signals of a recording being equally long.
fn padded(signal: &[f64], samples: usize) -> Vec<f64> {
    let mut signal = signal.to_vec();
    signal.resize(samples, f64::NAN);
    signal
}

fn row(source: &Source<'_>, window: usize, samples: usize, points: usize) -> Row {
    let overview = |signal: &[f64]| encode(&extremes(&padded(signal, samples), points).points);
    let averaged = |signal: &[f64], average: fn(&[f64]) -> f64| {
        let signal = padded(signal, samples);
        encode(&extremes(&signal.chunks_exact(window).map(average).collect::<Vec<_>>(), points).points)
    };
    let average = if source.alternating { root_mean_square } else { mean };
    let modelled = !source.residual.is_empty();
    Row {
        key: source.key,
        name: source.text.name.to_owned(),
        symbol: source.text.symbol,
        unit: source.text.unit,
        column: source.text.column,
        measured: overview(source.measured),
        modelled: modelled.then(|| overview(source.modelled)),
        residual: modelled.then(|| overview(&source.residual)),
        measured_average: averaged(source.measured, average),
        modelled_average: modelled.then(|| averaged(source.modelled, average)),
        residual_rms: modelled.then(|| averaged(&source.residual, root_mean_square)),
        residual_mean: modelled.then(|| averaged(&source.residual, mean)),
        average: if source.alternating { "RMS" } else { "mean" },
    }
}

/// Mean of the finite samples; NaN where there is none.
fn mean(samples: &[f64]) -> f64 {
    let (sum, count) =
        samples.iter().filter(|v| v.is_finite()).fold((0.0, 0usize), |(sum, count), v| (sum + v, count + 1));
    sum / count as f64
}

fn root_mean_square(samples: &[f64]) -> f64 {
    let squares: Vec<f64> = samples.iter().map(|v| v * v).collect();
    mean(&squares).sqrt()
}

fn uncounted(traces: &Traces, samples: usize) -> Vec<[f64; 2]> {
    if traces.counted.is_empty() {
        return Vec::new();
    }
    let time = |k: usize| traces.start_s + k as f64 * traces.sample_time_s;
    let mut stretches: Vec<[f64; 2]> = Vec::new();
    let mut start = None;
    for k in 0..=samples {
        let out = k < samples && !traces.counted.get(k).copied().unwrap_or(false);
        match (out, start) {
            (true, None) => start = Some(k),
            (false, Some(from)) => {
                stretches.push([time(from), time(k)]);
                start = None;
            }
            _ => {}
        }
    }
    // Scattered single samples would bury the plot; the longest stretches are the ones to see.
    stretches.sort_by(|a, b| (b[1] - b[0]).total_cmp(&(a[1] - a[0])));
    stretches.truncate(200);
    stretches
}

/// Squared residual of each run of `width` samples, relative to the whole; samples that do not count are zero.
fn error_energy(source: &Source<'_>, traces: &Traces, samples: usize, width: usize) -> Vec<f64> {
    let square = |k: usize| {
        let counts = traces.counted.is_empty() || traces.counted.get(k).copied().unwrap_or(false);
        source.residual.get(k).filter(|r| counts && r.is_finite()).map_or(0.0, |r| r * r)
    };
    let energies: Vec<f64> =
        (0..samples).step_by(width).map(|from| (from..(from + width).min(samples)).map(square).sum()).collect();
    let whole: f64 = energies.iter().sum();
    if whole > 0.0 { energies.iter().map(|e| e / whole).collect() } else { energies }
}

/// The stretch with the largest error of each signal, and one with the median error of the first.
fn stretches(sources: &[Source<'_>], traces: &Traces, samples: usize) -> Vec<Stretch> {
    let dt = traces.sample_time_s;
    let width = (STRETCH_S / dt).round() as usize;
    if width < 2 || samples < 3 * width {
        return Vec::new();
    }
    let stretch = |label: String, number: usize| Stretch {
        label,
        from_s: traces.start_s + (number * width) as f64 * dt,
        to_s: traces.start_s + ((number + 1) * width).min(samples) as f64 * dt,
    };
    let mut found = Vec::new();
    for source in sources.iter().filter(|s| !s.residual.is_empty()) {
        let energies = error_energy(source, traces, samples, width);
        let mut order: Vec<usize> = (0..energies.len()).filter(|&k| energies[k] > 0.0).collect();
        order.sort_by(|&a, &b| energies[b].total_cmp(&energies[a]));
        if let Some(&worst) = order.first() {
            found.push(stretch(format!("largest {} error", source.text.name), worst));
        }
        if let Some(&typical) = order.get(order.len() / 2) {
            found.push(stretch(format!("typical {} error", source.text.name), typical));
        }
    }
    found
}

fn full_rate(
    sources: &[Source<'_>],
    traces: &Traces,
    samples: usize,
    stretches: &[Stretch],
    budget: usize,
) -> FullRate {
    let mut signals: Vec<(Scale, Vec<f64>)> = Vec::new();
    for source in sources {
        let scale = Scale::of(source.measured, 0.0);
        signals.push((scale, padded(source.measured, samples)));
        if !source.residual.is_empty() {
            // Digits of the residual finer than those of the signal it belongs to would be noise.
            signals.push((Scale::of(&source.residual, scale.step), padded(&source.residual, samples)));
        }
    }
    let blocks = samples.div_ceil(BLOCK);
    let mut importance = vec![0.0; blocks];
    for source in sources {
        for (sum, energy) in importance.iter_mut().zip(error_energy(source, traces, samples, BLOCK)) {
            *sum += energy;
        }
    }
    for stretch in stretches {
        let block = |time: f64| ((time - traces.start_s) / traces.sample_time_s) as usize / BLOCK;
        for important in importance.iter_mut().take(block(stretch.to_s) + 1).skip(block(stretch.from_s)) {
            *important += sources.len() as f64 + 1.0;
        }
    }
    let mut order: Vec<usize> = (0..blocks).collect();
    order.sort_by(|&a, &b| importance[b].total_cmp(&importance[a]));
    let mut kept: Vec<Option<String>> = vec![None; blocks];
    let mut left = budget;
    for block in order {
        let range = block * BLOCK..((block + 1) * BLOCK).min(samples);
        let parts: Vec<_> = signals.iter().map(|(scale, signal)| (*scale, &signal[range.clone()])).collect();
        let Ok(bytes) = full_rate::pack(&parts) else { break };
        let text = BASE64.encode(bytes);
        let Some(rest) = left.checked_sub(text.len()) else { break };
        left = rest;
        kept[block] = Some(text);
    }
    FullRate { block: BLOCK, scales: signals.iter().map(|(scale, _)| *scale).collect(), blocks: kept }
}
