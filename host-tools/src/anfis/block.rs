//! Layers 1 to 3 for a block of rows at a time. Arrays are columns one after the other, [`BLOCK`] apart, so that the
//! compiler makes vector instructions of the loops over rows.

use greyrig::anfis::{Firing, Shape};

use super::elementary;
use crate::network::{Net, Scale};

/// Rows in a block: few enough that a block's columns stay in the cache.
pub const BLOCK: usize = 128;

/// A column of an array.
#[inline(always)]
pub fn column(values: &[f64], index: usize, rows: usize) -> &[f64] {
    &values[index * BLOCK..][..rows]
}

/// A column of an array, to be changed.
#[inline(always)]
pub fn column_mut(values: &mut [f64], index: usize, rows: usize) -> &mut [f64] {
    &mut values[index * BLOCK..][..rows]
}

/// out = a b, element by element.
#[inline(always)]
pub fn multiply(out: &mut [f64], a: &[f64], b: &[f64]) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out = a * b;
    }
}

/// out = out + a b, element by element.
#[inline(always)]
pub fn multiply_add(out: &mut [f64], a: &[f64], b: &[f64]) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out += a * b;
    }
}

/// Scalar product, as eight sums side by side.
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a8, a_rest) = a.as_chunks::<8>();
    let (b8, b_rest) = b.as_chunks::<8>();
    for (a, b) in a8.iter().zip(b8) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// Rows with their memberships.
#[derive(Debug, Default)]
pub struct Block {
    /// Rows in it.
    pub rows: usize,
    /// Inputs.
    pub x: Vec<f64>,
    /// Target.
    pub y: Vec<f64>,
    /// Membership of each function.
    pub mu: Vec<f64>,
    /// Membership of each function over the sum of its input's.
    pub nu: Vec<f64>,
    /// −∂ ln μ/∂ ln |z| of each function, with z = (x − c)/a.
    pub slope: Vec<f64>,
    /// ln z² of each function of a bell, where its exponent is free.
    pub log: Vec<f64>,
    free: bool,
}

impl Block {
    /// Space for rows of a network whose exponents b are `free` to be changed, or are not.
    pub fn new(net: &Net, free: bool) -> Self {
        let functions = vec![0.0; net.premise.len() * BLOCK];
        Self {
            rows: 0,
            x: vec![0.0; net.inputs * BLOCK],
            y: vec![0.0; BLOCK],
            mu: functions.clone(),
            nu: functions.clone(),
            slope: functions.clone(),
            log: functions,
            free,
        }
    }

    /// Takes rows from a chunk, which has so many columns of so many rows.
    #[inline(always)]
    pub fn load(&mut self, chunk: &[f64], start: usize, scales: &[Scale]) {
        let height = chunk.len() / (scales.len() + 1);
        self.rows = (height - start).min(BLOCK);
        for (k, s) in scales.iter().enumerate() {
            let from = &chunk[k * height + start..][..self.rows];
            for (x, from) in column_mut(&mut self.x, k, self.rows).iter_mut().zip(from) {
                *x = (from - s.centre) / s.half;
            }
        }
        self.y[..self.rows].copy_from_slice(&chunk[scales.len() * height + start..][..self.rows]);
    }

    /// Layers 1 and 3.
    #[inline(always)]
    pub fn memberships(&mut self, net: &Net) {
        let rows = self.rows;
        for (k, p) in net.premise.iter().enumerate() {
            let x = column(&self.x, k / net.functions, rows);
            let mu = column_mut(&mut self.mu, k, rows);
            let slope = column_mut(&mut self.slope, k, rows);
            let log = column_mut(&mut self.log, k, rows);
            let inverse = 1.0 / p.a;
            let squared = |x: &f64| ((x - p.c) * inverse).powi(2);
            if net.shape == Shape::Gaussian {
                for ((mu, slope), x) in mu.iter_mut().zip(slope).zip(x) {
                    *slope = squared(x);
                    *mu = (-0.5 * *slope).max(-FARTHEST);
                }
                elementary::exp(mu);
                continue;
            }
            let b = p.b;
            let cheap = b == 1.0 || b == 2.0;
            if self.free || !cheap {
                log.iter_mut().zip(x).for_each(|(log, x)| *log = squared(x).max(LEAST));
                elementary::ln(log);
            }
            // t = z^(2b), in the place of μ for now.
            if cheap {
                mu.iter_mut().zip(x).for_each(|(mu, x)| *mu = squared(x));
                if b == 2.0 {
                    mu.iter_mut().for_each(|mu| *mu *= *mu);
                }
            } else {
                mu.iter_mut().zip(&*log).for_each(|(mu, log)| *mu = (b * log).clamp(-FARTHEST, FARTHEST));
                elementary::exp(mu);
            }
            for (mu, slope) in mu.iter_mut().zip(slope) {
                let t = *mu;
                *mu = 1.0 / (1.0 + t);
                // 1 − μ as t μ, which cancels nothing.
                *slope = 2.0 * b * t * *mu;
            }
        }
        let mut total = [0.0; BLOCK];
        for i in 0..net.inputs {
            let functions = i * net.functions..(i + 1) * net.functions;
            total[..rows].fill(0.0);
            for k in functions.clone() {
                total[..rows].iter_mut().zip(column(&self.mu, k, rows)).for_each(|(t, mu)| *t += mu);
            }
            total[..rows].iter_mut().for_each(|t| *t = 1.0 / *t);
            for k in functions {
                multiply(column_mut(&mut self.nu, k, rows), column(&self.mu, k, rows), &total[..rows]);
            }
        }
    }

    /// Normalised firing strength of every rule.
    #[inline(always)]
    pub fn strengths(&self, net: &Net, out: &mut [f64]) {
        let (rows, rules, m) = (self.rows, net.rules(), net.functions);
        match net.firing {
            Firing::Product => products(net.inputs, m, rows, |i, j| column(&self.nu, i * m + j, rows), out),
            Firing::Minimum => {
                let mut total = [0.0; BLOCK];
                for rule in 0..rules {
                    let w = column_mut(out, rule, rows);
                    w.copy_from_slice(column(&self.mu, net.function_of(rule, 0), rows));
                    for i in 1..net.inputs {
                        let mu = column(&self.mu, i * m + net.function_of(rule, i), rows);
                        w.iter_mut().zip(mu).for_each(|(w, mu)| *w = if mu < w { *mu } else { *w });
                    }
                    total.iter_mut().zip(&*w).for_each(|(t, w)| *t += w);
                }
                total[..rows].iter_mut().for_each(|t| *t = 1.0 / *t);
                for rule in 0..rules {
                    column_mut(out, rule, rows).iter_mut().zip(&total).for_each(|(w, t)| *w *= t);
                }
            }
        }
    }
}

/// Products of one column of each factor, the last factor's columns varying fastest. `out` has space for all.
#[inline(always)]
pub fn products<'a>(
    factors: usize,
    columns: usize,
    rows: usize,
    get: impl Fn(usize, usize) -> &'a [f64],
    out: &mut [f64],
) {
    if factors == 0 {
        column_mut(out, 0, rows).fill(1.0);
        return;
    }
    for j in 0..columns {
        column_mut(out, j, rows).copy_from_slice(get(0, j));
    }
    let mut count = columns;
    for factor in 1..factors {
        // From the back, so that what is read has not been overwritten.
        for done in (0..count).rev() {
            for j in (0..columns).rev() {
                let (from, to) = (done, done * columns + j);
                if from == to {
                    let own = column_mut(out, to, rows);
                    own.iter_mut().zip(get(factor, j)).for_each(|(o, g)| *o *= g);
                } else {
                    let (head, tail) = out.split_at_mut(to * BLOCK);
                    multiply(&mut tail[..rows], column(head, from, rows), get(factor, j));
                }
            }
        }
        count *= columns;
    }
}

/// z² counts as at least this.
const LEAST: f64 = 1e-300;
/// |ln t| at most, so that products of t stay finite.
const FARTHEST: f64 = 230.0;
