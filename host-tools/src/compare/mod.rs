//! Model against measurement: how far apart, how far from what the data allow, and where.

pub mod noise_floor;
pub mod regions;
mod result;
mod series;
pub mod traces;

use greyrig::effects::Passed;
use greyrig::motor::{BaseParameter, OperatingPoint, State};
use rayon::prelude::*;

pub use result::{Comparison, Map, PerSignal, Profile, RecordingComparison, Region, Signal, Traces};

use crate::between::Course;
use crate::context::Context;
use crate::error::{Error, Place, Result};
use crate::experiment::{Drive, Experiment, Imposed, derivative};
use crate::filtering::directions;
use crate::model::Model;
use crate::prediction::{self, Sums};
use crate::recording::Recording;
use crate::segments;

/// An error, or a signal, within this factor of the noise floor is noise.
const AT_THE_FLOOR: f64 = 1.3;

/// Compares a model with recordings.
///
/// # Errors
/// A model that lacks what these recordings need, or recordings that cannot be compared; an interrupt.
///
/// # Examples
/// ```
/// use greyrig_host::{compare::compare, context::Context, identify::{Settings, identify}, model::Kind, rig::Setup};
///
/// let recorded = |seed| Setup::new(Kind::PmDc).seconds(4.0).seed(seed).run().map(|run| run.recording);
/// let model = identify(&[recorded(1)?], &Settings::new(Kind::PmDc), &Context::quiet())?.model;
/// let comparison = compare(&model, &[recorded(2)?], &Context::quiet())?;
/// // In free run from the voltage alone.
/// assert!(comparison.esr.speed.is_some_and(|ratio| ratio < 0.05));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn compare(model: &Model, recordings: &[Recording], ctx: &Context) -> Result<Comparison> {
    compare_along(model, recordings, None, ctx)
}

/// The same along a course of the voltage between its samples that the user knows.
///
/// # Errors
/// As [`compare`].
pub fn compare_along(
    model: &Model,
    recordings: &[Recording],
    course: Option<Course>,
    ctx: &Context,
) -> Result<Comparison> {
    ctx.install(|| compared(model, recordings, course, ctx))
}

fn compared(model: &Model, recordings: &[Recording], course: Option<Course>, ctx: &Context) -> Result<Comparison> {
    let recordings = &*segments::apart(recordings, &model.filter);
    let mut experiments: Vec<Experiment> = recordings
        .iter()
        .map(|r| Ok(Experiment::new(r, &model.filter)?.through(&model.chain).with_edges_placed()))
        .collect::<Result<_>>()?;
    for (e, recording) in experiments.iter().zip(recordings) {
        require(model, e)?;
        same_type(model, recording)?;
    }
    let refused = |error| Error::usage(format!("the model cannot be run: {error}"), "check its parameters");
    let mut single_model = model.clone();
    if experiments.iter().any(|e| e.drive == Drive::Torque) {
        // The torque acts as the current of a motor with magnets and K = 1.
        single_model.kind = crate::model::Kind::PmDc;
        single_model.parameters.remove(BaseParameter::K.name());
    }
    let motor = single_model.motor::<f32>().map_err(refused)?;
    let precise = single_model.motor::<f64>().map_err(refused)?;
    experiments = experiments.into_par_iter().map(|e| prediction::along(e, course, &precise)).collect();
    let correction = model.correction()?;
    let free_runs: Vec<Traces> = experiments
        .par_iter()
        .zip(recordings)
        .map(|(e, recording)| traces::traces(&motor, correction.as_ref(), &precise, e, recording.start_s()))
        .collect::<Result<_>>()?;
    let mut parts: Vec<Part> = experiments
        .par_iter()
        .zip(&free_runs)
        .enumerate()
        .map(|(k, (e, own))| {
            ctx.check()?;
            let others = experiments.iter().zip(&free_runs).enumerate().filter(|(j, _)| *j != k);
            let others: Vec<_> = others.map(|(_, other)| other).collect();
            let errors = errors(own);
            let off = PerSignal::from(errors.map(|e| e.map(|e| (e.error / e.samples).sqrt())));
            let of_one = || noise_floor::of_one(&motor, e, off);
            let floor = noise_floor::of_repeats((e, own), &others).unwrap_or_else(of_one);
            let structured = structured(&motor, e)?;
            let one_step = if e.is_as_sampled() { one_step(&precise, e) } else { prediction::sums(e, &precise) };
            Ok(Part { errors, floor, structured, one_step })
        })
        .collect::<Result<_>>()?;
    let floors = parts.iter().map(|part| part.floor.clone()).collect();
    let floors = noise_floor::of_files(&experiments, floors);
    parts.iter_mut().zip(floors).for_each(|(part, floor)| part.floor = floor);

    let per_recording: Vec<RecordingComparison> = parts
        .iter()
        .zip(&free_runs)
        .zip(&experiments)
        .zip(recordings)
        .map(|(((part, traces), e), recording)| {
            let errors = [part.errors];
            let esr = ratio(&errors, &[part.floor.rms]);
            let of_voltage = e.drive == Drive::Voltage;
            RecordingComparison {
                recording: e.name.clone(),
                esr,
                noise_floor: floor_ratio(&[part.floor.rms], &errors),
                structured: relative(&part.structured, &errors, &[part.floor.rms]),
                rms: errors[0].map(|e| e.map(|e| (e.signal / e.samples).sqrt())).into(),
                input: of_voltage.then(|| e.between.into()),
                input_share: e.between.share(),
                speed_sensor: e.sensor,
                cutoff_hz: e.filter.cutoff_hz,
                diverges: traces.diverges,
                warnings: recording.warnings().to_vec(),
                traces: traces.clone(),
            }
        })
        .collect();
    let all_errors: Vec<[Option<Sums>; 3]> = parts.iter().map(|p| p.errors).collect();
    let floors: Vec<PerSignal> = parts.iter().map(|p| p.floor.rms).collect();
    let known: Vec<&'static str> = parts.iter().filter_map(|p| p.floor.source).collect();
    let traces: Vec<&Traces> = free_runs.iter().collect();
    let (profiles, mut regions) = regions::profiles(&traces, recordings[0].motion());
    let diverges = per_recording.iter().any(|r| r.diverges);
    let esr = if diverges { PerSignal::default() } else { ratio(&all_errors, &floors) };
    let noise_floor = floor_ratio(&floors, &all_errors);
    regions.retain(|r| {
        let (error, floor) = (esr.of(r.quantity), noise_floor.of(r.quantity));
        // What stands out of pure noise says nothing about the model.
        error.is_some_and(|error| floor.is_none_or(|floor| error > AT_THE_FLOOR * floor))
    });
    let structured = merge(parts.iter().map(|p| p.structured));
    let mut courses: Vec<Option<Course>> = per_recording.iter().map(|r| r.input).collect();
    courses.dedup();
    Ok(Comparison {
        input: if let [course] = courses[..] { course } else { None },
        diverges,
        esr,
        noise_floor,
        noise_floor_source: (known.len() == parts.len()).then(|| known.first().map(|s| (*s).to_owned())).flatten(),
        structured: relative(&structured, &all_errors, &floors),
        one_step: one_step_ratio(&parts),
        per_recording,
        regions,
        profiles,
        maps: regions::maps(&traces),
    })
}

/// What is computed for one recording.
struct Part {
    errors: [Option<Sums>; 3],
    floor: noise_floor::Floor,
    structured: [Option<Sums>; 3],
    one_step: [Option<Sums>; 2],
}

impl From<[Option<f64>; 3]> for PerSignal {
    fn from([current, speed, torque]: [Option<f64>; 3]) -> Self {
        Self { current, speed, torque }
    }
}

/// A voltage-driven recording needs the electrical side, a turning rotor the mechanical one.
pub(crate) fn require(model: &Model, e: &Experiment) -> Result<()> {
    let turns = !(0..e.len()).all(|n| e.is_locked(n));
    let needed: &[BaseParameter] = match (e.drive, turns) {
        (Drive::Voltage, true) => &BaseParameter::POSITIVE,
        (Drive::Voltage, false) => &[BaseParameter::R, BaseParameter::L],
        (Drive::Torque, _) => &[BaseParameter::J],
    };
    let missing = needed.iter().filter(|p| model.base_parameter(**p).is_none());
    let missing: Vec<&str> = missing.map(|p| p.name()).collect();
    if missing.is_empty() {
        return Ok(());
    }
    Err(Error::input(
        Place::file(&e.name),
        format!("the model has no {}, which this recording needs", missing.join(", ")),
        "identify it from recordings that hold the missing side, or give it with --fix",
    ))
}

/// A recording that says which motor type it is of has to be of the model's.
pub(crate) fn same_type(model: &Model, recording: &Recording) -> Result<()> {
    match (&model.motor, recording.metadata().get("motor")) {
        (Some(expected), Some(found)) if expected != found => Err(Error::input(
            Place::file(recording.path()),
            format!("this is a recording of motor type {found:?}, and the model is of type {expected:?}"),
            "take the model of this type, or identify one",
        )),
        _ => Ok(()),
    }
}

fn sums(model: &[f64], measured: &[f64], counted: impl Fn(usize) -> bool) -> Option<Sums> {
    if measured.is_empty() {
        return None;
    }
    let mut sums = Sums::default();
    for n in (0..measured.len()).filter(|n| counted(*n)) {
        sums.error += (model[n] - measured[n]).powi(2);
        sums.signal += measured[n].powi(2);
        sums.samples += 1.0;
    }
    (sums.samples > 0.0).then_some(sums)
}

/// Of a free run that diverges there is no error: it has no bound.
fn errors(t: &Traces) -> [Option<Sums>; 3] {
    if t.diverges {
        return [None; 3];
    }
    let counted = |n: usize| t.counted[n];
    [
        sums(&t.modelled_current, &t.measured_current, counted),
        sums(&t.modelled_speed, &t.measured_speed, counted),
        sums(&t.modelled_torque, &t.measured_torque, counted),
    ]
}

fn merge(parts: impl Iterator<Item = [Option<Sums>; 3]>) -> [Option<Sums>; 3] {
    parts.fold([None; 3], |mut total, part| {
        for (t, p) in total.iter_mut().zip(part) {
            if let Some(p) = p {
                let t = t.get_or_insert_default();
                t.error += p.error;
                t.signal += p.signal;
                t.samples += p.samples;
            }
        }
        total
    })
}

fn floors_squared(floors: &[PerSignal], errors: &[[Option<Sums>; 3]]) -> [Option<f64>; 3] {
    let of = |pick: fn(&PerSignal) -> Option<f64>, k: usize| {
        let mut sum = 0.0;
        for (floor, errors) in floors.iter().zip(errors) {
            if let Some(e) = errors[k] {
                sum += pick(floor)?.powi(2) * e.samples;
            }
        }
        Some(sum)
    };
    [of(|f| f.current, 0), of(|f| f.speed, 1), of(|f| f.torque, 2)]
}

/// Whether a measured signal is more than the noise in it, whose sum of squares is given where it is known.
fn stands_out(of: &Sums, noise: Option<f64>) -> bool {
    of.signal > 0.0 && noise.is_none_or(|noise| of.signal > AT_THE_FLOOR * AT_THE_FLOOR * noise)
}

/// Error-to-signal ratios over several recordings; none where the measured signal is nothing but its own noise.
fn ratio(errors: &[[Option<Sums>; 3]], floors: &[PerSignal]) -> PerSignal {
    let total = merge(errors.iter().copied());
    let floor = floors_squared(floors, errors);
    let mut esr = [None; 3];
    for k in 0..3 {
        esr[k] = total[k].filter(|t| stands_out(t, floor[k])).map(|t| (t.error / t.signal).sqrt());
    }
    esr.into()
}

fn floor_ratio(floors: &[PerSignal], errors: &[[Option<Sums>; 3]]) -> PerSignal {
    let total = merge(errors.iter().copied());
    let floor = floors_squared(floors, errors);
    let mut ratio = [None; 3];
    for k in 0..3 {
        ratio[k] = total[k].zip(floor[k]).filter(|(t, f)| stands_out(t, Some(*f))).map(|(t, f)| (f / t.signal).sqrt());
    }
    ratio.into()
}

/// Errors with one side imposed, relative to the same measured signals; none where [`ratio`] has none.
fn relative(structured: &[Option<Sums>; 3], errors: &[[Option<Sums>; 3]], floors: &[PerSignal]) -> PerSignal {
    let total = merge(errors.iter().copied());
    let floor = floors_squared(floors, errors);
    let of = |k: usize| {
        structured[k].zip(total[k]).filter(|(_, t)| stands_out(t, floor[k])).map(|(s, _)| (s.error / s.signal).sqrt())
    };
    [of(0), of(1), None].into()
}

/// The current with measured voltage and speed, and the speed with measured current: in the free run each error moves
/// both.
fn structured(motor: &greyrig::motor::Motor<f32>, e: &Experiment) -> Result<[Option<Sums>; 3]> {
    let (Drive::Voltage, Some(i), Some(w)) = (e.drive, &e.current, &e.speed) else { return Ok([None; 3]) };
    let turning = e.speed_itself().unwrap_or_default();
    let electrical = traces::simulate(motor, None, e, Imposed::Speed(&turning))?;
    let mechanical = traces::simulate(motor, None, e, Imposed::Current(i))?;
    let counted = |n: usize| e.counted[n];
    Ok([
        sums(&electrical.current, &traces::filtered(e, i), counted),
        sums(&mechanical.speed, &traces::filtered(e, w), counted),
        None,
    ])
}

/// Residuals of the voltage balance and the torque balance at the measured state, filtered: what the equations leave
/// over before anything is simulated.
fn one_step(motor: &greyrig::motor::Motor<f64>, e: &Experiment) -> [Option<Sums>; 2] {
    let (Drive::Voltage, Some(i), Some(w)) = (e.drive, &e.current, e.speed_itself()) else { return [None; 2] };
    let (di, dw) = (derivative(i, e.interval_s), derivative(&w, e.interval_s));
    let direction = directions(&w);
    let (mut voltage, mut torque, mut driving) = (Vec::new(), Vec::new(), Vec::new());
    let state = |n: usize| State { current: i[n], speed: w[n] };
    let mut memories = motor.memories_after(state(0), e.elapsed_s);
    for n in 0..e.len() {
        if n > 0 {
            let passed = Passed { interval: e.interval_s, before: state(n - 1), after: state(n) };
            motor.advance(&passed, &mut memories);
        }
        let at = OperatingPoint { current: i[n], speed: w[n], voltage: e.input[n] };
        let around = motor.around_point(&memories);
        let slopes = motor.slopes(&at, Some(direction[n]), &around);
        voltage.push(slopes.inductance * (slopes.current - di[n]));
        let inertia = motor.parameters().inertia;
        torque.push(inertia * (slopes.speed - dw[n]));
        driving.push(motor.linkage(&motor.balance(&at, &around)) * i[n]);
    }
    for (n, [mean, _]) in e.means_around_edges(i) {
        voltage[n] += mean - e.input[n];
    }
    let zero = vec![0.0; e.len()];
    let counted = |n: usize| e.counted[n] && !e.is_open(n) && !e.is_locked(n);
    let of = |residual: &[f64], signal: &[f64]| {
        let r = sums(&e.filtered(residual), &zero, counted)?;
        let s = sums(&zero, &e.filtered(signal), counted)?;
        Some(Sums { error: r.error, signal: s.error, samples: r.samples })
    };
    [of(&voltage, &e.input), of(&torque, &driving)]
}

fn one_step_ratio(parts: &[Part]) -> PerSignal {
    let total = merge(parts.iter().map(|p| [p.one_step[0], p.one_step[1], None]));
    let of = |k: usize| total[k].filter(|t| t.signal > 0.0).map(|t| (t.error / t.signal).sqrt());
    [of(0), of(1), None].into()
}
