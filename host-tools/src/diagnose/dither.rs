//! Recordings that are cleaner than the model can be.
//!
//! The voltage between two samples is not a straight line, signals are averaged for the search, an integrator has an
//! order: what that leaves is a ten-thousandth of a signal, which repeats from one period to the next and obeys no law
//! of the catalogue. With the noise of a converter of twelve bits it drowns. A simulation without noise, or a converter
//! of twenty-four bits, would show it as structure. So the diagnosis adds white noise to a channel that has less than
//! the least, from a generator with a fixed seed: the same recordings, the same verdict.
//!
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | σ | standard deviation of a channel's white noise per sample | that of the channel |
//! | x̂ | largest RMS of the channel in any of the recordings | that of the channel |
//! | f | sampling rate; 5 kHz is what the search works with | Hz |
//!
//! `σ ≥ a x̂ √(f/5 kHz)` with a = 3e-4 of the voltage, 6e-4 of the current, 2.5e-4 of the speed, so that the density is
//! the same at any rate. The measuring chain of the virtual rig has two to three times that. Timed pulses average
//! nearly all noise away: each gets what that σ leaves of a mean over the samples since the last one, σ/√n.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::experiment::{Drive, Experiment};
use crate::noise;

/// Least noise of voltage, current and speed at [`RATE_HZ`], as shares of the channel's RMS.
const LEAST: [f64; 3] = [3e-4, 6e-4, 2.5e-4];
/// The rate for which these hold, Hz.
const RATE_HZ: f64 = 5000.0;
const SEED: u64 = 4;

/// Adds noise where there is less than the least; which channels of any recording got some.
pub fn add(experiments: &mut [Experiment]) -> Vec<&'static str> {
    let largest = [0, 1, 2].map(|k| {
        let signals = experiments.iter_mut().filter_map(|e| channel(e, k));
        signals.map(|signal| rms(signal)).fold(0.0, f64::max)
    });
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut clean = [false; 3];
    for e in experiments.iter_mut().filter(|e| e.drive == Drive::Voltage && e.current.is_some()) {
        let rate = (1.0 / (e.interval_s * RATE_HZ)).max(1.0);
        for (k, is_clean) in clean.iter_mut().enumerate() {
            // Values that are held have no noise of samples.
            if k == 2 && e.is_windowed() && e.renewed().len() < e.len() {
                *is_clean |= add_to_pulses(e, (LEAST[k] * largest[k]).powi(2) * rate, &mut random);
                continue;
            }
            let Some(signal) = channel(e, k) else { continue };
            let missing = (LEAST[k] * largest[k]).powi(2) * rate - noise::of_differences(signal).powi(2);
            if missing > 0.0 {
                *is_clean = true;
                for x in signal {
                    let z: f64 = StandardNormal.sample(&mut random);
                    *x += missing.sqrt() * z;
                }
            }
        }
    }
    ["voltage", "current", "speed"].into_iter().zip(clean).filter_map(|(name, clean)| clean.then_some(name)).collect()
}

/// Timed pulses average nearly all noise away: each value gets what noise of a variance per sample leaves of a mean
/// over its stretch. Whether there are any.
fn add_to_pulses(e: &mut Experiment, variance: f64, random: &mut ChaCha8Rng) -> bool {
    let (stretches, length) = (&e.stretches, e.input.len());
    let Some(speed) = &mut e.speed else { return false };
    let next = stretches.iter().skip(1).map(|[_, end]| *end).chain([length]);
    for ([begin, end], next) in stretches.iter().zip(next) {
        let z: f64 = StandardNormal.sample(random);
        let noise = z * (variance / (end - begin).max(1) as f64).sqrt();
        speed[*end..next].iter_mut().for_each(|w| *w += noise);
    }
    !stretches.is_empty()
}

/// Voltage, current or speed.
fn channel(e: &mut Experiment, k: usize) -> Option<&mut Vec<f64>> {
    match k {
        0 => Some(&mut e.input),
        1 => e.current.as_mut(),
        _ => e.speed.as_mut(),
    }
}

fn rms(signal: &[f64]) -> f64 {
    (signal.iter().map(|x| x * x).sum::<f64>() / signal.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::prepare;
    use crate::model::{Filter, Kind};
    use crate::rig::{Logger, Setup};
    use crate::speed_sensor::{Chain, SpeedSensor};

    fn recorded(noise: f64) -> Vec<Experiment> {
        let setup = Setup::new(Kind::Universal).noise(noise).profile("staircase").unwrap().seconds(4.0);
        prepare(&[setup.run().unwrap().recording], &Filter::default(), &Chain::default()).unwrap()
    }

    #[test]
    fn the_rigs_own_noise_stays_as_it_is() {
        let (mut with, without) = (recorded(1.0), recorded(1.0));
        assert!(add(&mut with).is_empty());
        assert_eq!(with[0].input, without[0].input);
        assert_eq!(with[0].current, without[0].current);
        assert_eq!(with[0].speed, without[0].speed);
    }

    #[test]
    fn clean_channels_get_what_they_lack() {
        let clean: Vec<f64> = (0..40_000).map(|n| 230.0 * (0.0314 * f64::from(n)).sin()).collect();
        let mut experiments = recorded(1.0);
        experiments[0].input.clone_from(&clean);
        experiments[0].current = Some(clean.iter().map(|u| u / 100.0).collect());
        assert_eq!(add(&mut experiments), ["voltage", "current"]);
        // 40,000 samples tell a standard deviation to a third of a per cent, the median to half of one.
        let wanted = LEAST[0] * rms(&clean) * 2f64.sqrt();
        assert!((noise::of_differences(&experiments[0].input) / wanted - 1.0).abs() < 0.03);
    }

    #[test]
    fn the_same_recordings_get_the_same_noise() {
        let (mut one, mut other) = (recorded(0.0), recorded(0.0));
        add(&mut one);
        add(&mut other);
        assert_eq!(one[0].current, other[0].current);
    }

    #[test]
    fn timed_pulses_get_what_a_mean_leaves_of_the_noise_and_stay_held() {
        let setup = Setup::new(Kind::PmDc).noise(0.0).profile("dc-ramp").unwrap().seconds(5.0);
        let sensor = SpeedSensor::Period { pulses: 4 };
        let timed = Logger { speed_sensor: Some(sensor), ..Logger::default() };
        let recording = timed.record(&setup.run().unwrap().recording).unwrap();
        let mut with = prepare(&[recording], &Filter::default(), &Chain::default()).unwrap();
        let without = with.clone();
        assert!(add(&mut with).contains(&"speed"));
        let [with, without] = [with, without].map(|mut e| e.remove(0));
        let [noisy, clean] = [&with, &without].map(|e| e.speed.clone().unwrap());
        // 2.5e-4 of the RMS at 5 kHz, times √2 at 10 kHz.
        let sigma = 2.5e-4 * 2f64.sqrt() * rms(&clean);
        let mut of_one = Vec::new();
        for pair in without.stretches.windows(2) {
            let ([begin, end], [_, next]) = (pair[0], pair[1]);
            let added: Vec<f64> = (end..next).map(|n| noisy[n] - clean[n]).collect();
            assert!(added.iter().all(|a| (a - added[0]).abs() < 1e-12), "a value is shown until the next one");
            of_one.push(added[0] / (sigma / ((end - begin) as f64).sqrt()));
        }
        assert!(of_one.len() > 200, "{}", of_one.len());
        // The standard deviation of 200 values is known to 1/√400, 5 %; four times that.
        assert!((rms(&of_one) - 1.0).abs() < 0.2, "{}", rms(&of_one));
    }
}
