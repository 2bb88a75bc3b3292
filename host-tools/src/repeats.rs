//! Recordings of the same excitation: what is off at the same time in both is the motor's, what is not is noise or the
//! load's.

use crate::experiment::Experiment;

/// Time over which voltages are compared where there is no mains, s.
const WINDOW_S: f64 = 0.02;
/// Largest difference of two voltages that are the same, as a share of the largest; sample by sample, of their RMS.
const SAME: f64 = 0.03;
/// Share of the windows that may differ: a step may lie a little earlier in one recording.
const MAY_DIFFER: f64 = 0.05;
/// Share of the longer recording that the shorter one has to have.
const LONG_ENOUGH: f64 = 0.8;

/// Recordings, two by two, of the same excitation.
pub fn of_experiments(experiments: &[Experiment]) -> Vec<[usize; 2]> {
    let pairs = (0..experiments.len()).flat_map(|a| (a + 1..experiments.len()).map(move |b| [a, b]));
    pairs.filter(|[a, b]| are_alike(&experiments[*a], &experiments[*b])).collect()
}

/// Whether the excitation of two recordings is the same: the voltage had the same course, and rotor and supply were
/// held and opened alike, whatever the phase of the mains was.
pub fn are_alike(one: &Experiment, other: &Experiment) -> bool {
    one.drive == other.drive
        && !are_of_one_file(one, other)
        && (one.interval_s / other.interval_s - 1.0).abs() < 1e-6
        && samples_of_window(one) == samples_of_window(other)
        && is_same(&course(one), &course(other))
}

/// Whether both are parts of the same recording, which has gaps: what they share is no excitation that was repeated.
fn are_of_one_file(one: &Experiment, other: &Experiment) -> bool {
    one.part_of.is_some() && one.part_of == other.part_of
}

/// Whether it is the same sample by sample, the phase of the mains included: then two errors can be compared sample by
/// sample.
pub fn are_in_step(one: &Experiment, other: &Experiment) -> bool {
    let counted = || (0..one.len().min(other.len())).filter(|n| one.counted[*n] && other.counted[*n]);
    let power = |u: &dyn Fn(usize) -> f64| counted().map(|n| u(n).powi(2)).sum::<f64>();
    let apart = power(&|n| one.input[n] - other.input[n]);
    are_alike(one, other) && apart <= SAME * SAME * power(&|n| one.input[n])
}

/// What the motor was given over a window.
struct Window {
    mean: f64,
    rms: f64,
    is_locked: bool,
    is_open: bool,
}

fn samples_of_window(e: &Experiment) -> usize {
    (e.mains_period_s.unwrap_or(WINDOW_S) / e.interval_s).round().max(1.0) as usize
}

fn course(e: &Experiment) -> Vec<Window> {
    let samples = samples_of_window(e);
    let window = |(k, input): (usize, &[f64])| Window {
        mean: input.iter().sum::<f64>() / samples as f64,
        rms: (input.iter().map(|u| u * u).sum::<f64>() / samples as f64).sqrt(),
        is_locked: e.is_locked(k * samples),
        is_open: e.is_open(k * samples),
    };
    e.input.chunks_exact(samples).enumerate().map(window).collect()
}

fn is_same(a: &[Window], b: &[Window]) -> bool {
    let (shorter, longer) = (a.len().min(b.len()), a.len().max(b.len()));
    if shorter == 0 || (shorter as f64) < LONG_ENOUGH * longer as f64 {
        return false;
    }
    let largest = a.iter().chain(b).map(|w| w.rms).fold(0.0, f64::max);
    let differ = |(a, b): &(&Window, &Window)| {
        (a.mean - b.mean).abs() > SAME * largest
            || (a.rms - b.rms).abs() > SAME * largest
            || (a.is_locked, a.is_open) != (b.is_locked, b.is_open)
    };
    let different = a.iter().zip(b).filter(differ).count();
    different as f64 <= MAY_DIFFER * shorter as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filtering::Filter;
    use crate::model::Kind;
    use crate::rig::Setup;

    fn recorded(kind: Kind, profile: &str, seed: u64) -> Experiment {
        let setup = Setup::new(kind).profile(profile).unwrap().seconds(4.0).seed(seed);
        Experiment::new(&setup.run().unwrap().recording, &Filter::default()).unwrap()
    }

    #[test]
    fn the_same_excitation_is_told_whatever_the_phase_of_the_mains_and_the_noise_are() {
        let experiments = [("staircase", 1), ("ramp", 1), ("staircase", 2), ("staircase", 3)]
            .map(|(profile, seed)| recorded(Kind::Universal, profile, seed));
        assert_eq!(of_experiments(&experiments), [[0, 2], [0, 3], [2, 3]]);
        // A quarter of a period later.
        let mut later = experiments[2].clone();
        later.input.rotate_left((0.005 / later.interval_s) as usize);
        assert_eq!(of_experiments(&[experiments[0].clone(), later]), [[0, 1]]);
    }

    #[test]
    fn another_size_sign_or_state_of_the_supply_is_another_excitation() {
        let one = recorded(Kind::PmDc, "dc-steps", 1);
        let changed = |change: &dyn Fn(&mut Experiment)| {
            let mut other = recorded(Kind::PmDc, "dc-steps", 2);
            change(&mut other);
            of_experiments(&[one.clone(), other]).len()
        };
        assert_eq!(changed(&|_| ()), 1);
        assert_eq!(changed(&|e| e.input.iter_mut().for_each(|u| *u *= 0.99)), 1, "a per cent is nothing");
        assert_eq!(changed(&|e| e.input.iter_mut().for_each(|u| *u *= 0.9)), 0);
        assert_eq!(changed(&|e| e.input.iter_mut().for_each(|u| *u *= -1.0)), 0, "of the same RMS");
        assert_eq!(changed(&|e| e.open = (0..e.len()).map(|n| n > e.len() / 2).collect()), 0);
        assert_eq!(changed(&|e| e.locked = vec![true; e.len()]), 0);
        assert_eq!(changed(&|e| e.input.truncate(e.input.len() / 2)), 0, "half of it");
        let mut parts = [one.clone(), recorded(Kind::PmDc, "dc-steps", 2)];
        parts.iter_mut().for_each(|e| e.part_of = Some("run.csv".into()));
        assert_eq!(of_experiments(&parts).len(), 0, "parts of one file");
        parts[1].part_of = Some("other.csv".into());
        assert_eq!(of_experiments(&parts).len(), 1, "parts of two files");
    }

    #[test]
    fn in_step_means_sample_by_sample() {
        let one = recorded(Kind::Universal, "staircase", 1);
        let mut other = recorded(Kind::Universal, "staircase", 1);
        other.input.iter_mut().for_each(|u| *u *= 0.98);
        assert!(are_alike(&one, &other) && are_in_step(&one, &other), "two per cent of the voltage");
        // A millisecond later, a twentieth of a period of the mains: they differ by 2 sin(π/20) = 0.31 of the RMS.
        other.input.rotate_right(10);
        assert!(are_alike(&one, &other) && !are_in_step(&one, &other));
    }
}
