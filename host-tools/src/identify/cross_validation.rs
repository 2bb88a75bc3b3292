//! Errors on data held out, block by block of time.
//!
//! Each block in turn is left out: the change of the estimate is `d = (A − A_b)⁻¹ g_b` with A = JᵀJ and g = Jᵀr (exact
//! for a model that is linear in its parameters, a Newton step otherwise), and the block's error is that of the
//! parameters from all other blocks, `r_b + J_b d`. A parameter that rests at an end of its range stays there: the
//! other blocks push it against it as well. A block of a staircase has an amplitude of its own, so that this is an
//! error on another excitation.
//!
//! Source: M. Stone: Cross-validatory choice and assessment of statistical predictions, J. R. Stat. Soc. B 36 (1974)
//! 111–147.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{Binomial, ChiSquared, ContinuousCDF, DiscreteCDF};

use super::intervals::correlation_time_s;
use super::minimise::{Fit, HeldOut, PRIOR};
use super::space::Entry;

/// How many blocks the recordings are cut into, about.
const BLOCKS: f64 = 32.0;
/// Curvature, relative to that of a whole column, that keeps a parameter in place.
const SMALLEST_CURVATURE: f64 = 1e-6;
/// Shortest block, s.
const SHORTEST_S: f64 = 0.2;

/// The block of each row, of recordings that begin at time zero: about `BLOCKS` in all, within a recording of equal
/// length.
pub fn blocks(times: &[(usize, f64)]) -> Vec<usize> {
    let mut lengths: BTreeMap<usize, f64> = BTreeMap::new();
    for (recording, t) in times {
        let length = lengths.entry(*recording).or_default();
        *length = length.max(*t);
    }
    let about = (lengths.values().sum::<f64>() / BLOCKS).max(SHORTEST_S);
    let mut count = 0;
    let of_recording = |(recording, length): (&usize, &f64)| {
        let blocks = ((length / about).round() as usize).max(1);
        count += blocks;
        (*recording, (count - blocks, blocks, length / blocks as f64))
    };
    let of_recordings: BTreeMap<usize, (usize, usize, f64)> = lengths.iter().map(of_recording).collect();
    let block = |(recording, t): &(usize, f64)| {
        let (first, blocks, length) = of_recordings[recording];
        first + ((t / length) as usize).min(blocks - 1)
    };
    times.iter().map(block).collect()
}

/// Leaves out each block in turn.
pub fn held_out(fit: &Fit, groups: &[u8], blocks: &[usize]) -> HeldOut {
    let entries: Vec<&Entry> = fit.space.free().collect();
    let count = blocks.iter().max().map_or(0, |b| b + 1);
    let mut rows_of: Vec<Vec<usize>> = vec![Vec::new(); count];
    for (row, block) in blocks.iter().enumerate() {
        rows_of[*block].push(row);
    }
    // A column beyond the parameters is that of a term which is tried.
    let moves = |column: &usize| entries.get(*column).is_none_or(|entry| !entry.rests_at_a_limit());
    let columns: Vec<usize> = (0..fit.jacobian.ncols()).filter(moves).collect();
    let p = columns.len();
    let lengths: Vec<f64> = columns.iter().map(|c| fit.jacobian.column(*c).norm().max(1e-300)).collect();
    let part = |rows: &[usize]| {
        let j = DMatrix::from_fn(rows.len(), p, |r, c| fit.jacobian[(rows[r], columns[c])] / lengths[c]);
        let r = DVector::from_fn(rows.len(), |k, _| fit.residuals[rows[k]]);
        (j, r)
    };
    let parts: Vec<(DMatrix<f64>, DVector<f64>)> = rows_of.iter().map(|rows| part(rows)).collect();
    let normals: Vec<DMatrix<f64>> = parts.iter().map(|(j, _)| j.tr_mul(j)).collect();
    let mut whole = normals.iter().fold(DMatrix::zeros(p, p), |sum, n| sum + n);
    for (k, column) in columns.iter().enumerate() {
        // What a single block tells all by itself stays where it is, and a shape keeps its prior.
        whole[(k, k)] += SMALLEST_CURVATURE
            + if entries.get(*column).is_some_and(|entry| entry.is_shape()) { PRIOR / lengths[k].powi(2) } else { 0.0 };
    }
    let mut predicted = fit.residuals.clone();
    for (b, (j, r)) in parts.iter().enumerate() {
        let gradient = j.tr_mul(r);
        if let Some(change) = (&whole - &normals[b]).cholesky().map(|c| c.solve(&gradient)) {
            let errors = r + j * change;
            rows_of[b].iter().zip(errors.iter()).for_each(|(row, error)| predicted[*row] = *error);
        }
    }
    let mut rows = vec![[0.0; 2]; count];
    groups.iter().zip(blocks).for_each(|(group, block)| rows[*block][usize::from(*group)] += 1.0);
    HeldOut::new(squares_of(&predicted, fit.rms, groups, blocks), rows)
}

/// Squared errors of the two groups in each block, of residuals that were divided by `unit`.
pub fn squares_of(residuals: &DVector<f64>, unit: [f64; 2], groups: &[u8], blocks: &[usize]) -> Vec<[f64; 2]> {
    let mut squares = vec![[0.0; 2]; blocks.iter().max().map_or(0, |b| b + 1)];
    for ((error, group), block) in residuals.iter().zip(groups).zip(blocks) {
        let g = usize::from(*group);
        squares[*block][g] += (error * unit[g]).powi(2);
    }
    squares
}

/// p-value of an effect by the fall of the held-out error: `2 Σ n ln(RMS before/RMS after)` over both balances against
/// χ² with as many degrees of freedom as the effect has parameters, where n is the number of independent rows: the rows
/// over the integrated correlation time of what is left. Where other structure that is still unexplained makes the rows
/// few, the sign test over the blocks counts instead: how many of them are predicted better? (The smaller of the two,
/// doubled.)
pub fn p_value(before: &HeldOut, after: &HeldOut, fit: &Fit, groups: &[u8], parameters: usize) -> f64 {
    let (worse, better) = (before.rms(), after.rms());
    let correlation = correlation_rows(fit, groups);
    let statistic: f64 = (0..2)
        .filter(|g| worse[*g].is_finite() && better[*g].is_finite())
        .map(|g| {
            let rows = groups.iter().filter(|group| usize::from(**group) == g).count() as f64;
            2.0 * (rows / correlation[g]) * (worse[g] / better[g]).ln()
        })
        .sum();
    let by_likelihood =
        ChiSquared::new(parameters.max(1) as f64).map_or(1.0, |d| if statistic > 0.0 { d.sf(statistic) } else { 1.0 });
    (2.0 * by_likelihood.min(sign_test(before, after))).min(1.0)
}

/// Rows of either group that are worth an independent one: the integrated correlation time of what a fit leaves.
pub fn correlation_rows(fit: &Fit, groups: &[u8]) -> [f64; 2] {
    [0, 1].map(|g| {
        let own = |(r, group): (&f64, &u8)| (usize::from(*group) == g).then_some(*r);
        let left: Vec<f64> = fit.residuals.iter().zip(groups).filter_map(own).collect();
        correlation_time_s(&left, 1.0).max(1.0)
    })
}

/// One-sided sign test: the chance that as many blocks gain by luck.
fn sign_test(before: &HeldOut, after: &HeldOut) -> f64 {
    let scale = before.rms().map(|r| r * r);
    let gains: Vec<f64> = before
        .squares
        .iter()
        .zip(&after.squares)
        .map(|(b, a)| (0..2).filter(|g| scale[*g].is_finite()).map(|g| (b[g] - a[g]) / scale[g]).sum::<f64>())
        .filter(|gain| *gain != 0.0)
        .collect();
    let better = gains.iter().filter(|g| **g > 0.0).count() as u64;
    Binomial::new(0.5, gains.len() as u64).map_or(1.0, |d| if better == 0 { 1.0 } else { d.sf(better - 1) })
}

#[cfg(test)]
mod tests {
    use greyrig::motor::BaseParameter;

    use super::*;
    use crate::identify::space::{Freedom, Space};
    use crate::model::{Base, Kind};

    /// A fit of R and L to two blocks of two rows, of which the second alone tells L.
    fn fit(inductance: f64) -> Fit {
        let mut space = Space::new(Kind::PmDc, Base::Full, &[]);
        space.hold([BaseParameter::K, BaseParameter::J], Freedom::Pinned);
        space.hold(BaseParameter::FRICTIONS, Freedom::Pinned);
        space.start(BaseParameter::L, inductance);
        let jacobian = DMatrix::from_row_slice(4, 2, &[1.0, 0.0, 1.0, 0.0, 1.0, 2.0, 1.0, 2.0]);
        Fit {
            space,
            jacobian,
            residuals: DVector::from_vec(vec![-0.3, -0.3, 0.3, 0.3]),
            rms: [1.0; 2],
            ended: true,
            known_held_out: std::sync::OnceLock::new(),
        }
    }

    /// Rows of a recording of `seconds`, a hundred a second, the last one at its end.
    fn rows(recording: usize, seconds: f64) -> Vec<(usize, f64)> {
        (0..=(100.0 * seconds) as usize).map(|k| (recording, 0.01 * k as f64)).collect()
    }

    /// Rows in each block.
    fn sizes(blocks: &[usize]) -> Vec<usize> {
        (0..=blocks.iter().copied().max().unwrap()).map(|b| blocks.iter().filter(|x| **x == b).count()).collect()
    }

    #[test]
    fn blocks_are_equal_and_none_is_a_crumb() {
        let of_one = sizes(&blocks(&rows(0, 12.0)));
        assert_eq!(of_one.len(), 32);
        // 1201 rows in 32 blocks: 37.5 each, and the one at the end.
        assert!(of_one.iter().all(|n| (37..=39).contains(n)), "{of_one:?}");
        // 10 s and 3 s: blocks of 13/32 s, 24.6 and 7.4 of them.
        let both = blocks(&[rows(0, 10.0), rows(3, 3.0)].concat());
        assert_eq!(both.iter().max(), Some(&31));
        assert_eq!((both[1000], both[1001]), (24, 25), "no block is of two recordings");
        assert!(sizes(&both).iter().all(|n| (39..=44).contains(n)), "{:?}", sizes(&both));
    }

    #[test]
    fn short_recordings_have_fewer_blocks_and_at_least_one() {
        assert_eq!(sizes(&blocks(&rows(0, 1.0))).len(), 5, "a block lasts for 0.2 s at least");
        assert_eq!(sizes(&blocks(&rows(0, 0.05))), [6]);
        assert_eq!(blocks(&[(0, 0.0)]), [0]);
    }

    #[test]
    fn what_rests_at_a_limit_does_not_move_with_a_block_that_is_left_out() {
        let second = |fit: &Fit| held_out(fit, &[0; 4], &[0, 0, 1, 1]).squares[1][0];
        // R alone: by the first block it is 0.3 more, which adds to each row of the second.
        let alone = 2.0 * (0.3f64 + 0.3).powi(2);
        // The curvature that keeps every parameter in place is a millionth.
        assert!((second(&fit(1e5)) - alone).abs() < 1e-5, "{}", second(&fit(1e5)));
        assert!(second(&fit(1.0)) > 1e3 * alone, "L is told by nothing else, and runs away");
    }

    /// Of ten blocks eight are better: (45 + 10 + 1)/1024. A block that is as it was does not count.
    #[test]
    fn the_sign_test_is_that_of_the_table() {
        let of = |squares: &[f64]| {
            HeldOut::new(squares.iter().map(|s| [*s, 0.0]).collect(), vec![[1.0, 0.0]; squares.len()])
        };
        let before = of(&[1.0; 12]);
        let mut after = [0.5; 12];
        (after[0], after[1], after[2], after[3]) = (1.5, 2.0, 1.0, 1.0);
        assert!((sign_test(&before, &of(&after)) - 56.0 / 1024.0).abs() < 1e-12);
        assert!((sign_test(&before, &of(&[0.5; 12])) - 1.0 / 4096.0).abs() < 1e-12);
        assert_eq!(sign_test(&before, &of(&[2.0; 12])), 1.0, "none is better");
        assert_eq!(sign_test(&before, &before), 1.0);
    }

    /// A fall of the RMS by 1 % over 100 independent rows: 2·100·ln(1/0.99) = 2.010 against χ². The tables have P(χ² >
    /// 2.706) = 0.1 for one degree of freedom and P(χ² > 4.605) = 0.1 for two, between which 2.010 lies at 0.156 and
    /// 0.366.
    #[test]
    fn a_fall_of_the_error_is_judged_by_independent_rows() {
        let mut fit = fit(1.0);
        // Neighbours of opposite sign do not correlate.
        fit.residuals = DVector::from_fn(100, |row, _| [1.0, -1.0][row % 2]);
        let groups = [0; 100];
        let of = |rms: f64| HeldOut::new(vec![[100.0 * rms * rms, 0.0]], vec![[100.0, 0.0]]);
        let p = |after: f64, parameters| p_value(&of(1.0), &of(after), &fit, &groups, parameters);
        // Doubled, as the smaller of two; the sign test of one block that gains is ½.
        assert!((p(0.99, 1) - 2.0 * 0.156_3).abs() < 1e-3, "{}", p(0.99, 1));
        assert!((p(0.99, 2) - 2.0 * 0.366_0).abs() < 1e-3, "{}", p(0.99, 2));
        // exp(−2.706/200) and exp(−4.605/200).
        assert!((p(0.986_561, 1) - 0.2).abs() < 1e-3 && (p(0.977_238, 2) - 0.2).abs() < 1e-3);
        assert_eq!(p(1.01, 1), 1.0, "an error that rises");
        // Of rows that are one value ten times over, five are worth one: 1 + 2 (0.8 + 0.6 + 0.4 + 0.2).
        fit.residuals = DVector::from_fn(1000, |row, _| [1.0, -1.0][row / 10 % 2]);
        let slow = HeldOut::new(vec![[1000.0, 0.0]], vec![[1000.0, 0.0]]);
        let better = HeldOut::new(vec![[1000.0 * 0.99 * 0.99, 0.0]], vec![[1000.0, 0.0]]);
        let few = p_value(&slow, &better, &fit, &[0; 1000], 1);
        // 2·200·ln(1/0.99) = 4.020; the table has P(χ² > 3.841) = 0.05.
        assert!((0.085..0.1).contains(&few), "{few}");
    }
}
