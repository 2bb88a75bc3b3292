//! A motor among those of its lot: faults as hypotheses about its balances, against what healthy motors show at the
//! same time of the same test.
//!
//! [`blocks`] forms the balances, [`population`] learns what is usual, [`likelihood`] tests the hypotheses of
//! [`fault`]. Every motor of a lot is tested along the same profile.

mod belonging;
pub mod blocks;
pub mod fault;
pub mod likelihood;
pub mod population;

use std::cmp::Ordering;

use greyrig::detector::Kind;
use rayon::prelude::*;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::context::Context;
use crate::error::Result;
use crate::model::Model;
use crate::model::lot::{Fault, Limit, Onset, Population};
use crate::recording::Recording;
use blocks::{Cut, POWER, Run, TORQUE, whole};
use likelihood::{Hypothesis, column, limits, scan};
use population::Whitened;

/// Difference of a block's voltage from the lot's, as a share of the lot's highest, that mains of another level do not
/// make (EN 50160 allows a tenth), and the share of blocks beyond it that makes another profile: by judgement.
const SAME_VOLTAGE: f64 = 0.15;
const OTHER_BLOCKS: f64 = 0.1;
/// Blocks that a test has at least: a second.
const FEWEST_BLOCKS: usize = 10;
/// Into how many parts a lot is divided at most, each judged by what the others say is usual.
const FOLDS: usize = 20;
/// Groups of limits that are exceeded apart from one another: faults that the balances tell go together, and so do
/// those with a row of their own. Each has its share of the false alarms.
const GROUPS: f64 = 2.0;
/// False alarms among healthy motors for which it is told what would be seen.
const POINTS: [f64; 4] = [0.1, 0.01, 1e-3, 1e-4];
/// Odds up to which one fault is as likely as another: as a verdict's 95 %.
const AS_LIKELY: f64 = 20.0;

/// A fault that is none of chance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// The fault.
    pub fault: Fault,
    /// `electrical`, `mechanical` or `sensor`.
    pub kind: &'static str,
    /// Begin, s; none if it was there from the start.
    pub t_s: Option<f64>,
    /// Its size, relative or in its unit.
    pub size: f64,
    /// 95 % interval of the size.
    pub ci95: [f64; 2],
    /// Z over its limit.
    pub ratio: f64,
    /// Z.
    pub z: f64,
    /// Share of the squares of what the balances leave over that it explains.
    pub explains: f64,
    /// Whether it explains what is seen about as well as the first does.
    pub as_likely: bool,
    /// How many times likelier what explains most is than this, 1 of that itself; none where it is too large for what
    /// a small one would do, by which it is told.
    pub odds: Option<f64>,
    /// In words.
    pub text: String,
    /// What to look at on the bench.
    pub look_at: &'static str,
}

/// How far a block's balances are from what is usual in the lot, the motor's own parameters taken off, in standard
/// deviations of what these leave of the motors that have taught it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beside {
    /// Middle of the block, s.
    pub t_s: f64,
    /// Power, where it counts.
    pub power: Option<f64>,
    /// Torque, where it counts.
    pub torque: Option<f64>,
}

/// What a lot says of a motor.
#[derive(Debug, Clone, PartialEq)]
pub enum Judged {
    /// What is wrong with it, the likeliest first, nothing of a healthy one; and its balances block by block.
    Found(Vec<Finding>, Vec<Beside>),
    /// Why it says nothing.
    Incomparable(String),
}

/// A motor that looks like none of the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outsider {
    /// Its place among the motors.
    #[serde(skip)]
    pub motor: usize,
    /// The recording that shows it.
    pub recording: String,
    /// What is wrong with it.
    pub finding: Finding,
}

/// What is seen at the price of some false alarms.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OperatingPoint {
    /// Share of healthy motors that fail.
    pub false_alarms: f64,
    /// The limits, with the smallest fault that 95 % of motors show.
    pub limits: Vec<Limit>,
}

/// What the runs of a lot teach.
#[derive(Debug, Clone)]
pub struct Learnt {
    /// What is usual in it, or why the runs do not tell.
    pub population: std::result::Result<Population, String>,
    /// Motors that look like none of the others.
    pub outsiders: Vec<Outsider>,
    /// What more or fewer false alarms would show.
    pub operating_points: Vec<OperatingPoint>,
}

impl Learnt {
    fn nothing(why: String) -> Self {
        Self { population: Err(why), outsiders: Vec::new(), operating_points: Vec::new() }
    }
}

/// What is known of the motors that teach.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Labels {
    /// All are healthy. One that the others do not take for theirs teaches all the same: where laws differ from motor
    /// to motor, the limits without it would be too narrow for the next one.
    #[default]
    Healthy,
    /// A few may be bad, a quarter of them at most. One that the others do not take for theirs teaches nothing.
    Unknown,
}

/// What is usual in a lot, and which motors the others do not take for theirs. The limits are for a share of false
/// alarms among healthy motors.
///
/// # Errors
/// Runs whose balances cannot be formed, an interrupt.
pub fn learn(
    model_of: impl Fn(&Recording) -> Result<Model> + Sync,
    recordings: &[Recording],
    motors: &[Vec<usize>],
    labels: Labels,
    false_alarms: f64,
    ctx: &Context,
) -> Result<Learnt> {
    if let Some(gap) = recordings.iter().find(|r| !r.gaps().is_empty()) {
        return Ok(Learnt::nothing(format!("{} has gaps", gap.path().display())));
    }
    let Some(first) = recordings.first() else { return Ok(Learnt::nothing("there are no runs".to_owned())) };
    let cut = Cut::of(&whole(&model_of(first)?, first)?);
    let steps = ctx.steps("balances", recordings.len() as u64);
    let one_run = |recording: &Recording| {
        ctx.check()?;
        let model = model_of(recording)?;
        let e = whole(&model, recording)?;
        let run = Cut::of(&e).is_as(&cut).then(|| cut.run(&model, &e)).transpose()?;
        steps.next();
        Ok(run)
    };
    let runs: Vec<Option<Run>> = recordings.par_iter().map(one_run).collect::<Result<_>>()?;
    if let Some(k) = runs.iter().position(Option::is_none) {
        return Ok(Learnt::nothing(format!("{} has mains of another frequency", recordings[k].path().display())));
    }
    let runs: Vec<Run> = runs.into_iter().flatten().collect();
    let shortest = runs.iter().map(|run| run.blocks.len()).min().unwrap_or(0);
    if shortest < FEWEST_BLOCKS {
        let told = format!("the shortest of them has {shortest} blocks of {:.2} s", cut.block_s);
        return Ok(Learnt::nothing(told));
    }
    let lot = Lot { cut, runs: &runs, motors, with_shapes: true };
    let all: Vec<usize> = (0..motors.len()).collect();
    let population = lot.usual(&all);
    if let Some(k) = (0..runs.len()).find(|k| !population.has_profile_of(&runs[*k])) {
        return Ok(Learnt::nothing(format!("{} follows a profile of its own", recordings[k].path().display())));
    }
    let members = match labels {
        Labels::Healthy => all.clone(),
        Labels::Unknown => match belonging::members(&lot, false_alarms, ctx)? {
            Some(members) => members,
            None => return Ok(Learnt::nothing("no three quarters of the motors are like one another".to_owned())),
        },
    };
    let population = if members.len() < all.len() { lot.usual(&members) } else { population };
    let shown = lot.by_the_others(&members, ctx)?;
    // As many are asked as there are motors, and each limit holds as much less often.
    let holds = 1.0 - false_alarms / (GROUPS * motors.len() as f64);
    let beyond_the_others = |motor: usize| match members.binary_search(&motor) {
        Ok(place) => {
            let others: Vec<_> = (0..shown.len()).filter(|other| *other != place).map(|k| shown[k].clone()).collect();
            beyond(&limits(&others, holds), &shown[place])
        }
        Err(_) => beyond(&limits(&shown, holds), &lot.judged_by(&population, motor)),
    };
    let outsider = |motor: usize| {
        let (run, limit, h) = beyond_the_others(motor)?;
        let run = motors[motor][run];
        Some(Outsider {
            motor,
            recording: recordings[run].path().display().to_string(),
            finding: finding(&limit, &h, (true, Some(1.0)), &runs[run]),
        })
    };
    let outsiders = all.iter().filter_map(|motor| outsider(*motor)).collect();
    let limits = |false_alarms: f64| limits(&shown, 1.0 - false_alarms / GROUPS);
    let point = |false_alarms: f64| OperatingPoint { false_alarms, limits: limits(false_alarms) };
    let population = Population { limits: limits(false_alarms), false_alarms, ..population };
    Ok(Learnt { population: Ok(population), outsiders, operating_points: POINTS.map(point).to_vec() })
}

/// The runs of a lot.
#[derive(Clone, Copy)]
struct Lot<'a> {
    cut: Cut,
    runs: &'a [Run],
    motors: &'a [Vec<usize>],
    /// Whether its motors may differ by shapes over time besides.
    with_shapes: bool,
}

impl Lot<'_> {
    /// What the runs of a motor show beside what is usual.
    fn judged_by(&self, usual: &Population, motor: usize) -> Vec<Vec<Hypothesis>> {
        self.motors[motor].iter().map(|k| scan(&usual.whitened(&self.runs[*k]), self.cut.block_s)).collect()
    }

    /// What is usual in some of its motors.
    fn usual(&self, members: &[usize]) -> Population {
        let runs: Vec<&Run> = members.iter().flat_map(|m| &self.motors[*m]).map(|k| &self.runs[*k]).collect();
        Population::learn(&self.cut, &runs, members.len(), self.with_shapes)
    }

    /// What each member shows when the others say what is usual.
    fn by_the_others(&self, members: &[usize], ctx: &Context) -> Result<Vec<Vec<Vec<Hypothesis>>>> {
        let judge_part = |left_out: &[usize]| {
            ctx.check()?;
            let others: Vec<usize> = members.iter().filter(|m| !left_out.contains(m)).copied().collect();
            let usual = self.usual(&others);
            Ok(left_out.iter().map(|m| self.judged_by(&usual, *m)).collect::<Vec<_>>())
        };
        let parts = members.par_chunks(members.len().div_ceil(FOLDS)).map(judge_part);
        Ok(parts.collect::<Result<Vec<_>>>()?.concat())
    }
}

/// Which of a motor's runs is farthest beyond limits, the limit and what exceeds it.
fn beyond(limits: &[Limit], runs: &[Vec<Hypothesis>]) -> Option<(usize, Limit, Hypothesis)> {
    let of_limit = |h: &Hypothesis| limits.iter().find(|l| l.fault == h.fault && l.onset == h.onset).copied();
    let of_runs = runs.iter().enumerate().flat_map(|(run, all)| all.iter().map(move |h| (run, h)));
    let over = of_runs.filter_map(|(run, h)| Some((run, of_limit(h)?, *h)));
    let over = over.filter(|(_, limit, h)| h.z.abs() > limit.z && h.fault.is_one_at(h.size));
    over.max_by(|a, b| a.2.z.abs().total_cmp(&b.2.z.abs()))
}

/// What is wrong with a motor.
///
/// # Errors
/// A run whose balances cannot be formed.
pub fn judge(model: &Model, population: &Population, recording: &Recording) -> Result<Judged> {
    if !recording.gaps().is_empty() {
        return Ok(Judged::Incomparable("its recording has gaps".to_owned()));
    }
    let cut = Cut { block_s: population.block_s, alternating: population.alternating, top_speed: population.top_speed };
    let e = whole(model, recording)?;
    if !Cut::of(&e).is_as(&cut) {
        return Ok(Judged::Incomparable("its mains are of another frequency than the lot's".to_owned()));
    }
    let run = cut.run(model, &e)?;
    if !population.has_profile_of(&run) {
        return Ok(Judged::Incomparable("it follows another profile than the lot did".to_owned()));
    }
    let limit = |h: &Hypothesis| population.limits.iter().find(|l| l.fault == h.fault && l.onset == h.onset);
    let beyond = |run: &Run| -> Vec<(&Limit, Hypothesis)> {
        let all = scan(&population.whitened(run), cut.block_s).into_iter();
        all.filter_map(|h| Some((limit(&h)?, h)))
            .filter(|(limit, h)| h.z.abs() > limit.z && h.fault.is_one_at(h.size))
            .collect()
    };
    let first = beyond(&run);
    // Gains and fluxes of several per cent are no small changes.
    let sizes = Fault::ALL.into_iter().filter_map(|fault| {
        let of_fault = first.iter().filter(|(_, h)| h.fault == fault && h.fault.is_relative_step());
        let (_, best) = of_fault.max_by(|(_, a), (_, b)| a.z.abs().total_cmp(&b.z.abs()))?;
        fault.holds(best.size).then_some((fault, best.size))
    });
    let sizes: Vec<(Fault, f64)> = sizes.collect();
    let run = if sizes.is_empty() { run } else { cut.with_columns_at(&sizes, &run, model, &e) };
    let mut found = if sizes.is_empty() { first } else { beyond(&run) };
    // What a fault explains, as Z: arcs take voltage, as a contact does. What is too large for its column comes last.
    let contact = found.iter().filter(|(_, h)| h.fault == Fault::Contact).map(|(_, h)| h.z.abs()).fold(0.0, f64::max);
    let explains = |h: &Hypothesis| if h.fault == Fault::Sparking { h.z.hypot(contact) } else { h.z.abs() };
    let rank = |h: &Hypothesis| (h.fault.holds(h.size), explains(h));
    let ordered = |a: &Hypothesis, b: &Hypothesis| rank(b).partial_cmp(&rank(a)).unwrap_or(Ordering::Equal);
    found.sort_by(|(_, a), (_, b)| ordered(a, b));
    let best = found.first().copied();
    let of_white = of_white(population.false_alarms);
    // The ratio of likelihoods is e to half of what one explains more, in squares of deviations.
    let logarithm_of_odds = |h: &Hypothesis| {
        let (limit, best) = best.filter(|_| h.fault.holds(h.size))?;
        let more = explains(&best).powi(2) - explains(h).powi(2);
        Some(more / (2.0 * (limit.z / of_white).powi(2)))
    };
    let is_as_likely = |h: &Hypothesis| logarithm_of_odds(h).is_some_and(|odds| odds < AS_LIKELY.ln());
    let odds = |h: &Hypothesis| logarithm_of_odds(h).map(|odds| odds.exp().min(f64::MAX));
    // Of what is as likely the frequent ones first, and behind them what hardly ever changes that way.
    found.sort_by_key(|(_, h)| match is_as_likely(h) {
        true => (h.fault.is_unlikely_by_sign(h.size), h.fault as usize),
        false => (true, Fault::ALL.len()),
    });
    let beside = beside(&population.whitened(&run), &run, found.first().map(|(_, h)| h));
    let finding = |(limit, h): (&Limit, Hypothesis)| finding(limit, &h, (is_as_likely(&h), odds(&h)), &run);
    Ok(Judged::Found(found.into_iter().map(finding).collect(), beside))
}

/// The limit of |Z| for a share of false alarms if all that is left over were white: a normal quantile. By how much a
/// real limit is larger, Z counts less.
fn of_white(false_alarms: f64) -> f64 {
    let share = 1.0 - false_alarms / (2.0 * GROUPS);
    Normal::new(0.0, 1.0).map_or(f64::INFINITY, |normal| normal.inverse_cdf(share))
}

/// A run's balances beside the lot's. The motor's own parameters are those beside the fault.
fn beside(white: &Whitened, run: &Run, fault: Option<&Hypothesis>) -> Vec<Beside> {
    let mut healthy = white.clone();
    if let Some(h) = fault {
        healthy.rows -= column(white, h.fault, h.onset, h.begin, run.block_s) * h.size;
    }
    let (own, _) = healthy.own_of_motor();
    let left = &white.rows - &white.own * own;
    let of = |k: usize, row: usize| {
        (0..white.blocks.len()).find(|n| white.blocks[*n] == k && white.row_of_block[*n] == row).map(|n| left[n])
    };
    let blocks = run.blocks.iter().enumerate();
    blocks.map(|(k, block)| Beside { t_s: block.t_s, power: of(k, POWER), torque: of(k, TORQUE) }).collect()
}

impl Population {
    /// Whether a run follows the profile of the lot: its voltage is the lot's but for the level of the mains.
    fn has_profile_of(&self, run: &Run) -> bool {
        let highest = self.voltage.iter().fold(0.0f64, |most, u| most.max(*u));
        let both = || run.blocks.iter().zip(&self.voltage);
        let differs =
            |(block, usual): &(&blocks::Block, &f64)| (block.voltage - **usual).abs() > SAME_VOLTAGE * highest;
        (both().filter(differs).count() as f64) <= OTHER_BLOCKS * both().count() as f64
    }
}

fn finding(limit: &Limit, h: &Hypothesis, (as_likely, odds): (bool, Option<f64>), run: &Run) -> Finding {
    let t_s = (h.onset == Onset::During).then(|| run.blocks[0].t_s + (h.begin - 0.5) * run.block_s);
    let when = t_s.map_or_else(|| "from the start".to_owned(), |t| format!("since {t:.2} s"));
    Finding {
        fault: h.fault,
        kind: Kind::name(h.fault.kind()),
        t_s,
        size: h.size,
        ci95: [-1.96, 1.96].map(|beside| h.size + beside * h.deviation),
        ratio: h.z.abs() / limit.z,
        z: h.z,
        explains: h.explains,
        as_likely,
        odds,
        text: format!("{} {} {when}", h.fault.words(), h.fault.told(h.size)),
        look_at: h.fault.look_at(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_white_noise_would_leave_is_of_the_published_table() {
        // Two groups, both sides: z of 0.99975 is 3.481, that of 0.9975 is 2.807.
        assert!((of_white(1e-3) - 3.481).abs() < 1e-3);
        assert!((of_white(1e-2) - 2.807).abs() < 1e-3);
    }
}
