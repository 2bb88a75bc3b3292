//! Least squares of few regressors, with standard errors by leaving out groups of rows.
//!
//! y = Σ b_k x_k + e, by the normal equations of columns scaled to unit RMS. The standard error of b is that of the
//! delete-a-group jackknife, se² = (G − 1)/G Σ (b₍g₎ − b̄)², which holds for any distribution and any colour of e
//! within a group (Efron and Stein 1981).

use super::criteria::GROUPS;

/// The result for N regressors.
#[derive(Debug, Clone)]
pub struct Fit<const N: usize> {
    /// Coefficients.
    pub b: [f64; N],
    /// Coefficients over their standard errors.
    pub t: [f64; N],
    /// Sum of squares left over, over that of y about its mean.
    pub unexplained: f64,
    /// Mean square left over.
    pub variance: f64,
    /// Rows.
    pub rows: usize,
}

/// Sums of products of one group.
#[derive(Clone, Copy)]
struct Sums<const N: usize> {
    xx: [[f64; N]; N],
    xy: [f64; N],
    yy: f64,
    y: f64,
    n: f64,
}

impl<const N: usize> Sums<N> {
    const ZERO: Self = Self { xx: [[0.0; N]; N], xy: [0.0; N], yy: 0.0, y: 0.0, n: 0.0 };

    fn add(&mut self, x: &[f64; N], y: f64) {
        for a in 0..N {
            for b in 0..N {
                self.xx[a][b] += x[a] * x[b];
            }
            self.xy[a] += x[a] * y;
        }
        self.yy += y * y;
        self.y += y;
        self.n += 1.0;
    }

    fn plus(mut self, other: &Self, sign: f64) -> Self {
        for a in 0..N {
            for b in 0..N {
                self.xx[a][b] += sign * other.xx[a][b];
            }
            self.xy[a] += sign * other.xy[a];
        }
        self.yy += sign * other.yy;
        self.y += sign * other.y;
        self.n += sign * other.n;
        self
    }

    /// Coefficients by Cholesky; those of columns that are multiples of others are zero.
    fn solve(&self) -> [f64; N] {
        const DEPENDENT: f64 = 1e-9;
        let scale: [f64; N] = std::array::from_fn(|k| self.xx[k][k].sqrt());
        let a = |i: usize, j: usize| {
            if scale[i] > 0.0 && scale[j] > 0.0 { self.xx[i][j] / (scale[i] * scale[j]) } else { 0.0 }
        };
        let mut l = [[0.0; N]; N];
        let mut used = [false; N];
        for i in 0..N {
            for j in 0..i {
                let sum: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
                l[i][j] = if used[j] { (a(i, j) - sum) / l[j][j] } else { 0.0 };
            }
            let rest = a(i, i) - l[i][..i].iter().map(|x| x * x).sum::<f64>();
            used[i] = rest > DEPENDENT;
            l[i][i] = if used[i] { rest.sqrt() } else { 1.0 };
        }
        let mut z = [0.0; N];
        for i in 0..N {
            if used[i] {
                let sum: f64 = (0..i).map(|k| l[i][k] * z[k]).sum();
                z[i] = (self.xy[i] / scale[i] - sum) / l[i][i];
            }
        }
        let mut b = [0.0; N];
        for i in (0..N).rev() {
            if used[i] {
                let sum: f64 = (i + 1..N).map(|k| l[k][i] * b[k]).sum();
                b[i] = (z[i] - sum) / l[i][i];
            }
        }
        std::array::from_fn(|k| if used[k] { b[k] / scale[k] } else { 0.0 })
    }

    fn left(&self, b: &[f64; N]) -> f64 {
        let mut left = self.yy;
        for i in 0..N {
            left -= 2.0 * b[i] * self.xy[i];
            for j in 0..N {
                left += b[i] * b[j] * self.xx[i][j];
            }
        }
        left.max(0.0)
    }
}

/// Fits rows (x, y) in their order of time; `None` with too few.
pub fn fit<const N: usize>(rows: impl Iterator<Item = ([f64; N], f64)>) -> Option<Fit<N>> {
    /// Neighbouring rows that stay together.
    const TOGETHER: usize = 4;
    let mut groups = [Sums::<N>::ZERO; GROUPS];
    let mut count = 0;
    for (x, y) in rows {
        groups[count / TOGETHER % GROUPS].add(&x, y);
        count += 1;
    }
    if count < 2 * GROUPS {
        return None;
    }
    let whole = groups.iter().fold(Sums::ZERO, |sum, g| sum.plus(g, 1.0));
    let b = whole.solve();
    let mut squares = [0.0; N];
    let used: Vec<[f64; N]> = groups.iter().filter(|g| g.n > 0.0).map(|g| whole.plus(g, -1.0).solve()).collect();
    let groups = used.len() as f64;
    for k in 0..N {
        let mean = used.iter().map(|b| b[k]).sum::<f64>() / groups;
        squares[k] = used.iter().map(|b| (b[k] - mean).powi(2)).sum::<f64>() * (groups - 1.0) / groups;
    }
    let left = whole.left(&b);
    let about_mean = (whole.yy - whole.y * whole.y / whole.n).max(0.0);
    Some(Fit {
        t: std::array::from_fn(|k| if squares[k] > 0.0 { b[k] / squares[k].sqrt() } else { 0.0 }),
        b,
        unexplained: if about_mean > 0.0 { left / about_mean } else { 1.0 },
        variance: left / whole.n,
        rows: count,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recovers_a_law_and_its_errors() {
        // y = 2 − 3 x + e, e of a linear congruence, uniform in ±0.5: variance 1/12.
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let rows: Vec<([f64; 2], f64)> = (0..4000)
            .map(|_| {
                let x = 2.0 * random();
                ([1.0, x], 2.0 - 3.0 * x + random())
            })
            .collect();
        let fit = fit(rows.into_iter()).unwrap();
        assert!((fit.b[0] - 2.0).abs() < 0.02 && (fit.b[1] + 3.0).abs() < 0.04);
        // The standard error of the slope is √(1/12 / (4000 · 1/3)) = 0.0079, that of a jackknife with 20 groups is
        // within a half.
        assert!((fit.t[1] / (-3.0 / 0.0079) - 1.0).abs() < 0.5, "{}", fit.t[1]);
        assert!((fit.variance * 12.0 - 1.0).abs() < 0.1);
    }
}
