//! Effects added to a model, each as the member of its class that the recordings want.
//!
//! A diagnosis names a class by its default member. Another one may differ from it in sign alone: the flux that late
//! commutation takes away looks like a resistance that falls with the speed, and skin effect like one that rises.

use greyrig::effects::EffectId;
use greyrig::motor::BaseParameter;

use crate::compare::{Comparison, PerSignal, compare};
use crate::context::Context;
use crate::diagnose::change;
use crate::diagnose::classes::class_of;
use crate::error::Result;
use crate::identify::space::Key;
use crate::identify::{Identification, Settings, identify};
use crate::model::{Assignment, Model, Status};
use crate::recording::Recording;
use crate::term::Formula;

/// What is to be added to a model.
#[derive(Debug, Clone, Copy, Default)]
pub struct Additions<'a> {
    /// Effects.
    pub effects: &'a [EffectId],
    /// Terms of the user's own.
    pub terms: &'a [Formula],
    /// Parameters of the effects that are known: [`held_of`].
    pub held: &'a [Assignment],
}

impl<'a> Additions<'a> {
    /// Effects, of which nothing is known.
    pub fn effects(effects: &'a [EffectId]) -> Self {
        Self { effects, ..Self::default() }
    }
}

/// What has to be known of effects before they are added, as the instant of a change, from all the data that there are:
/// of a part that is to judge it cannot be looked for, and tells of its size all the same.
///
/// # Errors
/// Recordings that tell of none of it; those that cannot be used; an interrupt.
pub fn held_of(
    model: &Model,
    effects: &[EffectId],
    recordings: &[Recording],
    ctx: &Context,
) -> Result<Vec<Assignment>> {
    let mut settings = Settings::of_model(model);
    let known = settings.fixed.len();
    settings.effects.extend(effects);
    change::hold(&mut settings, recordings, ctx)?;
    Ok(settings.fixed.split_off(known))
}

/// A model with effects added.
#[derive(Debug, Clone)]
pub struct Addition {
    /// The effects that it has got, in the order in which they were asked for.
    pub effects: Vec<EffectId>,
    /// What came of its identification.
    pub identification: Identification,
}

/// A model on the way, with its errors on the data that the fit saw and on those that it did not.
#[derive(Debug, Clone)]
pub struct Stage {
    /// What it has got last, such as `+ saturation`; `before` if nothing.
    pub label: String,
    /// As fitted to the training data.
    pub model: Model,
    /// Error-to-signal ratio on the training data.
    pub training: PerSignal,
    /// Model against the data held out.
    pub held_out: Comparison,
}

impl Stage {
    /// Whether what has been added to a model changes its error on data held out, and these are more than noise.
    ///
    /// # Errors
    /// Recordings that cannot be simulated.
    pub fn shows(&self, before: &Model, held_out: &[Recording], ctx: &Context) -> Result<bool> {
        let mut without = self.model.clone();
        without.effects.retain(|e| before.effects.iter().any(|known| known.id == e.id));
        without.terms.truncate(before.terms.len());
        let esr = self.held_out.esr;
        Ok(esr != PerSignal::default() && compare(&without, held_out, ctx)?.esr != esr)
    }
}

/// A model with effects and terms, identified again with the training data and judged on those held out.
///
/// # Errors
/// Recordings from which nothing can be identified, with the reason; an interrupt.
pub fn stage(
    model: &Model,
    additions: Additions<'_>,
    training: &[Recording],
    held_out: &[Recording],
    ctx: &Context,
) -> Result<Stage> {
    let Addition { effects, identification } = add_to(model, additions, training, ctx)?;
    let model = identification.model;
    let last = additions.terms.last().map(Formula::text).or(effects.last().map(|id| id.id()));
    Ok(Stage {
        label: last.map_or_else(|| "before".to_owned(), |last| format!("+ {last}")),
        training: compare(&model, training, ctx)?.esr,
        held_out: compare(&model, held_out, ctx)?,
        model,
    })
}

/// Identifies a model again with further terms and effects. A parameter of the model that the recordings do not tell,
/// such as the inertia on a single slow ramp, stays as it is; a note says so.
///
/// # Errors
/// Recordings from which nothing can be identified, with the reason; an interrupt.
///
/// # Examples
/// ```
/// use greyrig_host::addition::{Additions, add_to};
/// use greyrig_host::{context::Context, identify::{Settings, identify}, model::Kind, rig::Setup};
/// use greyrig::effects::EffectId;
/// use greyrig_host::compare::compare;
///
/// let recordings = [Setup::new(Kind::PmDc).effect("brush_drop")?.seconds(6.0).seed(1).run()?.recording];
/// let ctx = Context::quiet();
/// let without = identify(&recordings, &Settings::new(Kind::PmDc), &ctx)?.model;
/// let with = add_to(&without, Additions::effects(&[EffectId::BrushDrop]), &recordings, &ctx)?.identification.model;
/// let [before, after] = [compare(&without, &recordings, &ctx)?.esr, compare(&with, &recordings, &ctx)?.esr];
/// assert!(before.falls_to(&after));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn add_to(model: &Model, additions: Additions<'_>, recordings: &[Recording], ctx: &Context) -> Result<Addition> {
    let Additions { effects, terms, held } = additions;
    let mut settings = Settings::of_model(model);
    settings.terms.extend(terms.iter().cloned());
    settings.fixed.extend(held.iter().cloned());
    let mut untold: Vec<String> = Vec::new();
    loop {
        let mut added = identify_with(recordings, &settings, effects, ctx)?;
        let told = &added.identification.model.parameters;
        // Friction that is not told is none; of R, L, K and J the model knows better than where a fit starts.
        let positive = |name: &str| BaseParameter::of_name(name).is_some_and(BaseParameter::is_positive);
        let is_told =
            |name: &String| told.get(name).is_some_and(|p| p.status != Status::NotIdentifiable || !positive(name));
        // What is held may leave others that these recordings do not tell either.
        let further = model.parameters.iter().filter(|(name, _)| !is_told(name) && !untold.contains(name));
        let held: Vec<Assignment> =
            further.map(|(name, p)| Assignment { name: name.clone(), value: p.value }).collect();
        if held.is_empty() {
            if !untold.is_empty() {
                let names = untold.join(", ");
                let note = format!("{names} cannot be told from these recordings, and is held as the model has it");
                added.identification.notes.push(note);
            }
            return Ok(added);
        }
        untold.extend(held.iter().map(|a| a.name.clone()));
        settings.fixed.extend(held);
    }
}

/// Identifies a model with further effects. Where one of them comes to nothing, its 95 % interval holding zero, another
/// member of its class takes its place if that lowers the error of the free run; a note says so.
///
/// # Errors
/// Recordings or settings from which nothing can be identified, with the reason; an interrupt.
pub fn identify_with(
    recordings: &[Recording],
    settings: &Settings,
    effects: &[EffectId],
    ctx: &Context,
) -> Result<Addition> {
    let with = |effects: &[EffectId]| {
        let mut settings = settings.clone();
        settings.effects.extend(effects);
        change::hold(&mut settings, recordings, ctx)?;
        identify(recordings, &settings, ctx)
    };
    let mut added = Addition { effects: effects.to_vec(), identification: with(effects)? };
    let mut notes = Vec::new();
    for (place, asked) in effects.iter().enumerate() {
        if !comes_to_nothing(&added.identification, *asked) {
            continue;
        }
        for other in class_of(settings.kind, *asked).unwrap_or_default() {
            if added.effects.contains(&other) || settings.effects.contains(&other) {
                continue;
            }
            let mut instead = added.effects.clone();
            instead[place] = other;
            let identification = with(&instead)?;
            let esr = |identification: &Identification| -> Result<PerSignal> {
                Ok(compare(&identification.model, recordings, ctx)?.esr)
            };
            if esr(&added.identification)?.falls_to(&esr(&identification)?) {
                notes.push(format!("{asked} comes to nothing here; {other}, which is of its class, is added instead"));
                added = Addition { effects: instead, identification };
            }
        }
    }
    added.identification.notes.extend(notes);
    Ok(added)
}

/// Whether the size of an effect cannot be told from zero.
fn comes_to_nothing(identification: &Identification, id: EffectId) -> bool {
    let size = identification.parameters.iter().find(|p| p.key == Key::size_of(id));
    size.is_none_or(|p| p.ci95.is_none_or(|[low, high]| low <= 0.0 && 0.0 <= high))
}
