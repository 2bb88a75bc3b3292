//! From recordings to physical parameters.
//!
//! 1. Linear least squares in continuous time gives start values ([`regression`]).
//! 2. Output error refines them: the free-run simulation against the measurement, all recordings jointly
//!    ([`output_error`]). Recordings of torque and motion alone are fitted by [`inverse_dynamics`] instead.
//! 3. Intervals come from blocks of time, so that autocorrelated residuals do not make them too narrow ([`intervals`]).
//! 4. Directions in which the data leave the parameters open are closed, one by one, by holding a parameter; each is
//!    reported in words with the excitation that would tell ([`identifiability`]).

pub mod equation_error;
pub mod flux;
pub mod identifiability;
pub mod intervals;
pub mod inverse_dynamics;
pub mod minimise;
pub mod output_error;
pub mod regression;
pub mod scales;
pub mod space;

use std::collections::BTreeMap;

use greyrig::effects::Effect;
use greyrig::motor::MAX_TERMS;
use nalgebra::DVector;
use serde::Serialize;

use crate::error::{Error, Place, Result};
use crate::experiment::{Drive, Experiment};
use crate::model::{
    Assignment, BASE_PARAMETERS, Base, EffectEntry, Filter, Kind, Model, Origin, Parameter, Provenance, SCHEMA, Status,
    TermEntry, unit,
};
use crate::output;
use crate::recording::Recording;
use crate::term::Formula;
use equation_error::EquationError;
use flux::FluxAtPeak;
use identifiability::Weakness;
use intervals::{Covariance, block_length_s, correlation_time_s, covariance};
use minimise::{Effort, Refined, Residuals as _, as_it_is, minimise};
use output_error::{OutputError, Rows};
use scales::Scales;
use space::{Entry, Freedom, Space};

/// How far the estimation goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Method {
    /// Least squares, then output error: the best free run.
    #[default]
    OutputError,
    /// Linear least squares in continuous time alone, as Rakar & Juričić did.
    LeastSquares,
}

/// Distance from a limit, in the optimiser's coordinates, at which a shape is at it.
const AT_LIMIT: f64 = 1e-4;

/// Half a 95 % interval of the normal distribution, in standard deviations.
const NORMAL_95: f64 = 1.96;

/// What the user chooses.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// How far the estimation goes.
    pub method: Method,
    /// Kind of motor.
    pub kind: Kind,
    /// Friction terms of the base model.
    pub base: Base,
    /// Identifiers of effects that the model has besides.
    pub effects: Vec<String>,
    /// Terms of the user's own that the model has besides.
    pub terms: Vec<Formula>,
    /// Parameters with known values.
    pub fixed: Vec<Assignment>,
    /// Parameters with bounds: name, least, greatest.
    pub bounds: Vec<(String, f64, f64)>,
    /// Filter of the comparison; the cut-off may be left to the data on the mechanical side alone.
    pub filter: Filter,
    /// Whether the user chose the cut-off.
    pub cutoff_given: bool,
}

impl Settings {
    /// The usual base and filter for a kind of motor.
    pub fn new(kind: Kind) -> Self {
        Self {
            method: Method::default(),
            kind,
            base: Base::usual(kind),
            effects: Vec::new(),
            terms: Vec::new(),
            fixed: Vec::new(),
            bounds: Vec::new(),
            filter: Filter::default(),
            cutoff_given: false,
        }
    }
}

impl Settings {
    /// The settings that identify a model again; what the user fixed stays fixed.
    pub fn of_model(model: &Model) -> Self {
        let effects = model.effects.iter().flat_map(|e: &EffectEntry| &e.parameters);
        let terms = model.terms.iter().flat_map(|t| &t.parameters);
        let held = model.parameters.iter().chain(effects).chain(terms);
        Self {
            base: model.base,
            effects: model.effects.iter().map(|e| e.id.clone()).collect(),
            terms: model.terms.iter().map(|t| t.formula.clone()).collect(),
            fixed: held
                .filter(|(_, p)| p.status == Status::Fixed)
                .map(|(name, p)| Assignment { name: name.clone(), value: p.value })
                .collect(),
            filter: model.filter,
            cutoff_given: true,
            ..Self::new(model.kind)
        }
    }
}

/// One estimated parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Estimate {
    /// Name.
    pub name: String,
    /// Value, SI; `None` when the recordings say nothing about it and nobody gave it.
    pub value: Option<f64>,
    /// Unit.
    pub unit: String,
    /// 95 % interval, for what was estimated.
    pub ci95: Option<[f64; 2]>,
    /// Whether the recordings determine it.
    pub identifiable: bool,
    /// How it came to be.
    pub status: Status,
}

/// What an identification yields.
#[derive(Debug, Clone, PartialEq)]
pub struct Identification {
    /// The model.
    pub model: Model,
    /// Its parameters, in the order of the equations.
    pub parameters: Vec<Estimate>,
    /// Linkage at the largest current, of a series motor.
    pub flux: Option<FluxAtPeak>,
    /// Condition number of the problem with parameters scaled to equal effect.
    pub condition: Option<f64>,
    /// What the user should know, in words.
    pub notes: Vec<String>,
}

/// Identifies a model from recordings of one motor type.
///
/// # Errors
/// Recordings or settings from which nothing can be identified, with the reason; an interrupt.
pub fn identify(recordings: &[Recording], settings: &Settings) -> Result<Identification> {
    let mut filter = settings.filter;
    let experiments = prepare(recordings, &filter)?;
    let mut space = build_space(settings)?;
    let mut notes = Vec::new();
    let drive = experiments[0].drive;
    if experiments.iter().any(|e| e.drive != drive) {
        return Err(Error::usage(
            "some recordings have a voltage and others only a torque",
            "identify the two sorts separately",
        ));
    }
    let outcome = match drive {
        Drive::Torque => {
            hold(&mut space, &["R", "L", "K"], Freedom::Absent);
            if !settings.cutoff_given {
                filter.cutoff_hz = torque_cutoff_hz(&experiments);
            }
            by_torque(space, &experiments, filter.cutoff_hz)?
        }
        Drive::Voltage => by_simulation(space, &experiments, settings.method, &mut notes)?,
    };
    notes.extend(implausible(&outcome, settings.kind));
    let flux = outcome.covariance.as_ref().and_then(|c| FluxAtPeak::of(&outcome.space, c, &experiments));
    Ok(report(recordings, settings, filter, outcome, flux, notes))
}

/// Prepares recordings of one motor type.
///
/// # Errors
/// No recording, recordings of different types, or one that cannot be used.
pub fn prepare(recordings: &[Recording], filter: &Filter) -> Result<Vec<Experiment>> {
    if recordings.is_empty() {
        return Err(Error::usage("no recording was given", "name at least one file"));
    }
    let types: Vec<(&Recording, &String)> =
        recordings.iter().filter_map(|r| Some((r, r.metadata.get("motor")?))).collect();
    if let Some((odd, other)) = types.iter().find(|(_, t)| *t != types[0].1) {
        return Err(Error::input(
            Place::file(&odd.path),
            format!(
                "this is a recording of motor type {other:?}, and {} is of type {:?}",
                types[0].0.path.display(),
                types[0].1
            ),
            "identify each motor type by itself",
        ));
    }
    recordings.iter().map(|r| Ok(Experiment::new(r, filter)?.with_edges_placed())).collect()
}

/// The parameters that settings ask for.
///
/// # Errors
/// An effect or a parameter that there is not, or an impossible value.
pub fn build_space(settings: &Settings) -> Result<Space> {
    let mut ids = Vec::new();
    for id in &settings.effects {
        let found = Effect::<f64>::CATALOGUE.iter().find(|d| d.id == id);
        let known = || Effect::<f64>::CATALOGUE.iter().map(|d| d.id).collect::<Vec<_>>().join(", ");
        ids.push(
            found.ok_or_else(|| Error::usage(format!("there is no effect {id}"), format!("known are {}", known())))?.id,
        );
    }
    if settings.terms.len() > MAX_TERMS {
        return Err(Error::usage(
            format!("{} terms are too many", settings.terms.len()),
            format!("a model takes {MAX_TERMS} at most; write them as one sum"),
        ));
    }
    let mut space = Space::new(settings.kind, settings.base, &ids).with_terms(&settings.terms);
    for (k, entry) in space.entries.iter().enumerate() {
        if space.entries[..k].iter().any(|e| e.name == entry.name) {
            return Err(Error::usage(
                format!("the name {} stands for two parameters", entry.name),
                "give the unknown of the term another name",
            ));
        }
    }
    let names = space.entries.iter().map(|e| e.name.clone()).collect::<Vec<_>>().join(", ");
    let unknown = |name: &str| Error::usage(format!("there is no parameter {name}"), format!("the model has {names}"));
    for fix in &settings.fixed {
        let entry = space.get_mut(&fix.name).ok_or_else(|| unknown(&fix.name))?;
        if entry.positive && fix.value <= 0.0 {
            return Err(Error::usage(format!("{} = {} is impossible", fix.name, fix.value), "give a positive value"));
        }
        entry.value = fix.value;
        entry.freedom = Freedom::Fixed;
    }
    for (name, low, high) in &settings.bounds {
        let entry = space.get_mut(name).ok_or_else(|| unknown(name))?;
        if low >= high || (entry.positive && *low <= 0.0) {
            return Err(Error::usage(
                format!("{low} to {high} is no range for {name}"),
                "give the smaller number first; R, L, K and J are positive",
            ));
        }
        entry.value = 0.5 * (low + high);
        entry.freedom = Freedom::Free(Some((*low, *high)));
    }
    Ok(space)
}

/// Gives free parameters another freedom.
pub fn hold(space: &mut Space, names: &[&str], freedom: Freedom) {
    for name in names {
        if let Some(entry) = space.get_mut(name)
            && matches!(entry.freedom, Freedom::Free(_))
        {
            entry.freedom = freedom;
        }
    }
}

/// A fitted space with what is known about its uncertainty.
struct Outcome {
    space: Space,
    covariance: Option<Covariance>,
    weaknesses: Vec<Weakness>,
    method: &'static str,
    esr: BTreeMap<String, f64>,
}

impl Outcome {
    fn of_simulation(space: Space, covariance: Option<Covariance>, weaknesses: Vec<Weakness>, method: Method) -> Self {
        let method = match method {
            Method::OutputError => "output error",
            Method::LeastSquares => "least squares in continuous time",
        };
        Self { space, covariance, weaknesses, method, esr: BTreeMap::new() }
    }
}

/// A fit from before a parameter was held that seemed to be open. Where the error rises without it, it was not: what a model
/// lacks leaves residuals that make every parameter uncertain, and the motor cannot do without all of them.
struct Earlier {
    outcome: Outcome,
    error: f64,
    /// Notes that had been made by then.
    notes: usize,
}

/// Rise of the error, mean of the logarithms of the signals' RMS, from which a parameter is needed.
const NEEDED: f64 = 0.1;

fn torque_cutoff_hz(experiments: &[Experiment]) -> f64 {
    let each = experiments.iter().filter_map(|e| {
        let (motion, derivatives) = match &e.position {
            Some(angle) => (angle, 2),
            None => (e.speed.as_ref()?, 1),
        };
        Some(inverse_dynamics::automatic_cutoff_hz(motion, derivatives, e.interval_s))
    });
    each.fold(f64::INFINITY, f64::min).min(250.0)
}

fn by_torque(mut space: Space, experiments: &[Experiment], cutoff_hz: f64) -> Result<Outcome> {
    let few = || {
        Error::usage(
            "these recordings are too short or hold too little motion to fit the mechanical side",
            "record a longer motion with changes of speed in both directions",
        )
    };
    let mut weaknesses = Vec::new();
    loop {
        let columns = inverse_dynamics::columns(&space, experiments, cutoff_hz).ok_or_else(few)?;
        let p = columns.entries.len();
        if p == 0 || columns.target.len() < 4 * p {
            return Err(few());
        }
        let lengths: Vec<f64> = columns.matrix.column_iter().map(|c| c.norm().max(1e-300)).collect();
        let scaled = nalgebra::DMatrix::from_fn(columns.target.len(), p, |r, c| columns.matrix[(r, c)] / lengths[c]);
        let solution = scaled.clone().svd(true, true).solve(&columns.target, 1e-12).map_err(|_| few())?;
        for (c, entry) in columns.entries.iter().enumerate() {
            space.entries[*entry].value = solution[c] / lengths[c];
            // Coordinates of the covariance below: the coefficient itself.
            space.entries[*entry].positive = false;
            space.entries[*entry].scale = 1.0;
        }
        let residuals: DVector<f64> = &scaled * &solution - &columns.target;
        let interval = columns.times.windows(2).map(|t| t[1].1 - t[0].1).find(|d| *d > 0.0).unwrap_or(1.0);
        let total = columns.target.len() as f64 * interval;
        let correlation = correlation_time_s(residuals.as_slice(), interval);
        let block = block_length_s(correlation, total, p);
        let blocks = numbered(columns.times.iter().map(|(r, t)| (*r, (t / block) as usize)));
        let covariance = covariance(&columns.matrix, &residuals, &blocks);
        if let Some(weakness) = covariance.as_ref().and_then(|c| identifiability::of_columns(&space, &columns, c))
            && weaknesses.len() < p
        {
            identifiability::close(&mut space, &weakness);
            weaknesses.push(weakness);
            continue;
        }
        let esr = BTreeMap::from([("torque".to_owned(), residuals.norm() / columns.target.norm())]);
        return Ok(Outcome { space, covariance, weaknesses, method: "inverse dynamics", esr });
    }
}

/// The block of each row, for the covariance of a fit by output error: several times as long as the residuals' correlation.
fn blocks_of_rows(problem: &OutputError<'_>, fit: &Refined) -> Vec<usize> {
    let rows = problem.rows();
    let interval = rows.iter().map(Rows::row_interval_s).fold(0.0f64, f64::max);
    let total: f64 = rows.iter().map(Rows::covered_s).sum();
    let correlation = slowest_correlation_s(rows, fit.residuals.as_slice(), interval);
    let block = block_length_s(correlation, total, fit.jacobian.ncols());
    numbered(rows.iter().enumerate().flat_map(|(r, rows)| rows.blocks(block).into_iter().map(move |b| (r, b))))
}

/// 95 % intervals of the free parameters of a fit by output error, by name. Parameters at a limit have none.
pub(crate) fn intervals_of_fit(problem: &OutputError<'_>, fit: &Refined) -> BTreeMap<String, [f64; 2]> {
    intervals_of(fit, &blocks_of_rows(problem, fit))
}

/// 95 % intervals of the free parameters of a fit, by name, from the block of each of its rows. A shape that the data leave open
/// over its physical range has none.
pub(crate) fn intervals_of(fit: &Refined, blocks: &[usize]) -> BTreeMap<String, [f64; 2]> {
    let mut fit = fit.clone();
    pin_shapes_at_limits(&mut fit);
    let Some(covariance) = covariance(&fit.jacobian, &fit.residuals, blocks) else { return BTreeMap::new() };
    let theta = fit.space.coordinates();
    fit.space
        .free()
        .enumerate()
        .map(|(k, entry)| (entry, interval(entry, theta[k], covariance.half_width_95_of(k))))
        .filter(|(entry, interval)| !(entry.is_shape() && share_of_range(entry, *interval) > OPEN))
        .map(|(entry, interval)| (entry.name.clone(), interval))
        .collect()
}

/// A shape whose interval covers more than this share of its physical range is open.
const OPEN: f64 = 0.9;

/// Share of its physical range that an interval covers; of decades, where the parameter is positive.
fn share_of_range(entry: &Entry, interval: [f64; 2]) -> f64 {
    let (low, high) = entry.range;
    let covered = interval.map(|x| x.clamp(low, high));
    if entry.positive {
        (covered[1] / covered[0]).ln() / (high / low).ln()
    } else {
        (covered[1] - covered[0]) / (high - low)
    }
}

/// 95 % interval of a free parameter from half that of its coordinate.
fn interval(entry: &Entry, theta: f64, half: f64) -> [f64; 2] {
    if entry.positive && entry.freedom == Freedom::Free(None) {
        let half = half_width(half, 1.0);
        [entry.value * (-half).exp(), entry.value * half.exp()]
    } else {
        let half = half_width(half * entry.slope(theta).abs(), entry.value);
        [entry.value - half, entry.value + half]
    }
}

/// Half a 95 % interval with what the computation itself adds.
fn half_width(half: f64, value: f64) -> f64 {
    half.hypot(NORMAL_95 * intervals::SYSTEMATIC * value)
}

/// Numbers arbitrary keys in the order in which they first appear.
fn numbered<K: Ord>(keys: impl Iterator<Item = K>) -> Vec<usize> {
    let mut seen = BTreeMap::new();
    keys.map(|key| {
        let next = seen.len();
        *seen.entry(key).or_insert(next)
    })
    .collect()
}

fn by_simulation(
    mut space: Space,
    experiments: &[Experiment],
    method: Method,
    notes: &mut Vec<String>,
) -> Result<Outcome> {
    let mut weaknesses = identifiability::missing_channels(&mut space, experiments)?;
    identifiability::check_excitation(experiments)?;
    typical_values(&mut space);
    let mut neutral = space.clone();
    let mut earlier: Option<Earlier> = None;
    loop {
        if space.free().next().is_none() {
            let reasons: Vec<&str> = weaknesses.iter().map(|w| w.text.as_str()).collect();
            return Err(Error::input(
                place(&experiments[0]),
                format!("nothing is left that these recordings determine ({})", reasons.join("; ")),
                "record more excitation, or give what you know with --fix",
            ));
        }
        let mut bare = without_effects(&space);
        regression::start_values(&mut bare, experiments);
        take_values(&mut space, &bare);
        let substeps = |e: &Experiment| space.motor().and_then(|m| e.substeps(&m)).unwrap_or(1);
        let problem = OutputError::new(experiments.iter().map(|e| Rows::new(e, substeps(e))).collect())?;
        let refined = match method {
            Method::OutputError => {
                if space.entries.iter().any(Entry::of_effect) {
                    space = with_effects_started(&space, &bare, experiments)?;
                }
                refine(&space, &problem)?
            }
            Method::LeastSquares => as_it_is(&space, &problem),
        };
        let error = refined.log_error(problem.groups());
        if let Some(earlier) = earlier.take_if(|earlier| error > earlier.error + NEEDED) {
            notes.truncate(earlier.notes);
            return Ok(earlier.outcome);
        }
        if let Some(stuck) = refined.space.free().find(|e| e.at_bound()) {
            // At its bound a parameter no longer answers to the data: it stays there, and the others are fitted anew.
            notes.push(format!("{} has run into its bound at {:.4e} and is held there", stuck.name, stuck.value));
            for known in [&mut space, &mut neutral] {
                if let Some(entry) = known.get_mut(&stuck.name) {
                    entry.value = stuck.value;
                    entry.freedom = Freedom::Fixed;
                }
            }
            continue;
        }
        let blocks = blocks_of_rows(&problem, &refined);
        let mut refined = refined;
        pin_shapes_at_limits(&mut refined);
        let mut covariance = covariance(&refined.jacobian, &refined.residuals, &blocks);
        let mut weakness = identifiability::of_fit(&refined, covariance.as_ref(), experiments);
        while let Some(held) = weakness.as_ref().map(|w| w.held.clone()) {
            let place = refined.space.free().position(|e| e.name == held && e.is_shape());
            let Some(place) = place else { break };
            // The shape of an effect has a prior: it stays where the fit has left it, and nothing else has to move.
            hold(&mut refined.space, &[&held], Freedom::Pinned);
            refined.jacobian = refined.jacobian.remove_column(place);
            covariance = intervals::covariance(&refined.jacobian, &refined.residuals, &blocks);
            weakness = identifiability::of_fit(&refined, covariance.as_ref(), experiments);
        }
        // An effect that was asked for stays, however little the data say about its size.
        let weakness = weakness.filter(|w| refined.space.get(&w.held).is_none_or(|e| !e.of_effect()));
        match weakness {
            Some(weakness) if weaknesses.len() < 5 && method == Method::OutputError => {
                let outcome = Outcome::of_simulation(refined.space, covariance, weaknesses.clone(), method);
                earlier = Some(Earlier { outcome, error, notes: notes.len() });
                // A weak direction has taken the other parameters along, in the regression as in the fit: begin again.
                let mut again = neutral.clone();
                for entry in &mut again.entries {
                    if let Some(present) = space.get(&entry.name) {
                        entry.freedom = present.freedom;
                    }
                }
                identifiability::close(&mut again, &weakness);
                space = again;
                weaknesses.push(weakness);
            }
            _ => {
                if covariance.is_none() {
                    notes.push(format!(
                        "no 95 % intervals: these recordings hold too few independent stretches of time for {} parameters; record \
                         longer, with more changes of speed",
                        refined.jacobian.ncols()
                    ));
                }
                return Ok(Outcome::of_simulation(refined.space, covariance, weaknesses, method));
            }
        }
    }
}

/// Shapes of effects that have run into their physical limits no longer answer to the data: they stay there, without an
/// interval.
fn pin_shapes_at_limits(refined: &mut Refined) {
    let theta = refined.space.coordinates();
    let at_limit: Vec<(usize, String)> = refined
        .space
        .free()
        .zip(&theta)
        .enumerate()
        .filter(|(_, (entry, theta))| {
            let (low, high) = entry.limits();
            entry.is_shape() && (**theta - low < AT_LIMIT || high - **theta < AT_LIMIT)
        })
        .map(|(k, (entry, _))| (k, entry.name.clone()))
        .collect();
    for (k, name) in at_limit.into_iter().rev() {
        hold(&mut refined.space, &[&name], Freedom::Pinned);
        refined.jacobian = refined.jacobian.clone().remove_column(k);
    }
}

/// The order of magnitude of a small motor, from which the regression starts.
pub fn typical_values(space: &mut Space) {
    for entry in &mut space.entries {
        if entry.positive && !entry.of_effect() && matches!(entry.freedom, Freedom::Free(None)) {
            entry.value = match entry.name.as_str() {
                "R" => 1.0,
                "L" => 1e-3,
                "K" => 1e-2,
                _ => 1e-4,
            };
        }
    }
}

/// The output-error fit, with a progress bar.
fn refine(space: &Space, problem: &OutputError<'_>) -> Result<Refined> {
    let bar = output::progress("output-error fit", Effort::FULL.steps as u64);
    let refined = minimise(space, problem, Effort::FULL, None, &mut || bar.inc(1));
    bar.finish_and_clear();
    refined
}

/// Effects start at the fit of the base model and grow or shrink to where the balances of the measured state want them:
/// equation error is nearly linear and gets there in a few steps, where the free run would take dozens. They start from
/// absence and from a typical size, and the better end counts: what bends, such as hysteresis, may show no way up from zero,
/// and another effect no way down.
fn with_effects_started(space: &Space, bare: &Space, experiments: &[Experiment]) -> Result<Space> {
    let coarse: Vec<Experiment> = experiments.iter().map(Experiment::coarse).collect();
    let mut typical = space.clone();
    let Some(balances) = EquationError::new(&coarse) else {
        typical.take_scales(&Scales::of(&typical, experiments));
        return Ok(typical);
    };
    let bare = minimise(bare, &balances, Effort::ROUGH, None, &mut || ())?.space;
    take_values(&mut typical, &bare);
    typical.take_scales(&Scales::of(&typical, experiments));
    let mut absent = typical.clone();
    absent.remove_sizes();
    let effort = Effort { steps: 15, tolerance: 1e-4, carried_on: 0, confirmed: true };
    let fit = |from: &Space| minimise(from, &balances, effort, None, &mut || ());
    let (from_absent, from_typical) = rayon::join(|| fit(&absent), || fit(&typical));
    let error = |fit: &Refined| fit.log_error(balances.groups());
    let (from_absent, from_typical) = (from_absent?, from_typical?);
    Ok(if error(&from_typical) < error(&from_absent) { from_typical } else { from_absent }.space)
}

/// The base model of a space.
fn without_effects(space: &Space) -> Space {
    space.effects().to_vec().into_iter().fold(space.clone().with_terms(&[]), |less, id| less.without_effect(id))
}

/// Takes the values of the parameters that two spaces share.
fn take_values(space: &mut Space, from: &Space) {
    for entry in &mut space.entries {
        if let Some(known) = from.get(&entry.name) {
            (entry.value, entry.scale) = (known.value, known.scale);
        }
    }
}

fn slowest_correlation_s(rows: &[Rows<'_>], residuals: &[f64], interval_s: f64) -> f64 {
    let flags: Vec<bool> = rows.iter().flat_map(Rows::speed_rows).collect();
    let mut slowest = interval_s;
    let mut from = 0;
    while from < flags.len() {
        let to = (from..flags.len()).find(|k| flags[*k] != flags[from]).unwrap_or(flags.len());
        slowest = slowest.max(correlation_time_s(&residuals[from..to], interval_s));
        from = to;
    }
    slowest
}

/// Estimates that no motor can have, as a sign of missing physics.
fn implausible(outcome: &Outcome, kind: Kind) -> Vec<String> {
    let mut notes = Vec::new();
    for (k, entry) in outcome.space.free().enumerate() {
        let Some(covariance) = &outcome.covariance else { break };
        let half = covariance.half_width_95_of(k) * entry.scale;
        if !entry.positive && entry.name.starts_with("mu") && entry.value + half < 0.0 {
            notes.push(format!(
                "{} is negative, which no friction can be: the fit makes up for physics that the model lacks{}",
                entry.name,
                if kind == Kind::Universal { ", most often saturation of the flux" } else { "" }
            ));
        }
    }
    notes
}

fn report(
    recordings: &[Recording],
    settings: &Settings,
    filter: Filter,
    outcome: Outcome,
    flux: Option<FluxAtPeak>,
    mut notes: Vec<String>,
) -> Identification {
    let motion = recordings[0].motion;
    let Outcome { space, covariance, weaknesses, method, esr } = outcome;
    let theta = space.coordinates();
    let mut free = 0;
    let mut parameters = Vec::new();
    for entry in &space.entries {
        let unit = unit(&entry.name, settings.kind, motion).to_owned();
        let estimate = match entry.freedom {
            Freedom::Free(_) => {
                let k = free;
                free += 1;
                let ci95 = covariance.as_ref().map(|c| interval(entry, theta[k], c.half_width_95_of(k)));
                Estimate {
                    name: entry.name.clone(),
                    value: Some(entry.value),
                    unit,
                    ci95,
                    identifiable: ci95.is_some(),
                    status: Status::Identified,
                }
            }
            Freedom::Fixed => Estimate {
                name: entry.name.clone(),
                value: Some(entry.value),
                unit,
                ci95: None,
                identifiable: false,
                status: Status::Fixed,
            },
            Freedom::Pinned => Estimate {
                name: entry.name.clone(),
                // A friction term held at zero and the usual shape of an effect are usable values; an R, L, K or J that
                // nothing tells is not.
                value: (!entry.positive || entry.of_effect()).then_some(entry.value),
                unit,
                ci95: None,
                identifiable: false,
                status: Status::NotIdentifiable,
            },
            Freedom::Absent => continue,
        };
        parameters.push(estimate);
    }
    notes.extend(weaknesses.into_iter().map(|w| w.text));
    let stored = |names: &dyn Fn(&str) -> bool| -> BTreeMap<String, Parameter> {
        parameters
            .iter()
            .filter(|e| names(&e.name))
            .filter_map(|e| {
                let parameter = Parameter { value: e.value?, unit: e.unit.clone(), ci95: e.ci95, status: e.status };
                Some((e.name.clone(), parameter))
            })
            .collect()
    };
    let effects = settings
        .effects
        .iter()
        .filter_map(|id| {
            let description = Effect::<f64>::CATALOGUE.iter().find(|d| d.id == id)?;
            let names: Vec<&str> = description.parameters.iter().map(|p| p.name).collect();
            Some(EffectEntry { id: id.clone(), parameters: stored(&|name| names.contains(&name)) })
        })
        .collect();
    let terms = settings
        .terms
        .iter()
        .map(|formula| TermEntry {
            formula: formula.clone(),
            parameters: stored(&|name| formula.unknowns().iter().any(|u| u == name)),
        })
        .collect();
    let model = Model {
        schema: SCHEMA,
        kind: settings.kind,
        base: settings.base,
        motion,
        motor: recordings.iter().find_map(|r| r.metadata.get("motor").cloned()),
        filter,
        parameters: stored(&|name| BASE_PARAMETERS.contains(&name)),
        effects,
        terms,
        correction: None,
        detector: None,
        provenance: Provenance {
            greyrig: env!("CARGO_PKG_VERSION").to_owned(),
            method: method.to_owned(),
            esr,
            recordings: recordings.iter().map(Origin::from).collect(),
        },
    };
    Identification { model, parameters, flux, condition: covariance.map(|c| c.condition), notes }
}

/// A recording and its place for an error.
fn place(e: &Experiment) -> Place {
    Place::file(&e.name)
}
