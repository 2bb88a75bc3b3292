//! The shape of what is missing, free of any formula: the residual of a balance against the quantity that orders it
//! best.
//!
//! The rows are cut into bins with equally many rows along each quantity. The quantity whose bins explain the largest
//! share of the residual's variance (the correlation ratio η²) is shown as a curve, and the plane of current and speed
//! as a map.
//!
//! Source: K. Pearson: On the general theory of skew correlation and non-linear regression, 1905, for η².

use serde::Serialize;

use crate::identify::equation_error::{Balance, EquationError};
use crate::identify::minimise::{Fit, Residuals};

/// Bins of the curve.
const BINS: usize = 12;
/// Bins of the map on each side.
const MAP_BINS: usize = 6;
/// Fewest rows in a cell of the map.
const FEWEST_ROWS: usize = 4;

/// A quantity of the state: name, unit, its value at current (A), speed (rad/s) and di/dt (A/s).
type Axis = (&'static str, &'static str, fn(f64, f64, f64) -> f64);

const VOLTAGE_AXES: &[Axis] = &[
    ("i_a", "A", |i, _, _| i),
    ("|i|", "A", |i, _, _| i.abs()),
    ("omega_rad_s", "rad/s", |_, w, _| w),
    ("i*omega", "A rad/s", |i, w, _| i * w),
    ("di/dt", "A/s", |_, _, d| d),
    ("omega*di/dt", "A rad/s²", |_, w, d| w * d),
];
const TORQUE_AXES: &[Axis] = &[
    ("omega_rad_s", "rad/s", |_, w, _| w),
    ("i²", "A²", |i, _, _| i * i),
    ("i²*omega", "A² rad/s", |i, w, _| i * i * w),
];

/// A point of the curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// Mean of the quantity.
    pub at: f64,
    /// Mean of what is missing: V on the side of R i, or N m of braking torque.
    pub missing: f64,
    /// Rows.
    pub rows: usize,
}

/// A cell of the map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cell {
    /// Mean current, A.
    pub i_a: f64,
    /// Mean speed, rad/s.
    pub omega_rad_s: f64,
    /// Mean of what is missing.
    pub missing: f64,
    /// Rows.
    pub rows: usize,
}

/// The shape of what is missing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shape {
    /// `voltage` or `torque`.
    pub balance: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The quantity that orders it best.
    pub axis: &'static str,
    /// The quantity's unit.
    pub axis_unit: &'static str,
    /// Share of the residual's variance that the curve explains.
    pub explains: f64,
    /// The curve.
    pub curve: Vec<Point>,
    /// Share that the map explains.
    pub map_explains: f64,
    /// The map over current and speed.
    pub map: Vec<Cell>,
}

/// The rows of one balance: what is missing, and the mean of any quantity over each row.
struct Side<'a> {
    problem: &'a EquationError<'a>,
    balance: Balance,
    rows: Vec<usize>,
    weights: Vec<f64>,
    missing: Vec<f64>,
}

impl<'a> Side<'a> {
    fn new(fit: &Fit, problem: &'a EquationError<'a>, balance: Balance, group: u8) -> Self {
        let one = problem.column(balance, &|_, _, _| 1.0);
        let rows: Vec<usize> =
            (0..problem.groups().len()).filter(|k| problem.groups()[*k] == group && one[*k] != 0.0).collect();
        let weights: Vec<f64> = rows.iter().map(|k| one[*k]).collect();
        let missing =
            rows.iter().zip(&weights).map(|(k, w)| -fit.residuals[*k] * fit.rms[usize::from(group)] / w).collect();
        Self { problem, balance, rows, weights, missing }
    }

    fn quantity(&self, of: fn(f64, f64, f64) -> f64) -> Vec<f64> {
        let column = self.problem.column(self.balance, &of);
        self.rows.iter().zip(&self.weights).map(|(k, w)| column[*k] / w).collect()
    }

    /// Share of the variance that means over sets of rows explain.
    fn explained(&self, sets: &[Vec<usize>]) -> f64 {
        let mean = |set: &[usize]| set.iter().map(|k| self.missing[*k]).sum::<f64>() / set.len().max(1) as f64;
        let whole = self.missing.iter().sum::<f64>() / self.missing.len().max(1) as f64;
        let total: f64 = self.missing.iter().map(|m| (m - whole).powi(2)).sum();
        let between: f64 = sets.iter().map(|set| set.len() as f64 * (mean(set) - whole).powi(2)).sum();
        if total > 0.0 { between / total } else { 0.0 }
    }
}

/// Rows cut into bins with equally many of them along a quantity.
fn bins(quantity: &[f64], rows: &[usize], count: usize) -> Vec<Vec<usize>> {
    let mut order = rows.to_vec();
    order.sort_by(|a, b| quantity[*a].total_cmp(&quantity[*b]));
    order.chunks(order.len().div_ceil(count).max(1)).map(<[usize]>::to_vec).collect()
}

/// The shape of what a fit leaves over in the voltage or the torque balance. `None` without rows.
pub fn of(fit: &Fit, problem: &EquationError<'_>, balance: Balance) -> Option<Shape> {
    let (group, axes, name, unit) = match balance {
        Balance::Voltage => (0, VOLTAGE_AXES, "voltage", "V"),
        Balance::Torque => (1, TORQUE_AXES, "torque", "N m"),
    };
    let side = Side::new(fit, problem, balance, group);
    let all: Vec<usize> = (0..side.rows.len()).collect();
    if all.len() < 2 * BINS {
        return None;
    }
    let mean = |values: &[f64], set: &[usize]| set.iter().map(|k| values[*k]).sum::<f64>() / set.len().max(1) as f64;
    let ((axis, axis_unit, _), quantity, sets, explains) = axes
        .iter()
        .map(|axis| {
            let quantity = side.quantity(axis.2);
            let sets = bins(&quantity, &all, BINS);
            let explains = side.explained(&sets);
            (axis, quantity, sets, explains)
        })
        .max_by(|a, b| a.3.total_cmp(&b.3))?;
    let curve = sets
        .iter()
        .map(|set| Point { at: mean(&quantity, set), missing: mean(&side.missing, set), rows: set.len() })
        .collect();
    let (current, speed) = (side.quantity(|i, _, _| i), side.quantity(|_, w, _| w));
    let cells: Vec<Vec<usize>> = bins(&speed, &all, MAP_BINS)
        .iter()
        .flat_map(|slice| bins(&current, slice, MAP_BINS))
        .filter(|cell| cell.len() >= FEWEST_ROWS)
        .collect();
    let map = cells
        .iter()
        .map(|cell| Cell {
            i_a: mean(&current, cell),
            omega_rad_s: mean(&speed, cell),
            missing: mean(&side.missing, cell),
            rows: cell.len(),
        })
        .collect();
    Some(Shape { balance: name, unit, axis, axis_unit, explains, curve, map_explains: side.explained(&cells), map })
}
