//! Samples that are missing though the stamps are uniform.
//!
//! An alternating supply goes on while nothing is recorded: its phase jumps by 2π f Δ. A shaft has inertia: what it did
//! in the meantime shows as a jump of the speed, which no torque makes.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use super::signals::{self, Signals, largest, short};
use crate::mains;
use crate::noise;
use crate::recording::Channel;
use crate::recording::finding::{Code, DataFinding, Severity};

/// Samples on either side of a jump.
const SIDE: usize = 8;
/// Jump of the speed in standard deviations of what noise makes of it: as an outlier's.
const SIGMAS: f64 = 12.0;
/// The same in what the neighbourhood has: a bend has it all around.
const ALONE: f64 = 4.0;
/// Least jump of the speed, in its largest magnitude.
const LEAST: f64 = 2e-3;
/// Speed of a rotor at rest, in standard deviations of its noise: friction bends its course twice, as it stops and as
/// it breaks away, and what is lost there is not told.
const AT_REST: f64 = 4.0;
/// Step of the voltage, in its largest magnitude, beside which the speed may bend within a sample; and what a smaller
/// one may change the speed by, in largest speed over largest voltage: dry friction makes more of it than of the whole.
const EDGE: f64 = 0.05;
const FOLLOWS: f64 = 2.0;
/// Jump of the mains' phase, in the usual change from period to period.
const PHASE: f64 = 20.0;
/// Least jump of the phase, in samples.
const SAMPLES: f64 = 1.5;
/// Amplitude of the mains, in its largest one, below which it has no phase.
const AMPLITUDE: f64 = 0.1;
/// Change of the amplitude from a period before to one after, relative, beside which the supply may have been switched.
const SWITCHED: f64 = 0.1;
/// Share of samples without voltage from which on a supply is controlled by its phase, which moves with the control,
/// and the least jump then, rad.
const CHOPPED: f64 = 0.1;
const BY_CONTROL: f64 = 0.5;

/// What to look for.
pub fn look(s: &Signals<'_>, found: &mut Vec<DataFinding>) {
    let (places, seconds) = match s.voltage.and_then(|u| Some((u, mains::period_s(u, s.interval_s)?))) {
        Some((u, period_s)) => of_mains(s, u, period_s / s.interval_s, s.interval_s),
        None => {
            let resampled = found.iter().any(|f| f.recording == s.path() && f.code == Code::Resampled);
            if resampled || signals::goes_in_steps(s, Channel::Speed, found) {
                return;
            }
            (of_speed(s), None)
        }
    };
    let (Some(&first), Some(&last)) = (places.first(), places.last()) else { return };
    let so_much =
        seconds.map_or(String::new(), |t| format!(" (some {} ms of the mains' period at the first)", short(1e3 * t)));
    let text = format!(
        "samples are missing at {} {}, the first at {} s, though the stamps are uniform: {}{so_much}",
        places.len(),
        if places.len() == 1 { "place" } else { "places" },
        short(s.time_s(first)),
        if seconds.is_some() { "the supply's phase jumps" } else { "the speed jumps" },
    );
    found.push(
        s.finding(Code::SamplesLost, Severity::Warning, text)
            .between(s.time_s(first), s.time_s(last))
            .value(places.len() as f64, ""),
    );
}

/// Where the phase of the supply jumps, and by how much at first, s.
fn of_mains(s: &Signals<'_>, u: &[f64], period: f64, interval_s: f64) -> (Vec<usize>, Option<f64>) {
    let none = (Vec::new(), None);
    let nothing = 0.01 * largest(u);
    let chopped = u.iter().filter(|x| x.abs() < nothing).count() as f64 > CHOPPED * u.len() as f64;
    let length = period.round() as usize;
    if length < 8 || u.len() < 8 * length {
        return none;
    }
    let periods: Vec<(f64, f64)> = (0..u.len() / length)
        .map(|k| {
            let from = k * length;
            let (mut re, mut im) = (0.0, 0.0);
            for (n, x) in u[from..from + length].iter().enumerate() {
                let (sin, cos) = (TAU * (from + n) as f64 / period).sin_cos();
                re += x * cos;
                im -= x * sin;
            }
            (im.atan2(re), re.hypot(im))
        })
        .collect();
    let phases: Vec<f64> = periods.iter().map(|p| p.0).collect();
    let loud = AMPLITUDE * periods.iter().fold(0.0f64, |m, p| m.max(p.1));
    let has_phase = |k: usize| {
        let [before, after] = [periods[k - 1].1, periods[k + 1].1];
        let counts = ((k - 1) * length..(k + 2) * length).all(|n| s.is_valid(n));
        counts && periods[k - 1..=k + 1].iter().all(|p| p.1 > loud) && (after / before).ln().abs() < SWITCHED
    };
    let wrap = |x: f64| x - TAU * (x / TAU).round();
    let change = |k: usize| wrap(phases[k + 1] - phases[k - 1]);
    let usual = noise::median((1..phases.len() - 1).map(change).collect());
    let off: Vec<f64> =
        (1..phases.len() - 1).map(|k| if has_phase(k) { wrap(change(k) - usual) } else { 0.0 }).collect();
    let scatter = noise::median(off.iter().map(|x| x.abs()).collect());
    let limit = (PHASE * scatter).max(SAMPLES * TAU / period).max(if chopped { BY_CONTROL } else { 0.0 });
    // What is lost shifts the phase for good, an amplitude that steps within a period only that period's.
    let for_good = |k: usize| {
        let (before, after) = (k.saturating_sub(2), (k + 2).min(phases.len() - 1));
        let loud = [before, after].iter().all(|k| periods[*k].1 > loud);
        let shift = wrap(phases[after] - phases[before] - 0.5 * usual * (after - before) as f64);
        !loud || shift.abs() > 0.5 * limit
    };
    let mut places: Vec<usize> = Vec::new();
    let mut first = None;
    let mut last = 0;
    for (k, off) in off.iter().enumerate() {
        if off.abs() > limit && for_good(k + 1) {
            if places.is_empty() || k > last + 2 {
                places.push((k + 1) * length);
                first.get_or_insert(off.rem_euclid(TAU) / TAU * period * interval_s);
            }
            last = k;
        }
    }
    if places.len() * 4 > phases.len() { none } else { (places, first) }
}

/// Where the speed jumps.
fn of_speed(s: &Signals<'_>) -> Vec<usize> {
    let (Some(u), Some(w)) = (s.voltage, s.recording().channel(Channel::Speed)) else { return Vec::new() };
    let m = SIDE as f64;
    // A line of least squares over m samples, half a sample beyond its end: variance σ² (1/m + 3 m/(m² − 1)).
    let noise = noise::of_differences(w);
    let deviation = noise * (2.0 * (1.0 / m + 3.0 * m / (m * m - 1.0))).sqrt();
    let weight = |k: usize| 1.0 / m + (k as f64 - (m - 1.0) / 2.0) * (m / 2.0) * 12.0 / (m * (m * m - 1.0));
    let weights: [f64; SIDE] = std::array::from_fn(weight);
    let jump = |n: usize| -> f64 { (0..SIDE).map(|k| weights[k] * (w[n + SIDE - 1 - k] - w[n - SIDE + k])).sum() };
    let far = 3 * SIDE;
    if w.len() < 4 * far {
        return Vec::new();
    }
    let all: Vec<f64> = (SIDE..=w.len() - SIDE).map(|n| jump(n).abs()).collect();
    let limit = (SIGMAS * deviation).max(LEAST * largest(w));
    let step = EDGE * largest(u);
    let gain = FOLLOWS * largest(w) / largest(u).max(f64::MIN_POSITIVE);
    let mut places: Vec<usize> = Vec::new();
    for n in far..w.len() - far {
        let here = all[n - SIDE];
        if here < limit || all[n - SIDE - 2..=n - SIDE + 2].iter().any(|x| *x > here) {
            continue;
        }
        let beside = (SIDE..=2 * SIDE).flat_map(|k| [n - k, n + k]).map(|k| all.get(k - SIDE).copied().unwrap_or(0.0));
        let steepest = u[n - far..n + 2].windows(2).fold(0.0f64, |most, w| most.max((w[1] - w[0]).abs()));
        let calm = steepest < step && gain * steepest < here;
        let counts = (n - SIDE..n + SIDE).all(|k| s.is_valid(k) && !s.is_locked(k) && s.is_open(k) == s.is_open(n));
        let comes_to_rest = w[n - SIDE..n + SIDE].iter().any(|w| w.abs() <= AT_REST * noise);
        let alone = || here > ALONE * beside.fold(0.0, f64::max);
        if calm
            && counts
            && !comes_to_rest
            && alone()
            && more_than_a_bend(&w[n - SIDE..n + SIDE]) > (SIGMAS * noise).powi(2)
        {
            places.push(n);
        }
    }
    places
}

/// Squares that a jump in the middle of a course explains beyond a bend at an instant of its own: two straight lines
/// that need not meet, against two that do. A rotor that comes to rest bends the speed.
fn more_than_a_bend(course: &[f64]) -> f64 {
    let t = |k: usize| k as f64 - SIDE as f64 + 0.5;
    let from = |knot: f64| (0..course.len()).map(move |k| (t(k) - knot).max(0.0));
    let line = [vec![1.0; course.len()], (0..course.len()).map(t).collect()];
    let rest = |more: Vec<Vec<f64>>| {
        let columns: Vec<f64> = line.iter().chain(&more).flatten().copied().collect();
        let columns = DMatrix::from_vec(course.len(), line.len() + more.len(), columns);
        let y = DVector::from_column_slice(course);
        let q = columns.qr().q();
        y.norm_squared() - (q.transpose() * y).norm_squared()
    };
    let jump = (0..course.len()).map(|k| if t(k) > 0.0 { 1.0 } else { 0.0 }).collect();
    let jumps = rest(vec![jump, from(0.0).collect()]);
    let knots = (1..4 * (SIDE - 1)).map(|k| 0.5 * k as f64 - (SIDE - 1) as f64);
    let bends = knots.map(|knot| rest(vec![from(knot).collect()])).fold(f64::INFINITY, f64::min);
    bends - jumps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_course_that_bends_between_two_samples_does_not_jump() {
        // A rotor that comes to rest, 20 rad/s per sample before.
        for rest in [-3.3, -0.25, 0.0, 0.4, 5.1] {
            let course: Vec<f64> = (0..2 * SIDE).map(|k| 20.0 * (k as f64 - 7.5 - rest).min(0.0)).collect();
            // A knot that is a quarter of a sample off takes at most 5 rad/s at each sample beside it.
            assert!(more_than_a_bend(&course) < 25.0, "{rest}: {}", more_than_a_bend(&course));
        }
    }

    #[test]
    fn a_course_that_jumps_is_no_bend() {
        // Three samples are missing of a steady rise of 20 rad/s a sample: 60 rad/s. By numpy's least squares over the
        // same knots the best bend leaves 0.8765 of its square.
        let course: Vec<f64> = (0..2 * SIDE).map(|k| 20.0 * k as f64 + if k < SIDE { 0.0 } else { 60.0 }).collect();
        assert!((more_than_a_bend(&course) / 60.0f64.powi(2) - 0.8765).abs() < 1e-3, "{}", more_than_a_bend(&course));
    }
}
