//! How sure a verdict is: weights of the models that a search has compared.
//!
//! A model k predicts block b of the data held out with the log density
//!
//! ```text
//! ℓ_bk = −½ Σ_g n_bg/τ_g (ln σ²_gk + s²_bgk/(n_bg σ²_gk))      g: voltage, torque
//! ```
//! s² being the block's sum of squares, n its rows, τ the correlation time of what is left, in rows, and σ² the mean
//! square over all blocks. Pseudo-BMA+ weighs the models by exp(Σ_b ℓ_bk), each times the prior odds of its effect, and
//! averages over Dirichlet weights of the blocks (the Bayesian bootstrap): what hangs on few blocks is not sure. What
//! an effect costs in freedom is in data held out already.
//!
//! Each effect that was found is weighed against those of its step and against nothing, with which counts what gains
//! too little to matter; the verdict is as sure as all of them together. That holds among the models that were
//! compared: physics that no model has may pass for one of them (`OUTSIDE`). There are no odds where the search did
//! not end in a model that explains the data, nor where the free run has chosen against the balances, of which these
//! weights are.
//!
//! Source: Y. Yao, A. Vehtari, D. Simpson and A. Gelman, Using stacking to average Bayesian predictive distributions,
//! Bayesian Analysis 13 (2018) 917–1007; D. B. Rubin, The Bayesian bootstrap, Ann. Statist. 9 (1981) 130–134; T.
//! Sellke, M. J. Bayarri and J. O. Berger, Calibration of p values for testing precise null hypotheses, Am.
//! Statistician 55 (2001) 62–71.

use std::collections::BTreeMap;
use std::sync::Arc;

use greyrig::effects::{EffectId, Prior};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Exp1};

use super::classes;
use super::climb::Climb;
use super::ladder::{Ladder, Objection, Step, Tried};
use super::verdict::{Verdict, VerdictKind};
use crate::error::Result;
use crate::identify::cross_validation::correlation_rows;
use crate::identify::minimise::{Fit, HeldOut};
use crate::numbers::figure;

/// Draws of the Bayesian bootstrap: a weight of a half is known to 0.02.
const DRAWS: usize = 500;
/// Chance that a named effect stands for physics that the catalogue does not hold: one rig in three has some (a debt:
/// nobody has counted), and 5 % of the effects that were withheld got another name or none (`withheld-ac`).
const OUTSIDE: f64 = 0.015;
/// Odds below which more digits mean nothing.
const LEAST: f64 = 1e-3;
/// Weight below which the balances speak against an effect.
const AGAINST: f64 = 0.5;

/// Chances of a verdict and of what it was chosen from.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Odds {
    /// That exactly what is named is missing, or one of a set; `None`: the data are not explained.
    pub verdict: Option<f64>,
    /// Of the effects that were tried, by step, from 1.
    pub effects: BTreeMap<(usize, EffectId), f64>,
}

impl Odds {
    /// Of a verdict, and of the search that has led to it from a fit of the model as it was.
    ///
    /// # Errors
    /// An interrupt.
    pub fn of(verdict: &Verdict, ladder: &Ladder, base: &Fit, climb: &Climb<'_>) -> Result<Self> {
        let mut before = base;
        let mut weighed: Vec<Weights> = Vec::new();
        for step in &ladder.steps {
            weighed.push(Weights::of(step, before, climb)?);
            let winner = step.tried.iter().find(|t| step.winners.contains(&t.id));
            before = winner.map_or(before, |winner| &winner.fit);
        }
        let by_step = |(k, weights): (usize, &Weights)| {
            weights.effects.iter().map(|(id, chance)| ((k + 1, *id), *chance)).collect::<Vec<_>>()
        };
        let effects = weighed.iter().enumerate().flat_map(by_step).collect();
        let kind = ladder.fit.space.kind();
        let of_set = |(place, id): (usize, &EffectId)| {
            let step = ladder.steps.iter().rposition(|step| step.winners.contains(id));
            let rivals = ladder.rivals.get(place).filter(|_| verdict.kind == VerdictKind::Ambiguous);
            let set: Vec<EffectId> = std::iter::once(*id).chain(rivals.into_iter().flatten().copied()).collect();
            let is_in = |other: &EffectId| set.iter().any(|one| classes::same(kind, *one, *other));
            step.map_or(1.0, |step| weighed[step].effects.iter().filter(|(id, _)| is_in(id)).map(|(_, p)| p).sum())
        };
        let inside = match verdict.kind {
            VerdictKind::MissingEffect | VerdictKind::Ambiguous if !ladder.found.is_empty() => {
                let chances: Vec<f64> = ladder.found.iter().enumerate().map(of_set).collect();
                chances.iter().all(|chance| *chance > AGAINST).then(|| chances.iter().product::<f64>())
            }
            VerdictKind::None => Some(weighed.last().map_or(1.0, |weights| weights.nothing)),
            _ => None,
        };
        Ok(Self { verdict: inside.map(|chance| chance.min(1.0) * (1.0 - OUTSIDE)), effects })
    }

    /// Of an effect by its p-value alone, the most that it can speak for it: −1/(e p ln p) times its prior odds.
    pub fn by_p_value(p: f64, prior: Prior) -> f64 {
        let against = if p < (-1.0f64).exp() { -std::f64::consts::E * p * p.ln() } else { 1.0 };
        (1.0 - OUTSIDE) / (1.0 + against * (1.0 - prior.share) / prior.share)
    }
}

/// A chance as odds: `20 to 1`, `even`.
pub fn in_words(chance: f64) -> String {
    let rounded = |odds: f64| figure(odds, if odds < 10.0 { 1 } else { 2 });
    match chance / (1.0 - chance) {
        odds if odds >= 1.5 => format!("{} to 1", rounded(odds)),
        odds if odds > 1.0 / 1.5 => "even".to_owned(),
        odds if odds < LEAST => format!("less than 1 to {}", rounded(1.0 / LEAST)),
        odds => format!("1 to {}", rounded(1.0 / odds)),
    }
}

/// Weights of the models of a step.
struct Weights {
    effects: Vec<(EffectId, f64)>,
    nothing: f64,
}

impl Weights {
    /// `before` is the model that nothing is added to.
    fn of(step: &Step, before: &Fit, climb: &Climb<'_>) -> Result<Self> {
        if step.in_free_run {
            let of = |t: &Tried| (t.id, Odds::by_p_value(t.p_value, t.id.description().prior));
            let others = 1.0 + step.as_well.len() as f64;
            let effects: Vec<(EffectId, f64)> = step.tried.iter().map(of).map(|(id, p)| (id, p / others)).collect();
            let nothing = 1.0 - effects.iter().fold(0.0, |most, (_, p)| p.max(most));
            return Ok(Self { effects, nothing });
        }
        let may_be = |t: &&Tried| matches!(t.objection, None | Some(Objection::NotSignificant));
        // Two that were tried together are one model.
        let mut models: Vec<(Vec<EffectId>, &Fit)> = Vec::new();
        for tried in step.tried.iter().filter(may_be) {
            let fit = Arc::as_ref(&tried.fit);
            match models.iter_mut().find(|(_, known)| std::ptr::eq(*known, fit)) {
                Some((ids, _)) => ids.push(tried.id),
                None => models.push((vec![tried.id], fit)),
            }
        }
        let best = models.first().map_or(before, |(_, fit)| fit);
        let correlation = correlation_rows(best, climb.groups());
        let mut compared = vec![Model { held_out: climb.held_out(before)?, log_prior: 0.0 }];
        for (ids, fit) in &models {
            let log_odds = |id: &EffectId| {
                let share = id.description().prior.share;
                (share / (1.0 - share)).ln()
            };
            compared.push(Model { held_out: climb.held_out(fit)?, log_prior: ids.iter().map(log_odds).sum() });
        }
        let weights = weights(&compared, correlation);
        let effects = models.iter().zip(&weights[1..]).flat_map(|((ids, _), w)| ids.iter().map(|id| (*id, *w)));
        Ok(Self { effects: effects.collect(), nothing: weights[0] })
    }
}

/// A model that is compared: its errors on data held out, and the logarithm of its prior odds.
struct Model<'a> {
    held_out: &'a HeldOut,
    log_prior: f64,
}

/// Pseudo-BMA+ weights of models, of which so many rows of voltage and torque are worth an independent one.
fn weights(models: &[Model<'_>], correlation: [f64; 2]) -> Vec<f64> {
    let count = models.iter().map(|m| m.held_out.squares.len()).min().unwrap_or(0);
    // What a model only extrapolates to decides nothing.
    let told = |b: &usize| models.iter().all(|m| m.held_out.beyond[*b] == [false; 2]);
    let blocks: Vec<usize> = (0..count).filter(told).collect();
    let densities: Vec<Vec<f64>> = models.iter().map(|m| log_densities(m.held_out, &blocks, correlation)).collect();
    let mut random = ChaCha8Rng::seed_from_u64(0);
    let mut sums = vec![0.0; models.len()];
    for _ in 0..DRAWS {
        let parts: Vec<f64> = blocks.iter().map(|_| Exp1.sample(&mut random)).collect();
        let scale = blocks.len() as f64 / parts.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let of = |(model, densities): (&Model<'_>, &Vec<f64>)| {
            model.log_prior + densities.iter().zip(&parts).map(|(density, part)| density * part * scale).sum::<f64>()
        };
        let scores: Vec<f64> = models.iter().zip(&densities).map(of).collect();
        let most = scores.iter().fold(f64::NEG_INFINITY, |most, score| score.max(most));
        let shares: Vec<f64> = scores.iter().map(|score| (score - most).exp()).collect();
        let whole: f64 = shares.iter().sum();
        sums.iter_mut().zip(&shares).for_each(|(sum, share)| *sum += share / whole / DRAWS as f64);
    }
    sums
}

/// ℓ of a model in some blocks.
fn log_densities(held_out: &HeldOut, blocks: &[usize], correlation: [f64; 2]) -> Vec<f64> {
    let variance = [0, 1].map(|g| {
        let sum = |of: &[[f64; 2]]| blocks.iter().map(|b| of[*b][g]).sum::<f64>();
        sum(&held_out.squares) / sum(&held_out.rows)
    });
    let of_group = |b: usize, g: usize| {
        let (squares, rows) = (held_out.squares[b][g], held_out.rows[b][g]);
        if rows > 0.0 && variance[g] > 0.0 {
            -0.5 * (rows * variance[g].ln() + squares / variance[g]) / correlation[g]
        } else {
            0.0
        }
    };
    blocks.iter().map(|b| of_group(*b, 0) + of_group(*b, 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks of 100 rows of the first group with these mean squares.
    fn blocks(squares: &[f64]) -> HeldOut {
        HeldOut::new(squares.iter().map(|s| [100.0 * s, 0.0]).collect(), vec![[100.0, 0.0]; squares.len()])
    }

    /// By hand: with equal blocks the bootstrap changes nothing, and the odds are the ratio of the variances to the
    /// power of half the independent rows: of 30 blocks of 100 rows that are worth one in 50, (1.2)^30 = 237.
    #[test]
    fn equal_blocks_give_the_odds_of_their_variances() {
        let (one, other) = (blocks(&[1.0; 30]), blocks(&[1.2; 30]));
        let models = |prior| [Model { held_out: &one, log_prior: 0.0 }, Model { held_out: &other, log_prior: prior }];
        let even = weights(&models(0.0), [50.0, 1.0]);
        assert!((even[0] / even[1] - 1.2f64.powi(30)).abs() < 1e-6, "{even:?}");
        // Prior odds multiply.
        let prior = weights(&models(10f64.ln()), [50.0, 1.0]);
        assert!((prior[0] / prior[1] - 1.2f64.powi(30) / 10.0).abs() < 1e-6, "{prior:?}");
        assert!((even.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    /// The same sum of squares from a single block that decides is less sure than from all of them.
    #[test]
    fn what_hangs_on_one_block_is_not_sure() {
        let one = blocks(&[1.0; 30]);
        let mut squares = [1.0; 30];
        squares[7] = 7.0;
        let spread = weights(
            &[Model { held_out: &one, log_prior: 0.0 }, Model { held_out: &blocks(&[1.2; 30]), log_prior: 0.0 }],
            [50.0, 1.0],
        );
        let single = weights(
            &[Model { held_out: &one, log_prior: 0.0 }, Model { held_out: &blocks(&squares), log_prior: 0.0 }],
            [50.0, 1.0],
        );
        assert!(single[1] > 5.0 * spread[1], "{single:?} {spread:?}");
    }

    #[test]
    fn a_chance_is_told_as_odds() {
        let told = [0.985, 0.8, 0.55, 0.25, 0.01, 0.0].map(in_words);
        assert_eq!(told, ["66 to 1", "4 to 1", "even", "1 to 3", "1 to 99", "less than 1 to 1000"]);
    }

    /// −e p ln p of p = 0.01 is 0.125: a p-value of a hundredth is odds of 8 at most (Sellke et al., table 1).
    #[test]
    fn a_p_value_speaks_no_more_than_it_can() {
        let even = Prior { share: 0.5, because: "" };
        let chance = Odds::by_p_value(0.01, even) / (1.0 - OUTSIDE);
        assert!((chance - 1.0 / 1.125_2).abs() < 1e-3, "{chance}");
        assert!((Odds::by_p_value(0.5, even) / (1.0 - OUTSIDE) - 0.5).abs() < 1e-12);
    }
}
