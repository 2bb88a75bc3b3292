//! The fit of the whole motor: start values by least squares, then the free run, until no parameter is left that the
//! data do not tell.

use greyrig::motor::BaseParameter;
use rayon::prelude::*;

use super::determined::covariance_without_open_shapes;
use super::equation_error::EquationError;
use super::identifiability::Weakness;
use super::identification::Outcome;
use super::intervals::of_fit::blocks_of_rows;
use super::minimise::{Effort, Fit, Residuals as _, as_it_is, have_rows, minimise};
use super::output_error::{OutputError, Rows};
use super::settings::Method;
use super::space::{Entry, Freedom, Key, Space};
use super::{identifiability, regression, slow_sampling};
use crate::context::Context;
use crate::error::{Error, Insufficient, Result};
use crate::experiment::Experiment;
use crate::model::Assignment;

/// A fit from before a parameter was held that seemed to be open. Where the error rises without it, it was not: what a
/// model lacks leaves residuals that make every parameter uncertain, and the motor cannot do without all of them.
struct Earlier {
    outcome: Outcome,
    error: f64,
    /// Notes that had been made by then.
    notes: usize,
}

/// Rise of each signal's error, as a logarithm, from which a parameter is needed.
const NEEDED: f64 = 0.1;

/// Fits what is free and not known to be `out_of_reach`, from what is `known`, too, and says in `notes` what the user
/// should know.
///
/// # Errors
/// Recordings from which nothing can be identified, with the reason; an interrupt.
pub fn fit(
    mut space: Space,
    experiments: &[Experiment],
    method: Method,
    out_of_reach: Option<Weakness>,
    known: &[Assignment],
    notes: &mut Vec<String>,
    ctx: &Context,
) -> Result<Outcome> {
    let mut weaknesses = identifiability::missing_channels(&mut space, experiments)?;
    let unsure = out_of_reach.as_ref().map(|weakness| weakness.held);
    let name_of_unsure = unsure.and_then(|key| space.get(key)).map(|entry| entry.name.clone());
    weaknesses.extend(out_of_reach);
    identifiability::check_excitation(experiments)?;
    let slow = slow_sampling::is_slow(experiments);
    if !slow {
        space.take_typical_values();
    }
    let mut neutral = space.clone();
    let mut earlier: Option<Earlier> = None;
    let mut ambiguous: Vec<String> = Vec::new();
    loop {
        if space.free().next().is_none() {
            let reasons = weaknesses.into_iter().map(|w| w.text).collect();
            return Err(Error::insufficient(experiments[0].place(), Insufficient::NothingDetermined(reasons)));
        }
        let mut bare = space.bare();
        if slow {
            slow_sampling::start_values(&mut bare, experiments, &ctx.quietly())?;
        } else {
            regression::start_values(&mut bare, experiments);
        }
        space.take_values(&bare);
        let substeps = |e: &Experiment| space.motor().and_then(|m| e.substeps(&m)).unwrap_or(1);
        let problem = OutputError::new(experiments.iter().map(|e| Rows::new(e, substeps(e))).collect())?;
        let refined = match method {
            Method::OutputError => {
                // A term of the user's own may fit the balances with a sign that the free run does not stand.
                let has_terms = space.entries.iter().any(|entry| matches!(entry.key, Key::Term(..)));
                let absent = has_terms.then(|| space.clone());
                if space.entries.iter().any(Entry::of_effect) {
                    space = with_effects_started(&space, &bare, known, experiments, &ctx.quietly())?;
                }
                if experiments.iter().all(|e| e.current.is_none()) {
                    let (best, differing) = from_several_starts(&space, &problem, ctx)?;
                    ambiguous = differing;
                    best
                } else {
                    let best = minimise(&space, &problem, Effort::FULL, None, ctx)?;
                    match absent {
                        Some(absent) => better(best, &from_absence(&space, &absent), &problem, ctx)?,
                        None => best,
                    }
                }
            }
            Method::LeastSquares => as_it_is(&space, &problem),
        };
        let error = refined.log_error(problem.groups());
        let signals = have_rows(problem.groups()).into_iter().filter(|has| *has).count();
        if let Some(earlier) = earlier.take_if(|earlier| error > earlier.error + NEEDED * signals as f64) {
            notes.truncate(earlier.notes);
            return Ok(earlier.outcome);
        }
        if let Some(stuck) = refined.space.free().find(|e| e.at_bound()) {
            // At its bound a parameter no longer answers to the data: it stays there, and the others are fitted anew.
            notes.push(format!("{} has run into its bound at {:.4e} and is held there", stuck.name, stuck.value));
            for known in [&mut space, &mut neutral] {
                if let Some(entry) = known.get_mut(stuck.key) {
                    entry.value = stuck.value;
                    entry.freedom = Freedom::Fixed;
                }
            }
            continue;
        }
        let blocks = blocks_of_rows(&problem, &refined);
        let mut refined = refined;
        let covariance = covariance_without_open_shapes(&mut refined, &blocks);
        let weakness = identifiability::of_fit(&refined, covariance.as_ref(), experiments);
        // An effect that was asked for stays, however little the data say about its size.
        let weakness = weakness.filter(|w| refined.space.get(w.held).is_none_or(|e| !e.of_effect()));
        match weakness {
            Some(weakness) if weaknesses.len() < 5 && method == Method::OutputError => {
                let mut outcome = Outcome::of_simulation(refined.space, covariance, weaknesses.clone(), method);
                outcome.ambiguous.extend(name_of_unsure.clone());
                earlier = Some(Earlier { outcome, error, notes: notes.len() });
                // A weak direction has taken the other parameters along, in the regression as in the fit: begin again.
                let mut again = neutral.clone();
                for entry in &mut again.entries {
                    if let Some(present) = space.get(entry.key) {
                        entry.freedom = present.freedom;
                    }
                }
                identifiability::close(&mut again, &weakness);
                space = again;
                if unsure != Some(weakness.held) {
                    weaknesses.push(weakness);
                }
            }
            _ => {
                if covariance.is_none() {
                    notes.push(format!(
                        "no 95 % intervals: these recordings hold too few independent stretches of time for {} parameters; record \
                         longer, with more changes of speed",
                        refined.jacobian.ncols()
                    ));
                }
                if !ambiguous.is_empty() {
                    notes.push(format!(
                        "fits from several starts end alike with different values of {}: these recordings do not tell them apart",
                        ambiguous.join(", ")
                    ));
                }
                let mut outcome = Outcome::of_simulation(refined.space, covariance, weaknesses, method);
                outcome.ambiguous = ambiguous.into_iter().chain(name_of_unsure).collect();
                return Ok(outcome);
            }
        }
    }
}

/// A space whose terms begin from where they are in another one.
fn from_absence(space: &Space, absent: &Space) -> Space {
    let mut start = space.clone();
    for entry in start.entries.iter_mut().filter(|entry| matches!(entry.key, Key::Term(..) | Key::Base(_))) {
        entry.value = absent.value(entry.key);
    }
    start
}

/// A fit, or the one from another start where that ends with a smaller error of the free run.
fn better(fit: Fit, start: &Space, problem: &OutputError<'_>, ctx: &Context) -> Result<Fit> {
    let other = minimise(start, problem, Effort::FULL, None, ctx)?;
    let error = |fit: &Fit| Some(fit.log_error(problem.groups())).filter(|error| error.is_finite());
    Ok(match (error(&fit), error(&other)) {
        (Some(own), Some(others)) if own <= others => fit,
        (Some(_), None) => fit,
        _ => other,
    })
}

/// Factors of the inertia from which a fit without a current starts besides: without one, balances say little of where
/// to begin.
const STARTS: [f64; 4] = [0.1, 0.3, 3.0, 10.0];
/// Ends whose errors differ by less than this, mean of the logarithms, are as good: a per cent.
const AS_GOOD: f64 = 0.01;
/// Distance of their parameters, as a share of the value or of a typical friction, from which they differ.
const ANOTHER: f64 = 0.1;

/// Fits from several inertias: the best end, fitted to the last digit, and the names of the parameters of which ends
/// that are as good say otherwise.
fn from_several_starts(space: &Space, problem: &OutputError<'_>, ctx: &Context) -> Result<(Fit, Vec<String>)> {
    let error = |end: &Fit| end.log_error(problem.groups());
    let mut ends = Vec::new();
    for factor in std::iter::once(1.0).chain(STARTS) {
        let mut start = space.clone();
        start.start(BaseParameter::J, factor * space.value(BaseParameter::J));
        ends.push(minimise(&start, problem, Effort::PATIENT, None, ctx)?);
    }
    ends.sort_by(|a, b| error(a).total_cmp(&error(b)));
    let best = ends.remove(0);
    let best = minimise(&best.space, problem, Effort::FULL, Some(best.rms), ctx)?;
    let as_good: Vec<&Fit> = ends.iter().filter(|end| error(end) < error(&best) + AS_GOOD).collect();
    let differs = |entry: &&Entry| as_good.iter().any(|end| differ(entry, &end.space));
    let ambiguous = best.space.free().filter(differs).map(|entry| entry.name.clone()).collect();
    Ok((best, ambiguous))
}

/// Whether a space has another value of a parameter.
fn differ(entry: &Entry, other: &Space) -> bool {
    let size = if entry.positive { entry.value.abs() } else { entry.scale };
    (other.value(entry.key) - entry.value).abs() > ANOTHER * size
}

/// Effects start at the fit of the base model and grow or shrink to where the balances of the measured state want them:
/// equation error is nearly linear and gets there in a few steps, where the free run would take dozens. They start from
/// absence, from a typical size and from what is `known`, and the best end counts: what bends, such as hysteresis, may
/// show no way up from zero, and another effect no way down.
fn with_effects_started(
    space: &Space,
    bare: &Space,
    known: &[Assignment],
    experiments: &[Experiment],
    ctx: &Context,
) -> Result<Space> {
    let coarse: Vec<Experiment> = experiments.iter().map(Experiment::coarse).collect();
    let mut typical = space.clone();
    let Some(balances) = EquationError::new(&coarse) else {
        typical.take_scales(&typical.scales(experiments));
        return Ok(typical);
    };
    let bare = minimise(bare, &balances, Effort::ROUGH, None, ctx)?.space;
    typical.take_values(&bare);
    typical.take_scales(&typical.scales(experiments));
    let mut absent = typical.clone();
    absent.remove_sizes();
    let effort = Effort { steps: 15, tolerance: 1e-4, carried_on: 0, confirmed: true };
    let fit = |from: &Space| minimise(from, &balances, effort, None, ctx);
    let starts: Vec<Space> = [Some(absent), typical.started_at(known), Some(typical)].into_iter().flatten().collect();
    let fits: Vec<Fit> = starts.par_iter().map(fit).collect::<Result<_>>()?;
    let error = |fit: &Fit| fit.log_error(balances.groups());
    let best = fits.into_iter().min_by(|a, b| error(a).total_cmp(&error(b)));
    Ok(best.map_or_else(|| space.clone(), |best| best.space))
}
