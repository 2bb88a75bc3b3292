//! The handbook of effects: a page for each, made of its description and of a run of the virtual rig with and without
//! it.

mod difference;
mod page;
mod run;
pub mod words;

use greyrig::effects::Description;

use crate::context::Context;
use crate::error::Result;

/// A file of the handbook.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Its name within the handbook's folder.
    pub name: String,
    /// What it holds.
    pub text: String,
}

/// The page of an effect, and its figure where the virtual rig has the effect.
///
/// # Errors
/// An interrupt.
pub fn files(d: &Description, ctx: &Context) -> Result<Vec<File>> {
    let difference = run::with_and_without(d, ctx)?;
    let page = File { name: format!("{}.md", d.id), text: page::page(d, difference.as_ref()) };
    let figure = difference.map(|it| File { name: format!("{}.svg", d.id), text: it.figure(d) });
    Ok(std::iter::once(page).chain(figure).collect())
}
