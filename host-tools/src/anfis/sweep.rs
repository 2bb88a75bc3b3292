//! Residuals of a network, their derivatives by the premise parameters, and the sums that training needs of them.
//!
//! With the output o, the normalised strengths w̄ and the rules' f, ∂o/∂ ln μ_ij is the sum of w̄ (f − o) over the
//! rules with function j of input i. For the product that is ν_ij (E_ij − o), where E_ij is the output with function j
//! alone on input i. Then, with z = (x − c)/a and s = −∂ ln μ/∂ ln |z| (2b (1 − μ) for the bell, z² for the Gaussian):
//!
//! ∂ ln μ/∂ ln a = s, ∂ ln μ/∂ ln b = −s ln|z|, ∂ ln μ/∂c = s/(x − c), the last two 0 at x = c.

use greyrig::anfis::{Firing, Shape};
use nalgebra::{DMatrix, DVector};

use super::block::{BLOCK, Block, column, column_mut, dot, multiply, multiply_add, products};
use super::fold::{Sum, Workers, fold};
use super::moments::{add_product, design};
use super::table::Table;
use crate::error::Result;
use crate::network::{Net, Scale};

/// What is summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Want {
    /// The squared error.
    Error,
    /// The gradient, too.
    Gradient,
    /// What a Gauss–Newton step needs, too.
    Normal,
}

/// Sums over a table; r = y − o, D = ∂o/∂(ln a, ln b, c), A the matrix of the consequents. D lists the parameters of
/// each function in turn, without b where it is not free.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// Σ r².
    pub squared_error: f64,
    /// Dᵀr.
    pub gradient: DVector<f64>,
    /// AᵀD.
    pub cross: DMatrix<f64>,
    /// DᵀD.
    pub normal: DMatrix<f64>,
}

/// Premise parameters that are trained, of each function.
pub fn parameters(net: &Net, free: bool) -> usize {
    if net.shape == Shape::Bell && free { 3 } else { 2 }
}

/// Sums them over a table.
///
/// # Errors
/// The temporary file cannot be read.
pub fn sweep(workers: &Workers, net: &Net, free: bool, table: &Table, scales: &[Scale], want: Want) -> Result<Sweep> {
    let free = free && net.shape == Shape::Bell;
    let sums = fold(workers, net, free && want > Want::Error, table, scales, &Residuals { net, free, want })?;
    let premises = net.premise.len() * parameters(net, free);
    let rows = |k: usize| sums[k].len() / premises;
    Ok(Sweep {
        squared_error: sums[0][0],
        gradient: DVector::from_column_slice(&sums[1]),
        cross: DMatrix::from_column_slice(rows(2), premises, &sums[2]),
        normal: DMatrix::from_column_slice(rows(3), premises, &sums[3]),
    })
}

struct Residuals<'a> {
    net: &'a Net,
    free: bool,
    want: Want,
}

struct Space {
    squared_error: [f64; 1],
    gradient: Vec<f64>,
    cross: DMatrix<f64>,
    normal: DMatrix<f64>,
    /// Outputs of the rules, then summed over the last inputs, one after the other.
    rules: Vec<f64>,
    summed: Vec<Vec<f64>>,
    /// Products of the strengths of the first inputs.
    weights: Vec<f64>,
    /// Outputs with one function alone, then derivatives by the logarithms of the memberships.
    alone: Vec<f64>,
    jacobian: Vec<f64>,
    strengths: Vec<f64>,
    design: Vec<f64>,
}

impl Sum for Residuals<'_> {
    type Partial = Space;

    fn start(&self) -> Space {
        let net = self.net;
        let premises = net.premise.len() * parameters(net, self.free);
        let space = |columns: usize| vec![0.0; columns * BLOCK];
        let gradient = if self.want >= Want::Gradient { premises } else { 0 };
        let normal = if self.want == Want::Normal { premises } else { 0 };
        let columns = if self.want == Want::Normal { net.columns() } else { 0 };
        Space {
            squared_error: [0.0],
            gradient: vec![0.0; gradient],
            cross: DMatrix::zeros(columns, normal),
            normal: DMatrix::zeros(normal, normal),
            rules: space(net.rules()),
            summed: (0..net.inputs).map(|i| space(net.functions.pow(i as u32))).collect(),
            weights: space(net.rules()),
            alone: space(net.premise.len()),
            jacobian: space(gradient),
            strengths: space(net.rules()),
            design: space(columns),
        }
    }

    #[inline(always)]
    fn add(&self, space: &mut Space, block: &Block) {
        let (net, rows) = (self.net, block.rows);
        rule_outputs(net, block, &mut space.rules);
        match net.firing {
            Firing::Product => self.product(space, block),
            Firing::Minimum => self.minimum(space, block),
        }
        let mut residual = [0.0; BLOCK];
        let output = &space.summed[0];
        for ((r, y), o) in residual[..rows].iter_mut().zip(&block.y).zip(output) {
            *r = y - o;
        }
        space.squared_error[0] += dot(&residual[..rows], &residual[..rows]);
        if self.want == Want::Error {
            return;
        }
        self.jacobian(space, block);
        for (k, g) in space.gradient.iter_mut().enumerate() {
            *g += dot(column(&space.jacobian, k, rows), &residual[..rows]);
        }
        if self.want == Want::Normal {
            if net.firing == Firing::Product {
                block.strengths(net, &mut space.strengths);
            }
            design(net, block, &space.strengths, &mut space.design);
            add_product(&mut space.cross, &space.design, &space.jacobian, rows);
            add_product(&mut space.normal, &space.jacobian, &space.jacobian, rows);
        }
    }

    fn sums(partial: &Space) -> Vec<&[f64]> {
        vec![&partial.squared_error, &partial.gradient, partial.cross.as_slice(), partial.normal.as_slice()]
    }
}

impl Residuals<'_> {
    /// The output, in `summed[0]`, and ∂o/∂ ln μ in `alone`.
    #[inline(always)]
    fn product(&self, space: &mut Space, block: &Block) {
        let (net, m, rows) = (self.net, self.net.functions, block.rows);
        let nu = |i: usize, j: usize| column(&block.nu, i * m + j, rows);
        for i in (0..net.inputs).rev() {
            let (into, from) = space.summed.split_at_mut(i + 1);
            let from = from.first().unwrap_or(&space.rules);
            for group in 0..m.pow(i as u32) {
                let sum = column_mut(&mut into[i], group, rows);
                multiply(sum, column(from, group * m, rows), nu(i, 0));
                for j in 1..m {
                    multiply_add(sum, column(from, group * m + j, rows), nu(i, j));
                }
            }
        }
        if self.want == Want::Error {
            return;
        }
        for i in 0..net.inputs {
            products(i, m, rows, nu, &mut space.weights);
            let from = space.summed.get(i + 1).unwrap_or(&space.rules);
            for j in 0..m {
                let alone = column_mut(&mut space.alone, i * m + j, rows);
                multiply(alone, column(from, j, rows), column(&space.weights, 0, rows));
                for group in 1..m.pow(i as u32) {
                    multiply_add(alone, column(from, group * m + j, rows), column(&space.weights, group, rows));
                }
                for ((alone, o), nu) in alone.iter_mut().zip(&space.summed[0]).zip(nu(i, j)) {
                    *alone = (*alone - o) * nu;
                }
            }
        }
    }

    /// The same for the minimum, whose derivative is that of the smallest membership.
    #[inline(always)]
    fn minimum(&self, space: &mut Space, block: &Block) {
        let (net, m, rows) = (self.net, self.net.functions, block.rows);
        block.strengths(net, &mut space.strengths);
        space.summed[0].fill(0.0);
        for rule in 0..net.rules() {
            let (w, f) = (column(&space.strengths, rule, rows), column(&space.rules, rule, rows));
            multiply_add(&mut space.summed[0][..rows], w, f);
        }
        space.alone.fill(0.0);
        if self.want == Want::Error {
            return;
        }
        for rule in 0..net.rules() {
            let functions: Vec<usize> = (0..net.inputs).map(|i| i * m + net.function_of(rule, i)).collect();
            for row in 0..rows {
                let mut least = functions[0];
                for &k in &functions[1..] {
                    if block.mu[k * BLOCK + row] < block.mu[least * BLOCK + row] {
                        least = k;
                    }
                }
                space.alone[least * BLOCK + row] +=
                    space.strengths[rule * BLOCK + row] * (space.rules[rule * BLOCK + row] - space.summed[0][row]);
            }
        }
    }

    #[inline(always)]
    fn jacobian(&self, space: &mut Space, block: &Block) {
        let (net, rows) = (self.net, block.rows);
        let width = parameters(net, self.free);
        for (k, premise) in net.premise.iter().enumerate() {
            let x = column(&block.x, k / net.functions, rows);
            let slope = column(&block.slope, k, rows);
            let alone = column(&space.alone, k, rows);
            multiply(column_mut(&mut space.jacobian, k * width, rows), alone, slope);
            let (head, tail) = space.jacobian.split_at_mut((k * width + 1) * BLOCK);
            let by_width = column(head, k * width, rows);
            let mut tail = tail.chunks_mut(BLOCK);
            if self.free {
                let log = column(&block.log, k, rows);
                for ((d, w), l) in tail.next().into_iter().flatten().zip(by_width).zip(log) {
                    *d = -0.5 * w * l;
                }
            }
            for ((d, w), x) in tail.next().into_iter().flatten().zip(by_width).zip(x) {
                let distance = x - premise.c;
                *d = if distance == 0.0 { 0.0 } else { w / distance };
            }
        }
    }
}

/// The linear functions of all rules.
#[inline(always)]
fn rule_outputs(net: &Net, block: &Block, out: &mut [f64]) {
    let rows = block.rows;
    for (rule, p) in net.consequents.chunks(net.inputs + 1).enumerate() {
        let f = column_mut(out, rule, rows);
        match net.inputs {
            3 => {
                let [x, y, z] = [0, 1, 2].map(|k| column(&block.x, k, rows));
                for (((f, x), y), z) in f.iter_mut().zip(x).zip(y).zip(z) {
                    *f = p[3] + p[0] * x + p[1] * y + p[2] * z;
                }
            }
            n => {
                f.fill(p[n]);
                for (k, p) in p[..n].iter().enumerate() {
                    f.iter_mut().zip(column(&block.x, k, rows)).for_each(|(f, x)| *f += p * x);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use greyrig::anfis::{Firing, Premise, Shape};

    use super::*;
    use crate::anfis::moments::moments;

    /// Numbers without pattern within ±1.
    fn draw(k: usize) -> f64 {
        (k as f64 * 12.9898).sin() * 43758.5453 % 1.0
    }

    fn net(shape: Shape, firing: Firing, inputs: usize, functions: usize) -> Net {
        let mut net = Net::grid(shape, firing, 2.0, functions, &vec![(-1.0, 1.0); inputs]);
        for (k, p) in net.premise.iter_mut().enumerate() {
            *p = Premise { a: p.a * (1.2 + 0.3 * draw(k)), b: 1.7 + 0.6 * draw(k + 50), c: p.c + 0.1 * draw(k + 100) };
        }
        (0..net.columns()).for_each(|k| net.consequents[k] = draw(k + 200));
        net
    }

    fn table(inputs: usize, rows: usize) -> Table {
        let row = |r: usize| (0..inputs).map(|i| draw(r * 7 + i + 300)).collect::<Vec<_>>();
        Table::collect(inputs, (0..rows).map(|r| (row(r), draw(r * 7 + 900)))).unwrap()
    }

    const ALL: [(Shape, Firing); 4] = [
        (Shape::Bell, Firing::Product),
        (Shape::Gaussian, Firing::Product),
        (Shape::Bell, Firing::Minimum),
        (Shape::Gaussian, Firing::Minimum),
    ];

    fn squared_error(net: &Net, table: &Table, scales: &[Scale]) -> f64 {
        let sums = sweep(&Workers::new(1).unwrap(), net, true, table, scales, Want::Error).unwrap();
        sums.squared_error
    }

    /// Against the layers one by one, and the gradient against central differences.
    #[test]
    fn errors_and_their_derivatives() {
        for (shape, firing) in ALL {
            for (inputs, functions) in [(1, 5), (2, 3), (3, 3), (4, 2)] {
                let (net, table) = (net(shape, firing, inputs, functions), table(inputs, 300));
                let scales = vec![Scale::NONE; inputs];
                let chunk = table.chunk(0).unwrap();
                let direct: f64 = (0..300)
                    .map(|r| {
                        let x: Vec<f64> = (0..inputs).map(|i| chunk[i * 300 + r]).collect();
                        (chunk[inputs * 300 + r] - net.output(&x)).powi(2)
                    })
                    .sum();
                let sums = sweep(&Workers::new(1).unwrap(), &net, true, &table, &scales, Want::Normal).unwrap();
                // Roundings of 300 terms.
                assert!((sums.squared_error / direct - 1.0).abs() < 1e-11, "{shape:?} {firing:?}");
                let width = parameters(&net, true);
                // Steps of 1e-5 leave the third derivative's 1e-10 and rounding's 1e-11 of the error.
                const STEP: f64 = 1e-5;
                for k in 0..sums.gradient.len() {
                    let moved = |by: f64| {
                        let mut net = net.clone();
                        let p = &mut net.premise[k / width];
                        match (k % width, width) {
                            (0, _) => p.a *= by.exp(),
                            (1, 3) => p.b *= by.exp(),
                            _ => p.c += by,
                        }
                        squared_error(&net, &table, &scales)
                    };
                    let numeric = -(moved(STEP) - moved(-STEP)) / (4.0 * STEP);
                    let scale = sums.gradient.amax();
                    // The minimum has kinks, which a step may cross on some row.
                    let tolerance = if firing == Firing::Product { 1e-7 } else { 1e-3 };
                    let error = (numeric - sums.gradient[k]).abs();
                    assert!(error < tolerance * scale, "{shape:?} {firing:?} {k}: {numeric} {}", sums.gradient[k]);
                }
            }
        }
    }

    /// The factorised sums are those of the matrix A written out.
    #[test]
    fn normal_equations() {
        for (shape, firing) in ALL {
            for (inputs, functions, rows) in [(1, 5, 3), (2, 3, 131), (3, 3, 300), (4, 2, 257)] {
                let (net, table) = (net(shape, firing, inputs, functions), table(inputs, rows));
                let chunk = table.chunk(0).unwrap();
                let a = DMatrix::from_fn(rows, net.columns(), |r, column| {
                    // The output with one consequent 1 and the others 0.
                    let mut one = net.clone();
                    one.consequents.fill(0.0);
                    one.consequents[column] = 1.0;
                    one.output(&(0..inputs).map(|i| chunk[i * rows + r]).collect::<Vec<_>>())
                });
                let y = DVector::from_fn(rows, |r, _| chunk[inputs * rows + r]);
                let sums = moments(&Workers::new(1).unwrap(), &net, &table, &vec![Scale::NONE; inputs]).unwrap();
                // Roundings of as many terms below 1.
                assert!((&sums.gram - a.tr_mul(&a)).amax() < 1e-13 * rows as f64, "{shape:?} {firing:?} {inputs}");
                assert!((&sums.rhs - a.tr_mul(&y)).amax() < 1e-13 * rows as f64);
            }
        }
    }
}
