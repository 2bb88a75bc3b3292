//! Is there really nothing else? From what size on the user's own recordings would have revealed each effect.
//!
//! Each effect of the catalogue that the model lacks is put into the recordings at a known size,
//! ```text
//! i' = i + (i_with − i_without)      ω' = ω + (ω_with − ω_without)
//! ```
//! where both free runs of the model, unfiltered and at the recording's rate, differ by the effect alone. The noise,
//! the turbulence of the load and all else that the rig did stay as they are. Diagnosis makes one step on that. The
//! smallest size at which it names the effect, or one of its class, is found by bisection over a geometric grid.
//!
//! What diagnosis finds in the recordings as they are is taken into the model before. An effect that the balances show
//! there and the free run does not confirm would win every step: it is left out, and named.

use greyrig::effects::{Description, EffectId, MAX_EFFECTS, Seen};
use greyrig::motor::Motor;
use rayon::prelude::*;
use serde::Serialize;

use crate::compare::{PerSignal, compare};
use crate::context::{Context, Steps};
use crate::diagnose::climb::Climb;
use crate::diagnose::holds::Holds;
use crate::diagnose::ladder::{Objection, Step};
use crate::diagnose::screening;
use crate::diagnose::{self, VerdictKind, classes, dither, samples};
use crate::error::{Error, Insufficient, Result};
use crate::experiment::{Drive, Experiment, Imposed};
use crate::identify::minimise::Fit;
use crate::identify::scales::Scales;
use crate::identify::space::{Key, Space};
use crate::identify::{self, Settings, identifiability, slow_sampling};
use crate::model::{Kind, Model};
use crate::recording::{Motion, Recording};

/// Sizes are 2^(k/2) typical sizes, from the first k to the last one: 1/64 to 4.
const GRID: (i32, i32) = (-12, 4);

/// Share of an effect that the model's parameters leave over, below which they do the same.
const SAME: f64 = 1e-5;

/// Tries for one effect at most: the typical size, then four bisections.
const MOST_TRIES: u64 = 5;

/// What one effect would have done.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Challenged {
    /// The effect.
    pub effect: EffectId,
    /// The field's name of it.
    pub name: &'static str,
    /// The parameter that is its size.
    pub parameter: &'static str,
    /// Unit of its size.
    pub unit: &'static str,
    /// Smallest size at which diagnosis names it.
    pub revealed_from: Option<f64>,
    /// Largest size tried at which it does not.
    pub hidden_up_to: Option<f64>,
    /// What the smallest revealed size adds to the free-run error-to-signal ratio; where none is revealed, the largest
    /// one.
    pub esr: PerSignal,
    /// The effect that diagnosis names at the largest hidden size instead.
    pub mistaken_for: Option<EffectId>,
    /// Why diagnosis does not name it there.
    pub objection: Option<&'static str>,
}

/// An effect that cannot be challenged with these recordings, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutOfReach {
    /// The effect.
    pub effect: EffectId,
    /// The field's name of it.
    pub name: &'static str,
    /// Whether no recording of voltage, current and speed could show it.
    pub invisible: bool,
    /// What it takes instead, in words.
    pub text: String,
}

/// The result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Challenge {
    /// Free-run error-to-signal ratio of the model as it is.
    pub esr: PerSignal,
    /// What diagnosis finds without any challenge; the challenged model has it.
    pub found: Vec<EffectId>,
    /// Whether structure is left that no effect of the catalogue explains: what follows is then pessimistic.
    pub unexplained: bool,
    /// Effect by effect, in the order of the catalogue.
    pub effects: Vec<Challenged>,
    /// The others.
    pub out_of_reach: Vec<OutOfReach>,
}

/// Challenges a model and its recordings with the named effects, or with all.
///
/// # Errors
/// A model or recordings that cannot be used, an effect that the model has, an interrupt.
pub fn challenge(recordings: &[Recording], model: &Model, effects: &[EffectId], ctx: &Context) -> Result<Challenge> {
    ctx.install(|| challenged(recordings, model, effects, ctx))
}

fn challenged(recordings: &[Recording], model: &Model, effects: &[EffectId], ctx: &Context) -> Result<Challenge> {
    check_room(model, effects)?;
    let esr = compare(model, recordings, ctx)?.esr;
    let recordings = samples::without_clipped(recordings);
    let mut full = identify::prepare(&recordings, &model.filter, &model.chain)?;
    dither::add(&mut full);
    identifiability::check_excitation(&full)?;
    let mut settings = Settings::of_model(model);
    if full.iter().any(|e| e.drive == Drive::Torque) {
        // The torque acts as the current of a motor with magnets and K = 1.
        settings.kind = Kind::PmDc;
    }
    let (found, unexplained) = unchallenged(&recordings, &settings, ctx)?;
    let rig = Rig::new(&full, model, &settings, &found, recordings[0].motion(), ctx)?;
    let wanted = Description::all().filter(|d| {
        let named = effects.contains(&d.id);
        !rig.space.effects().contains(&d.id) && (named || (effects.is_empty() && d.fits(settings.kind.flux_law())))
    });
    let (inside, outside): (Vec<&'static Description>, Vec<_>) = wanted.partition(|d| rig.challenging.contains(&d.id));
    let holds = Holds::of(&full);
    let steps = ctx.steps("challenge", MOST_TRIES * inside.len() as u64);
    Ok(Challenge {
        esr,
        found,
        unexplained,
        effects: inside.par_iter().map(|d| rig.search(d, &steps)).collect::<Result<_>>()?,
        out_of_reach: outside
            .into_iter()
            .map(|d| out_of_reach(d, settings.kind, holds, rig.unconfirmed.contains(&d.id)))
            .collect(),
    })
}

fn check_room(model: &Model, effects: &[EffectId]) -> Result<()> {
    for id in effects {
        if model.effects.iter().any(|e| e.id == *id) {
            return Err(Error::usage(format!("the model has {id} already"), "challenge it with another effect"));
        }
    }
    if model.effects.len() >= MAX_EFFECTS {
        return Err(Error::usage(
            format!("the model has {MAX_EFFECTS} effects, and no room for another one"),
            "challenge a model with fewer",
        ));
    }
    Ok(())
}

/// What diagnosis finds in the recordings as they are, and whether structure is left that no effect explains.
fn unchallenged(recordings: &[Recording], settings: &Settings, ctx: &Context) -> Result<(Vec<EffectId>, bool)> {
    let options = diagnose::Options { settings: settings.clone(), exclude: Vec::new(), candidates_refined: false };
    let verdict = diagnose::diagnose(recordings, &options, &ctx.quietly())?.verdict;
    let mut found = verdict.effects;
    if verdict.kind == VerdictKind::Ambiguous {
        // The others are rivals of the first, not further effects.
        found.truncate(1);
    }
    found.retain(|id| id.description().seen_with(settings.kind.flux_law()) == Seen::FreeRun);
    found.truncate(MAX_EFFECTS - 1 - settings.effects.len());
    Ok((found, verdict.kind == VerdictKind::OutsideCatalogue))
}

fn out_of_reach(d: &Description, kind: Kind, holds: Holds, unconfirmed: bool) -> OutOfReach {
    let seen = d.seen_with(kind.flux_law());
    let text = match seen {
        _ if unconfirmed => "the balances show it in the recordings as they are, and the free run does not".to_owned(),
        Seen::Invisible(needed) | Seen::InvisibleInSeries(needed) => {
            format!("no recording of voltage, current and speed shows it; it takes {needed}")
        }
        _ if !d.fits(kind.flux_law()) => "a motor with magnets cannot have it".to_owned(),
        _ if d.of_data => "it shows in the samples themselves, before any fit".to_owned(),
        Seen::Variance => "it shows in the variance of the residual, not in its mean".to_owned(),
        Seen::Orders => "it shows in lines at multiples of the rotation, above the filter".to_owned(),
        Seen::Course => "it is looked for in what changes from an instant on".to_owned(),
        Seen::Samples => "it shows in the samples themselves, before any fit".to_owned(),
        Seen::FreeRun if holds.tells(d) => "the model's own parameters do the same already".to_owned(),
        Seen::FreeRun if !holds.electrical && !d.shows_in_motion() => "it takes a voltage and a current".to_owned(),
        Seen::FreeRun => "it takes motion in both directions".to_owned(),
    };
    OutOfReach { effect: d.id, name: d.name, invisible: matches!(seen, Seen::Invisible(_)), text }
}

/// The recordings and the model that are challenged.
struct Rig<'a> {
    full: &'a [Experiment],
    kind: Kind,
    motion: Motion,
    /// The model whose free runs are compared.
    space: Space,
    scales: Scales,
    /// Its free runs, without any challenge.
    runs: Vec<FreeRun>,
    /// The fit from which each diagnosis starts.
    fit: Fit,
    candidates: Vec<&'static Description>,
    /// Effects that the balances show without any challenge, and that the free run has not confirmed.
    unconfirmed: Vec<EffectId>,
    /// Those of the candidates that do something of their own.
    challenging: Vec<EffectId>,
    ctx: &'a Context,
}

/// Current and speed as the measuring chain shows them.
type FreeRun = [Vec<f64>; 2];

/// What a try has shown.
enum Answer {
    Revealed,
    Hidden {
        named: Option<EffectId>,
        objection: Option<&'static str>,
    },
    /// The model cannot be run with that much of the effect.
    Impossible,
}

impl<'a> Rig<'a> {
    fn new(
        full: &'a [Experiment],
        model: &Model,
        settings: &Settings,
        found: &[EffectId],
        motion: Motion,
        ctx: &'a Context,
    ) -> Result<Self> {
        let mut start = identify::build_space(settings)?;
        let mut space = start.clone();
        space.take_model(model);
        let mut along = full.to_vec();
        slow_sampling::prepare(&mut start, &mut along, settings.course, None, &ctx.quietly())?;
        let coarse = diagnose::base::start(&mut start, &along)?;
        let scales = start.scales(full);
        for id in found {
            start = start.with_effect(*id, &scales);
        }
        let known = |id: EffectId| start.effects().contains(&id);
        let mut candidates = screening::candidates(settings.kind, Holds::of(full), known);
        let fit = climb(&coarse, &candidates, ctx)?.fit_from_what_is_known(&start, &settings.known)?;
        let mut unconfirmed = Vec::new();
        while let Some(id) = climb(&coarse, &candidates, ctx)?.first_step(&fit)?.winners.first().copied() {
            unconfirmed.push(id);
            candidates.retain(|d| d.id != id);
        }
        let climb = climb(&coarse, &candidates, ctx)?;
        let own = |d: &Description| climb.independence(&fit, d).is_some_and(|share| share > SAME);
        let challenging = candidates.iter().filter(|d| own(d)).map(|d| d.id).collect();
        if !found.is_empty() {
            space = fit.space.clone();
        }
        let refused = |e: String| Error::usage(format!("the model cannot be run: {e}"), "check its parameters");
        let motor = space.motor().map_err(|e| refused(e.to_string()))?;
        let runs = full
            .par_iter()
            .map(|e| free_run(e, &motor, &motor).ok_or_else(|| refused("its free run does not stay finite".to_owned())))
            .collect::<Result<_>>()?;
        Ok(Self {
            full,
            kind: settings.kind,
            motion,
            space,
            scales,
            runs,
            fit,
            candidates,
            unconfirmed,
            challenging,
            ctx,
        })
    }

    /// Bisection for the smallest size at which an effect is revealed; the typical size comes first.
    fn search(&self, d: &'static Description, steps: &Steps<'_>) -> Result<Challenged> {
        let typical = self.space.with_effect(d.id, &self.scales).value(Key::size_of(d.id)).abs();
        let (mut low, mut high) = (GRID.0 - 1, GRID.1 + 1);
        let (mut revealed, mut hidden) = (None, None);
        let mut k = 0;
        while high - low > 1 {
            self.ctx.check()?;
            let size = typical * 2f64.powf(0.5 * f64::from(k));
            let (answer, esr) = self.attempt(d, size)?;
            steps.next();
            match answer {
                Answer::Hidden { named, objection } => {
                    low = k;
                    hidden = Some((size, esr, named, objection));
                }
                Answer::Revealed => {
                    high = k;
                    revealed = Some((size, esr));
                }
                Answer::Impossible => high = k,
            }
            k = if high > GRID.1 { GRID.1 } else { (low + high).div_euclid(2) };
        }
        let esr = revealed.map(|r| r.1).or(hidden.map(|h| h.1)).unwrap_or_default();
        Ok(Challenged {
            effect: d.id,
            name: d.name,
            parameter: d.size().name,
            unit: Key::size_of(d.id).unit(self.kind, self.motion),
            revealed_from: revealed.map(|r| r.0),
            hidden_up_to: hidden.map(|h| h.0),
            esr,
            mistaken_for: hidden.and_then(|h| h.2),
            objection: hidden.and_then(|h| h.3),
        })
    }

    /// One size: whether diagnosis would name the effect, and the error that it causes.
    fn attempt(&self, d: &'static Description, size: f64) -> Result<(Answer, PerSignal)> {
        let Some(challenged) = self.with(d, size) else { return Ok((Answer::Impossible, PerSignal::default())) };
        let esr = added_error(self.full, &challenged);
        let coarse: Vec<Experiment> = challenged.iter().map(Experiment::coarse).collect();
        drop(challenged);
        let climb = climb(&coarse, &self.candidates, self.ctx)?;
        let step = climb.first_step(&climb.fit(&self.fit.space)?)?;
        Ok((answer(&step, d.id, self.fit.space.kind()), esr))
    }

    /// The recordings as they would be with the effect; `None` if the model cannot be run with it.
    fn with(&self, d: &Description, size: f64) -> Option<Vec<Experiment>> {
        let without = self.space.motor().ok()?;
        let mut space = self.space.with_effect(d.id, &self.scales);
        space.get_mut(Key::size_of(d.id))?.value = size;
        let motor = space.motor().ok()?;
        self.full
            .par_iter()
            .zip(&self.runs)
            .map(|(e, plain)| {
                let run = free_run(e, &motor, &without)?;
                let mut challenged = e.clone();
                for (measured, (with, without)) in
                    [&mut challenged.current, &mut challenged.speed].into_iter().zip(run.iter().zip(plain))
                {
                    for (x, (with, without)) in measured.iter_mut().flatten().zip(with.iter().zip(without)) {
                        *x += with - without;
                    }
                }
                Some(challenged)
            })
            .collect()
    }
}

fn climb<'a>(coarse: &'a [Experiment], candidates: &[&'static Description], ctx: &Context) -> Result<Climb<'a>> {
    Climb::new(coarse, candidates.to_vec(), 1, &ctx.quietly())
        .ok_or_else(|| Error::insufficient(coarse[0].place(), Insufficient::NeitherSide))
}

/// Free run with as many sub-steps as the model without the effect takes; `None` unless it stays finite.
fn free_run(e: &Experiment, motor: &Motor<f64>, plain: &Motor<f64>) -> Option<FreeRun> {
    let mut run = [Vec::with_capacity(e.len()), Vec::with_capacity(e.len())];
    e.run(motor, e.substeps(plain).ok()?, Imposed::Nothing, |_, reading| {
        run[0].push(reading.current);
        run[1].push(reading.speed);
    })
    .ok()?;
    run.iter().flatten().all(|x| x.is_finite()).then_some(run)
}

fn answer(step: &Step, id: EffectId, kind: Kind) -> Answer {
    match step.winners.first().copied() {
        Some(winner) if classes::same(kind, winner, id) => Answer::Revealed,
        named => {
            let own = step.tried.iter().find(|t| classes::same(kind, t.id, id));
            let objection = own.map_or(Some(Objection::TooSmall), |t| t.objection).map(Objection::words);
            Answer::Hidden { named, objection }
        }
    }
}

/// RMS of what was added over RMS of what was measured, both filtered.
fn added_error(plain: &[Experiment], challenged: &[Experiment]) -> PerSignal {
    let of = |signal: fn(&Experiment) -> Option<&Vec<f64>>, skip: fn(&Experiment, usize) -> bool| {
        let (mut added, mut measured) = (0.0, 0.0);
        for (before, after) in plain.iter().zip(challenged) {
            let (Some(x), Some(y)) = (signal(before), signal(after)) else { continue };
            let (x, y) = (before.filtered(x), before.filtered(y));
            for n in (0..before.len()).filter(|n| before.counted[*n] && !skip(before, *n)) {
                added += (y[n] - x[n]).powi(2);
                measured += x[n].powi(2);
            }
        }
        (measured > 0.0).then(|| (added / measured).sqrt())
    };
    PerSignal {
        current: of(|e| e.current.as_ref(), Experiment::is_open),
        speed: of(|e| e.speed.as_ref(), Experiment::is_locked),
        torque: None,
    }
}
