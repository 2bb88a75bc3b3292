//! The normal equations of the consequents, without ever forming the matrix that they belong to.
//!
//! A row of that matrix A is ν1 ⊗ ν2 ⊗ … ⊗ (x1, …, xn, 1), with the normalised memberships ν_i of each input. So an
//! entry of AᵀA is a sum over rows of Π_i ν_ij ν_ij' · x_k x_k', and each factor is symmetric in its two indices: three
//! inputs with three functions have 6·6·6·10 = 2160 different sums instead of 108·109/2 = 5886. They are one matrix
//! product UᵀV, with the pairs of the first inputs in U and those of the others, times the x_k x_k', in V.
//!
//! With the minimum nothing factorises, and A is formed block by block.

use greyrig::anfis::Firing;
use nalgebra::{DMatrix, DMatrixView, DVector, Dyn};

use super::block::{BLOCK, Block, column, column_mut, dot, multiply, products};
use super::fold::{Sum, Workers, fold};
use super::table::Table;
use crate::error::Result;
use crate::network::{Net, Scale};

/// AᵀA and Aᵀy.
#[derive(Debug, Clone)]
pub struct Moments {
    /// AᵀA.
    pub gram: DMatrix<f64>,
    /// Aᵀy.
    pub rhs: DVector<f64>,
}

/// Sums them over a table.
///
/// # Errors
/// The temporary file cannot be read.
pub fn moments(workers: &Workers, net: &Net, table: &Table, scales: &[Scale]) -> Result<Moments> {
    match net.firing {
        Firing::Product => {
            let sums = fold(workers, net, false, table, scales, &Factors::new(net))?;
            Ok(Factors::new(net).expand(&sums))
        }
        Firing::Minimum => {
            let sums = fold(workers, net, false, table, scales, &Plain { net })?;
            let columns = net.columns();
            Ok(Moments {
                gram: DMatrix::from_column_slice(columns, columns, &sums[0]),
                rhs: DVector::from_column_slice(&sums[1]),
            })
        }
    }
}

/// C += AᵀB of arrays of columns.
pub fn add_product(c: &mut DMatrix<f64>, a: &[f64], b: &[f64], rows: usize) {
    let (n, m) = c.shape();
    // Small products are not worth the call, and nalgebra 0.34.2 multiplies them by another routine, which
    // writes out of bounds when the rows of a view are not contiguous.
    if n.min(m).min(rows) < 8 {
        for k in 0..m {
            let b = column(b, k, rows);
            for (j, c) in c.column_mut(k).iter_mut().enumerate() {
                *c += dot(column(a, j, rows), b);
            }
        }
        return;
    }
    let a: DMatrixView<'_, f64, Dyn, Dyn> = DMatrixView::from_slice_with_strides(a, n, rows, BLOCK, 1);
    let b: DMatrixView<'_, f64, Dyn, Dyn> = DMatrixView::from_slice_with_strides(b, rows, m, 1, BLOCK);
    c.gemm(1.0, &a, &b, 1.0);
}

/// The columns of A: every strength times every input, and times 1.
#[inline(always)]
pub fn design(net: &Net, block: &Block, strengths: &[f64], out: &mut [f64]) {
    let rows = block.rows;
    for rule in 0..net.rules() {
        let w = column(strengths, rule, rows);
        for k in 0..net.inputs {
            multiply(column_mut(out, rule * (net.inputs + 1) + k, rows), w, column(&block.x, k, rows));
        }
        column_mut(out, rule * (net.inputs + 1) + net.inputs, rows).copy_from_slice(w);
    }
}

/// Pairs j ≤ j' of so many.
fn pairs(of: usize) -> Vec<(usize, usize)> {
    (0..of).flat_map(|j| (j..of).map(move |k| (j, k))).collect()
}

/// Place of a pair in that list.
fn pair(of: usize, j: usize, k: usize) -> usize {
    let (j, k) = (j.min(k), j.max(k));
    j * of - j * (j + 1) / 2 + k
}

struct Factors<'a> {
    net: &'a Net,
    /// Inputs whose pairs are in U.
    head: usize,
    pairs: Vec<(usize, usize)>,
    monomials: Vec<(usize, usize)>,
}

/// Sums and the columns that they are formed from.
struct FactorSpace {
    gram: DMatrix<f64>,
    rhs: DMatrix<f64>,
    pairs: Vec<f64>,
    extended: Vec<f64>,
    monomials: Vec<f64>,
    u: Vec<f64>,
    v: Vec<f64>,
    tail: Vec<f64>,
}

impl<'a> Factors<'a> {
    fn new(net: &'a Net) -> Self {
        let (pairs, monomials) = (pairs(net.functions), pairs(net.inputs + 1));
        Self { net, head: net.inputs.div_ceil(2), pairs, monomials }
    }

    /// Columns of U and V, of singles and of pairs.
    fn sizes(&self) -> [usize; 4] {
        let (n, m) = (self.net.inputs, self.net.functions);
        let (head, tail) = (self.head as u32, (n - self.head) as u32);
        [
            self.pairs.len().pow(head),
            self.pairs.len().pow(tail) * self.monomials.len(),
            m.pow(head),
            m.pow(tail) * (n + 1),
        ]
    }

    fn expand(&self, sums: &[Vec<f64>]) -> Moments {
        let (n, m) = (self.net.inputs, self.net.functions);
        let [u, v, u1, v1] = self.sizes();
        let gram = DMatrix::from_column_slice(u, v, &sums[0]);
        let rhs = DMatrix::from_column_slice(u1, v1, &sums[1]);
        let (width, columns) = (n + 1, self.net.columns());
        let tails = m.pow((n - self.head) as u32);
        let place = |rule: usize, other: usize, inputs: std::ops::Range<usize>| {
            inputs.fold(0, |place, i| {
                place * self.pairs.len() + pair(m, self.net.function_of(rule, i), self.net.function_of(other, i))
            })
        };
        let mut all = DMatrix::zeros(columns, columns);
        for rule in 0..self.net.rules() {
            for other in 0..self.net.rules() {
                let row = place(rule, other, 0..self.head);
                let start = place(rule, other, self.head..n) * self.monomials.len();
                for (a, b) in (0..width).flat_map(|a| (0..width).map(move |b| (a, b))) {
                    all[(rule * width + a, other * width + b)] = gram[(row, start + pair(width, a, b))];
                }
            }
        }
        Moments {
            gram: all,
            rhs: DVector::from_fn(columns, |a, _| {
                let rule = a / width;
                rhs[(rule / tails, rule % tails * width + a % width)]
            }),
        }
    }
}

impl Sum for Factors<'_> {
    type Partial = FactorSpace;

    fn start(&self) -> FactorSpace {
        let [u, v, u1, v1] = self.sizes();
        FactorSpace {
            gram: DMatrix::zeros(u, v),
            rhs: DMatrix::zeros(u1, v1),
            pairs: vec![0.0; self.net.inputs * self.pairs.len() * BLOCK],
            extended: vec![0.0; (self.net.inputs + 1) * BLOCK],
            monomials: vec![0.0; self.monomials.len() * BLOCK],
            u: vec![0.0; u.max(u1) * BLOCK],
            v: vec![0.0; v.max(v1) * BLOCK],
            tail: vec![0.0; v.max(v1) * BLOCK],
        }
    }

    #[inline(always)]
    fn add(&self, space: &mut FactorSpace, block: &Block) {
        let (n, m, rows) = (self.net.inputs, self.net.functions, block.rows);
        let count = self.pairs.len();
        for i in 0..n {
            for (k, &(a, b)) in self.pairs.iter().enumerate() {
                let [a, b] = [a, b].map(|j| column(&block.nu, i * m + j, rows));
                multiply(column_mut(&mut space.pairs, i * count + k, rows), a, b);
            }
        }
        space.extended[..n * BLOCK].copy_from_slice(&block.x);
        column_mut(&mut space.extended, n, rows).fill(1.0);
        for (k, &(a, b)) in self.monomials.iter().enumerate() {
            let [a, b] = [a, b].map(|j| column(&space.extended, j, rows));
            multiply(column_mut(&mut space.monomials, k, rows), a, b);
        }
        let pair_of = |i: usize, k: usize| column(&space.pairs, i * count + k, rows);
        products(self.head, count, rows, pair_of, &mut space.u);
        products(n - self.head, count, rows, |i, k| pair_of(self.head + i, k), &mut space.tail);
        cross(
            &mut space.v,
            &space.tail,
            count.pow((n - self.head) as u32),
            &space.monomials,
            self.monomials.len(),
            rows,
        );
        add_product(&mut space.gram, &space.u, &space.v, rows);

        let single = |i: usize, j: usize| column(&block.nu, i * m + j, rows);
        products(self.head, m, rows, single, &mut space.u);
        products(n - self.head, m, rows, |i, j| single(self.head + i, j), &mut space.tail);
        for k in 0..=n {
            column_mut(&mut space.extended, k, rows).iter_mut().zip(&block.y).for_each(|(x, y)| *x *= y);
        }
        cross(&mut space.v, &space.tail, m.pow((n - self.head) as u32), &space.extended, n + 1, rows);
        add_product(&mut space.rhs, &space.u, &space.v, rows);
    }

    fn sums(partial: &FactorSpace) -> Vec<&[f64]> {
        vec![partial.gram.as_slice(), partial.rhs.as_slice()]
    }
}

/// Every column of a times every column of b, those of b varying fastest.
#[inline(always)]
fn cross(out: &mut [f64], a: &[f64], a_columns: usize, b: &[f64], b_columns: usize, rows: usize) {
    for i in 0..a_columns {
        for j in 0..b_columns {
            multiply(column_mut(out, i * b_columns + j, rows), column(a, i, rows), column(b, j, rows));
        }
    }
}

struct Plain<'a> {
    net: &'a Net,
}

struct PlainSpace {
    gram: DMatrix<f64>,
    rhs: DMatrix<f64>,
    strengths: Vec<f64>,
    design: Vec<f64>,
}

impl Sum for Plain<'_> {
    type Partial = PlainSpace;

    fn start(&self) -> PlainSpace {
        let columns = self.net.columns();
        PlainSpace {
            gram: DMatrix::zeros(columns, columns),
            rhs: DMatrix::zeros(columns, 1),
            strengths: vec![0.0; self.net.rules() * BLOCK],
            design: vec![0.0; columns * BLOCK],
        }
    }

    #[inline(always)]
    fn add(&self, space: &mut PlainSpace, block: &Block) {
        block.strengths(self.net, &mut space.strengths);
        design(self.net, block, &space.strengths, &mut space.design);
        add_product(&mut space.gram, &space.design, &space.design, block.rows);
        add_product(&mut space.rhs, &space.design, &block.y, block.rows);
    }

    fn sums(partial: &PlainSpace) -> Vec<&[f64]> {
        vec![partial.gram.as_slice(), partial.rhs.as_slice()]
    }
}
