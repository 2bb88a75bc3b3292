//! The recording that would best tell rival effects apart, found by simulating them.
//!
//! y(θ) are the filtered current and speed of the model's free run and, where the supply is open, the voltage that the
//! terminals show, each over its noise σ; d_A = y(θ, a) − y(θ) is what effect A does to them at a size that causes an error
//! of 1 % in the current of the usual staircase. J holds the sensitivities ∂y/∂θ to the base parameters, d_B, and how d_B
//! changes with the shape of B. What neither can imitate is
//! ```text
//! s(A|B) = ‖(I − J J⁺) d_A‖/√N
//! ```
//! over N instants, in multiples of the noise. The separation of two rivals is the smaller one of s(A|B) and s(B|A):
//! whichever of them is real, it is seen not to be the other one. Several recordings stand below each other in y.
//!
//! | noise | σ |
//! |---|---|
//! | before the filter | that of the virtual rig's chain ([`ChainSetup`]) |
//! | after it | a fifth: √(250 Hz/5 kHz) is 0.22 |
//!
//! Profiles are waveforms of the voltage, scaled down until voltage and current stay within the limits.

use std::collections::BTreeMap;
use std::f64::consts::{PI, SQRT_2};

use greyrig::butterworth::{self, Cascade, Coefficients};
use greyrig::effects::{Description, Effect, Motors, Passed, Seen};
use greyrig::motor::{Constraints, Motor, OperatingPoint, State, Stepper};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::Serialize;

use crate::diagnose::classes;
use crate::diagnose::screening::Complement;
use crate::error::{Error, Result};
use crate::identify::minimise::{Residuals, jacobian_at};
use crate::identify::scales::Scales;
use crate::identify::space::Space;
use crate::identify::{self, Settings};
use crate::model::{Filter, Kind, Model};
use crate::output;
use crate::rig::motor::Nameplate;
use crate::rig::source::{DIODE_DROP_V, Drive, Segment, Waveform};
use crate::rig::{ChainSetup, PROFILES, Profile, SAMPLE_RATE_HZ};

/// Rivals that are known of old.
const CLASSIC: [[&str; 2]; 5] = [
    ["eddy_current", "channel_delay"],
    ["remanence", "current_offset"],
    ["saturation", "current_compression"],
    ["hysteresis", "eddy_current"],
    ["brush_drop", "saturation"],
];

/// The recording that sizes are relative to, and that goes with each other profile.
const USUAL: &str = "staircase";
/// Error of the current, relative, that an effect causes there.
const ERROR: f64 = 0.01;
/// Size from which that is extrapolated, in typical sizes.
const SMALL: f64 = 0.01;
/// Factor to a neighbouring shape.
const NEIGHBOUR: f64 = 1.5;
/// Noise after the filter over noise before it.
const FILTERED: f64 = 0.2;
/// Step of the differences, in the optimiser's coordinates: well above the jolts of the friction at standstill.
const DIFFERENCE: f64 = 1e-3;
/// Mains frequency, Hz.
const MAINS_HZ: f64 = 50.0;
/// Shortest and longest plan, s.
pub const SECONDS: (f64, f64) = (2.0, 120.0);

/// The most that a recording may ask of motor and rig.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Limits {
    /// Peak voltage, V.
    pub voltage_v: f64,
    /// Peak current, A.
    pub current_a: f64,
}

impl Limits {
    /// The scale of the motors that the rig was made for.
    pub const fn usual(kind: Kind) -> Self {
        match kind {
            Kind::Universal => Self { voltage_v: 325.0, current_a: 10.0 },
            Kind::PmDc => Self { voltage_v: 24.0, current_a: 15.0 },
        }
    }
}

/// A recording of a proposal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Take {
    /// Profile of the rig.
    pub profile: &'static str,
    /// Length, s.
    pub seconds: f64,
    /// Peak voltage, V.
    pub peak_voltage_v: f64,
    /// Peak current of the model, A.
    pub peak_current_a: f64,
}

/// Recordings, and how well they tell two rivals apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Proposal {
    /// One or two recordings.
    pub recordings: Vec<Take>,
    /// What remains of the effect that is harder to tell, in multiples of the noise.
    pub separation: f64,
    /// What remains of each rival after the other one.
    pub each: [f64; 2],
}

/// Two rivals and the proposals, best first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contest {
    /// The effects.
    pub rivals: [&'static str; 2],
    /// Their sizes: 1 % of the current of the usual staircase.
    pub sizes: [f64; 2],
    /// What the catalogue says.
    pub separated_by: &'static str,
    /// Recordings, best first.
    pub proposals: Vec<Proposal>,
}

/// The result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// What was kept to.
    pub limits: Limits,
    /// Pair by pair.
    pub contests: Vec<Contest>,
    /// The recordings that tell most over all pairs: largest Σ ln(1 + s²).
    pub best: Vec<Take>,
}

/// Plans the recording that tells rivals apart; without rivals, the classic pairs. `tick` is called after each simulation.
///
/// # Errors
/// A model that cannot be run, rivals that there are not or that nothing tells apart, an impossible length, an interrupt.
pub fn plan(model: &Model, rivals: &[String], seconds: f64, limits: Limits, tick: &(dyn Fn() + Sync)) -> Result<Plan> {
    if !(SECONDS.0..=SECONDS.1).contains(&seconds) {
        return Err(Error::usage(
            format!("a recording of {seconds} s is not possible"),
            format!("give --seconds from {} to {}", SECONDS.0, SECONDS.1),
        ));
    }
    let pairs = if rivals.is_empty() { classic(model.kind) } else { pairs(model.kind, rivals)? };
    let bench = Bench::new(model, &pairs, seconds, limits)?;
    tick();
    let mut lengths: Vec<(&'static Profile, f64)> = Vec::new();
    for profile in PROFILES.iter().filter(|p| p.pm_dc || model.kind == Kind::Universal) {
        lengths.extend([(profile, seconds), (profile, 0.5 * seconds)]);
    }
    let pieces: Vec<Option<Piece>> = lengths
        .par_iter()
        .map(|(profile, seconds)| {
            output::check_interrupt()?;
            let piece = bench.piece(profile, *seconds)?;
            tick();
            Ok(piece)
        })
        .collect::<Result<_>>()?;
    let sets = sets(&pieces, seconds);
    let contests: Vec<Contest> = pairs.iter().map(|pair| bench.contest(*pair, &sets)).collect();
    let best = overall(&contests, &sets);
    Ok(Plan { limits, contests, best })
}

/// How often `tick` is called for a kind of motor.
pub fn ticks(kind: Kind) -> u64 {
    1 + 2 * PROFILES.iter().filter(|p| p.pm_dc || kind == Kind::Universal).count() as u64
}

fn description(id: &str) -> Option<&'static Description> {
    Effect::<f64>::CATALOGUE.iter().find(|d| d.id == id)
}

fn fits(d: &Description, kind: Kind) -> bool {
    d.motors == Motors::All || kind == Kind::Universal
}

fn classic(kind: Kind) -> Vec<[&'static Description; 2]> {
    let series: Vec<[&str; 2]> = match kind {
        Kind::Universal => CLASSIC.to_vec(),
        Kind::PmDc => {
            vec![
                ["coulomb_friction", "stribeck"],
                ["brush_drop", "supply_dead_zone"],
                ["current_offset", "voltage_offset"],
            ]
        }
    };
    series.iter().filter_map(|[a, b]| Some([description(a)?, description(b)?])).collect()
}

/// Pairs among the rivals that the catalogue knows as confused; all pairs, where it knows none; the rivals of a single one.
fn pairs(kind: Kind, rivals: &[String]) -> Result<Vec<[&'static Description; 2]>> {
    let mut named = Vec::new();
    for id in rivals {
        let d = description(id)
            .ok_or_else(|| Error::usage(format!("there is no effect {id}"), "`greyrig effects` lists them"))?;
        match d.seen_with(kind.flux_law()) {
            Seen::FreeRun if fits(d, kind) => named.push(d),
            Seen::FreeRun => return Err(Error::usage(format!("a {kind} motor cannot have {id}"), "leave it out")),
            Seen::Invisible(needed) | Seen::InvisibleInSeries(needed) => {
                return Err(Error::usage(
                    format!("no recording of voltage, current and speed shows {id}"),
                    format!("it takes {needed}"),
                ));
            }
            _ => {
                return Err(Error::usage(
                    format!("{id} does not show in the error of a free run"),
                    format!("it is told by {}", d.separated_by),
                ));
            }
        }
    }
    if let [only] = named[..] {
        let others = only.confused_with.iter().filter_map(|id| description(id));
        named.extend(others.filter(|d| d.seen_with(kind.flux_law()) == Seen::FreeRun && fits(d, kind)));
        named.dedup_by_key(|d| d.id);
        return different(kind, named[1..].iter().map(|other| [only, other]).collect());
    }
    let all: Vec<[&'static Description; 2]> =
        named.iter().enumerate().flat_map(|(k, a)| named[k + 1..].iter().map(move |b| [*a, *b])).collect();
    let confused =
        |p: &&[&Description; 2]| p[0].confused_with.contains(&p[1].id) || p[1].confused_with.contains(&p[0].id);
    let known: Vec<_> = all.iter().filter(confused).copied().collect();
    different(kind, if known.is_empty() { all } else { known })
}

/// Leaves out pairs that are one in the data.
fn different(kind: Kind, pairs: Vec<[&'static Description; 2]>) -> Result<Vec<[&'static Description; 2]>> {
    let same = |p: &&[&Description; 2]| classes::same(kind, p[0].id, p[1].id);
    let left: Vec<_> = pairs.iter().filter(|p| !same(p)).copied().collect();
    if let (true, Some([a, b])) = (left.is_empty(), pairs.iter().find(same)) {
        return Err(Error::usage(
            format!("no recording of voltage, current and speed tells {} from {}", a.id, b.id),
            "in the model one stands for the other; leave one out",
        ));
    }
    if left.is_empty() {
        return Err(Error::usage(
            "these rivals are no pair",
            "give two effects or more, such as --rivals saturation,brush_drop",
        ));
    }
    Ok(left)
}

/// One or two pieces, and what they stand for.
struct Set<'a> {
    pieces: Vec<&'a Piece>,
    takes: Vec<Take>,
}

/// Each profile by itself, and with the usual staircase at half the length each. `pieces`: full and half length in turn.
fn sets(pieces: &[Option<Piece>], seconds: f64) -> Vec<Set<'_>> {
    let usual = pieces.iter().flatten().find(|p| p.take.profile == USUAL && p.take.seconds < seconds);
    let mut sets = Vec::new();
    for piece in pieces.iter().flatten() {
        let half = piece.take.seconds < seconds;
        let together = match (half, usual) {
            (false, _) => vec![piece],
            (true, Some(usual)) if piece.take.profile != USUAL => vec![usual, piece],
            _ => continue,
        };
        sets.push(Set { takes: together.iter().map(|p| p.take.clone()).collect(), pieces: together });
    }
    sets
}

fn overall(contests: &[Contest], sets: &[Set<'_>]) -> Vec<Take> {
    let told = |set: &Set<'_>| -> f64 {
        contests
            .iter()
            .filter_map(|c| c.proposals.iter().find(|p| p.recordings == set.takes))
            .map(|p| p.separation.powi(2).ln_1p())
            .sum()
    };
    sets.iter().max_by(|a, b| told(a).total_cmp(&told(b))).map_or_else(Vec::new, |set| set.takes.clone())
}

/// What one recording shows of parameters and effects.
struct Piece {
    take: Take,
    /// ∂y/∂θ.
    base: DMatrix<f64>,
    /// d of each effect at its usual shape, then its changes with the shape.
    effects: BTreeMap<&'static str, Vec<DVector<f64>>>,
}

/// The model that is simulated, and the effects at their sizes.
struct Bench {
    space: Space,
    kind: Kind,
    limits: Limits,
    filter: Filter,
    noise: [f64; 3],
    scales: Scales,
    effects: Vec<(&'static Description, f64)>,
}

impl Bench {
    fn new(model: &Model, pairs: &[[&'static Description; 2]], seconds: f64, limits: Limits) -> Result<Self> {
        let missing: Vec<&str> =
            ["R", "L", "K", "J"].into_iter().filter(|n| !model.parameters.contains_key(*n)).collect();
        if !missing.is_empty() {
            return Err(Error::usage(
                format!("the model has no {}, without which no voltage can be planned", missing.join(", ")),
                "identify it from recordings of the whole motor",
            ));
        }
        let mut space = identify::build_space(&Settings::of_model(model))?;
        let scales = Scales {
            voltage: limits.voltage_v,
            current: limits.current_a,
            heat: limits.current_a.powi(2) * seconds,
            speed: 1.0,
            friction: 0.1
                * model.value("K")
                * limits.current_a
                * if model.kind == Kind::Universal { limits.current_a } else { 1.0 },
        };
        take(&mut space, model, &scales);
        // A rival that the model has already is in question: it is no part of the base.
        for d in pairs.iter().flatten() {
            space = space.without_effect(d.id);
        }
        let nominal = crate::rig::Motor::nominal(model.kind);
        let noise = ChainSetup::for_motor(&nominal, false).channels.map(|c| FILTERED * c.noise);
        let mut bench =
            Self { space, kind: model.kind, limits, filter: model.filter, noise, scales, effects: Vec::new() };
        bench.size(model, pairs, seconds)?;
        Ok(bench)
    }

    /// Gives each effect the size at which it changes the current of the usual staircase by 1 %.
    fn size(&mut self, model: &Model, pairs: &[[&'static Description; 2]], seconds: f64) -> Result<()> {
        let usual = Profile::find(USUAL)?;
        let refused =
            |what: &str| Error::usage(format!("the model cannot be run on a {USUAL}: {what}"), "check its parameters");
        let waveform = self.waveform(usual, seconds)?.ok_or_else(|| refused("it does not stay within the limits"))?;
        self.scales.speed = waveform.peak_speed.max(1e-9);
        take(&mut self.space, model, &self.scales);
        let trial = self.trial(waveform, &self.space)?;
        let plain = trial.at(&self.space, &self.space.coordinates());
        let mut all: Vec<&'static Description> = pairs.iter().flatten().copied().collect();
        all.sort_by_key(|d| d.id);
        all.dedup_by_key(|d| d.id);
        for d in all {
            let typical = self.space.with_effect(d.id, &self.scales).value(d.parameters[0].name);
            let there = self.with(d, SMALL * typical, 1.0, 0);
            let changed = trial.at(&there, &there.coordinates()) - &plain;
            let [current, reference] = [&changed, &plain].map(|y| trial.currents(y).map(|i| i * i).sum::<f64>().sqrt());
            let factor = if current > 0.0 { ERROR * reference / current } else { 1.0 / SMALL };
            let size = (SMALL * typical * factor).clamp(d.parameters[0].range.0, d.parameters[0].range.1);
            self.effects.push((d, size));
        }
        Ok(())
    }

    /// The model with an effect of a size, a shape parameter (0: none) being `factor` times as usual.
    fn with(&self, d: &'static Description, size: f64, factor: f64, shape: usize) -> Space {
        let mut space = self.space.with_effect(d.id, &self.scales);
        if let Some(entry) = space.get_mut(d.parameters[0].name) {
            entry.value = size;
        }
        if shape > 0
            && let Some(entry) = space.get_mut(d.parameters[shape].name)
        {
            let (low, high) = d.parameters[shape].range;
            let there = entry.value * factor;
            entry.value = if there > high { entry.value / factor } else { there.max(low) };
        }
        space
    }

    /// Simulates a profile with all that may happen; `None` if no voltage keeps the current within its limit.
    fn piece(&self, profile: &'static Profile, seconds: f64) -> Result<Option<Piece>> {
        let Some(waveform) = self.waveform(profile, seconds)? else { return Ok(None) };
        let take = Take {
            profile: profile.id,
            seconds,
            peak_voltage_v: waveform.peak_voltage,
            peak_current_a: waveform.peak_current,
        };
        let trial = self.trial(waveform, &self.space)?;
        let theta = self.space.coordinates();
        let plain = trial.at(&self.space, &theta);
        let base = jacobian_at(&self.space, &trial, &theta, &plain, DIFFERENCE);
        let effects = self.effects.iter().map(|(d, size)| {
            let shown = |space: Space| trial.at(&space, &space.coordinates()) - &plain;
            let usual = shown(self.with(d, *size, 1.0, 0));
            let shapes = (1..d.parameters.len()).map(|k| shown(self.with(d, *size, NEIGHBOUR, k)) - &usual);
            let all: Vec<_> = std::iter::once(usual.clone()).chain(shapes).collect();
            (d.id, all)
        });
        let effects = effects.collect();
        Ok(Some(Piece { take, base, effects }))
    }

    fn contest(&self, pair: [&'static Description; 2], sets: &[Set<'_>]) -> Contest {
        let mut proposals: Vec<Proposal> = sets
            .par_iter()
            .map(|set| {
                let each = [remains(&set.pieces, pair[0].id, pair[1].id), remains(&set.pieces, pair[1].id, pair[0].id)];
                Proposal { recordings: set.takes.clone(), separation: each[0].min(each[1]), each }
            })
            .collect();
        proposals.sort_by(|a, b| b.separation.total_cmp(&a.separation));
        let size = |d: &Description| self.effects.iter().find(|(e, _)| e.id == d.id).map_or(0.0, |e| e.1);
        Contest { rivals: pair.map(|d| d.id), sizes: pair.map(size), separated_by: pair[0].separated_by, proposals }
    }

    fn trial(&self, waveform: Drawn, space: &Space) -> Result<Trial> {
        let refused = |e: String| Error::usage(format!("the model cannot be run: {e}"), "check its parameters");
        let motor = space.motor().map_err(|e| refused(e.to_string()))?;
        let substeps = Stepper::build(motor, 1.0 / SAMPLE_RATE_HZ).map_err(|e| refused(e.to_string()))?.substeps();
        let settings = butterworth::Settings {
            order: self.filter.order,
            cutoff_hz: self.filter.cutoff_hz,
            sample_rate_hz: SAMPLE_RATE_HZ,
        };
        let coefficients =
            settings.build().map_err(|e| refused(format!("its filter does not fit {SAMPLE_RATE_HZ} Hz: {e}")))?;
        let stride = ((SAMPLE_RATE_HZ / (4.0 * self.filter.cutoff_hz)) as usize).max(1);
        let rows = SIGNALS * waveform.voltage.len().div_ceil(stride);
        Ok(Trial { waveform, substeps, coefficients, stride, noise: self.noise, groups: vec![0; rows] })
    }

    /// The voltage of a profile, scaled down until the limits are kept.
    fn waveform(&self, profile: &'static Profile, seconds: f64) -> Result<Option<Drawn>> {
        let refused = |e: greyrig::motor::ParameterError| {
            Error::usage(format!("the model cannot be run: {e}"), "check its parameters")
        };
        let motor = self.space.motor().map_err(refused)?;
        let mut scale = 1.0;
        for _ in 0..SCALINGS {
            output::check_interrupt()?;
            let segments = profile.segments(&self.nameplate(scale), MAINS_HZ, seconds)?;
            let stepper = Stepper::build(motor.clone(), 1.0 / SAMPLE_RATE_HZ).map_err(refused)?;
            let drawn = draw(stepper, &segments);
            let share = (self.limits.current_a / drawn.peak_current).min(self.limits.voltage_v / drawn.peak_voltage);
            if share >= 1.0 {
                return Ok(Some(drawn));
            }
            if !share.is_finite() {
                return Ok(None);
            }
            scale *= (1.0 - MARGIN) * share;
        }
        Ok(None)
    }

    /// The model as the rig's profiles want to know it.
    fn nameplate(&self, scale: f64) -> crate::rig::Motor {
        let value = |name: &str| self.space.value(name);
        let voltage_v = self.limits.voltage_v / if self.kind == Kind::Universal { SQRT_2 } else { 1.0 };
        let impedance = value("R").hypot(2.0 * PI * MAINS_HZ * value("L"));
        let peak_current_a = self.limits.current_a.min(self.limits.voltage_v / impedance);
        crate::rig::Motor {
            r: value("R"),
            l: value("L"),
            k: value("K"),
            j: value("J"),
            mu0: value("mu0"),
            mu1: value("mu1"),
            mu2: value("mu2"),
            nameplate: Nameplate {
                voltage_v: scale * voltage_v,
                peak_current_a: scale * peak_current_a,
                rms_current_a: scale * peak_current_a / SQRT_2,
                speed_rad_s: self.scales.speed,
            },
            ..crate::rig::Motor::nominal(self.kind)
        }
    }
}

/// Times that a profile is scaled down before it counts as impossible.
const SCALINGS: usize = 12;
/// By how much a profile is scaled down further than in proportion.
const MARGIN: f64 = 0.005;
/// Current, speed, terminal voltage.
const SIGNALS: usize = 3;

/// Typical sizes, and the model's values.
fn take(space: &mut Space, model: &Model, scales: &Scales) {
    space.take_scales(scales);
    space.take_model(model);
}

/// s(A|B) over several recordings.
fn remains(pieces: &[&Piece], a: &str, b: &str) -> f64 {
    let stacked = |column: &dyn Fn(&Piece) -> DVector<f64>| {
        DVector::from_vec(pieces.iter().flat_map(|p| column(p).iter().copied().collect::<Vec<f64>>()).collect())
    };
    let mut columns: Vec<DVector<f64>> =
        (0..pieces[0].base.ncols()).map(|c| stacked(&|p| p.base.column(c).into_owned())).collect();
    let of_b = pieces[0].effects.get(b).map_or(0, Vec::len);
    columns.extend((0..of_b).map(|k| stacked(&|p| p.effects[b][k].clone())));
    let effect = stacked(&|p| p.effects[a][0].clone());
    let left = Complement::of(&DMatrix::from_columns(&columns)).project(&effect);
    (left.norm_squared() * SIGNALS as f64 / left.len() as f64).sqrt()
}

/// A profile as the model has drawn it.
struct Drawn {
    voltage: Vec<f64>,
    locked: Vec<bool>,
    open: Vec<bool>,
    peak_voltage: f64,
    peak_current: f64,
    peak_speed: f64,
}

/// Runs the base model through segments, with the contact opening at the zeros of its current.
fn draw(mut stepper: Stepper<f64>, segments: &[Segment]) -> Drawn {
    let mut drawn = Drawn {
        voltage: Vec::new(),
        locked: Vec::new(),
        open: Vec::new(),
        peak_voltage: 0.0,
        peak_current: 0.0,
        peak_speed: 0.0,
    };
    let (mut last_current, mut conducting) = (0.0, false);
    for segment in segments {
        let begin = drawn.voltage.len();
        let wave = Waveform::new(*segment, begin as f64 / SAMPLE_RATE_HZ, 0.0);
        for n in begin..begin + (segment.seconds * SAMPLE_RATE_HZ).round() as usize {
            let t = n as f64 / SAMPLE_RATE_HZ;
            let current = stepper.state().current;
            let at_zero = current == 0.0 || current * last_current < 0.0;
            let fired = wave.gate(t).is_some_and(|(on, off)| on <= t && t < off);
            conducting = match segment.drive {
                Drive::Closed => true,
                Drive::Off => conducting && !at_zero,
                Drive::Triac { .. } => fired || (conducting && !at_zero),
            };
            let freewheels = segment.drive == Drive::Off && wave.is_dc();
            let voltage = match (conducting, freewheels) {
                (false, _) => 0.0,
                (true, true) => -DIODE_DROP_V * current.signum(),
                (true, false) => wave.at(t),
            };
            let constraints =
                Constraints { speed: segment.locked.then_some(0.0), current: (!conducting).then_some(0.0) };
            let from = drawn.voltage.last().copied().unwrap_or(voltage);
            last_current = current;
            let state = stepper.step(from, voltage, constraints);
            drawn.voltage.push(voltage);
            drawn.locked.push(segment.locked);
            drawn.open.push(!conducting);
            drawn.peak_voltage = drawn.peak_voltage.max(voltage.abs());
            drawn.peak_current = drawn.peak_current.max(state.current.abs());
            drawn.peak_speed = drawn.peak_speed.max(state.speed.abs());
        }
    }
    drawn
}

/// A recording to be made, as a problem of the parameters.
struct Trial {
    waveform: Drawn,
    substeps: u8,
    coefficients: Coefficients<f64>,
    stride: usize,
    noise: [f64; 3],
    groups: Vec<u8>,
}

impl Trial {
    /// The rows of the current.
    fn currents<'a>(&self, y: &'a DVector<f64>) -> impl Iterator<Item = f64> + 'a {
        y.iter().step_by(SIGNALS).copied()
    }

    /// y, a row of current, speed and terminal voltage at a time; `None` if the motor cannot be run.
    fn run(&self, motor: &Motor<f64>) -> Option<Vec<f64>> {
        let Drawn { voltage, locked, open, .. } = &self.waveform;
        let interval = 1.0 / SAMPLE_RATE_HZ;
        let mut stepper = Stepper::with_substeps(motor.clone(), interval, self.substeps).ok()?;
        stepper.set_state(State::default());
        let mut memories = motor.memories_at_start(State::default());
        let mut filters = [Cascade::<f64>::default(), Cascade::default()];
        let mut rows = Vec::with_capacity(self.groups.len());
        for n in 0..voltage.len() {
            let constraints = Constraints { speed: locked[n].then_some(0.0), current: open[n].then_some(0.0) };
            let before = stepper.state();
            let after = stepper.step(voltage[n.saturating_sub(1)], voltage[n], constraints);
            motor.advance(&Passed { interval, before, after }, &mut memories);
            let reading = stepper.reading();
            let shown = [
                filters[0].process(&self.coefficients, reading.current),
                filters[1].process(&self.coefficients, reading.speed),
                if open[n] { terminal_voltage(motor, after, &memories) } else { 0.0 },
            ];
            if n % self.stride == 0 {
                rows.extend(
                    shown.iter().zip([self.noise[1], self.noise[2], self.noise[0]]).map(|(x, sigma)| x / sigma),
                );
            }
        }
        rows.iter().all(|x| x.is_finite()).then_some(rows)
    }
}

/// What the terminals of an open motor show, V: K φ ω + v, less what the voltage channel adds to it.
fn terminal_voltage(motor: &Motor<f64>, state: State<f64>, memories: &greyrig::motor::Memories<f64>) -> f64 {
    let balance = |voltage: f64| {
        let at = OperatingPoint { current: 0.0, speed: state.speed, voltage };
        motor.balance(&at, memories)
    };
    let open = balance(0.0);
    let true_voltage = motor.linkage(&open) * state.speed + open.voltage;
    true_voltage - (balance(true_voltage).supply - true_voltage)
}

/// Stands for a run that cannot be made.
const HOPELESS: f64 = 1e6;

impl Residuals for Trial {
    fn at(&self, space: &Space, theta: &[f64]) -> DVector<f64> {
        let rows = space.motor_at(theta).ok().and_then(|motor| self.run(&motor));
        rows.map_or_else(|| DVector::from_element(self.groups.len(), HOPELESS), DVector::from_vec)
    }
    fn groups(&self) -> &[u8] {
        &self.groups
    }
    fn sizes(&self) -> [f64; 2] {
        [1.0; 2]
    }
}
