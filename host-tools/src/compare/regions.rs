//! Where the model fails: the residual sorted by what the motor was doing.

use super::result::{Map, Profile, Region, Signal, Traces};
use crate::recording::Motion;

/// Bins along an axis.
const BINS: usize = 12;
/// Cells along each side of a map.
const CELLS: usize = 24;
/// A region counts when its RMS residual is at least this many times that of the whole,
const STANDS_OUT: f64 = 1.25;
/// holds at least this share of the squared residual,
const LEAST_SHARE: f64 = 0.05;
/// and at least this share of the samples.
const LEAST_SAMPLES: f64 = 0.005;
/// How many regions are reported.
const MOST_REGIONS: usize = 6;

/// What the residual can be sorted by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Axis {
    Current,
    AbsCurrent,
    Speed,
    Voltage,
    CurrentSlope,
    MainsPhase,
    Time,
}

impl Axis {
    const ALL: [Self; 7] =
        [Self::AbsCurrent, Self::Current, Self::Speed, Self::Voltage, Self::CurrentSlope, Self::MainsPhase, Self::Time];

    const fn name(self) -> &'static str {
        match self {
            Self::Current => "i_a",
            Self::AbsCurrent => "abs_i_a",
            Self::Speed => "omega_rad_s",
            Self::Voltage => "u_v",
            Self::CurrentSlope => "di_dt_sign",
            Self::MainsPhase => "mains_phase_deg",
            Self::Time => "t_s",
        }
    }

    /// The axis' value at a sample, from the measured signals.
    fn at(self, t: &Traces, phase: &[f64], n: usize) -> Option<f64> {
        match self {
            Self::Current => t.measured_current.get(n).copied(),
            Self::AbsCurrent => t.measured_current.get(n).map(|i| i.abs()),
            Self::Speed => t.measured_speed.get(n).copied(),
            Self::Voltage => t.voltage.get(n).copied(),
            Self::CurrentSlope => {
                Some((t.measured_current.get(n)? - t.measured_current.get(n.checked_sub(1)?)?).signum())
            }
            Self::MainsPhase => phase.get(n).copied().filter(|p| p.is_finite()),
            Self::Time => Some(t.start_s + n as f64 * t.sample_time_s),
        }
    }

    fn words(self, from: f64, to: f64, edges: &[f64], motion: Motion) -> String {
        let (first, last) = (edges[0], edges[edges.len() - 1]);
        let unit = match self {
            Self::Current | Self::AbsCurrent => "A",
            Self::Speed => match motion {
                Motion::Rotary => "rad/s",
                Motion::Linear => "m/s",
            },
            Self::Voltage => "V",
            Self::Time => "s",
            Self::MainsPhase => "°",
            Self::CurrentSlope => {
                return if from < 0.0 { "falling current".into() } else { "rising current".into() };
            }
        };
        let name = match self {
            Self::Current => "current",
            Self::AbsCurrent => "magnitude of the current",
            Self::Speed => "speed",
            Self::Voltage => "voltage",
            Self::MainsPhase => "mains phase",
            Self::Time => "time",
            Self::CurrentSlope => "",
        };
        if to >= last {
            format!("{name} above {} {unit}", short(from))
        } else if from <= first {
            format!("{name} below {} {unit}", short(to))
        } else {
            format!("{name} from {} to {} {unit}", short(from), short(to))
        }
    }
}

/// A number with three significant digits.
pub fn short(x: f64) -> String {
    if x == 0.0 {
        return "0".into();
    }
    let digits = (2 - x.abs().log10().floor() as i32).clamp(0, 6) as usize;
    format!("{x:.digits$}")
}

/// Mains phase of each sample in degrees, from the rising zero crossings of the voltage; NaN where there is none.
pub fn mains_phase(t: &Traces) -> Vec<f64> {
    let Some(period) = t.mains_period_s else { return Vec::new() };
    let mut phase = vec![f64::NAN; t.voltage.len()];
    let peak = t.voltage.iter().fold(0.0f64, |m, u| m.max(u.abs()));
    let (mut below, mut crossing) = (false, None);
    for (n, u) in t.voltage.iter().enumerate() {
        if *u < -0.02 * peak {
            below = true;
        } else if *u >= 0.0 && below {
            below = false;
            crossing = Some(n);
        }
        if let Some(start) = crossing {
            let turns = (n - start) as f64 * t.sample_time_s / period;
            if turns < 1.02 {
                phase[n] = 360.0 * turns.fract();
            }
        }
    }
    phase
}

/// Residuals of one signal over all recordings, with what they are sorted by.
fn residual(t: &Traces, signal: Signal, n: usize) -> Option<f64> {
    let [measured, model] = t.signal(signal);
    Some(model.get(n)? - measured.get(n)?)
}

fn edges(axis: Axis, values: &[f64]) -> Option<Vec<f64>> {
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    if high <= low || values.is_empty() {
        return None;
    }
    let bins = if axis == Axis::CurrentSlope { 2 } else { BINS };
    Some((0..=bins).map(|k| low + (high - low) * k as f64 / bins as f64).collect())
}

fn bin(edges: &[f64], x: f64) -> usize {
    let bins = edges.len() - 1;
    let place = (x - edges[0]) / (edges[bins] - edges[0]) * bins as f64;
    (place.max(0.0) as usize).min(bins - 1)
}

/// All profiles over all recordings, and the regions that stand out.
pub fn profiles(all: &[&Traces], motion: Motion) -> (Vec<Profile>, Vec<Region>) {
    let phases: Vec<Vec<f64>> = all.iter().map(|t| mains_phase(t)).collect();
    let (mut profiles, mut regions) = (Vec::new(), Vec::new());
    for signal in [Signal::Current, Signal::Speed, Signal::Torque] {
        for axis in Axis::ALL {
            let mut points = Vec::new();
            for (t, phase) in all.iter().zip(&phases) {
                for n in (0..t.counted.len()).filter(|n| t.counted[*n]) {
                    if let (Some(r), Some(x)) = (residual(t, signal, n), axis.at(t, phase, n)) {
                        points.push((x, r, t.measured_speed.get(n).copied().unwrap_or(0.0)));
                    }
                }
            }
            let Some(edges) = edges(axis, &points.iter().map(|p| p.0).collect::<Vec<_>>()) else { continue };
            let profile = profile(signal, axis, &edges, &points);
            regions.extend(standing_out(&profile, axis, &points, motion));
            profiles.push(profile);
        }
    }
    regions.sort_by(|a, b| (b.times_average * b.share.sqrt()).total_cmp(&(a.times_average * a.share.sqrt())));
    // The signed current tells what its magnitude has told already.
    let mut kept: Vec<Region> = Vec::new();
    for region in regions {
        let same = |k: &Region| k.quantity == region.quantity && k.axis == region.axis;
        if kept.iter().filter(|k| same(k)).count() < 1 && kept.len() < MOST_REGIONS {
            kept.push(region);
        }
    }
    (profiles, kept)
}

/// Whether each sample that counts lies in a region, whose bins are those of its profile.
pub fn inside(region: &Region, profiles: &[Profile], t: &Traces) -> Vec<bool> {
    let axis = Axis::ALL.into_iter().find(|axis| axis.name() == region.axis);
    let of_region = |p: &&Profile| p.quantity == region.quantity && p.axis == region.axis;
    let (Some(axis), Some(profile)) = (axis, profiles.iter().find(of_region)) else {
        return vec![false; t.counted.len()];
    };
    let phase = mains_phase(t);
    let lies_inside = |n: usize| {
        let x = axis.at(t, &phase, n).filter(|_| t.counted[n] && residual(t, region.quantity, n).is_some())?;
        let k = bin(&profile.edges, x);
        Some(profile.edges[k] >= region.from && profile.edges[k + 1] <= region.to)
    };
    (0..t.counted.len()).map(|n| lies_inside(n).unwrap_or(false)).collect()
}

fn profile(signal: Signal, axis: Axis, edges: &[f64], points: &[(f64, f64, f64)]) -> Profile {
    let bins = edges.len() - 1;
    let (mut counts, mut mean, mut rms) = (vec![0usize; bins], vec![0.0; bins], vec![0.0; bins]);
    for (x, r, _) in points {
        let k = bin(edges, *x);
        counts[k] += 1;
        mean[k] += r;
        rms[k] += r * r;
    }
    for k in 0..bins {
        let n = counts[k].max(1) as f64;
        mean[k] /= n;
        rms[k] = (rms[k] / n).sqrt();
    }
    Profile { quantity: signal, axis: axis.name(), edges: edges.to_vec(), counts, mean, rms }
}

/// The run of neighbouring bins around the worst one whose residual stands out.
fn standing_out(profile: &Profile, axis: Axis, points: &[(f64, f64, f64)], motion: Motion) -> Option<Region> {
    let total: f64 = points.iter().map(|p| p.1 * p.1).sum();
    let whole = (total / points.len() as f64).sqrt();
    if whole == 0.0 {
        return None;
    }
    let least = (LEAST_SAMPLES * points.len() as f64).max(20.0);
    let stands = |k: usize| profile.rms[k] >= STANDS_OUT * whole && profile.counts[k] as f64 >= least;
    let worst =
        (0..profile.rms.len()).filter(|k| stands(*k)).max_by(|a, b| profile.rms[*a].total_cmp(&profile.rms[*b]))?;
    let (mut from, mut to) = (worst, worst);
    while from > 0 && stands(from - 1) {
        from -= 1;
    }
    while to + 1 < profile.rms.len() && stands(to + 1) {
        to += 1;
    }
    let (low, high) = (profile.edges[from], profile.edges[to + 1]);
    let inside: Vec<&(f64, f64, f64)> =
        points.iter().filter(|p| (from..=to).contains(&bin(&profile.edges, p.0))).collect();
    let squares: f64 = inside.iter().map(|p| p.1 * p.1).sum();
    let mean = inside.iter().map(|p| p.1).sum::<f64>() / inside.len() as f64;
    let rms = (squares / inside.len() as f64).sqrt();
    let share = squares / total;
    if share < LEAST_SHARE {
        return None;
    }
    let times = rms / whole;
    let mut text = format!(
        "{}, {}: {times:.1} times the average, {:.0} % of the squared error",
        quantity_word(profile.quantity),
        axis.words(low, high, &profile.edges, motion),
        100.0 * share
    );
    // For an odd error (too high at one sign of the current, too low at the other) the mean says nothing.
    if mean.abs() > 0.5 * rms {
        text += if mean > 0.0 { ", model too high" } else { ", model too low" };
    }
    if axis != Axis::Speed
        && let Some(trend) = with_speed(&inside)
    {
        text += trend;
    }
    Some(Region {
        axis: axis.name(),
        from: low,
        to: high,
        quantity: profile.quantity,
        error_rms: rms,
        error_mean: mean,
        times_average: times,
        share,
        text,
    })
}

fn quantity_word(signal: Signal) -> &'static str {
    match signal {
        Signal::Current => "current error",
        Signal::Speed => "speed error",
        Signal::Torque => "torque error",
    }
}

/// Whether the residual grows or shrinks with the speed within a region.
fn with_speed(inside: &[&(f64, f64, f64)]) -> Option<&'static str> {
    let mut speeds: Vec<f64> = inside.iter().map(|p| p.2.abs()).collect();
    speeds.sort_by(f64::total_cmp);
    let (low, high) = (speeds[speeds.len() / 4], speeds[speeds.len() * 3 / 4]);
    if high < 1.3 * low.max(1e-9) {
        return None;
    }
    let rms = |keep: &dyn Fn(f64) -> bool| {
        let (sum, n) =
            inside.iter().filter(|p| keep(p.2.abs())).fold((0.0, 0usize), |(s, n), p| (s + p.1 * p.1, n + 1));
        (sum / n.max(1) as f64).sqrt()
    };
    let (slow, fast) = (rms(&|w| w <= low), rms(&|w| w >= high));
    if fast > 1.3 * slow {
        Some(", grows with speed")
    } else if slow > 1.3 * fast {
        Some(", shrinks with speed")
    } else {
        None
    }
}

/// Mean residual over the plane of current and speed, for each signal.
pub fn maps(all: &[&Traces]) -> Vec<Map> {
    let mut maps = Vec::new();
    for signal in [Signal::Current, Signal::Speed] {
        let mut points = Vec::new();
        for t in all {
            for n in (0..t.counted.len()).filter(|n| t.counted[*n]) {
                if let (Some(r), Some(i), Some(w)) =
                    (residual(t, signal, n), t.measured_current.get(n), t.measured_speed.get(n))
                {
                    points.push((*i, *w, r));
                }
            }
        }
        let spread = |of: &dyn Fn(&(f64, f64, f64)) -> f64| {
            let (low, high) =
                points.iter().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            (high > low).then(|| (0..=CELLS).map(|k| low + (high - low) * k as f64 / CELLS as f64).collect::<Vec<_>>())
        };
        let (Some(current_edges), Some(speed_edges)) = (spread(&|p| p.0), spread(&|p| p.1)) else { continue };
        let (mut counts, mut mean) = (vec![0usize; CELLS * CELLS], vec![0.0; CELLS * CELLS]);
        for (i, w, r) in &points {
            let cell = bin(&speed_edges, *w) * CELLS + bin(&current_edges, *i);
            counts[cell] += 1;
            mean[cell] += r;
        }
        for (m, n) in mean.iter_mut().zip(&counts) {
            *m /= (*n).max(1) as f64;
        }
        maps.push(Map { quantity: signal, current_edges, speed_edges, counts, mean });
    }
    maps
}
