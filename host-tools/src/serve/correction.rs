//! What is learnt of what the physics leaves over.

use super::api;
use super::error::Result;
use super::version::Made;
use crate::answers::Given;
use crate::answers::train::{self, Request, learning_curve};
use crate::compare::compare;
use crate::context::Context;
use crate::held_out::split;
use crate::hybrid;
use crate::model::Model;
use crate::report::training::{memberships, surfaces};
use crate::report::{Curves, Surface};

/// A model with a correction, judged on data held out; and what was learnt.
///
/// # Errors
/// A model or recordings that cannot be used, an interrupt.
pub fn learnt(model: &Model, given: Given, request: &Request, ctx: &Context) -> Result<(Made, api::Correction)> {
    let answer = ctx.install(|| request.answer(model, given, ctx))?;
    let names = hybrid::INPUTS.map(str::to_owned);
    let told = api::Correction {
        text: answer.in_words(),
        accepted: answer.accepted(),
        learning: lines(learning_curve(&answer.trained)),
        memberships: memberships(&names, &answer.trained).into_iter().map(|both| both.map(lines)).collect(),
        surfaces: surfaces(&names, hybrid::TARGET, &answer.trained).into_iter().map(surface).collect(),
    };
    Ok((made(answer, ctx)?, told))
}

/// Judged as other versions are: on whole recordings, from their begin on.
fn made(answer: train::Answer, ctx: &Context) -> Result<Made> {
    let accepted = answer.accepted();
    let (training, held_out) = split(&answer.given.recordings);
    let quietly = &ctx.quietly();
    let (seen, judged) = (compare(&answer.model, &training, quietly)?, compare(&answer.model, &held_out, quietly)?);
    let mut notes = vec![answer.in_words()];
    notes.extend(answer.trained.notes());
    let mut model = answer.model;
    model.judged(accepted);
    Ok(Made {
        label: "+ learned correction".to_owned(),
        model,
        parameters: Vec::new(),
        notes,
        training: seen.esr,
        held_out: judged.esr,
        floor: judged.noise_floor,
        accepted: Some(accepted),
    })
}

fn lines(of: Curves) -> api::Lines {
    let locus = |(name, points): (String, Vec<(f64, f64)>)| {
        let (x, y) = points.into_iter().unzip();
        api::Locus { name, x, y }
    };
    api::Lines { x: of.x, y: of.y, curves: of.curves.into_iter().map(locus).collect() }
}

fn surface(of: Surface) -> api::Surface {
    api::Surface {
        x_range: [of.x.1, of.x.2],
        x: of.x.0,
        y_range: [of.y.1, of.y.2],
        y: of.y.0,
        columns: u32::try_from(of.columns).unwrap_or(u32::MAX),
        values: of.values,
    }
}
