//! What error a perfect model would show on these data: the noise of the measuring chain, through the same filter and,
//! for the voltage that drives the model, through the model.
//!
//! Three sources, best first:
//! 1. Repeated runs ([`repeats::are_in_step`]): half of the mean square by which the model's errors on two recordings
//!    of the same
//!    excitation differ holds everything that no model can know, disturbances of the load included. What the voltages
//!    differ by is in the model as well, and drops out.
//! 2. Idle stretches (voltage and current at rest) show the noise of each channel directly.
//! 3. The spectrum above the signal: the noise density at the top of the band, taken as white.
//!
//! Slow samples have no band above the signal. There white noise is told by what is not smooth over five samples, in
//! the median, of the signal or of what the model leaves of it, whichever is less; of a speed that is held, over five
//! of its values, and of their noise more passes the filter. The voltage is asked where it is calmest. Both still hold
//! what the signal itself does within five samples, so that no floor is taken to be above the model's own error.
//!
//! Without repeated runs it holds no disturbance of the load. A diagnosis, whose best fit leaves nothing but noise,
//! measures them by what does not repeat in its error: [`diagnose::completeness`](crate::diagnose::completeness).

use greyrig::motor::Motor;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::result::{PerSignal, Traces};
use super::traces::simulate;
use crate::experiment::{Drive, Experiment, Imposed};
use crate::free_run::free_run;
use crate::noise::{self, TOP_OF_BAND, white_noise};
use crate::repeats;

/// A stretch is idle while the voltage stays below this share of its largest value.
const IDLE: f64 = 0.02;
/// Idle stretches have to add up to this, s.
const IDLE_S: f64 = 0.2;
/// Share of the filter's cut-off to Nyquist that has to be free of signal for that.
const FREE_BAND: f64 = 2.0;

/// The floor of one recording, as an error-to-signal ratio, and where it comes from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Floor {
    /// RMS floor of each signal, in its unit.
    pub rms: PerSignal,
    /// The source in words; `None`: unknown.
    pub source: Option<&'static str>,
}

/// Share of white noise that passes the filter, as a standard deviation, where each value is held for so many samples.
fn passed(e: &Experiment, held: usize) -> f64 {
    let mut value = vec![0.0; (e.filter.settling_samples().unwrap_or(1000) as usize) * 2 + 1 + held];
    value[1..=held].fill(1.0);
    (e.filtered(&value).iter().map(|h| h * h).sum::<f64>() / held as f64).sqrt()
}

/// The values that a speed has shown, and for how many samples each.
fn values_shown(e: &Experiment) -> (Option<Vec<f64>>, usize) {
    let renewed = e.renewed();
    let held = e.len() / renewed.len().max(1);
    (e.speed.as_ref().map(|speed| renewed.iter().map(|n| speed[*n]).collect()), held.max(1))
}

/// The floor from idle stretches or the spectrum; `error` is the RMS by which the model itself is off.
pub fn of_one(motor: &Motor<f32>, e: &Experiment, error: PerSignal) -> Floor {
    if e.drive != Drive::Voltage {
        return Floor::default();
    }
    let has_free_band = FREE_BAND * e.filter.cutoff_hz <= TOP_OF_BAND.0 / e.interval_s;
    if !has_free_band && !e.is_slow(None) {
        return Floor::default();
    }
    let (speed, held) = values_shown(e);
    let (sigmas, source) = match idle(e) {
        _ if !has_free_band => {
            let of = |signal: &[f64]| Some(noise::of_differences(signal)).filter(|sigma| *sigma > 0.0);
            let left = left_by(motor, e);
            let sigma = |signal: Option<&[f64]>, left: Option<&[f64]>| {
                [signal, left].into_iter().flatten().filter_map(of).reduce(f64::min)
            };
            let [of_current, of_speed] = [0, 1].map(|k| left[k].as_deref());
            let voltage = Some(noise::of_calm_differences(&e.input)).filter(|sigma| *sigma > 0.0);
            let sigmas = [voltage, sigma(e.current.as_deref(), of_current), sigma(speed.as_deref(), of_speed)];
            (sigmas, "fourth differences of the samples, taken as white noise; voltage noise through the model")
        }
        Some(sigmas) => (sigmas, "idle stretches of the recordings, voltage noise through the model"),
        None => {
            let sigma = |signal: Option<&[f64]>| signal.and_then(white_noise);
            let sigmas = [sigma(Some(&e.input)), sigma(e.current.as_deref()), sigma(e.speed.as_deref())];
            (sigmas, "noise above the signal's band, taken as white; voltage noise through the model")
        }
    };
    let driven = sigmas[0].and_then(|sigma| through_model(motor, e, sigma)).unwrap_or([0.0; 2]);
    let floor = |sigma: Option<f64>, held: usize, driven: f64| sigma.map(|s| (s * passed(e, held)).hypot(driven));
    let (mut current, mut speed) = (floor(sigmas[1], 1, driven[0]), floor(sigmas[2], held, driven[1]));
    if !has_free_band {
        let at_most = |floor: Option<f64>, error: Option<f64>| Some(floor?.min(error.unwrap_or(f64::INFINITY)));
        (current, speed) = (at_most(current, error.current), at_most(speed, error.speed));
    }
    let rms = PerSignal { current, speed, torque: None };
    Floor { source: (rms.current.is_some() || rms.speed.is_some()).then_some(source), rms }
}

/// What the free run leaves of the current, A, and of the values that the speed has shown, rad/s, before any filter.
fn left_by(motor: &Motor<f32>, e: &Experiment) -> [Option<Vec<f64>>; 2] {
    let (mut current, mut speed) = (Vec::with_capacity(e.len()), Vec::with_capacity(e.len()));
    let run = free_run(motor, None, e, Imposed::Nothing, |_, state| {
        current.push(f64::from(state.current));
        speed.push(f64::from(state.speed));
    });
    if run.is_err() {
        return [None, None];
    }
    let left = |signal: Option<&[f64]>, modelled: &[f64], at: &[usize]| {
        let left: Option<Vec<f64>> = signal.map(|x| at.iter().map(|n| x[*n] - modelled[*n]).collect());
        left.filter(|left| left.iter().all(|x| x.is_finite()))
    };
    let all: Vec<usize> = (0..e.len()).collect();
    [left(e.current.as_deref(), &current, &all), left(e.speed.as_deref(), &speed, &e.renewed())]
}

/// Floors of parts of recordings with gaps that are too short to show one: that of the longest part of the same file
/// that shows it.
pub fn of_files(experiments: &[Experiment], floors: Vec<Floor>) -> Vec<Floor> {
    let of_file = |k: usize| {
        let same = |j: &usize| experiments[*j].part_of == experiments[k].part_of && floors[*j].source.is_some();
        let others = (0..experiments.len()).filter(same);
        others.max_by_key(|j| experiments[*j].len()).map(|j| floors[j].clone())
    };
    let own = |k: usize| (experiments[k].part_of.is_some() && floors[k].source.is_none()).then(|| of_file(k)).flatten();
    (0..floors.len()).map(|k| own(k).unwrap_or_else(|| floors[k].clone())).collect()
}

/// Noise of voltage, current and speed while nothing happens.
fn idle(e: &Experiment) -> Option<[Option<f64>; 3]> {
    let peak = e.input.iter().fold(0.0f64, |m, u| m.max(u.abs()));
    let at_rest: Vec<usize> = (0..e.len())
        .filter(|n| e.counted[*n] && !e.is_open(*n))
        .filter(|n| {
            let around = n.saturating_sub(100)..(n + 100).min(e.len());
            around.clone().step_by(10).all(|k| e.input[k].abs() < IDLE * peak)
        })
        .collect();
    let still = |signal: &[f64]| {
        let values: Vec<f64> =
            at_rest.windows(2).filter(|w| w[1] == w[0] + 1).map(|w| signal[w[1]] - signal[w[0]]).collect();
        (values.iter().map(|d| d * d).sum::<f64>() / values.len().max(1) as f64 / 2.0).sqrt()
    };
    (at_rest.len() as f64 * e.interval_s >= IDLE_S)
        .then(|| [Some(still(&e.input)), e.current.as_deref().map(still), e.speed.as_deref().map(still)])
}

/// RMS change of the modelled current and speed when the voltage gets the noise once more.
fn through_model(motor: &Motor<f32>, e: &Experiment, sigma: f64) -> Option<[f64; 2]> {
    let mut noisy = e.clone();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for u in &mut noisy.input {
        let z: f64 = StandardNormal.sample(&mut random);
        *u += sigma * z;
    }
    let clean = simulate(motor, None, e, Imposed::Nothing).ok()?;
    let disturbed = simulate(motor, None, &noisy, Imposed::Nothing).ok()?;
    let rms = |a: &[f64], b: &[f64]| {
        let counted = (0..a.len()).filter(|n| e.counted[*n]);
        let (sum, n) = counted.fold((0.0, 0usize), |(s, n), k| (s + (a[k] - b[k]).powi(2), n + 1));
        (sum / n.max(1) as f64).sqrt()
    };
    Some([rms(&clean.current, &disturbed.current), rms(&clean.speed, &disturbed.speed)])
}

/// The floor from a repeated run, if there is another one with the same excitation: of each, the recording and the
/// model's free run.
pub fn of_repeats(own: (&Experiment, &Traces), others: &[(&Experiment, &Traces)]) -> Option<Floor> {
    let (_, twin) = others.iter().find(|(other, _)| repeats::are_in_step(own.0, other))?;
    let own = own.1;
    let floor = |modelled: fn(&Traces) -> &[f64], measured: fn(&Traces) -> &[f64]| {
        let error = |t: &Traces, k: usize| Some(modelled(t).get(k)? - measured(t).get(k)?);
        let counted = (0..own.counted.len()).filter(|k| own.counted[*k] && twin.counted.get(*k) == Some(&true));
        let (sum, count) = counted
            .filter_map(|k| Some(error(own, k)? - error(twin, k)?))
            .fold((0.0, 0.0), |(sum, count), apart: f64| (sum + apart * apart, count + 1.0));
        (count > 0.0).then(|| (0.5 * sum / count).sqrt())
    };
    let current = floor(|t| &t.modelled_current, |t| &t.measured_current);
    let speed = floor(|t| &t.modelled_speed, |t| &t.measured_speed);
    let rms = PerSignal { current, speed, torque: None };
    Some(Floor { rms, source: Some("repeated runs with the same voltage") })
}

#[cfg(test)]
mod tests {
    use greyrig::motor::{FluxLaw, Parameters};

    use super::*;
    use crate::filtering::Filter;
    use crate::model::Kind;
    use crate::rig::Setup;

    /// A permanent-magnet motor's recording without noise.
    fn experiment() -> Experiment {
        let setup = Setup::new(Kind::PmDc).profile("dc-steps").unwrap().seconds(4.0).seed(1).ideal();
        Experiment::new(&setup.run().unwrap().recording, &Filter::default()).unwrap()
    }

    /// White noise of unit variance.
    fn noise(values: usize, seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        (0..values).map(|_| StandardNormal.sample(&mut random)).collect()
    }

    /// A filter of the fourth order passes 1.026 times its cut-off of the band, ∫ 1/(1 + x⁸) dx = (π/8)/sin(π/8), as a
    /// share of 5 kHz at 10 kHz. A value that is held ten times has the spectrum of one that comes once a millisecond.
    #[test]
    fn the_filter_passes_its_share_of_white_noise() {
        let mut e = experiment();
        e.interval_s = 1e-4;
        e.filter = greyrig::butterworth::Settings { order: 4, cutoff_hz: 50.0, sample_rate_hz: 10_000.0 };
        let share = (1.026_2 * 50.0 / 5000.0f64).sqrt();
        // The bilinear transform's warping is of the order of a thousandth here.
        assert!((passed(&e, 1) / share - 1.0).abs() < 5e-3, "{} {share}", passed(&e, 1));
        assert!((passed(&e, 10) / (share * 10f64.sqrt()) - 1.0).abs() < 1e-2, "{}", passed(&e, 10));
    }

    /// Noise of 0.5 V, 0.1 A and 2 rad/s while the voltage is off for a second; what moves elsewhere does not count.
    #[test]
    fn idle_stretches_tell_the_noise_of_each_channel() {
        let mut e = experiment();
        let rate = (1.0 / e.interval_s).round() as usize;
        let n = e.len();
        e.counted = vec![true; n];
        e.open = Vec::new();
        let off = rate..2 * rate;
        let with = |level: f64, sigma: f64, seed: u64| -> Vec<f64> {
            let white = noise(n, seed);
            (0..n).map(|k| sigma * white[k] + if off.contains(&k) { 0.0 } else { level * (k as f64).sin() }).collect()
        };
        (e.current, e.speed) = (Some(with(50.0, 0.1, 2)), Some(with(500.0, 2.0, 3)));
        e.input = with(0.0, 0.05, 1);
        (0..n).filter(|k| !off.contains(k)).for_each(|k| e.input[k] = 100.0);
        let [voltage, current, speed] = idle(&e).unwrap().map(|sigma| sigma.unwrap());
        // Of some thousand differences, of which neighbours share a value, 3 % at most.
        assert!((voltage / 0.05 - 1.0).abs() < 0.05, "{voltage}");
        assert!((current / 0.1 - 1.0).abs() < 0.05 && (speed / 2.0 - 1.0).abs() < 0.05, "{current} {speed}");
        // Where the supply is open nothing holds the current, and what does not count tells nothing.
        let (mut open, mut masked) = (e.clone(), e.clone());
        open.open = (0..n).map(|k| off.contains(&k)).collect();
        assert_eq!(idle(&open), None);
        masked.counted = (0..n).map(|k| !off.contains(&k)).collect();
        assert_eq!(idle(&masked), None);
        // A fifth of a second, less what lies within 10 ms of the voltage, is too short.
        let mut brief = e.clone();
        (0..n).filter(|k| !(rate..rate + rate / 5).contains(k)).for_each(|k| brief.input[k] = 100.0);
        assert_eq!(idle(&brief), None);
    }

    /// Two runs with the same voltage, whose models are off by constants 3 and 1 A, and by 5 and −1 rad/s: half of the
    /// squares of 2 and 6.
    #[test]
    fn repeated_runs_tell_half_of_what_their_errors_differ_by() {
        let e = experiment();
        let n = e.len();
        let traces = |current: f64, speed: f64| Traces {
            start_s: 0.0,
            sample_time_s: e.interval_s,
            mains_period_s: None,
            voltage: e.input.clone(),
            measured_current: vec![1.0; n],
            modelled_current: vec![1.0 + current; n],
            measured_speed: vec![10.0; n],
            modelled_speed: vec![10.0 + speed; n],
            measured_torque: Vec::new(),
            modelled_torque: Vec::new(),
            counted: vec![true; n],
            diverges: false,
        };
        let (own, mut twin) = (traces(3.0, 5.0), traces(1.0, -1.0));
        let floor = |twin: &Traces, other: &Experiment| of_repeats((&e, &own), &[(other, twin)]);
        let found = floor(&twin, &e).unwrap();
        let [current, speed] = [found.rms.current, found.rms.speed].map(|rms| rms.unwrap());
        assert!((current - 2f64.sqrt()).abs() < 1e-12 && (speed - 18f64.sqrt()).abs() < 1e-12, "{found:?}");
        assert_eq!((found.rms.torque, found.source), (None, Some("repeated runs with the same voltage")));
        // What does not count in the other one, and what it has not recorded.
        twin.modelled_current[7] = 1e9;
        twin.counted[7] = false;
        twin.measured_speed.clear();
        let found = floor(&twin, &e).unwrap();
        assert!((found.rms.current.unwrap() - 2f64.sqrt()).abs() < 1e-12 && found.rms.speed.is_none(), "{found:?}");
        let mut another = e.clone();
        another.input.iter_mut().for_each(|u| *u *= 0.5);
        assert_eq!(floor(&twin, &another), None, "another excitation");
    }

    #[test]
    fn a_part_that_shows_no_floor_has_that_of_the_longest_of_its_file() {
        let of = |file: Option<&str>, samples: usize| {
            let mut e = experiment();
            e.part_of = file.map(Into::into);
            e.input.truncate(samples);
            e
        };
        let known = |current: f64| Floor {
            rms: PerSignal { current: Some(current), ..PerSignal::default() },
            source: Some("somewhere"),
        };
        let parts =
            [of(Some("a"), 10), of(Some("a"), 100), of(Some("a"), 200), of(Some("b"), 10), of(None, 10), of(None, 300)];
        let floors = vec![Floor::default(), known(1.0), known(2.0), Floor::default(), Floor::default(), known(3.0)];
        let found = of_files(&parts, floors);
        let currents: Vec<Option<f64>> = found.iter().map(|floor| floor.rms.current).collect();
        assert_eq!(currents, [Some(2.0), Some(1.0), Some(2.0), None, None, Some(3.0)]);
    }

    /// 2 Ω, and so little inductance and so much inertia that below 50 Hz the current is the voltage over the
    /// resistance.
    fn slow_motor() -> Motor<f32> {
        let values = [2.0, 4e-4, 0.02, 1e-2, 0.0, 1e-4, 0.0];
        Motor::build(Parameters::from_values(FluxLaw::PermanentMagnet, values), &[]).unwrap()
    }

    /// 100 V, and nothing else measured; 50 Hz at 10 kHz.
    fn steady() -> Experiment {
        let mut e = experiment();
        e.filter = greyrig::butterworth::Settings { order: 4, cutoff_hz: 50.0, sample_rate_hz: 10_000.0 };
        e.interval_s = 1e-4;
        e.input.fill(100.0);
        (e.open, e.locked) = (Vec::new(), Vec::new());
        (e.edges, e.instants, e.stretches, e.window) = (Vec::new(), Vec::new(), Vec::new(), None);
        e.counted = (0..e.len()).map(|n| n > 1000).collect();
        e
    }

    /// Through the model noise of 0.4 V is 0.2 A, as far as the filter lets it pass; the inertia keeps the speed. Some
    /// 300 independent values tell it to 4 %.
    #[test]
    fn noise_of_the_voltage_passes_the_model() {
        let e = steady();
        let [current, speed] = through_model(&slow_motor(), &e, 0.4).unwrap();
        assert!((current / (0.2 * passed(&e, 1)) - 1.0).abs() < 0.15, "{current}");
        // ∫ K i/J of what is white: 0.02 · 0.2 A/1e-2 √(t h) is 0.008 rad/s after 4 s; no more than some of that.
        assert!(speed > 0.0 && speed < 0.03, "{speed}");
        let twice = through_model(&slow_motor(), &e, 0.8).unwrap();
        assert!((twice[0] / current - 2.0).abs() < 1e-2, "{twice:?}");
    }

    /// White noise of 0.4 V, 0.1 A and 2 rad/s: of the current what passes of √(0.1² + 0.2²), of the speed what passes
    /// of its own.
    #[test]
    fn without_rest_and_repeats_the_spectrum_tells() {
        let mut e = steady();
        let n = e.len();
        let white = |sigma: f64, seed: u64| noise(n, seed).into_iter().map(|z| sigma * z).collect::<Vec<f64>>();
        e.input.iter_mut().zip(white(0.4, 5)).for_each(|(u, z)| *u += z);
        (e.current, e.speed) = (Some(white(0.1, 6)), Some(white(2.0, 7)));
        let floor = of_one(&slow_motor(), &e, PerSignal::default());
        let share = passed(&e, 1);
        let [current, speed] = [floor.rms.current, floor.rms.speed].map(|rms| rms.unwrap() / share);
        assert!((current / 0.05f64.sqrt() - 1.0).abs() < 0.12, "{current}");
        assert!((speed / 2.0 - 1.0).abs() < 0.05, "{speed}");
        assert!(floor.source.unwrap().starts_with("noise above the signal's band"), "{floor:?}");
        // With a second of rest that tells it; where a torque drives the model nothing does, nor without a free band.
        e.input[5000..20_000].fill(0.0);
        let floor = of_one(&slow_motor(), &e, PerSignal::default());
        assert!(floor.source.unwrap().starts_with("idle"), "{floor:?}");
        let mut driven = e.clone();
        driven.drive = Drive::Torque;
        assert_eq!(of_one(&slow_motor(), &driven, PerSignal::default()), Floor::default());
        // Twice 1300 Hz are more than a quarter of 10 kHz, and twice 1200 Hz are not.
        for (cutoff_hz, known) in [(1300.0, false), (1200.0, true)] {
            e.filter.cutoff_hz = cutoff_hz;
            assert_eq!(of_one(&slow_motor(), &e, PerSignal::default()).source.is_some(), known, "{cutoff_hz}");
        }
    }

    #[test]
    fn what_the_model_leaves_is_measured_less_modelled() {
        let mut e = steady();
        let n = e.len();
        (e.current, e.speed) = (Some(vec![0.0; n]), Some(vec![0.0; n]));
        let [current, speed] = left_by(&slow_motor(), &e).map(|left| left.unwrap());
        // 50 A less what the slow rotor takes; and a rotor that 1 N m accelerates, 100 rad/s².
        assert!(
            (-50.0..-40.0).contains(&current[n / 10]) && speed[n / 10] < -1.0,
            "{} {}",
            current[n / 10],
            speed[n / 10]
        );
        let off = |left: &[f64], by: f64| left.iter().map(|x| by - x).collect::<Vec<f64>>();
        (e.current, e.speed) = (Some(off(&current, 3.0)), Some(off(&speed, -5.0)));
        let [current, speed] = left_by(&slow_motor(), &e).map(|left| left.unwrap());
        assert!(current.iter().all(|x| (x - 3.0).abs() < 1e-9) && speed.iter().all(|x| (x + 5.0).abs() < 1e-9));
    }

    #[test]
    fn a_held_speed_shows_fewer_values() {
        let mut e = steady();
        e.speed = Some((0..e.len()).map(|n| n as f64).collect());
        assert_eq!((values_shown(&e).0.map(|v| v.len()), values_shown(&e).1), (Some(e.len()), 1));
        e.stretches = (1..=e.len() / 8).map(|k| [8 * (k - 1), 8 * k - 1]).collect();
        let (values, held) = values_shown(&e);
        assert_eq!((&values.unwrap()[..3], held), (&[7.0, 15.0, 23.0][..], 8));
        e.speed = None;
        assert_eq!(values_shown(&e), (None, 8));
    }
}
