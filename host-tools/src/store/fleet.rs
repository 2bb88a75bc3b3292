//! Rows of recordings in, rows of results out, without a store: what an engine calls that spreads work over machines.
//!
//! Both are the content of Parquet files with the columns of the store. Nothing is kept between two calls, and the same
//! rows give the same results as [`run`](super::run::run) on a store that holds them: engines repeat what a machine has
//! lost with it, and keep each result once by its key.

use std::path::Path;

use rayon::prelude::*;

use super::files;
use super::job::Task;
use super::recordings::Recordings;
use super::results::{Outcome, Results};
use super::run::{Asked, ask};
use crate::context::Context;
use crate::error::{Error, Place, Result};

/// What the rows that are handed over are called in errors.
const BATCH: &str = "the batch";

/// What came of a batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answered {
    /// Rows of results, in the order of their recordings: the content of a Parquet file.
    pub results: Vec<u8>,
    /// Recordings of another motor type than the model's, which have none.
    pub other_type: usize,
}

/// Rows of a table without any, for their columns: the content of a Parquet file.
///
/// # Errors
/// None.
pub fn no_recordings() -> Result<Vec<u8>> {
    files::encode::<Recordings>(&[]).map_err(ours)
}

/// Asks the recordings of a batch, the content of a Parquet file.
///
/// # Errors
/// What is no batch of recordings; a row that is damaged; an interrupt.
pub fn run(batch: &[u8], task: &Task, ctx: &Context) -> Result<Answered> {
    let damaged = |row: usize, what: String| {
        Error::input(
            Place::file(BATCH),
            format!("row {}: {what}", row + 1),
            "leave this row out; `greyrig store check` names it",
        )
    };
    let rows = files::decode::<Recordings>(Path::new(BATCH), batch)?.into_iter().enumerate();
    let entries = rows.map(|(k, row)| row.map_err(|what| damaged(k, what))).collect::<Result<Vec<_>>>()?;
    let steps = ctx.steps(task.job.name(), entries.len() as u64);
    let asked = || {
        entries
            .par_iter()
            .enumerate()
            .map(|(k, entry)| {
                ctx.check()?;
                let asked = ask(task, entry, ctx)?;
                steps.next();
                match asked {
                    Asked::Answered(outcome) => Ok(Some(*outcome)),
                    Asked::OtherType => Ok(None),
                    Asked::Failed(what) => Err(damaged(k, what)),
                }
            })
            .collect::<Result<Vec<Option<Outcome>>>>()
    };
    let answers = ctx.install(asked)?;
    let other_type = answers.iter().filter(|answer| answer.is_none()).count();
    let outcomes: Vec<Outcome> = answers.into_iter().flatten().collect();
    Ok(Answered { results: files::encode::<Results>(&outcomes).map_err(ours)?, other_type })
}

fn ours(error: parquet::errors::ParquetError) -> Error {
    Error::usage(format!("results cannot be written as Parquet: {error}"), "report this as a bug")
}
