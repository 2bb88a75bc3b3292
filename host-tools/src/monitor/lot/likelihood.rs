//! Whether a fault has begun, which, when and how large: the generalised likelihood ratio.
//!
//! With the rows r and the columns X of what differs from motor to motor in units of what is usual
//! ([`super::population`]), A = XᵀX + 1 and r̂ = r − X A⁻¹ Xᵀ r, a fault of column s that begins with block τ has
//!
//! ```text
//! Z = sᵀ r̂ / √(sᵀ s − bᵀ A⁻¹ b)      size = sᵀ r̂ / (sᵀ s − bᵀ A⁻¹ b)      b = Xᵀ s
//! ```
//!
//! Z² is twice the logarithm of the likelihood ratio between the fault at its best size and none. The largest |Z| over
//! τ is compared with a limit from the healthy motors, each judged by what the others say is usual. Its logarithm is
//! about normal: the limit is a quantile of Student's distribution, with a variance pooled over the faults that the
//! balances tell, and one of its own for what is watched as it is. From the start there is but one Z, about normal
//! itself, by the scatter of the lot; its limit is a quantile for its mean square.
//!
//! Sources: A. S. Willsky, H. L. Jones, A generalized likelihood ratio approach to the detection and estimation of
//! jumps in linear systems, IEEE Trans. Autom. Control 21 (1976) 108–112; M. Basseville, I. V. Nikiforov, Detection of
//! Abrupt Changes (1993).

use std::cmp::Ordering;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::blocks::PERIODS;
use super::fault::Course;
use super::population::Whitened;
use crate::model::lot::{Fault, Limit, Onset};

/// Half the window over which the speed at a border is averaged, a period of the mains, in blocks.
const SMOOTHED: f64 = 0.5 / PERIODS;
/// Blocks behind the onset, at least: two tell a size and that it lasts.
const FEWEST_BEHIND: usize = 2;
/// Standard deviation of the logarithm of the largest |Z| of white noise, 80 blocks with a level of their own (by 4,000
/// draws): what is left over of few motors may seem to spread by less.
const LEAST_SPREAD: f64 = 0.27;
/// Standard deviations above a limit at which 95 % of motors are beyond it.
const SEEN: f64 = 1.645;

/// A fault at its likeliest begin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// The fault.
    pub fault: Fault,
    /// When it begins.
    pub onset: Onset,
    /// When it begins, in blocks since the first.
    pub begin: f64,
    /// Z.
    pub z: f64,
    /// Its size and the standard deviation of that, in the fault's unit.
    pub size: f64,
    /// Standard deviation of the size.
    pub deviation: f64,
    /// Share of the squares of what the motor's own parameters leave over that it explains.
    pub explains: f64,
}

/// Every fault at its likeliest begin, from the start and during the test.
pub fn scan(run: &Whitened, block_s: f64) -> Vec<Hypothesis> {
    let Some(judged) = Judged::of(run) else { return Vec::new() };
    let whole = judged.left.norm_squared().max(f64::MIN_POSITIVE);
    let last = run.blocks.iter().max().map_or(0, |k| k + 1);
    let mut all = Vec::new();
    for fault in Fault::ALL {
        let at = |begin: f64, onset: Onset| {
            let (z, size, deviation) = judged.test(&column(run, fault, onset, begin, block_s))?;
            Some(Hypothesis { fault, onset, begin, z, size, deviation, explains: z * z / whole })
        };
        if fault.course() == Course::Step {
            all.extend(at(0.0, Onset::Start));
        }
        let first = usize::from(fault.course() == Course::Step);
        let begins = (first..last.saturating_sub(FEWEST_BEHIND))
            .flat_map(|block| places_in_a_block(fault).iter().map(move |place| block as f64 + place));
        let during = begins.filter_map(|begin| at(begin, Onset::During));
        // A size beyond what the column holds for is believed only where no other begin explains anything.
        let rank = |h: &Hypothesis| (fault.holds(h.size), h.z.abs());
        all.extend(during.max_by(|a, b| rank(a).partial_cmp(&rank(b)).unwrap_or(Ordering::Equal)));
    }
    all
}

/// Where in a block a fault is tried to begin. The jump of a speed whose gain changes falls into two blocks if it comes
/// close to the border.
const fn places_in_a_block(fault: Fault) -> &'static [f64] {
    match fault {
        Fault::SpeedGain => &[0.0, 0.5 * SMOOTHED, 0.5, 1.0 - 0.5 * SMOOTHED],
        _ => &[0.0, 0.5],
    }
}

/// What a fault of unit size adds to the rows if it begins at a time, in blocks.
pub fn column(run: &Whitened, fault: Fault, onset: Onset, begin: f64, block_s: f64) -> DVector<f64> {
    let jumps = fault == Fault::SpeedGain && onset == Onset::During;
    // How much of the window around a border lies behind the begin.
    let behind = |border: f64| ((border - begin) / (2.0 * SMOOTHED) + 0.5).clamp(0.0, 1.0);
    let row = |n: usize| {
        let k = run.blocks[n] as f64;
        let jump = if jumps { run.jump[n] * (behind(k + 1.0) - behind(k)) } else { 0.0 };
        run.faults[fault as usize][n] * weight(fault, k, begin, block_s) + jump
    };
    DVector::from_fn(run.blocks.len(), |n, _| row(n))
}

/// How large a fault is in block k, on the average, if it begins at a time, in blocks.
fn weight(fault: Fault, k: f64, begin: f64, block_s: f64) -> f64 {
    let within = (k + 1.0 - begin).clamp(0.0, 1.0);
    match fault.course() {
        Course::Step => within,
        Course::Drift => within * (k + 1.0 - begin - 0.5 * within) * block_s,
    }
}

/// A run with what differs from motor to motor taken off.
struct Judged<'a> {
    run: &'a Whitened,
    left: DVector<f64>,
    inverse: DMatrix<f64>,
}

impl<'a> Judged<'a> {
    fn of(run: &'a Whitened) -> Option<Self> {
        let (own, inverse) = run.own_of_motor();
        let left = &run.rows - &run.own * own;
        (!run.blocks.is_empty()).then_some(Self { run, left, inverse })
    }

    /// Z, size and its deviation of a column.
    fn test(&self, s: &DVector<f64>) -> Option<(f64, f64, f64)> {
        let b = self.run.own.tr_mul(s);
        let whole = s.norm_squared();
        let information = whole - b.dot(&(&self.inverse * &b));
        let product = s.dot(&self.left);
        // What the motor's own parameters explain but for rounding tells nothing.
        (information > 1e-9 * whole && information > 0.0)
            .then(|| (product / information.sqrt(), product / information, 1.0 / information.sqrt()))
    }
}

/// The limits, each of which holds a share of healthy motors, from what each motor shows when the others say what is
/// usual: the hypotheses of its runs.
pub fn limits(motors: &[Vec<Vec<Hypothesis>>], holds: f64) -> Vec<Limit> {
    let n = motors.len() as f64;
    let all_of = |fault: Fault, onset: Onset| -> Option<Vec<Hypothesis>> {
        let largest = |runs: &Vec<Vec<Hypothesis>>| {
            let of_fault = runs.iter().flatten().filter(|h| h.fault == fault && h.onset == onset);
            of_fault.max_by(|a, b| a.z.abs().total_cmp(&b.z.abs())).copied()
        };
        motors.iter().map(largest).collect()
    };
    let mut limits = Vec::new();
    let mut put = |fault: Fault, onset: Onset, of: &[Hypothesis], z: f64| {
        let usual = (of.iter().map(|h| h.z * h.z).sum::<f64>() / n).sqrt();
        let mut seen: Vec<f64> = of.iter().map(|h| (z + SEEN * usual) * h.deviation).collect();
        seen.sort_by(f64::total_cmp);
        limits.push(Limit { fault, onset, z, seen: seen[seen.len() / 2] });
    };
    let student = |freedom: f64, share: f64| {
        StudentsT::new(0.0, 1.0, freedom).map_or(f64::INFINITY, |student| student.inverse_cdf(share))
    };
    let of_another = (1.0 + 1.0 / n).sqrt();
    for fault in Fault::ALL {
        let Some(of) = all_of(fault, Onset::Start) else { continue };
        let square = of.iter().map(|h| h.z * h.z).sum::<f64>() / n;
        put(fault, Onset::Start, &of, student(n - 1.0, 0.5 * (1.0 + holds)) * square.sqrt() * of_another);
    }
    let of_balances = |fault: &Fault| fault.own_row().is_none();
    let together: Vec<Fault> = Fault::ALL.into_iter().filter(of_balances).collect();
    let alone = Fault::ALL.into_iter().filter(|fault| !of_balances(fault)).map(|fault| vec![fault]);
    for group in std::iter::once(together).chain(alone) {
        let shown: Vec<(Fault, Vec<Hypothesis>)> =
            group.into_iter().filter_map(|fault| Some((fault, all_of(fault, Onset::During)?))).collect();
        let logarithms: Vec<Vec<f64>> =
            shown.iter().map(|(_, of)| of.iter().map(|h| h.z.abs().max(f64::MIN_POSITIVE).ln()).collect()).collect();
        let Some((deviation, freedom)) = pooled(&logarithms) else { continue };
        let beyond = student(freedom, holds) * deviation.max(LEAST_SPREAD) * of_another;
        for ((fault, of), logarithms) in shown.iter().zip(&logarithms) {
            put(*fault, Onset::During, of, (logarithms.iter().sum::<f64>() / n + beyond).exp());
        }
    }
    limits
}

/// Standard deviation pooled over samples of the same motors, and its degrees of freedom: a mean of correlated
/// variances (Satterthwaite).
fn pooled(samples: &[Vec<f64>]) -> Option<(f64, f64)> {
    let n = samples.first()?.len() as f64;
    let centred: Vec<DVector<f64>> = samples
        .iter()
        .map(|sample| {
            let sample = DVector::from_column_slice(sample);
            let mean = sample.mean();
            sample.add_scalar(-mean)
        })
        .collect();
    let covariance = |a: &DVector<f64>, b: &DVector<f64>| a.dot(b) / (n - 1.0);
    let trace: f64 = centred.iter().map(|a| covariance(a, a)).sum();
    let squares: f64 = centred.iter().flat_map(|a| centred.iter().map(move |b| covariance(a, b).powi(2))).sum();
    (n > 1.0 && trace > 0.0)
        .then(|| ((trace / centred.len() as f64).sqrt(), (n - 1.0) * (trace * trace / squares).max(1.0)))
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::model::lot::OWN;

    /// White rows, one a block, of which one fault has a column of its own.
    fn run(fault: Fault, rows: DVector<f64>, column: impl Fn(usize) -> f64) -> Whitened {
        let count = rows.len();
        let nothing = DVector::zeros(count);
        let mut faults = vec![nothing.clone(); Fault::ALL.len()];
        faults[fault as usize] = DVector::from_fn(count, |k, _| column(k));
        Whitened {
            blocks: (0..count).collect(),
            row_of_block: vec![0; count],
            rows,
            own: DMatrix::zeros(count, OWN.len()),
            faults,
            jump: nothing,
        }
    }

    fn found(run: &Whitened, fault: Fault, onset: Onset) -> Hypothesis {
        scan(run, 0.1).into_iter().find(|h| h.fault == fault && h.onset == onset).unwrap()
    }

    #[test]
    fn a_fault_without_noise_is_found_where_and_as_large_as_it_is() {
        // 0.2 times a column of 5 from block 30 on: Z = 0.2 · 5 √50, and nothing else is left.
        let rows = DVector::from_fn(80, |k, _| if k < 30 { 0.0 } else { 1.0 });
        let h = found(&run(Fault::Resistance, rows, |_| 5.0), Fault::Resistance, Onset::During);
        assert_eq!(h.begin, 30.0);
        assert!((h.size - 0.2).abs() < 1e-12 && (h.z - 50f64.sqrt()).abs() < 1e-12, "{h:?}");
        assert!((h.deviation - 1.0 / (5.0 * 50f64.sqrt())).abs() < 1e-12 && (h.explains - 1.0).abs() < 1e-12, "{h:?}");
        // A drift of 0.3 a second, in the middle of each block of 0.1 s.
        let rows = DVector::from_fn(80, |k, _| if k < 30 { 0.0 } else { 0.3 * (k as f64 - 29.5) * 0.1 });
        let h = found(&run(Fault::CurrentDrift, rows, |_| 1.0), Fault::CurrentDrift, Onset::During);
        assert_eq!(h.begin, 30.0);
        assert!((h.size - 0.3).abs() < 1e-12, "{h:?}");
    }

    #[test]
    fn a_begin_at_which_the_size_is_believable_comes_first() {
        // The mean from block k on is (0.7 (40 − k) + 0.4 · 40)/(80 − k), at most a half from block 20 on; that from
        // block 1 on explains most.
        let rows = DVector::from_fn(80, |k, _| match k {
            0 => 0.0,
            1..40 => 0.7,
            _ => 0.4,
        });
        let h = found(&run(Fault::VoltageGain, rows.clone(), |_| 1.0), Fault::VoltageGain, Onset::During);
        assert!((20.0..=21.0).contains(&h.begin), "{h:?}");
        // A contact's drop in volts may be as large as it is.
        let h = found(&run(Fault::Contact, rows, |_| 1.0), Fault::Contact, Onset::During);
        assert_eq!(h.begin, 1.0);
    }

    #[test]
    fn what_a_motor_may_have_of_its_own_is_no_fault_from_the_start() {
        // With s = X of n = 80 rows of 1 and a size of one standard deviation of the scatter, A = n + 1, and
        // Z = (n/(n + 1))/√(n − n²/(n + 1)) = √(n/(n + 1)).
        let mut run = run(Fault::Resistance, DVector::from_element(80, 1.0), |_| 1.0);
        run.own.column_mut(0).fill(1.0);
        let h = found(&run, Fault::Resistance, Onset::Start);
        assert!((h.z - (80.0f64 / 81.0).sqrt()).abs() < 1e-12, "{h:?}");
    }

    #[test]
    fn a_gain_of_the_speed_brings_its_jump() {
        // In the middle of block 40, and at the border before it.
        for (begin, before, within) in [(40.5, 0.0, 1.0 - 50.0), (40.0, -25.0, 2.0 - 25.0)] {
            let rows = DVector::from_fn(80, |k, _| match k {
                39 => 0.1 * before,
                40 => 0.1 * within,
                41.. => 0.1 * 2.0,
                _ => 0.0,
            });
            let mut run = run(Fault::SpeedGain, rows, |_| 2.0);
            run.jump.fill(-50.0);
            let h = found(&run, Fault::SpeedGain, Onset::During);
            assert_eq!(h.begin, begin);
            assert!((h.size - 0.1).abs() < 1e-12 && (h.explains - 1.0).abs() < 1e-12, "{h:?}");
        }
    }

    #[test]
    fn variances_of_the_same_motors_are_worth_as_much_as_they_differ() {
        let a = [1.0, -1.0, 1.0, -1.0];
        let b = [1.0, 1.0, -1.0, -1.0];
        // The same twice is worth one: n − 1. Two that go with nothing of each other: 2 (n − 1).
        let (deviation, freedom) = pooled(&[a.to_vec(), a.to_vec()]).unwrap();
        assert!((deviation - (4.0f64 / 3.0).sqrt()).abs() < 1e-12 && (freedom - 3.0).abs() < 1e-12);
        assert!((pooled(&[a.to_vec(), b.to_vec()]).unwrap().1 - 6.0).abs() < 1e-12);
    }

    #[test]
    fn limits_are_quantiles_of_the_published_table() {
        // |Z| = 1 from the start of ten motors: t of 9 degrees of freedom, 0.9995 one-sided, is 4.781.
        let shown = |z: f64| {
            let h = Hypothesis {
                fault: Fault::Inertia,
                onset: Onset::Start,
                begin: 0.0,
                z,
                size: z,
                deviation: 1.0,
                explains: 0.0,
            };
            vec![vec![h]]
        };
        let motors: Vec<_> = (0..10).map(|k| shown(if k % 2 == 0 { 1.0 } else { -1.0 })).collect();
        let all = limits(&motors, 0.999);
        let [limit] = all.as_slice() else { panic!("{all:?}") };
        assert!((limit.z - 4.781 * 1.1f64.sqrt()).abs() < 1e-3, "{limit:?}");
        assert!((limit.seen - (limit.z + 1.645)).abs() < 1e-9);
    }

    #[test]
    fn the_largest_z_of_white_noise_spreads_as_is_assumed() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let draws = 600;
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let logarithms: Vec<f64> = (0..draws)
            .map(|_| {
                // A drop in volts may have any size.
                let mut white = run(Fault::Contact, DVector::from_fn(80, |_, _| normal()), |_| 1.0);
                // A level of its own, of any size.
                white.own.column_mut(0).fill(1e3);
                found(&white, Fault::Contact, Onset::During).z.abs().ln()
            })
            .collect();
        let deviation = pooled(&[logarithms]).unwrap().0;
        // A standard deviation from 600 draws is known to 1/√1200 of itself, 0.008: three of them.
        assert!((deviation - LEAST_SPREAD).abs() < 0.025, "{deviation}");
    }
}
