//! Sums over all rows of a table, chunk by chunk and on several threads, with the same result on any number of them.

use rayon::prelude::*;

use super::block::{BLOCK, Block};
use super::table::Table;
use crate::error::{Error, Result};
use crate::network::{Net, Scale};

/// Chunks that are under way at a time; their sums are in memory together.
const WAVE: usize = 32;

/// Threads to work on.
#[derive(Debug)]
pub struct Workers(Option<rayon::ThreadPool>);

impl Workers {
    /// So many threads; zero for as many as there are processors.
    ///
    /// # Errors
    /// The system gives no threads.
    pub fn new(threads: usize) -> Result<Self> {
        if threads == 1 {
            return Ok(Self(None));
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.map(|pool| Self(Some(pool)))
            .map_err(|e| Error::usage(format!("{threads} threads cannot be had: {e}"), "ask for fewer by --threads"))
    }
}

/// Something that is summed over rows.
pub trait Sum: Sync {
    /// Sums of a chunk, and space to work in.
    type Partial: Send;
    /// Sums of nothing.
    fn start(&self) -> Self::Partial;
    /// Adds the rows of a block, whose memberships are known.
    fn add(&self, partial: &mut Self::Partial, block: &Block);
    /// The sums alone, in some order.
    fn sums(partial: &Self::Partial) -> Vec<&[f64]>;
}

/// Sums over the rows of a table as the network sees them.
///
/// # Errors
/// The temporary file cannot be read.
pub fn fold<S: Sum>(
    workers: &Workers,
    net: &Net,
    free: bool,
    table: &Table,
    scales: &[Scale],
    sum: &S,
) -> Result<Vec<Vec<f64>>> {
    let of_chunk = |index: usize| -> Result<Vec<Vec<f64>>> {
        let chunk = table.chunk(index)?;
        let mut block = Block::new(net, free);
        let mut partial = sum.start();
        pulp::Arch::new().dispatch(Rows { net, scales, sum, chunk: &chunk, block: &mut block, partial: &mut partial });
        Ok(S::sums(&partial).into_iter().map(<[f64]>::to_vec).collect())
    };
    let mut total: Option<Vec<Vec<f64>>> = None;
    let mut add = |one: Vec<Vec<f64>>| match &mut total {
        None => total = Some(one),
        Some(total) => {
            for (total, one) in total.iter_mut().zip(&one) {
                total.iter_mut().zip(one).for_each(|(t, o)| *t += o);
            }
        }
    };
    match &workers.0 {
        None => {
            for index in 0..table.chunks() {
                add(of_chunk(index)?);
            }
        }
        Some(pool) => {
            for from in (0..table.chunks()).step_by(WAVE) {
                let wave = from..(from + WAVE).min(table.chunks());
                let sums: Vec<_> = pool.install(|| wave.into_par_iter().map(of_chunk).collect());
                for one in sums {
                    add(one?);
                }
            }
        }
    }
    Ok(total.unwrap_or_default())
}

/// The work on a chunk, compiled for the vector units that the processor turns out to have: all that it calls is
/// inlined. Vectors only do several rows at a time, and nothing is fused, so that the result is the same.
struct Rows<'a, S: Sum> {
    net: &'a Net,
    scales: &'a [Scale],
    sum: &'a S,
    chunk: &'a [f64],
    block: &'a mut Block,
    partial: &'a mut S::Partial,
}

impl<S: Sum> pulp::NullaryFnOnce for Rows<'_, S> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let height = self.chunk.len() / (self.scales.len() + 1);
        for start in (0..height).step_by(BLOCK) {
            self.block.load(self.chunk, start, self.scales);
            self.block.memberships(self.net);
            self.sum.add(self.partial, self.block);
        }
    }
}
