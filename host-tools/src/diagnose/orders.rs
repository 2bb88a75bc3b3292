//! Order tracking: lines in the speed that follow the angle of the rotor.
//!
//! Windows of eight turns each; the power of the speed at n waves per turn is ranked among that at neighbouring waves
//! per turn which are no whole numbers. Without a line every rank is as likely as any other, whatever the noise, so the
//! mean rank over the windows is the test. Whether the line grows with the speed or fades tells the tacho from a
//! torque: a torque c cos nθ makes a speed of c/(J n ω), or less than that where the back-EMF brakes, and an error of
//! the tacho goes with ω. The law a² ω^(2α) that fits the windows' powers best counts, α = 1 against 0 and −1, by least
//! squares weighted by the noise of each: a run-up tells little of a line that the steady speed shows.
//!
//! A sensor that shows a value for several samples has a raster of its own: timed pulses tell lines of fewer than half
//! as many waves a turn, windows those below half their rate. What stands above is the raster.
//!
//! What repeats with the mains is taken off first, by the mean of one period before and one after: the torque of an AC
//! motor pulsates at twice the mains, which is an order at some speed.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::experiment::Experiment;
use crate::speed_sensor::SpeedSensor;

/// Turns in a window.
const TURNS: f64 = 8.0;
/// Orders that are looked at.
const ORDERS: std::ops::RangeInclusive<usize> = 1..=48;
/// Parts into which one wave per turn is divided.
const PARTS: usize = 16;
/// Distances of the neighbours in such parts.
const NEIGHBOURS: [isize; 8] = [-8, -7, -6, -5, 5, 6, 7, 8];
/// Highest frequency that is looked at, of the sampling rate.
const HIGHEST: f64 = 0.4;
/// Slowest speed, of the largest.
const SLOWEST: f64 = 0.02;
/// Windows that are looked at, at most.
const MOST_WINDOWS: usize = 800;
/// Fewest windows.
const FEWEST_WINDOWS: usize = 16;
/// Standard deviations of the mean rank from which a line is seen; 48 orders in four sets of windows are tried.
const SEEN: f64 = 6.0;

/// A line that follows the rotor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Waves per turn.
    pub order: usize,
    /// Standard deviations by which it stands out.
    pub stands_out: f64,
    /// Its amplitude in the speed (rad/s) and that speed (rad/s), in the slow and in the fast half of the windows.
    pub amplitudes: [(f64, f64); 2],
    /// Whether it grows with the speed, as an error of the tacho does; a torque's fades.
    pub grows: bool,
}

/// Power of a window at each order and at its neighbours.
struct Window {
    speed: f64,
    /// Square of the amplitude at the order.
    power: Vec<Option<f64>>,
    /// Mean square of the amplitudes at its neighbours, and the share of them that are smaller.
    floor: Vec<(f64, f64)>,
}

/// The lines that stand out, the strongest first.
pub fn lines(experiments: &[Experiment]) -> Vec<Line> {
    let mut windows: Vec<Window> = experiments.iter().flat_map(windows).collect();
    windows.sort_by(|a, b| a.speed.total_cmp(&b.speed));
    if windows.len() < FEWEST_WINDOWS {
        return Vec::new();
    }
    let half = windows.len() / 2;
    let mut found: Vec<Line> = ORDERS
        .filter_map(|order| {
            let k = order - ORDERS.start();
            let parts = [&windows[..], &windows[..half], &windows[..half / 2], &windows[half..]];
            let stands_out = parts.map(|part| score(part, k)).into_iter().fold(0.0, f64::max);
            (stands_out > SEEN).then(|| Line {
                order,
                stands_out,
                amplitudes: [amplitude(&windows[..half], k), amplitude(&windows[half..], k)],
                grows: grows(&windows, k),
            })
        })
        .collect();
    found.sort_by(|a, b| b.stands_out.total_cmp(&a.stands_out).then(a.order.cmp(&b.order)));
    found
}

/// Standard deviations by which the mean rank of an order exceeds one half.
fn score(windows: &[Window], k: usize) -> f64 {
    let ranks: Vec<f64> = windows.iter().filter(|w| w.power[k].is_some()).map(|w| w.floor[k].1).collect();
    if ranks.len() < FEWEST_WINDOWS / 2 {
        return 0.0;
    }
    let m = NEIGHBOURS.len() as f64;
    // A rank among m others takes the values 0, 1/m … 1 alike: variance (m + 2)/(12 m).
    let deviation = ((m + 2.0) / (12.0 * m) / ranks.len() as f64).sqrt();
    (ranks.iter().sum::<f64>() / ranks.len() as f64 - 0.5) / deviation
}

/// Power above the noise, speed, and weight of the windows that know of an order.
fn powers(windows: &[Window], k: usize) -> impl Iterator<Item = (f64, f64, f64)> + Clone {
    let known = windows.iter().filter_map(move |w| w.power[k].map(|power| (w, power)));
    known.map(move |(w, power)| {
        let noise = w.floor[k].0;
        (power - noise, w.speed, 1.0 / noise.powi(2).max(f64::MIN_POSITIVE))
    })
}

/// Amplitude above the noise, and the mean speed, of some windows, weighted by what they know.
fn amplitude(windows: &[Window], k: usize) -> (f64, f64) {
    let sums = powers(windows, k)
        .fold([0.0; 3], |[p, s, n], (power, speed, weight)| [p + weight * power, s + weight * speed, n + weight]);
    let [power, speed, weight] = sums;
    ((power / weight.max(f64::MIN_POSITIVE)).max(0.0).sqrt(), speed / weight.max(f64::MIN_POSITIVE))
}

/// Whether an amplitude that goes with the speed fits the windows better than one that stays or fades.
fn grows(windows: &[Window], k: usize) -> bool {
    let fastest = powers(windows, k).map(|(_, speed, _)| speed).fold(f64::MIN_POSITIVE, f64::max);
    let explained = |exponent: i32| {
        let (along, square) = powers(windows, k).fold((0.0, 0.0), |(a, q), (power, speed, weight)| {
            let shape = (speed / fastest).powi(2 * exponent);
            (a + weight * power * shape, q + weight * shape * shape)
        });
        if along > 0.0 && square > 0.0 { along * along / square } else { 0.0 }
    };
    explained(1) > explained(0).max(explained(-1))
}

fn windows(e: &Experiment) -> Vec<Window> {
    let Some(speed) = &e.speed else { return Vec::new() };
    let largest = speed.iter().fold(0.0f64, |m, w| m.max(w.abs()));
    let period = e.mains_period_s.map_or(0, |t| (t / e.interval_s).round() as usize);
    // The angle comes from the speed itself, over which noise averages.
    let angle: Vec<f64> = speed
        .iter()
        .scan(0.0, |theta, w| {
            *theta += w * e.interval_s;
            Some(*theta)
        })
        .collect();
    let highest = Highest::of(e);
    let usable = |n: usize| e.counted[n] && !e.is_locked(n) && n >= period && n + period < speed.len();
    let mut cuts: Vec<(usize, usize)> = Vec::new();
    let mut from = 0;
    for n in 0..speed.len() {
        if !usable(n) || speed[n].abs() < SLOWEST * largest {
            from = n + 1;
        } else if (angle[n] - angle[from.min(n)]).abs() >= TURNS * TAU {
            cuts.push((from, n));
            from = n;
        }
    }
    let every = cuts.len().div_ceil(MOST_WINDOWS).max(1);
    cuts.into_iter()
        .step_by(every)
        .collect::<Vec<_>>()
        .into_par_iter()
        .filter(|(a, b)| b - a >= 64)
        .map(|(a, b)| {
            let signal: Vec<f64> = (a..b)
                .map(|n| {
                    // The mean of two periods adds half as much power again, as it is out of step with the line.
                    match period {
                        0 => speed[n],
                        _ => (speed[n] - 0.5 * (speed[n - period] + speed[n + period])) / 1.5f64.sqrt(),
                    }
                })
                .collect();
            window(&without_trend(&signal), &angle[a..b], e.interval_s, highest)
        })
        .collect()
}

/// A signal less its least-squares cubic, which is what a run-up leaves in so short a window.
fn without_trend(signal: &[f64]) -> Vec<f64> {
    let n = signal.len();
    let x = |k: usize| 2.0 * k as f64 / (n - 1) as f64 - 1.0;
    let powers = nalgebra::DMatrix::from_fn(n, 4, |r, c| x(r).powi(c as i32));
    let y = nalgebra::DVector::from_column_slice(signal);
    let normal = powers.tr_mul(&powers).cholesky().map(|c| c.solve(&powers.tr_mul(&y)));
    normal.map_or_else(|| signal.to_vec(), |b| (&y - &powers * b).iter().copied().collect())
}

/// What a sensor can show.
#[derive(Debug, Clone, Copy)]
struct Highest {
    hz: f64,
    order: f64,
}

impl Highest {
    fn of(e: &Experiment) -> Self {
        let samples = e.window.map_or(1, |window| window.samples);
        let hz = HIGHEST / (e.interval_s * samples as f64);
        let order = match e.sensor {
            Some(SpeedSensor::Period { pulses }) => 0.5 * f64::from(pulses),
            _ => f64::INFINITY,
        };
        Self { hz, order }
    }
}

fn window(signal: &[f64], angle: &[f64], interval_s: f64, highest: Highest) -> Window {
    let n = signal.len();
    let turned = angle[n - 1] - angle[0];
    let speed = (turned / ((n - 1) as f64 * interval_s)).abs();
    // Sums over exp(i m θ/16) for all m at once: sixteen fractions of a wave side by side, turned on by a whole θ for
    // each wave more.
    let mut sums = vec![[(0.0f64, 0.0f64); PARTS]; ORDERS.end() + 1];
    let mut total = 0.0;
    for (k, (x, theta)) in signal.iter().zip(angle).enumerate() {
        let weight = 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / n as f64).cos();
        total += weight;
        let theta = theta - angle[0];
        let (sin, cos) = (theta / PARTS as f64).sin_cos();
        let (mut c, mut s) = ([x * weight; PARTS], [0.0; PARTS]);
        for p in 1..PARTS {
            (c[p], s[p]) = (c[p - 1] * cos - s[p - 1] * sin, c[p - 1] * sin + s[p - 1] * cos);
        }
        let (sin, cos) = theta.sin_cos();
        for wave in &mut sums {
            for p in 0..PARTS {
                wave[p].0 += c[p];
                wave[p].1 += s[p];
                (c[p], s[p]) = (c[p] * cos - s[p] * sin, c[p] * sin + s[p] * cos);
            }
        }
    }
    let power = |part: usize| {
        let (c, s) = sums[part / PARTS][part % PARTS];
        4.0 * (c * c + s * s) / (total * total)
    };
    let mut powers = Vec::new();
    let mut floors = Vec::new();
    for order in ORDERS {
        // With the neighbours, which are half an order away.
        let reach = order as f64 + 0.5;
        if reach * speed / TAU > highest.hz || reach > highest.order {
            powers.push(None);
            floors.push((0.0, 0.0));
            continue;
        }
        let own = power(order * PARTS);
        let around = NEIGHBOURS.map(|d| power((order * PARTS).wrapping_add_signed(d)));
        let m = NEIGHBOURS.len() as f64;
        powers.push(Some(own));
        floors.push((around.iter().sum::<f64>() / m, around.iter().filter(|p| **p < own).count() as f64 / m));
    }
    Window { speed, power: powers, floor: floors }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filtering::Filter;
    use crate::model::Kind;
    use crate::rig::{Logger, Setup};

    /// Windows at these speeds, rad/s, with a line of an amplitude and a noise.
    fn of(speeds: impl Iterator<Item = u32>, amplitude: impl Fn(f64) -> f64, noise: f64) -> Vec<Window> {
        let window = |(n, speed): (usize, u32)| {
            let speed = f64::from(speed);
            // Noise of either sign about its mean, half of it.
            let power = amplitude(speed).powi(2) + noise * if n % 2 == 0 { 0.5 } else { 1.5 };
            Window { speed, power: vec![Some(power)], floor: vec![(noise, 1.0)] }
        };
        speeds.enumerate().map(window).collect()
    }

    #[test]
    fn a_line_of_the_tacho_grows_and_one_of_a_torque_does_not() {
        let tacho = of((100..400).step_by(10), |w| 0.01 * w, 0.01);
        assert!(grows(&tacho, 0));
        let torque = of((100..400).step_by(10), |w| 300.0 / w, 0.01);
        assert!(!grows(&torque, 0));
        // A line that the back-EMF damps, where only the steady speeds show it: run-ups are a thousand times as noisy.
        let damped = |w: f64| 3.0 / (1.0 + (w / 300.0).powi(2)).sqrt();
        let run_up = of((50..250).step_by(10), |_| 0.0, 100.0);
        let steady = of((300..400).step_by(5), damped, 0.1);
        let windows: Vec<Window> = run_up.into_iter().chain(steady).collect();
        assert!(!grows(&windows, 0));
        let (slow, _) = amplitude(&windows[..20], 0);
        let (fast, at) = amplitude(&windows[20..], 0);
        assert!(slow < 3.0 && (fast - damped(at)).abs() < 0.02, "{slow} {fast}");
    }

    #[test]
    fn timed_pulses_are_no_line_of_the_rotor() {
        let setup = Setup::new(Kind::PmDc).profile("dc-ramp").unwrap().seconds(5.0);
        let timed = Logger { speed_sensor: Some(SpeedSensor::Period { pulses: 4 }), ..Logger::default() };
        let recording = timed.record(&setup.run().unwrap().recording).unwrap();
        let mut e = Experiment::new(&recording, &Filter::default()).unwrap();
        assert_eq!(lines(std::slice::from_ref(&e)), []);
        // What it would be taken for.
        (e.sensor, e.window) = (None, None);
        assert!(lines(&[e]).iter().any(|line| line.order == 4));
    }
}
