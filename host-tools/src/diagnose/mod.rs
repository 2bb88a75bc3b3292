//! Which physical effect is missing, how sure that is, what it is confused with, and the experiment that would tell.
//!
//! 1. What the samples show before any fit ([`samples`]).
//! 2. The base model by equation error; every candidate of the catalogue by linearisation ([`screening`]); a fit of
//!    base +
//!    effect for those that promise something, all other parameters free to move ([`climb`]).
//! 3. Judgement on blocks of time held out ([`cross_validation`](crate::identify::cross_validation)), against decoys
//!    ([`decoys`]), with a correction for how many were
//!    tried, by the independence of the effect from the base parameters and by whether those stay plausible.
//! 4. Further effects one after the other, with a look back.
//! 5. All that was found once more in the free run, where each effect has to earn its place ([`audit`]).
//! 6. A second look at what single steps miss; then exchanges of what was chosen too early, and rivals
//!    ([`second_look`]).
//! 7. Whether anything is left to explain ([`completeness`]); if so, its shape ([`lead`]).

mod answer;
pub mod audit;
pub mod base;
pub mod candidates;
pub mod change;
pub mod classes;
pub mod climb;
pub mod completeness;
pub mod constancy;
pub mod criteria;
pub mod decoys;
pub mod dither;
mod fluctuation;
pub mod holds;
pub mod ladder;
pub mod lead;
pub mod odds;
pub mod orders;
mod remarks;
pub mod samples;
pub mod screening;
pub mod second_look;
pub mod shape;
pub mod sizes;
mod varying;
mod verdict;

use greyrig::effects::{EffectId, MAX_EFFECTS};

use crate::compare::{PerSignal, Signal};
use crate::context::Context;
use crate::error::{Error, Insufficient, Result, if_possible};
use crate::experiment::Experiment;
use crate::identify::minimise::Fit;
use crate::identify::space::Space;
use crate::identify::{self, Settings, identifiability, slow_sampling};
use crate::model::Kind;
use crate::recording::Recording;
use audit::Audit;
use candidates::{Candidate, InFreeRun, errors_in_free_run};
use change::Change;
use climb::Climb;
use completeness::Completeness;
use criteria::ABOVE_THE_FLOOR;
use holds::Holds;
use ladder::{Ladder, Step};
use lead::Lead;
use odds::Odds;
use remarks::Wandering;
use samples::Finding;
use second_look::SecondLook;
use shape::Shape;
use sizes::sizes;
use varying::Varying;
use verdict::{Remaining, Strained};

pub use verdict::{Verdict, VerdictKind};

/// Effects that one diagnosis adds at most.
const MOST_EFFECTS: usize = 6;

/// The result.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// The verdict.
    pub verdict: Verdict,
    /// Whether a model of all these recordings can have what is missing: not a change in the midst of a set.
    pub can_be_added: bool,
    /// Free-run error-to-signal ratio of the model as it was.
    pub esr_before: PerSignal,
    /// And with all effects found.
    pub esr_after: PerSignal,
    /// Candidates, best first, step by step.
    pub candidates: Vec<Candidate>,
    /// All candidates by what the screening promised: fall of the error, best first.
    pub screening: Vec<(EffectId, f64)>,
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
    pub exclude: Vec<EffectId>,
    /// Whether the free-run error of the best candidates is refined for a report.
    pub candidates_refined: bool,
}

impl Diagnosis {
    /// An acquittal held against the noise floor of the recordings: it was judged by what does not repeat, which a load
    /// that fluctuates raises, and so does what is missing and acts as slowly.
    #[must_use]
    pub fn held_against(mut self, floor: &PerSignal) -> Self {
        let signals = [Signal::Current, Signal::Speed];
        let over = signals.into_iter().filter_map(|signal| Some(self.esr_after.of(signal)? / floor.of(signal)?));
        let over = over.filter(|over| over.is_finite()).fold(0.0, f64::max);
        let verdict = &mut self.verdict;
        if verdict.kind == VerdictKind::None && verdict.remaining.is_none() && over > ABOVE_THE_FLOOR {
            let remaining = Remaining::above_the_sensors(over);
            verdict.text += &format!("\n{}", remaining.text);
            verdict.remaining = Some(remaining);
        }
        self
    }
}

/// Who is told how a screening ranks the candidates, from several threads: by how much each promises to lower the
/// error, best first.
pub type Ranked<'a> = dyn Fn(&[(EffectId, f64)]) + Sync + 'a;

impl Options {
    fn excludes(&self, id: EffectId) -> bool {
        self.exclude.contains(&id)
    }
}

/// Diagnoses a model on recordings.
///
/// # Errors
/// Recordings that cannot be used, an interrupt.
///
/// # Examples
/// ```
/// use greyrig_host::{context::Context, diagnose::{Options, diagnose}, identify::Settings, model::Kind, rig::Setup};
///
/// // Brushes that take a voltage, of which the model does not know.
/// let recording = Setup::new(Kind::PmDc).effect("brush_drop")?.seconds(6.0).seed(1).run()?.recording;
/// let options = Options { settings: Settings::new(Kind::PmDc), exclude: Vec::new(), candidates_refined: false };
/// let verdict = diagnose(&[recording], &options, &Context::quiet())?.verdict;
/// println!("{:?} {:?}: {}", verdict.kind, verdict.effects, verdict.text);
/// assert!(!verdict.effects.is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn diagnose(recordings: &[Recording], options: &Options, ctx: &Context) -> Result<Diagnosis> {
    diagnose_telling(recordings, options, ctx, &|_| ())
}

/// The same, with somebody who is told how the screenings rank the candidates, long before the verdict.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_telling(
    recordings: &[Recording],
    options: &Options,
    ctx: &Context,
    ranked: &Ranked<'_>,
) -> Result<Diagnosis> {
    ctx.install(|| diagnosed(recordings, options, None, ctx, ranked))
}

/// `beside` is a motor with its first effect that the same recordings have told before, with which slow samples are
/// asked again.
fn diagnosed(
    recordings: &[Recording],
    options: &Options,
    beside: Option<&Space>,
    ctx: &Context,
    ranked: &Ranked<'_>,
) -> Result<Diagnosis> {
    ctx.doing("reading");
    let recordings = &samples::without_clipped(recordings);
    let mut full: Vec<Experiment> = identify::prepare(recordings, &options.settings.filter, &options.settings.chain)?;
    let mut settings = options.settings.clone();
    // A sensor without a sign is a matter of the data: it is part of what is fitted, and no effect that is missing.
    let has = settings.effects.contains(&samples::SIGN_LOST) || options.excludes(samples::SIGN_LOST);
    if settings.kind == Kind::PmDc && !has && full.iter().any(samples::sign_lost) {
        settings.effects.push(samples::SIGN_LOST);
    }
    let settings = &settings;
    let clean = dither::add(&mut full);
    let mut findings = samples::look(&full);
    findings.retain(|f| !options.excludes(f.id) && !settings.effects.contains(&f.id));
    // A line that follows the rotor is seen long before it matters: named only where there is nothing else.
    let (lines, findings): (Vec<Finding>, Vec<Finding>) = findings.into_iter().partition(Finding::is_line);
    let mut space = identify::build_space(settings)?;
    match identifiability::check_excitation(&full) {
        Err(Error::Insufficient { cause, .. }) => return Ok(insufficient(&cause)),
        other => other?,
    }
    let unasked = slow_sampling::is_slow(&full).then(|| full.clone());
    let known = space.started_at(&settings.known);
    let whole = beside.or(known.as_ref());
    let out_of_reach = slow_sampling::prepare(&mut space, &mut full, settings.course, whole, &ctx.quietly())?;
    let coarse = base::start(&mut space, &full)?;

    let holds = Holds { inductance: out_of_reach.is_none(), ..Holds::of(&full) };
    let known: Vec<EffectId> = space.effects().to_vec();
    let left_out = |id: EffectId| options.excludes(id) || known.contains(&id) || findings.iter().any(|f| f.id == id);
    let candidates = screening::candidates(settings.kind, holds, left_out);
    let most = MOST_EFFECTS.min(MAX_EFFECTS - known.len());
    let Some(climb) = Climb::new(&coarse, candidates, most, ctx).map(|climb| climb.ranked_to(ranked)) else {
        return Ok(insufficient(&Insufficient::NeitherSide));
    };
    let base = climb.fit_from_what_is_known(&space, &settings.known)?;
    let free_run = match climb.is_of_whole_motor() {
        true => if_possible(Audit::new(&coarse, &base.space, ctx))?,
        false => None,
    };
    let unasked = unasked.filter(|_| beside.is_none() && settings.course.is_none());
    let first = unasked.as_ref().map(|_| climb.first_step(&base)).transpose()?;
    // The first effect alone: later ones may stand for what the wrong course leaves.
    if let (Some(unasked), Some(audit), Some(tried)) = (unasked, &free_run, first.as_ref().and_then(Step::winner)) {
        let with_first = audit.fit(&tried.fit.space)?.space;
        let otherwise = slow_sampling::tells_otherwise(&with_first, unasked, &full, &ctx.quietly())?;
        if otherwise.course_or_inductance || otherwise.gain {
            return diagnosed(recordings, options, Some(&with_first), ctx, ranked);
        }
    }
    let Searched { ladder, in_free_run, wandering, errors } =
        search(&climb, free_run.as_ref(), &base, first, &space, options)?;
    let alone = ladder.found.is_empty() && findings.is_empty();
    if alone && let Some(reason) = base::hidden_dry_friction(&climb, &base, &space) {
        return Ok(insufficient(&reason));
    }
    let fitted = in_free_run.as_ref().filter(|_| !ladder.found.is_empty()).map(|[_, with]| with);
    let space = fitted.map_or(&ladder.fit.space, |fit| &fit.space);
    let varies = climb.varies(&ladder.fit, &ladder);
    let is_a_form = varies.as_ref().is_some_and(|varies| varies.explains && varies.of_law().is_some());
    let by_a_law = ladder.is_explained() || is_a_form && !ladder.found.is_empty();
    let load = match !by_a_law && ladder.is_explained_but_for_the_load() {
        true => climb.fluctuation(&ladder.fit),
        false => None,
    };
    let explained = by_a_law || load.is_some();
    let by_what_it_has = match (&free_run, &in_free_run) {
        (Some(audit), Some([with, _])) if alone && !explained => {
            explained_by_what_it_has(&climb, audit, &base, with, &ladder)?
        }
        _ => false,
    };
    let strained = Strained::among(&ladder, holds, space, explained);
    let (left, varies) = match &strained {
        Some(strained) => {
            let without = climb.fit(&ladder.fit.space.without_effect(strained.effect))?;
            let varies = climb.varies(&without, &ladder);
            (without, varies)
        }
        None => (ladder.fit.clone(), varies),
    };
    let lead = climb.lead(&left);
    let sizes = match (&free_run, fitted) {
        (Some(audit), Some(fit)) => sizes(&ladder.found, &fit.space, &audit.intervals(fit), settings, recordings),
        _ => sizes(&ladder.found, &ladder.fit.space, &climb.intervals(&ladder.fit), settings, recordings),
    };
    ctx.doing("candidates");
    let errors = match &free_run {
        Some(audit) => errors_in_free_run(&ladder.steps, audit, options, &errors)?,
        None => errors,
    };
    let seen = if alone { &lines } else { &findings };
    let both = free_run.as_ref().zip(in_free_run.as_ref());
    let varying = Varying {
        climb: &climb,
        in_free_run: both,
        base: &base,
        ladder: &ladder,
        alone,
        samples_are_clean: findings.is_empty(),
        by_what_it_has,
        is_strained: strained.is_some(),
    };
    let (varies, mut verdict) = varying.decide(varies, || {
        verdict::judge(&ladder, explained, seen, &lead, strained.as_ref(), sizes, holds).but_for(&options.exclude)
    })?;
    // A change that a model can have is fitted like any other effect.
    let mut change =
        varies.as_ref().filter(|_| verdict.is_of_a_change()).and_then(|varies| Change::of(varies, &coarse));
    let with_change = match (&mut change, both) {
        (Some(change), Some((audit, [free, _]))) if change.is_of_one_recording => {
            Some(change.fit(&free.space, audit, &coarse)?)
        }
        _ => None,
    };
    let stands = matches!(verdict.kind, VerdictKind::MissingEffect | VerdictKind::Ambiguous);
    let over = ladder.free_run.filter(|_| stands && ladder.leaves_more_than_healthy()).map(|(_, over)| over);
    let motion = recordings[0].motion();
    verdict.remaining = match verdict.kind {
        VerdictKind::InsufficientData => None,
        kind => load.filter(|_| varies.is_none()).map_or_else(
            || {
                Remaining::beside(
                    kind,
                    varies.as_ref().map(|v| (v, v.key.unit(settings.kind, motion))),
                    over.as_ref(),
                    wandering,
                    by_what_it_has.then_some(&ladder.after),
                )
            },
            |load| Some(Remaining::load(&load, ladder.after.mechanical)),
        ),
    };
    if let Some(remaining) = &verdict.remaining {
        verdict.text += &format!("\n{}", remaining.text);
    }
    let odds = Odds::of(&verdict, &ladder, &base, &climb)?;
    let mut candidates = candidates::describe(&ladder, &odds, &errors, options, recordings);
    verdict.probability = odds.verdict;
    let known = change.as_ref().zip(varies.as_ref());
    let changed = known.map(|(change, varies)| {
        change.as_candidate(
            varies,
            with_change.as_ref().zip(free_run.as_ref()),
            &base.space,
            &coarse,
            settings,
            recordings,
        )
    });
    if let Some(candidate) = changed {
        // What changes is what is missing, and nothing that is left besides.
        verdict.remaining = None;
        verdict.sizes.clone_from(&candidate.parameters);
        verdict.probability = candidate.probability;
        if change.as_ref().is_some_and(|change| !change.is_of_one_recording) {
            verdict.text += change::SEVERAL;
        }
        candidates.insert(0, candidate);
    }
    if !alone {
        lines.iter().for_each(|line| verdict.text += &format!("\nbesides, {}", line.text));
    }
    let remarks = [
        remarks::standstill(verdict.kind, holds),
        remarks::held_voltage(&ladder.fit.space, &ladder.found, &full),
        remarks::flux(space, &ladder.found, &full),
        wandering
            .filter(|_| verdict.kind == VerdictKind::OutsideCatalogue)
            .and_then(|wandering| remarks::wandering(verdict.kind, wandering)),
    ];
    remarks.iter().flatten().for_each(|line| verdict.text += &format!("\n{line}"));
    out_of_reach.iter().for_each(|weakness| verdict.text += &format!("\n{}", weakness.text));
    // A change in time has no shape over current and speed.
    let in_time = varies.as_ref().is_some_and(|varies| varies.of_law().is_none());
    let is_outside = verdict.kind == VerdictKind::OutsideCatalogue && !in_time;
    let shape = is_outside.then(|| climb.shape(&left, &ladder.floor)).flatten();
    let [esr_before, esr_after] = both.map_or([PerSignal::default(); 2], |(audit, [free, with])| {
        [free, with_change.as_ref().unwrap_or(with)].map(|fit| audit.ratio(fit.rms))
    });
    // Blocks held out are not refitted once the work is to stop: what has come of it is no diagnosis.
    ctx.check()?;
    Ok(Diagnosis {
        can_be_added: change.map_or(!verdict.is_of_a_change(), |change| change.is_of_one_recording),
        verdict,
        esr_before,
        esr_after,
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

/// Whether the effects of the model as it was, `base` by the balances and `with` in the free run, explain nearly all
/// that the motor would leave without them, where nothing was found beside them.
fn explained_by_what_it_has(
    climb: &Climb<'_>,
    audit: &Audit<'_>,
    base: &Fit,
    with: &Fit,
    ladder: &Ladder,
) -> Result<bool> {
    // A part of the sensor is no law of the motor.
    let known: Vec<EffectId> = base.space.effects().iter().copied().filter(|id| !id.description().of_data).collect();
    if known.is_empty() {
        return Ok(false);
    }
    let bare = climb.fit(&known.iter().fold(base.space.clone(), |space, id| space.without_effect(*id)))?;
    let free = audit.fit(&bare.space)?;
    let before = Completeness::of(&bare, &ladder.floor);
    Ok(ladder.is_explained_by(&known, before, &audit.completeness_of_both(&free, with)))
}

/// What was found, and what the free run makes of it, where there is one.
struct Searched {
    ladder: Ladder,
    /// The fits of the free run, without and with all effects.
    in_free_run: Option<[Fit; 2]>,
    /// How its speed wanders.
    wandering: Option<Wandering>,
    /// Errors of candidates, as far as they are known.
    errors: Vec<InFreeRun>,
}

/// Looks for effects beside the base model, by the balances and then by the free run.
fn search(
    climb: &Climb<'_>,
    free_run: Option<&Audit<'_>>,
    base: &Fit,
    first: Option<Step>,
    start: &Space,
    options: &Options,
) -> Result<Searched> {
    let (ladder, look) = rayon::join(
        || climb.climb(base, first),
        || free_run.map(|audit| SecondLook::new(climb, audit, base, start)).transpose(),
    );
    let (mut ladder, look) = (ladder?, look?);
    climb.context().doing("free run");
    let (Some(audit), Some(look)) = (free_run, &look) else {
        climb.find_rivals(&mut ladder)?;
        return Ok(Searched { ladder, in_free_run: None, wandering: None, errors: Vec::new() });
    };
    // Fits for the report fill the pauses of the search, which goes step by step.
    let tried = ladder.steps.clone();
    let (judged, errors) = rayon::join(|| look.at(ladder), || errors_in_free_run(&tried, audit, options, &[]));
    let (ladder, kept) = judged?;
    let wandering = Some(Wandering { times: audit.wandering(&kept), comes_back: audit.comes_back(&kept) });
    Ok(Searched { ladder, in_free_run: Some([look.free().clone(), kept]), wandering, errors: errors? })
}

fn insufficient(reason: &Insufficient) -> Diagnosis {
    Diagnosis {
        verdict: Verdict::insufficient(reason),
        can_be_added: true,
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

/// Findings of the samples as effects.
fn ids(findings: &[Finding]) -> Vec<EffectId> {
    findings.iter().map(|f| f.id).collect()
}
