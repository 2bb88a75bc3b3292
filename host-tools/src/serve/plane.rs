//! The residual over a plane of what the motor did, and the instants that a cell of it holds.

use super::api::{Axis, Map};
use super::simulated::{Kind, Simulated};
use crate::compare::Signal;

/// Cells along each side.
const CELLS: usize = 24;
/// Stretches of time that are told at most: as many as a screen has columns. Closer ones are joined.
const MOST_STRETCHES: usize = 2000;

/// What spans a map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// Current and speed.
    CurrentSpeed,
    /// Phase of the mains and voltage.
    PhaseVoltage,
}

/// The edges of a map's cells.
pub struct Grid {
    plane: Plane,
    x: Vec<f64>,
    y: Vec<f64>,
}

impl Plane {
    /// By its name.
    pub fn of(name: &str) -> Option<Self> {
        match name {
            "i_omega" => Some(Self::CurrentSpeed),
            "phase_u" => Some(Self::PhaseVoltage),
            _ => None,
        }
    }

    /// What the motor did at a sample that counts.
    fn at(self, s: &Simulated, n: usize) -> Option<[f64; 2]> {
        if !s.counted[n] {
            return None;
        }
        let measured = |signal| Some(s.signal(signal)?.curve(Kind::Measured).pyramid.samples()[n]);
        let point = match self {
            Self::CurrentSpeed => [measured(Signal::Current)?, measured(Signal::Speed)?],
            Self::PhaseVoltage => [s.phase[n], s.voltage[n]],
        };
        point.iter().all(|x| x.is_finite()).then(|| point.map(f64::from))
    }

    const fn axes(self) -> [[&'static str; 2]; 2] {
        match self {
            Self::CurrentSpeed => [["current", "A"], ["speed", "rad/s"]],
            Self::PhaseVoltage => [["phase of the mains", "°"], ["voltage", "V"]],
        }
    }
}

impl Grid {
    /// Over all that the recordings hold; none: they hold none of it.
    pub fn over(plane: Plane, all: &[&Simulated]) -> Option<Self> {
        let mut range = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for s in all {
            for point in (0..s.counted.len()).filter_map(|n| plane.at(s, n)) {
                for (range, x) in range.iter_mut().zip(point) {
                    *range = [range[0].min(x), range[1].max(x)];
                }
            }
        }
        let edges = |[low, high]: [f64; 2]| {
            (high > low).then(|| (0..=CELLS).map(|k| low + (high - low) * k as f64 / CELLS as f64).collect())
        };
        Some(Self { plane, x: edges(range[0])?, y: edges(range[1])? })
    }

    /// The cell of a sample.
    fn cell(&self, s: &Simulated, n: usize) -> Option<usize> {
        let [x, y] = self.plane.at(s, n)?;
        let place = |edges: &[f64], x: f64| {
            let share = (x - edges[0]) / (edges[CELLS] - edges[0]);
            ((share * CELLS as f64).max(0.0) as usize).min(CELLS - 1)
        };
        Some(place(&self.y, y) * CELLS + place(&self.x, x))
    }

    /// The residual of a signal in each cell.
    pub fn map(&self, all: &[&Simulated], signal: Signal, unit: &str) -> Map {
        let mut map = Map {
            x: self.axis(0, &self.x),
            y: self.axis(1, &self.y),
            unit: unit.to_owned(),
            counts: vec![0; CELLS * CELLS],
            mean: vec![0.0; CELLS * CELLS],
            rms: vec![0.0; CELLS * CELLS],
        };
        for s in all {
            let Some(residual) = s.signal(signal).map(|c| c.curve(Kind::Residual).pyramid.samples()) else { continue };
            for (n, r) in residual.iter().enumerate().filter(|(_, r)| r.is_finite()) {
                if let Some(cell) = self.cell(s, n) {
                    map.counts[cell] += 1;
                    map.mean[cell] += f64::from(*r);
                    map.rms[cell] += f64::from(*r).powi(2);
                }
            }
        }
        for (k, count) in map.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            map.mean[k] /= f64::from(*count);
            map.rms[k] = (map.rms[k] / f64::from(*count)).sqrt();
        }
        map
    }

    fn axis(&self, which: usize, edges: &[f64]) -> Axis {
        let [name, unit] = self.plane.axes()[which];
        Axis { name: name.to_owned(), unit: unit.to_owned(), edges: edges.to_vec() }
    }

    /// When a recording was in some cells: stretches from, to, s.
    pub fn instants(&self, s: &Simulated, cells: &[usize]) -> Vec<[f64; 2]> {
        let inside = (0..s.counted.len()).filter(|n| self.cell(s, *n).is_some_and(|cell| cells.contains(&cell)));
        let mut stretches: Vec<[usize; 2]> = Vec::new();
        for n in inside {
            match stretches.last_mut() {
                Some(last) if last[1] == n => last[1] = n + 1,
                _ => stretches.push([n, n + 1]),
            }
        }
        let mut least_gap = 1;
        while stretches.len() > MOST_STRETCHES {
            least_gap *= 2;
            stretches.dedup_by(|next, before| {
                let is_close = next[0] - before[1] < least_gap;
                if is_close {
                    before[1] = next[1];
                }
                is_close
            });
        }
        let time = |n: usize| s.start_s + n as f64 * s.step_s;
        stretches.iter().map(|[from, to]| [time(*from), time(*to)]).collect()
    }

    /// The cells in which a recording was between two times.
    pub fn cells(&self, s: &Simulated, from_s: f64, to_s: f64) -> Vec<u32> {
        let place = |t: f64| (((t - s.start_s) / s.step_s).max(0.0) as usize).min(s.counted.len());
        let mut cells: Vec<u32> = (place(from_s)..place(to_s))
            .filter_map(|n| self.cell(s, n))
            .filter_map(|c| u32::try_from(c).ok())
            .collect();
        cells.sort_unstable();
        cells.dedup();
        cells
    }
}
