//! Which physical effect is missing, how sure that is, what it is confused with, and the experiment that would tell.
//!
//! 1. What the samples show before any fit ([`samples`]).
//! 2. The base model by equation error; every candidate of the catalogue by linearisation ([`screening`]); a fit of base +
//!    effect for those that promise something, all other parameters free to move ([`climb`]).
//! 3. Judgement on blocks of time held out ([`blocks`]), against decoys ([`decoys`]), with a correction for how many were
//!    tried, by the independence of the effect from the base parameters and by whether those stay plausible.
//! 4. Further effects one after the other, with a look back.
//! 5. All that was found once more in the free run, where each effect has to earn its place ([`audit`]).
//! 6. A second look at what single steps miss; then rivals, by swapping ([`second_look`]).
//! 7. Whether anything is left to explain ([`completeness`]); if so, its shape ([`lead`]).

pub mod audit;
pub mod blocks;
pub mod classes;
pub mod climb;
pub mod completeness;
pub mod decoys;
pub mod dither;
pub mod ladder;
pub mod lead;
pub mod orders;
mod remarks;
pub mod samples;
pub mod screening;
pub mod second_look;
pub mod shape;
mod verdict;

use std::collections::BTreeMap;
use std::sync::Arc;

use greyrig::effects::{Effect, MAX_EFFECTS};
use rayon::prelude::*;
use serde::Serialize;

use crate::compare::PerSignal;
use crate::error::{Error, Result};
use crate::experiment::{Drive, Experiment};
use crate::identify::minimise::{Effort, Refined};
use crate::identify::scales::Scales;
use crate::identify::space::{Freedom, Space};
use crate::identify::{self, Settings, identifiability, regression};
use crate::model::unit;
use crate::recording::Recording;
use audit::Audit;
use climb::Climb;
use completeness::Completeness;
use ladder::{Ladder, Objection, Step, Tried};
use lead::Lead;
use samples::Finding;
use screening::Holds;
use second_look::SecondLook;
use shape::Shape;

pub use verdict::{Verdict, VerdictKind};

/// Effects that one diagnosis adds at most.
const MOST_EFFECTS: usize = 6;
/// Candidates whose free-run error is refined for the report.
const REFINED: usize = 3;

/// A parameter of a candidate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Size {
    /// Name.
    pub name: String,
    /// Value, SI.
    pub value: f64,
    /// Unit.
    pub unit: String,
    /// 95 % interval, for what was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ci95: Option<[f64; 2]>,
}

/// A candidate that was fitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// The effect.
    pub effect: &'static str,
    /// Free-run error-to-signal ratio with it (after the effects found before it).
    pub esr_after: PerSignal,
    /// By how much the error on data held out falls: 0.9 is 90 %.
    pub held_out_gain: f64,
    /// p-value, corrected for the number of candidates tried.
    pub p_value: f64,
    /// Its parameters.
    pub parameters: Vec<Size>,
    /// Effects that look alike.
    pub confused_with: Vec<&'static str>,
    /// Why it does not count, in words; `None`: it does.
    pub objection: Option<&'static str>,
    /// The step of the diagnosis in which it was tried, from 1.
    pub step: usize,
}

/// The result.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// The verdict.
    pub verdict: Verdict,
    /// Free-run error-to-signal ratio of the model as it was.
    pub esr_before: PerSignal,
    /// And with all effects found.
    pub esr_after: PerSignal,
    /// Candidates, best first, step by step.
    pub candidates: Vec<Candidate>,
    /// All candidates by what the screening promised: fall of the error, best first.
    pub screening: Vec<(&'static str, f64)>,
    /// Residual over what does not repeat, before and after.
    pub completeness: Option<(Completeness, Completeness)>,
    /// What generic terms make of the rest.
    pub lead: Lead,
    /// The shape of the rest, where no effect explains it.
    pub shape: Option<Shape>,
    /// Best gain of a decoy.
    pub decoy_gain: f64,
    /// Decoys tried, and how many of them would have been accepted by what they gain.
    pub decoys: [usize; 2],
    /// Channels that are cleaner than the model can be, and got noise ([`dither`]).
    pub clean: Vec<&'static str>,
}

/// What the user chooses.
#[derive(Debug, Clone)]
pub struct Options {
    /// Kind of motor, base and effects that the model has already.
    pub settings: Settings,
    /// Effects that are not to be tried.
    pub exclude: Vec<String>,
    /// Whether the free-run error of the best candidates is refined for a report.
    pub candidates_refined: bool,
}

/// What a diagnosis is at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Progress<'a> {
    /// A step, in a word or two.
    Doing(&'a str),
    /// A screening has ranked the candidates: by how much each promises to lower the error, best first.
    Ranking(&'a [(&'static str, f64)]),
}

/// Who is told what a diagnosis is at, from several threads.
pub type Watch<'a> = dyn Fn(Progress<'_>) + Sync + 'a;

/// Diagnoses a model on recordings.
///
/// # Errors
/// Recordings that cannot be used, an unknown effect in `exclude`, an interrupt.
pub fn diagnose(recordings: &[Recording], options: &Options, progress: &Watch<'_>) -> Result<Diagnosis> {
    let settings = &options.settings;
    for id in &options.exclude {
        if Effect::<f64>::CATALOGUE.iter().all(|d| d.id != id) {
            return Err(Error::usage(format!("there is no effect {id}"), "`greyrig effects` lists them"));
        }
    }
    let excluded = |id: &str| options.exclude.iter().any(|e| e == id);
    progress(Progress::Doing("reading"));
    let recordings = &samples::without_clipped(recordings);
    let mut full: Vec<Experiment> = identify::prepare(recordings, &settings.filter)?;
    let clean = dither::add(&mut full);
    let mut findings = samples::look(recordings, &full, settings.kind);
    findings.retain(|f| !excluded(f.id) && !settings.effects.iter().any(|e| e == f.id));
    // A line that follows the rotor is seen long before it matters: named only where there is nothing else.
    let (lines, findings): (Vec<Finding>, Vec<Finding>) = findings.into_iter().partition(Finding::is_line);
    let coarse: Vec<Experiment> = full.iter().map(Experiment::coarse).collect();
    let mut space = identify::build_space(settings)?;
    if let Err(error) = identifiability::check_excitation(&full) {
        return Ok(insufficient(&error.to_string()));
    }
    start(&mut space, &full, &coarse)?;

    let holds = Holds::of(&full);
    let known: Vec<&'static str> = space.effects().to_vec();
    let candidates: Vec<_> = screening::candidates(settings.kind, holds)
        .filter(|d| !excluded(d.id) && !known.contains(&d.id) && findings.iter().all(|f| f.id != d.id))
        .collect();
    let most = MOST_EFFECTS.min(MAX_EFFECTS - known.len());
    let Some(climb) = Climb::new(&coarse, candidates, most) else {
        return Ok(insufficient("these recordings hold neither voltage and current nor torque and motion"));
    };
    let base = climb.fit(&space)?;
    let free_run = if climb.is_of_whole_motor() { Audit::new(&coarse, &base.space).ok() } else { None };
    let (ladder, look) = rayon::join(
        || climb.climb(&base, progress),
        || free_run.as_ref().map(|audit| SecondLook::new(&climb, audit, &base)).transpose(),
    );
    let (mut ladder, look) = (ladder?, look?);
    progress(Progress::Doing("free run"));
    let mut esr = [PerSignal::default(); 2];
    let mut fitted = None;
    let mut errors = Vec::new();
    if let (Some(audit), Some(look)) = (&free_run, &look) {
        // Fits for the report fill the pauses of the search, which goes step by step.
        let tried = ladder.steps.clone();
        let (looked, shown) =
            rayon::join(|| look.at(ladder, progress), || errors_in_free_run(&tried, audit, options, &[]));
        let (judged, kept) = looked?;
        errors = shown?;
        ladder = judged;
        esr = [look.free(), &kept].map(|fit| ratio(audit, fit));
        fitted = (!ladder.found.is_empty()).then_some(kept);
    } else {
        climb.find_rivals(&mut ladder, progress)?;
    }
    if ladder.found.is_empty()
        && findings.is_empty()
        && let Some(reason) = hidden_dry_friction(&climb, &base, &space)
    {
        return Ok(insufficient(&reason));
    }
    let lead = climb.lead(&ladder.fit);
    let sizes = match (&free_run, &fitted) {
        (Some(audit), Some(fit)) => sizes(&ladder.found, &fit.space, &audit.intervals(fit), settings, recordings),
        _ => sizes(&ladder.found, &ladder.fit.space, &climb.intervals(&ladder.fit), settings, recordings),
    };
    progress(Progress::Doing("candidates"));
    if let Some(audit) = &free_run {
        errors = errors_in_free_run(&ladder.steps, audit, options, &errors)?;
    }
    let candidates = describe_candidates(&ladder, &errors, options, recordings);
    let alone = ladder.found.is_empty() && findings.is_empty();
    let mut verdict = verdict::judge(&ladder, if alone { &lines } else { &findings }, &lead, sizes, holds);
    if !alone {
        lines.iter().for_each(|line| verdict.text += &format!("\nbesides, {}", line.text));
    }
    let fit = fitted.as_ref().map_or(&ladder.fit.space, |fit| &fit.space);
    let remarks =
        [remarks::held_voltage(&ladder.fit.space, &ladder.found, &full), remarks::flux(fit, &ladder.found, &full)];
    remarks.iter().flatten().for_each(|line| verdict.text += &format!("\n{line}"));
    let shape = (verdict.kind == VerdictKind::OutsideCatalogue).then(|| climb.shape(&ladder)).flatten();
    Ok(Diagnosis {
        verdict,
        esr_before: esr[0],
        esr_after: esr[1],
        candidates,
        screening: ladder.steps.first().map_or_else(Vec::new, |s| s.promises.clone()),
        completeness: Some((ladder.before, ladder.after)),
        lead,
        shape,
        decoy_gain: ladder.steps.iter().map(|s| s.decoy_gain).fold(0.0, f64::max),
        decoys: ladder.steps.iter().fold([0, 0], |sum, s| [sum[0] + s.decoys[0], sum[1] + s.decoys[1]]),
        clean,
    })
}

/// Free-run error-to-signal ratios, current and speed, of a model that has been fitted to recordings.
///
/// # Errors
/// Recordings that cannot be used, an interrupt.
pub fn base_error(recordings: &[Recording], settings: &Settings) -> Result<[f64; 2]> {
    let full = identify::prepare(recordings, &settings.filter)?;
    let coarse: Vec<Experiment> = full.iter().map(Experiment::coarse).collect();
    let mut space = identify::build_space(settings)?;
    start(&mut space, &full, &coarse)?;
    let audit = Audit::new(&coarse, &space)?;
    let esr = ratio(&audit, &audit.fit(&space)?);
    Ok([esr.current.unwrap_or(0.0), esr.speed.unwrap_or(0.0)])
}

/// Start values of the base model, and what these recordings cannot hold taken out of it.
pub(crate) fn start(space: &mut Space, full: &[Experiment], coarse: &[Experiment]) -> Result<()> {
    if full.iter().all(|e| e.drive == Drive::Torque) {
        space.hold(&["R", "L", "K"], Freedom::Absent);
        space.take_scales(&Scales::of(space, coarse));
        return Ok(());
    }
    if full.iter().all(|e| e.current.is_none()) {
        // Without a current R is a unit of torque, and viscous friction counts to K: what is found does not depend on it.
        space.hold(&["mu1"], Freedom::Pinned);
        for name in ["R", "L"] {
            if space.get(name).is_some_and(|e| matches!(e.freedom, Freedom::Free(_))) {
                space.hold(&[name], Freedom::Fixed);
                if let Some(entry) = space.get_mut(name) {
                    entry.value = if name == "R" { 1.0 } else { 1e-6 };
                }
            }
        }
    }
    identifiability::missing_channels(space, full)?;
    space.take_typical_values();
    regression::start_values(space, coarse);
    space.take_scales(&Scales::of(space, coarse));
    Ok(())
}

/// Least part of its column that dry friction has to have for itself.
const VISIBLE_FRICTION: f64 = 0.05;

/// Every motor has dry friction: where the base model lacks it and the recordings could not show it, they cannot acquit.
fn hidden_dry_friction(climb: &Climb<'_>, base: &Refined, space: &Space) -> Option<String> {
    if space.get("mu0").is_some_and(|e| e.freedom != Freedom::Absent) {
        return None;
    }
    let d = Effect::<f64>::CATALOGUE.iter().find(|d| d.id == "coulomb_friction")?;
    let own = climb.independence(base, d).unwrap_or(0.0);
    (own < VISIBLE_FRICTION).then(|| {
        format!(
            "the model has no dry friction, and only {:.1} % of what dry friction would do here is not what the back-EMF and the \
             inertia do already",
            100.0 * own
        )
    })
}

fn insufficient(reason: &str) -> Diagnosis {
    Diagnosis {
        verdict: Verdict::insufficient(reason),
        esr_before: PerSignal::default(),
        esr_after: PerSignal::default(),
        candidates: Vec::new(),
        screening: Vec::new(),
        completeness: None,
        lead: Lead::default(),
        shape: None,
        decoy_gain: 0.0,
        decoys: [0, 0],
        clean: Vec::new(),
    }
}

fn ratio(audit: &Audit<'_>, fit: &Refined) -> PerSignal {
    ratios(audit, fit.rms)
}

fn ratios(audit: &Audit<'_>, rms: [f64; 2]) -> PerSignal {
    let (signal, has) = (audit.signals(), audit.has());
    let of = |g: usize| (has[g] && signal[g] > 0.0).then(|| rms[g] / signal[g]).filter(|r| r.is_finite());
    PerSignal { current: of(0), speed: of(1), torque: None }
}

/// The fit of a candidate by the balances, and its error in the free run.
type InFreeRun = (Arc<Refined>, PerSignal);

/// Errors in the free run of the candidates of all steps, for the report: refined where it matters, for the others at the
/// estimate by the balances. What is `known` is not computed again.
fn errors_in_free_run(
    steps: &[Step],
    audit: &Audit<'_>,
    options: &Options,
    known: &[InFreeRun],
) -> Result<Vec<InFreeRun>> {
    if !options.candidates_refined {
        return Ok(Vec::new());
    }
    let error = |(step, place, t): (usize, usize, &Tried)| {
        let error = match error_of(t, known) {
            Some(error) => error,
            None if step == 0 && place < REFINED && t.objection.is_none() => {
                ratio(audit, &audit.fit_with(&t.fit.space, Effort::ESTIMATE)?)
            }
            None => ratios(audit, audit.error_at(&t.fit.space)),
        };
        Ok((Arc::clone(&t.fit), error))
    };
    let steps = steps.iter().enumerate();
    let tried = steps.flat_map(|(step, s)| s.tried.iter().enumerate().map(move |(place, t)| (step, place, t)));
    tried.collect::<Vec<_>>().into_par_iter().map(error).collect()
}

fn error_of(tried: &Tried, known: &[InFreeRun]) -> Option<PerSignal> {
    known.iter().find(|(fit, _)| Arc::ptr_eq(fit, &tried.fit)).map(|(_, error)| *error)
}

fn describe_candidates(
    ladder: &Ladder,
    errors: &[InFreeRun],
    options: &Options,
    recordings: &[Recording],
) -> Vec<Candidate> {
    let steps = ladder.steps.iter().enumerate();
    let tried = steps.flat_map(|(step, s)| s.tried.iter().map(move |t| (step, t)));
    let describe = |(step, t): (usize, &Tried)| {
        let esr_after = error_of(t, errors).unwrap_or_default();
        candidate(t, step + 1, esr_after, &options.settings, recordings)
    };
    tried.map(describe).collect()
}

fn candidate(
    tried: &Tried,
    step: usize,
    esr_after: PerSignal,
    settings: &Settings,
    recordings: &[Recording],
) -> Candidate {
    let description = Effect::<f64>::CATALOGUE.iter().find(|d| d.id == tried.id);
    Candidate {
        effect: tried.id,
        esr_after,
        held_out_gain: 1.0 - (-0.5 * tried.gain).exp(),
        p_value: tried.p_value,
        parameters: sizes(&[tried.id], &tried.fit.space, &BTreeMap::new(), settings, recordings),
        confused_with: description.map_or_else(Vec::new, |d| d.confused_with.to_vec()),
        objection: tried.objection.map(Objection::words),
        step,
    }
}

/// The parameters of effects with their intervals, as far as these are known.
fn sizes(
    ids: &[&'static str],
    space: &Space,
    intervals: &BTreeMap<String, [f64; 2]>,
    settings: &Settings,
    recordings: &[Recording],
) -> Vec<Size> {
    ids.iter()
        .filter_map(|id| Effect::<f64>::CATALOGUE.iter().find(|d| d.id == *id))
        .flat_map(|d| d.parameters)
        .map(|p| Size {
            name: p.name.to_owned(),
            value: space.value(p.name),
            unit: unit(p.name, settings.kind, recordings[0].motion).to_owned(),
            ci95: intervals.get(p.name).copied(),
        })
        .collect()
}

/// Findings of the samples as effects.
fn ids(findings: &[Finding]) -> Vec<&'static str> {
    findings.iter().map(|f| f.id).collect()
}

/// Number of parameters of an effect.
fn parameters_of(id: &str) -> usize {
    Effect::<f64>::CATALOGUE.iter().find(|d| d.id == id).map_or(0, |d| d.parameters.len())
}

/// Name of the size of an effect.
pub(crate) fn size_of(id: &str) -> &'static str {
    Effect::<f64>::CATALOGUE.iter().find(|d| d.id == id).map_or("", |d| d.parameters[0].name)
}
