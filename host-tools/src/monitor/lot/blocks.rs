//! The balances of a run, block by block.
//!
//! With v = u − R i − K φ ω − … what the model leaves for the inductance and τ = K φ i − … what it leaves for the
//! inertia, both at the measured state, ⟨⟩ the mean over a block of whole periods of the mains and T its length,
//!
//! | row | what is in it |
//! | --- | --- |
//! | power | ⟨v i⟩ − Δ(L i²/2)/T |
//! | torque | ⟨τ⟩ − J Δω/T |
//! | mean current | ⟨i⟩, on alternating voltage |
//! | sparks | ln RMS of the current above 1 kHz |
//! | ripple | amplitude of the speed's wave once a turn |
//!
//! L i di integrates to nothing over a period, so that the inductance drops out, with what saturates it, and no current
//! has to be simulated. The speed at the ends of a block is its mean over a period around them, and the torque is
//! averaged alike, both over a turn of the rotor, too. (Two further moments of v, ⟨v sgn i⟩ and ⟨v i |i|⟩, were tried:
//! on lots of mixed laws their limits were wider by more than what they told.)

use std::f64::consts::TAU;
use std::path::Path;

use greyrig::butterworth::HighPass;
use greyrig::detector::SPARKS_ABOVE_HZ;
use greyrig::motor::BaseParameter;
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::experiment::{Drive, Experiment};
use crate::identify::equation_error::WholeMotor;
use crate::identify::prepare;
use crate::model::Model;
use crate::model::lot::{BALANCES, Fault, ROWS};
use crate::recording::Recording;

/// The row of the power.
pub const POWER: usize = 0;
/// The row of the torque.
pub const TORQUE: usize = 1;
const MEAN_CURRENT: usize = 2;
/// The row of sparks.
pub const SPARKS: usize = 3;
/// The row of the speed's ripple.
pub const RIPPLE: usize = 4;
/// Periods in a block.
pub const PERIODS: f64 = 5.0;
/// A period without mains, s.
const USUAL_PERIOD_S: f64 = 0.02;
/// Share of the largest voltage above which the supply is on.
const ON: f64 = 0.05;
/// Change of the voltage from one period to the next, of the largest, after which the current settles.
const STEP: f64 = 0.03;
/// Periods that it takes.
const SETTLES: usize = 2;
/// Least speed at which friction has its direction, of the largest.
const TURNS: f64 = 0.02;
/// Relative difference of the mains' period up to which a test is that of the lot: EN 50160 allows 1 %.
const SAME_PERIOD: f64 = 0.012;
/// Turns within a block from which a wave once a turn is told from the course of the speed: the main lobe of Hann's
/// window is four wide.
const FEWEST_TURNS: f64 = 4.0;
/// Samples a turn, at least, by Nyquist with room for the window's lobe.
const FEWEST_SAMPLES_A_TURN: f64 = 2.5;
/// Relative change by which a derivative is taken: the balances are linear in the parameters and of low degree in the
/// signals.
const SMALL: f64 = 1e-3;
/// Current by which a contact's drop has come to 1 − 1/e, A. The law's own where the model has one; else as the
/// balances hardly tell it apart from a constant drop.
const CONTACT_A: f64 = 0.5;

/// A block of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Its middle, s since the recording began.
    pub t_s: f64,
    /// What is in them.
    pub rows: [f64; ROWS],
    /// Whether a row counts.
    pub counts: [bool; ROWS],
    /// RMS voltage, V.
    pub voltage: f64,
    /// Mean magnitude of the power, W.
    pub power: f64,
    /// What each fault of unit size adds, in the order of [`Fault::ALL`].
    pub columns: Vec<[f64; ROWS]>,
    /// What a gain of the speed's sensor adds that comes within the block, −J ω/T: the torque balance takes the jump
    /// for an acceleration.
    pub jump: [f64; ROWS],
}

/// The balances of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Length of a block, s.
    pub block_s: f64,
    /// Its blocks, since the supply was switched on.
    pub blocks: Vec<Block>,
}

/// How the runs of a lot are cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Length of a block, s.
    pub block_s: f64,
    /// Whether the voltage alternates.
    pub alternating: bool,
    /// Speed at which frictions are told, rad/s.
    pub top_speed: f64,
}

impl Cut {
    /// As a test tells it.
    pub fn of(e: &Experiment) -> Self {
        let top_speed = e.speed.iter().flatten().fold(0.0f64, |most, w| most.max(w.abs()));
        let block_s = PERIODS * e.mains_period_s.unwrap_or(USUAL_PERIOD_S);
        Self { block_s, alternating: e.mains_period_s.is_some(), top_speed }
    }

    /// Whether runs of another cut can be compared: blocks of the same length, of alternating voltage or of direct.
    pub fn is_as(&self, other: &Self) -> bool {
        self.alternating == other.alternating && (self.block_s / other.block_s - 1.0).abs() <= SAME_PERIOD
    }

    /// The balances of a test by a model.
    ///
    /// # Errors
    /// A model that no motor can have.
    pub fn run(&self, model: &Model, e: &Experiment) -> Result<Run> {
        let borders = self.borders(e);
        let refused = |x: greyrig::motor::ParameterError| {
            Error::usage(format!("{}: {x}", e.name), "check the model's parameters")
        };
        model.motor::<f64>().map_err(refused)?;
        let plain = self.rows(e, model, &borders).ok_or_else(|| lacks(&e.name))?;
        let columns: Vec<Option<Vec<[f64; ROWS]>>> =
            Fault::ALL.par_iter().map(|fault| self.column(*fault, SMALL, e, model, &borders, &plain)).collect();
        let direct = Direct::of(e, &borders, self.alternating);
        let voltage = Integral::of(&e.input.iter().map(|u| u * u).collect::<Vec<f64>>());
        let power = Integral::of(
            &e.input.iter().zip(e.current.iter().flatten()).map(|(u, i)| (u * i).abs()).collect::<Vec<f64>>(),
        );
        let counts = self.counts(e, &borders);
        let speed = Integral::of(e.speed.as_deref().unwrap_or_default());
        let inertia = model.value(BaseParameter::J);
        let blocks = (0..borders.len().saturating_sub(1)).map(|k| {
            let mut rows = [0.0; ROWS];
            rows[..BALANCES].copy_from_slice(&plain[k]);
            let mut counts = counts[k];
            for (row, value) in [(MEAN_CURRENT, direct.mean[k]), (SPARKS, direct.sparks[k]), (RIPPLE, direct.ripple[k])]
            {
                rows[row] = value.unwrap_or(0.0);
                counts[row] = value.is_some();
            }
            let column = |c: &Option<Vec<[f64; ROWS]>>| c.as_ref().map_or([0.0; ROWS], |c| c[k]);
            let two = &borders[k..k + 2];
            let mut jump = [0.0; ROWS];
            jump[TORQUE] = -inertia * speed.mean(two) / ((two[1] - two[0]) * e.interval_s);
            Block {
                t_s: 0.5 * (borders[k] + borders[k + 1]) * e.interval_s,
                rows,
                counts,
                voltage: voltage.mean(two).max(0.0).sqrt(),
                power: power.mean(two),
                columns: columns.iter().map(column).collect(),
                jump,
            }
        });
        Ok(Run { block_s: self.block_s, blocks: blocks.collect() })
    }

    /// A run whose columns of some faults are those of sizes that are not small: the secant in place of the tangent,
    /// since gains stand in the balances with powers.
    pub fn with_columns_at(&self, sizes: &[(Fault, f64)], run: &Run, model: &Model, e: &Experiment) -> Run {
        let borders = self.borders(e);
        let plain: Vec<[f64; BALANCES]> =
            run.blocks.iter().map(|block| std::array::from_fn(|row| block.rows[row])).collect();
        let columns: Vec<_> = sizes
            .par_iter()
            .map(|(fault, size)| (*fault, self.column(*fault, *size, e, model, &borders, &plain)))
            .collect();
        let mut run = run.clone();
        for (fault, column) in columns {
            for (block, rows) in run.blocks.iter_mut().zip(column.into_iter().flatten()) {
                block.columns[fault as usize] = rows;
            }
        }
        run
    }

    /// Places of the borders, in samples: each where the voltage rises through zero next to where it should be.
    fn borders(&self, e: &Experiment) -> Vec<f64> {
        let peak = e.input.iter().fold(0.0f64, |peak, u| peak.max(u.abs()));
        let mut crossings = Vec::new();
        let mut armed = false;
        for (n, two) in e.input.windows(2).enumerate() {
            if two[0] < -ON * peak {
                armed = true;
            }
            if armed && two[0] < 0.0 && two[1] >= 0.0 {
                crossings.push(n as f64 + two[0] / (two[0] - two[1]));
                armed = false;
            }
        }
        let on = e.input.iter().position(|u| u.abs() > ON * peak).unwrap_or(0) as f64;
        let period = self.block_s / PERIODS / e.interval_s;
        let nearest = |x: f64| {
            let k = crossings.partition_point(|c| *c < x);
            let beside = [k.checked_sub(1), Some(k)].into_iter().flatten().filter_map(|k| crossings.get(k));
            beside
                .filter(|c| (*c - x).abs() <= 0.6 * period)
                .min_by(|a, b| (*a - x).abs().total_cmp(&(*b - x).abs()))
                .copied()
        };
        let last = (e.len() - 1) as f64 - 0.5 * period;
        let mut borders: Vec<f64> = Vec::new();
        let mut x = on.max(0.5 * period + 1.0);
        while x <= last {
            let at = if self.alternating { nearest(x).filter(|at| (0.5 * period..=last).contains(at)) } else { None };
            borders.push(at.unwrap_or(x));
            x += self.block_s / e.interval_s;
        }
        borders
    }

    /// The balances' rows of an experiment by a model.
    fn rows(&self, e: &Experiment, model: &Model, borders: &[f64]) -> Option<Vec<[f64; BALANCES]>> {
        self.rows_with(e, model, borders, |_, _| 0.0, |_| 0.0)
    }

    /// The same with a voltage that is lost by current, V, and a torque by speed, N m.
    fn rows_with(
        &self,
        e: &Experiment,
        model: &Model,
        borders: &[f64],
        lost: impl Fn(f64, usize) -> f64,
        braked: impl Fn(f64) -> f64,
    ) -> Option<Vec<[f64; BALANCES]>> {
        let motor = model.motor::<f64>().ok()?;
        let whole = WholeMotor::new(e)?;
        let left = whole.left(&motor);
        let [current, speed] = whole.at_the_motor(&motor);
        let v: Vec<f64> = left.voltage.iter().zip(&current).enumerate().map(|(n, (v, i))| v + lost(*i, n)).collect();
        let stored: Vec<f64> = left.inductance.iter().zip(&current).map(|(l, i)| 0.5 * l * i * i).collect();
        let product = Integral::of(&v.iter().zip(&current).map(|(v, i)| v * i).collect::<Vec<f64>>());
        let power = borders.windows(2).map(|two| {
            let change = between(&stored, two[1]) - between(&stored, two[0]);
            product.mean(two) - change / ((two[1] - two[0]) * e.interval_s)
        });
        let torque: Vec<f64> = left.torque.iter().zip(&speed).map(|(t, w)| t + braked(*w)).collect();
        let period = self.block_s / PERIODS / e.interval_s;
        let turns: Vec<Option<f64>> = borders.iter().map(|x| turn_around(e, *x, period)).collect();
        let (impulse, angle) = (Smooth::of(&Integral::of(&torque).values), Smooth::of(&speed));
        let at = |signal: &Smooth, n: usize| signal.mean_around(borders[n], period, turns[n]);
        let torques = (1..borders.len()).map(|n| {
            let length = borders[n] - borders[n - 1];
            let change = at(&angle, n) - at(&angle, n - 1);
            (at(&impulse, n) - at(&impulse, n - 1)) / length - left.inertia * change / (length * e.interval_s)
        });
        Some(power.zip(torques).map(|(power, torque)| [power, torque]).collect())
    }

    /// What a fault adds to the rows, by its size: with it the rows are `plain`, and with the model or the signals that
    /// undo a size of `at` they are as if it were not there.
    fn column(
        &self,
        fault: Fault,
        at: f64,
        e: &Experiment,
        model: &Model,
        borders: &[f64],
        plain: &[[f64; BALANCES]],
    ) -> Option<Vec<[f64; ROWS]>> {
        let difference = |other: Vec<[f64; BALANCES]>, size: f64| {
            let of = |(a, b): (&[f64; BALANCES], &[f64; BALANCES])| {
                std::array::from_fn(|row| if row < BALANCES { (a[row] - b[row]) / size } else { 0.0 })
            };
            other.iter().zip(plain).map(of).collect::<Vec<[f64; ROWS]>>()
        };
        let parameter = |parameter: BaseParameter| {
            let mut other = model.clone();
            let p = other.base_parameter_mut(parameter).filter(|p| p.value > 0.0)?;
            p.value *= 1.0 + at;
            Some(difference(self.rows(e, &other, borders)?, -at))
        };
        let without = |change: &dyn Fn(&mut Experiment)| {
            let mut other = e.clone();
            change(&mut other);
            Some(difference(self.rows(&other, model, borders)?, -at))
        };
        let top = self.top_speed.max(f64::MIN_POSITIVE);
        let braked =
            |torque: &dyn Fn(f64) -> f64| Some(difference(self.rows_with(e, model, borders, |_, _| 0.0, torque)?, 1.0));
        let scale = |signal: &mut Option<Vec<f64>>| signal.iter_mut().flatten().for_each(|x| *x /= 1.0 + at);
        let only = |row: usize| {
            let mut column = [0.0; ROWS];
            column[row] = 1.0;
            Some(vec![column; plain.len()])
        };
        match fault {
            Fault::Resistance => parameter(BaseParameter::R),
            Fault::Turns => parameter(BaseParameter::K),
            Fault::Inertia => parameter(BaseParameter::J),
            Fault::Contact => {
                let drop =
                    |i: f64, n: usize| if e.is_open(n) { 0.0 } else { sign(i) * -(-i.abs() / CONTACT_A).exp_m1() };
                Some(difference(self.rows_with(e, model, borders, drop, |_| 0.0)?, 1.0))
            }
            Fault::DryFriction => braked(&sign),
            Fault::ViscousFriction => braked(&|w| w / top),
            Fault::Load => braked(&|w| w * w.abs() / (top * top)),
            Fault::VoltageGain | Fault::VoltageDrift => without(&|e| e.input.iter_mut().for_each(|u| *u /= 1.0 + at)),
            Fault::CurrentGain | Fault::CurrentDrift => without(&|e| scale(&mut e.current)),
            Fault::SpeedGain | Fault::SpeedDrift => without(&|e| scale(&mut e.speed)),
            Fault::CurrentOffset => {
                let mut column = without(&|e| e.current.iter_mut().flatten().for_each(|i| *i -= at))?;
                column.iter_mut().for_each(|rows| rows[MEAN_CURRENT] = 1.0);
                Some(column)
            }
            Fault::Sparking => only(SPARKS),
            Fault::Imbalance => only(RIPPLE),
        }
    }

    /// Whether the balances of each block count: behind a step of the voltage the current settles, and friction has no
    /// direction at rest.
    fn counts(&self, e: &Experiment, borders: &[f64]) -> Vec<[bool; ROWS]> {
        let squares = Integral::of(&e.input.iter().map(|u| u * u).collect::<Vec<f64>>());
        let period = self.block_s / PERIODS / e.interval_s;
        let level = |from: f64| ((squares.at(from + period) - squares.at(from)) / period).max(0.0).sqrt();
        let last = (e.len() - 1) as f64;
        let highest = borders.iter().filter(|x| **x + period <= last).map(|x| level(*x)).fold(0.0, f64::max);
        let empty = Vec::new();
        let speed = e.speed.as_ref().unwrap_or(&empty);
        borders
            .windows(2)
            .map(|two| {
                let periods = PERIODS as usize + SETTLES;
                let levels: Vec<f64> = (0..=periods)
                    .map(|p| two[0] + (p as f64 - SETTLES as f64 - 1.0) * period)
                    .filter(|from| *from >= 0.0 && from + period <= last)
                    .map(level)
                    .collect();
                let steady = levels.windows(2).all(|l| (l[1] - l[0]).abs() <= STEP * highest);
                let [from, to] = [two[0] as usize, (two[1] as usize + 1).min(e.len())];
                let known = (from..to).all(|n| e.counted.get(n).copied().unwrap_or(true));
                let slice = speed.get(from..to).unwrap_or_default();
                let least = TURNS * self.top_speed;
                let turns = !slice.is_empty()
                    && (slice.iter().all(|w| *w > least) || slice.iter().all(|w| *w < -least))
                    && !(from..to).any(|n| e.is_locked(n));
                let mut counts = [false; ROWS];
                counts[..BALANCES].copy_from_slice(&[steady && known, turns && known]);
                counts
            })
            .collect()
    }
}

/// What is watched beside the balances.
struct Direct {
    mean: Vec<Option<f64>>,
    sparks: Vec<Option<f64>>,
    ripple: Vec<Option<f64>>,
}

impl Direct {
    fn of(e: &Experiment, borders: &[f64], alternating: bool) -> Self {
        let empty = Vec::new();
        let current = e.current.as_ref().unwrap_or(&empty);
        let speed = e.speed.as_ref().unwrap_or(&empty);
        let mean = Integral::of(current);
        let mean = borders.windows(2).map(|two| alternating.then(|| mean.mean(two))).collect();
        let log_rms = |signal: &[f64], above_hz: f64| -> Vec<Option<f64>> {
            let filter = HighPass::new(above_hz * e.interval_s).filter(|_| !signal.is_empty());
            let Some(mut filter) = filter else { return vec![None; borders.len().saturating_sub(1)] };
            filter.reset_to(signal[0] as f32);
            let squares: Vec<f64> = signal.iter().map(|x| f64::from(filter.process(*x as f32)).powi(2)).collect();
            let squares = Integral::of(&squares);
            borders.windows(2).map(|two| Some(0.5 * squares.mean(two).max(f64::MIN_POSITIVE).ln())).collect()
        };
        let sparks = log_rms(current, f64::from(SPARKS_ABOVE_HZ));
        let angles = angles(speed, e.interval_s);
        let of_turn = |two: &[f64]| {
            let within = two[0].ceil() as usize..(two[1] as usize + 1).min(speed.len());
            shows_a_turn(e).then(|| wave_of_turn(&speed[within.clone()], &angles[within])).flatten()
        };
        let ripple = borders.windows(2).map(of_turn).collect();
        Self { mean, sparks, ripple }
    }
}

/// Whether the speed can show a wave once a turn: one that is counted or averaged has none of its own.
fn shows_a_turn(e: &Experiment) -> bool {
    e.sensor.is_none() && !e.is_windowed()
}

/// The rotor's angle at each sample, rad.
fn angles(speed: &[f64], interval_s: f64) -> Vec<f64> {
    let turned = speed.iter().scan(0.0, |angle, w| {
        *angle += w * interval_s;
        Some(*angle)
    });
    turned.collect()
}

/// Amplitude, rad/s, of the wave of a speed once a turn beside its straight course, by Hann's window:
/// `2 |Σ h (ω − ω̄ − ω̇ t) e^(jθ)| / Σ h`. `None` where too few turns or too few samples of one tell it.
fn wave_of_turn(speed: &[f64], angles: &[f64]) -> Option<f64> {
    let count = speed.len() as f64;
    let turns = (angles.last()? - angles.first()?).abs() / TAU;
    if turns < FEWEST_TURNS || count < FEWEST_SAMPLES_A_TURN * turns {
        return None;
    }
    let middle = 0.5 * (count - 1.0);
    let mean = speed.iter().sum::<f64>() / count;
    let times = || (0..speed.len()).map(|n| n as f64 - middle);
    let slope = speed.iter().zip(times()).map(|(w, t)| w * t).sum::<f64>() / times().map(|t| t * t).sum::<f64>();
    let [mut cosine, mut sine, mut sum] = [0.0; 3];
    for ((w, angle), t) in speed.iter().zip(angles).zip(times()) {
        let window = 0.5 * (1.0 + (TAU * t / count).cos());
        let part = window * (w - mean - slope * t);
        cosine += part * angle.cos();
        sine += part * angle.sin();
        sum += window;
    }
    Some(2.0 * cosine.hypot(sine) / sum)
}

/// How long the turn takes in which a place lies, in samples. `None` of a turn that is longer than a block is half, or
/// that is not within the test.
fn turn_around(e: &Experiment, x: f64, period: f64) -> Option<f64> {
    let speed = e.speed.as_deref()?;
    let near = (x - 0.5 * period).max(0.0) as usize..((x + 0.5 * period) as usize + 1).min(speed.len());
    let mean = speed[near.clone()].iter().sum::<f64>() / near.len() as f64;
    let turn = TAU / (mean.abs() * e.interval_s);
    let reaches = 0.5 * (period + turn);
    (turn <= 0.5 * PERIODS * period && x >= reaches && x + reaches <= (speed.len() - 1) as f64).then_some(turn)
}

/// Mean of a signal over a window around a place and, of that, over another: of the turn in which the place lies, so
/// that what comes once a turn, an imbalance or an eccentric sensor, is no acceleration. Both are in samples.
struct Smooth {
    once: Integral,
    twice: Integral,
}

impl Smooth {
    fn of(signal: &[f64]) -> Self {
        let once = Integral::of(signal);
        Self { twice: Integral::of(&once.values), once }
    }

    fn mean_around(&self, x: f64, width: f64, turn: Option<f64>) -> f64 {
        match turn {
            None => self.once.mean_around(x, width),
            Some(turn) => {
                (self.twice.mean_around(x + 0.5 * width, turn) - self.twice.mean_around(x - 0.5 * width, turn)) / width
            }
        }
    }
}

/// The integral of a signal over its samples, by the trapezium rule.
struct Integral {
    signal: Vec<f64>,
    values: Vec<f64>,
}

impl Integral {
    fn of(signal: &[f64]) -> Self {
        let mut values = Vec::with_capacity(signal.len());
        let mut sum = 0.0;
        for (n, x) in signal.iter().enumerate() {
            sum += if n > 0 { 0.5 * (x + signal[n - 1]) } else { 0.0 };
            values.push(sum);
        }
        Self { signal: signal.to_vec(), values }
    }

    /// Up to a place between samples.
    fn at(&self, x: f64) -> f64 {
        let last = self.values.len().saturating_sub(2);
        let n = (x.max(0.0) as usize).min(last);
        let share = x - n as f64;
        let Some(two) = self.signal.get(n..n + 2) else { return 0.0 };
        self.values[n] + share * (two[0] + 0.5 * share * (two[1] - two[0]))
    }

    fn mean(&self, two: &[f64]) -> f64 {
        (self.at(two[1]) - self.at(two[0])) / (two[1] - two[0])
    }

    fn mean_around(&self, x: f64, width: f64) -> f64 {
        self.mean(&[x - 0.5 * width, x + 0.5 * width])
    }
}

/// A signal at a place between samples.
fn between(signal: &[f64], x: f64) -> f64 {
    let n = (x.max(0.0) as usize).min(signal.len().saturating_sub(2));
    let share = x - n as f64;
    signal[n] + share * (signal[n + 1] - signal[n])
}

/// −1, 0 or 1.
fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// A recording as one experiment.
///
/// # Errors
/// A recording with gaps or without voltage, current and speed.
pub fn whole(model: &Model, recording: &Recording) -> Result<Experiment> {
    let one = prepare(std::slice::from_ref(recording), &model.filter, &model.chain)?;
    match <[Experiment; 1]>::try_from(one) {
        Ok([e]) if e.drive == Drive::Voltage && e.current.is_some() && e.speed.is_some() => Ok(e),
        _ => Err(lacks(recording.path())),
    }
}

fn lacks(path: impl AsRef<Path>) -> Error {
    Error::input(
        crate::error::Place::file(path.as_ref()),
        "its balances need voltage, current and speed without gaps",
        "record u_v, i_a and omega_rad_s of the whole test",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_once_a_turn_is_told_beside_a_course_and_another_wave() {
        // 380 rad/s, 0.1 s at 10 kHz: six turns; a run-up of 20 rad/s, and a wave of the load at 100 Hz.
        let speed = |wave: f64| -> Vec<f64> {
            let mut angle = 0.3;
            (0..1000)
                .map(|n| {
                    let t = f64::from(n) * 1e-4;
                    let w = 380.0 + 200.0 * t + 2.0 * (TAU * 100.0 * t).sin() + wave * f64::sin(angle);
                    angle += w * 1e-4;
                    w
                })
                .collect()
        };
        let amplitude = |speed: &[f64], interval: f64| wave_of_turn(speed, &angles(speed, interval));
        // Four turns beside its main lobe Hann's window has 1 % of 2 rad/s left.
        assert!((amplitude(&speed(1.5), 1e-4).unwrap() - 1.5).abs() < 0.03);
        assert!(amplitude(&speed(0.0), 1e-4).unwrap() < 0.03);
        // Too few turns, and too few samples of a turn.
        assert_eq!(amplitude(&speed(1.5), 1e-5), None);
        assert_eq!(amplitude(&speed(1.5), 1e-2), None);
    }
    #[test]
    fn over_a_turn_a_wave_of_it_is_no_acceleration() {
        // 50 samples a turn: the mean over 200 samples, four turns, or over 180 and a turn, has nothing of the wave.
        let signal = |wave: f64| -> Vec<f64> {
            (0..2000).map(|n| 3.0 + 0.01 * f64::from(n) + wave * (TAU * f64::from(n) / 50.0).sin()).collect()
        };
        let (plain, waved) = (Smooth::of(&signal(0.0)), Smooth::of(&signal(5.0)));
        for x in [700.0, 713.4] {
            assert!((plain.mean_around(x, 180.0, Some(50.0)) - (3.0 + 0.01 * x)).abs() < 1e-9);
            // A wave of 5 through a window of 180 leaves 5 sin(3.6 π)/(3.6 π) = 0.42 at most; the trapezium rule within
            // a sample leaves (2 π/50)²/12 of that.
            let alone = waved.mean_around(x, 180.0, None) - plain.mean_around(x, 180.0, None);
            let left = waved.mean_around(x, 180.0, Some(50.0)) - plain.mean_around(x, 180.0, Some(50.0));
            assert!(left.abs() < 0.42 * 0.0014, "{left} of {alone}");
        }
    }
}
