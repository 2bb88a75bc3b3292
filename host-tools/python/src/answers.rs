//! The questions, and what is answered.

use std::path::PathBuf;
use std::sync::Arc;

use greyrig_host::answers;
use greyrig_host::between::Course;
use greyrig_host::error::{Error, Result};
use greyrig_host::forecast;
use greyrig_host::model::catalogue;
use greyrig_host::monitor::lot::Labels;
use greyrig_host::recording::check_extension;
use pyo3::prelude::*;
use serde_json::Value;

use crate::model::Model;
use crate::options::{Destination, assignments, choice, choice_if, formulas};
use crate::recording::{Recording, files, those};
use crate::table::Table;
use crate::trouble::raised;
use crate::work::{Watch, work};

/// What was answered.
#[allow(clippy::large_enum_variant, reason = "there is one, behind an `Arc`")]
enum Told {
    Identify(answers::identify::Answer),
    Compare(answers::compare::Answer),
    Diagnose(answers::diagnose::Answer),
    Add(answers::add::Answer),
    Predict(answers::predict::Answer),
    Train(answers::train::Answer),
    Monitor(answers::monitor::Answer),
    /// Findings or limits, of which there is nothing more to show.
    Figures,
}

/// An answer: as JSON, as columns, as a report.
#[pyclass(frozen, module = "greyrig._native")]
pub struct Answer {
    json: String,
    model: Option<Py<Model>>,
    told: Arc<Told>,
}

impl Answer {
    fn new(py: Python<'_>, json: Result<Value>, model: Option<Model>, told: Told) -> PyResult<Self> {
        let json = raised(py, json)?.to_string();
        Ok(Self { json, model: model.map(|model| Py::new(py, model)).transpose()?, told: Arc::new(told) })
    }
}

#[pymethods]
impl Answer {
    /// The JSON object of the interface, as the command prints it.
    #[getter]
    fn json(&self) -> &str {
        &self.json
    }

    /// The model that came of it.
    #[getter]
    fn model(&self, py: Python<'_>) -> Option<Py<Model>> {
        self.model.as_ref().map(|model| model.clone_ref(py))
    }

    /// The same sample by sample.
    fn series(&self, py: Python<'_>) -> PyResult<Option<Table>> {
        let told = Arc::clone(&self.told);
        let series = py.detach(|| match &*told {
            Told::Compare(answer) => Some(answer.series()),
            Told::Predict(answer) => Some(answer.series.clone()),
            _ => None,
        });
        series.map(Table::of).transpose()
    }

    /// The report, an HTML page that needs no network; none where there is nothing to show.
    fn report(&self, py: Python<'_>) -> Option<String> {
        let told = Arc::clone(&self.told);
        py.detach(|| {
            let report = match &*told {
                Told::Identify(answer) => answer.report(),
                Told::Compare(answer) => Some(answer.report()),
                Told::Diagnose(answer) => answer.report(),
                Told::Add(answer) => Some(answer.report()),
                Told::Predict(answer) => Some(answer.report()),
                Told::Train(answer) => Some(answer.report()),
                Told::Monitor(answer) => Some(answer.report()),
                Told::Figures => None,
            };
            Some(report?.html())
        })
    }
}

/// Parameters of a motor type from recordings.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Identify {
    kind: Option<String>,
    method: String,
    base: Option<String>,
    effects: Vec<String>,
    terms: Vec<String>,
    fix: Vec<(String, f64)>,
    bound: Vec<(String, f64, f64)>,
    input: Option<String>,
    cutoff_hz: Option<f64>,
    order: u8,
}

impl Identify {
    fn request(self) -> Result<answers::identify::Request> {
        if !(1..=8).contains(&self.order) {
            return Err(Error::usage(
                format!("a filter of order {} cannot be", self.order),
                "choose an order from 1 to 8",
            ));
        }
        Ok(answers::identify::Request {
            kind: choice_if("kind", self.kind.as_deref())?,
            method: choice("method", &self.method)?,
            base: choice_if("base", self.base.as_deref())?,
            effects: catalogue::effects(&self.effects)?,
            terms: formulas(&self.terms)?,
            fixed: assignments(self.fix)?,
            bounds: self.bound,
            course: course(self.input.as_deref())?,
            cutoff_hz: self.cutoff_hz,
            order: Some(self.order),
        })
    }
}

fn course(word: Option<&str>) -> Result<Option<Course>> {
    choice_if("input", word)
}

/// Recordings that are asked about.
fn some(recordings: &[Py<Recording>]) -> Result<Vec<greyrig_host::recording::Recording>> {
    match recordings {
        [] => Err(Error::usage("there is no recording", "give one, or a list of some")),
        _ => Ok(those(recordings)),
    }
}

/// Recordings to a model.
///
/// # Errors
/// As the command.
#[pyfunction]
#[allow(private_interfaces, reason = "what a dictionary of options becomes")]
pub fn identify(
    py: Python<'_>,
    recordings: Vec<Py<Recording>>,
    options: Identify,
    to: Destination,
    watch: Watch,
) -> PyResult<Answer> {
    let asked = || -> Result<_> {
        to.check()?;
        let request = options.request()?;
        request.check()?;
        Ok((request, some(&recordings)?))
    };
    let (request, recordings) = raised(py, asked())?;
    let answer = work(py, &watch, move |ctx| request.answer(request.question(recordings), ctx))?;
    let model = &answer.identification.model;
    let out = raised(py, to.save(model))?;
    Answer::new(py, answer.as_json(out), Some(Model::of(model, out)), Told::Identify(answer))
}

/// A model against recordings.
///
/// # Errors
/// As the command.
#[pyfunction]
pub fn compare(
    py: Python<'_>,
    recordings: Vec<Py<Recording>>,
    model: &Model,
    input: Option<String>,
    to: Destination,
    watch: Watch,
) -> PyResult<Answer> {
    let asked = || -> Result<_> {
        to.check()?;
        to.out.as_deref().map_or(Ok(()), check_extension)?;
        Ok((answers::compare::Request { course: course(input.as_deref())? }, some(&recordings)?))
    };
    let (request, recordings) = raised(py, asked())?;
    let (model, out) = (Arc::clone(&model.model), to.out.clone());
    let answer = work(py, &watch, move |ctx| {
        let answer = request.answer(&model, request.question(&model, recordings), ctx)?;
        if let Some(path) = &out {
            answer.series().write(path, to.force, ctx)?;
        }
        Ok(answer)
    })?;
    Answer::new(py, answer.as_json(to.out.as_deref()), None, Told::Compare(answer))
}

/// What is looked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Diagnose {
    kind: Option<String>,
    base: Option<String>,
    fix: Vec<(String, f64)>,
    exclude: Vec<String>,
    input: Option<String>,
}

/// Which effect is missing.
///
/// # Errors
/// As the command.
#[pyfunction]
#[pyo3(signature = (recordings, model, options, watch))]
#[allow(private_interfaces, reason = "what a dictionary of options becomes")]
pub fn diagnose(
    py: Python<'_>,
    recordings: Vec<Py<Recording>>,
    model: Option<Py<Model>>,
    options: Diagnose,
    watch: Watch,
) -> PyResult<Answer> {
    let asked = || -> Result<_> {
        let request = answers::diagnose::Request {
            kind: choice_if("kind", options.kind.as_deref())?,
            base: choice_if("base", options.base.as_deref())?,
            fixed: assignments(options.fix)?,
            exclude: catalogue::effects(&options.exclude)?,
            course: course(options.input.as_deref())?,
        };
        if model.is_some() && (request.kind.is_some() || request.base.is_some()) {
            return Err(Error::usage("kind and base are those of the model", "leave them out"));
        }
        Ok((request, some(&recordings)?))
    };
    let (request, taken) = raised(py, asked())?;
    let known = model.as_ref().map(|model| Arc::clone(&model.get().model));
    let (request, answer) = work(py, &watch, move |ctx| {
        let given = request.question(known.as_deref(), taken);
        let answer = request.answer(known.as_deref(), given, ctx, &|_| {})?;
        Ok((request, answer))
    })?;
    let path = model.as_ref().and_then(|model| model.get().path.as_deref());
    // A command line can name files alone.
    let can_be_named = model.is_none() || path.is_some();
    let files = files(&recordings).filter(|_| can_be_named);
    let next = files.and_then(|files| request.next_command(&answer, &files, path));
    let fitted = answer.fitted.as_ref().map(|fitted| Model::of(fitted, None));
    Answer::new(py, answer.as_json(next.as_ref()), fitted, Told::Diagnose(answer))
}

/// Effects and terms added to a model.
///
/// # Errors
/// As the command.
#[pyfunction]
pub fn add(
    py: Python<'_>,
    effects: Vec<String>,
    terms: Vec<String>,
    recordings: Vec<Py<Recording>>,
    model: &Model,
    to: Destination,
    watch: Watch,
) -> PyResult<Answer> {
    let asked = || -> Result<_> {
        to.check()?;
        let request = answers::add::Request { effects: catalogue::effects(&effects)?, terms: formulas(&terms)? };
        request.check(!recordings.is_empty())?;
        request.check_model(&model.model)?;
        Ok((request, those(&recordings)))
    };
    let (request, recordings) = raised(py, asked())?;
    let model = Arc::clone(&model.model);
    let answer = work(py, &watch, move |ctx| request.answer(&model, request.question(&model, recordings), ctx))?;
    let model = &answer.identification.model;
    let out = raised(py, to.save(model))?;
    Answer::new(py, answer.as_json(out), Some(Model::of(model, out)), Told::Add(answer))
}

/// How a prediction is made.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Predict {
    input: String,
    initial: Vec<(String, f64)>,
    band: Option<f64>,
}

/// The model's free run on a voltage.
///
/// # Errors
/// As the command.
#[pyfunction]
#[allow(private_interfaces, reason = "what a dictionary of options becomes")]
pub fn predict(
    py: Python<'_>,
    recording: Py<Recording>,
    model: &Model,
    options: Predict,
    to: Destination,
    watch: Watch,
) -> PyResult<Answer> {
    let asked = || -> Result<_> {
        to.check()?;
        to.out.as_deref().map_or(Ok(()), check_extension)?;
        let band = options.band.map(|percent| percent / 100.0);
        let settings = forecast::Settings { input: choice("input", &options.input)?, band, ..Default::default() };
        let mut request = answers::predict::Request { settings };
        assignments(options.initial)?.iter().try_for_each(|part| request.begin_with(part))?;
        Ok((request, those(std::slice::from_ref(&recording))))
    };
    let (request, recordings) = raised(py, asked())?;
    let (known, path): (_, Option<PathBuf>) = (Arc::clone(&model.model), model.path.clone());
    let out = to.out.clone();
    let answer = work(py, &watch, move |ctx| {
        let answer = request.answer(&known, request.question(&known, recordings), ctx)?;
        if let Some(path) = &out {
            answer.series.write(path, to.force, ctx)?;
        }
        Ok(answer)
    })?;
    Answer::new(py, answer.as_json(path.as_deref(), to.out.as_deref()), None, Told::Predict(answer))
}

/// What is wrong with recordings.
///
/// # Errors
/// As the command.
#[pyfunction]
#[pyo3(signature = (recordings, kind, watch))]
pub fn check(py: Python<'_>, recordings: Vec<Py<Recording>>, kind: Option<String>, watch: Watch) -> PyResult<Answer> {
    let asked = || -> Result<_> {
        Ok((answers::check::Request { kind: choice_if("kind", kind.as_deref())? }, some(&recordings)?))
    };
    let (request, recordings) = raised(py, asked())?;
    let answer = work(py, &watch, move |_| Ok(request.answer(&recordings)))?;
    Answer::new(py, answer.as_json(), None, Told::Figures)
}

/// How a correction is learnt.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Train {
    blanking_s: f64,
    epochs: usize,
    method: String,
    bell: Option<f64>,
    ridge: Option<f64>,
    firing: String,
    delay_s: Option<f64>,
}

/// The learned correction of what a model leaves over.
///
/// # Errors
/// As the command.
#[pyfunction]
#[allow(private_interfaces, reason = "what a dictionary of options becomes")]
pub fn train(
    py: Python<'_>,
    recordings: Vec<Py<Recording>>,
    model: &Model,
    options: Train,
    to: Destination,
    watch: Watch,
) -> PyResult<Answer> {
    let asked = || -> Result<_> {
        to.check()?;
        if let Some(bell) = options.bell.filter(|bell| ![1.0, 2.0].contains(bell)) {
            return Err(Error::usage(
                format!("a bell of exponent {bell} cannot be"),
                "choose 1, 2, or None to train it",
            ));
        }
        let usual = answers::train::Request::default();
        let request = answers::train::Request {
            blanking_s: options.blanking_s,
            epochs: options.epochs,
            method: choice("method", &options.method)?,
            exponent: options.bell,
            ridge: options.ridge.unwrap_or(usual.ridge),
            firing: choice("firing", &options.firing)?,
            delay_s: options.delay_s,
            threads: watch.threads.unwrap_or(usual.threads),
        };
        request.check()?;
        Ok((request, some(&recordings)?))
    };
    let (request, recordings) = raised(py, asked())?;
    let model = Arc::clone(&model.model);
    let answer = work(py, &watch, move |ctx| request.answer(&model, request.question(&model, recordings), ctx))?;
    let out = raised(py, to.save(&answer.model))?;
    Answer::new(py, answer.as_json(out), Some(Model::of(&answer.model, out)), Told::Train(answer))
}

/// How limits are learnt.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Calibrate {
    blanking_s: f64,
    false_alarms: f64,
    unlabelled: bool,
}

/// The detector's limits from healthy motors.
///
/// # Errors
/// As the command.
#[pyfunction]
pub fn calibrate(
    py: Python<'_>,
    recordings: Vec<Py<Recording>>,
    model: &Model,
    options: Calibrate,
    to: Destination,
    watch: Watch,
) -> PyResult<Answer> {
    let Calibrate { blanking_s, false_alarms, unlabelled } = options;
    let labels = if unlabelled { Labels::Unknown } else { Labels::Healthy };
    let asked = || -> Result<_> {
        to.check()?;
        Ok((answers::calibrate::Request { blanking_s, false_alarms, labels }, some(&recordings)?))
    };
    let (request, recordings) = raised(py, asked())?;
    let model = Arc::clone(&model.model);
    let answer = work(py, &watch, move |ctx| request.answer(&model, request.question(&model, recordings), ctx))?;
    let out = raised(py, to.save(&answer.model))?;
    Answer::new(py, answer.as_json(out), Some(Model::of(&answer.model, out)), Told::Figures)
}

/// What is known beside the recordings of motors that are judged.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Monitor {
    motor: Option<String>,
    serial: Option<String>,
    air_hpa: Option<f64>,
    temp_c: Option<f64>,
}

/// Motors judged.
///
/// # Errors
/// As the command.
#[pyfunction]
#[allow(private_interfaces, reason = "what a dictionary of options becomes")]
pub fn monitor(
    py: Python<'_>,
    recordings: Vec<Py<Recording>>,
    model: &Model,
    options: Monitor,
    watch: Watch,
) -> PyResult<Answer> {
    let Monitor { motor, serial, air_hpa, temp_c } = options;
    let request = answers::monitor::Request { motor, serial, air_hpa, temp_c };
    let recordings = raised(py, some(&recordings))?;
    let (known, path) = (Arc::clone(&model.model), model.path.clone());
    let answer = work(py, &watch, move |ctx| {
        request.check_model(&known)?;
        let named = path.unwrap_or_else(|| "the model".into());
        known.limits(&named)?;
        let given = request.question(&known, recordings)?;
        let (all, mut done) = (given.recordings.len(), 0);
        let mut each = |_: &_| {
            done += 1;
            ctx.at("judging", f64::from(done) / all as f64);
            Ok(())
        };
        request.answer(&known, &named, given, ctx, &mut each)
    })?;
    Answer::new(py, answer.as_json(model.path.as_deref()), None, Told::Monitor(answer))
}

/// What is simulated.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Simulate {
    kind: String,
    effects: Vec<String>,
    faults: Vec<String>,
    hidden: Option<u64>,
    profile: Option<String>,
    seed: u64,
    seconds: Option<f64>,
    peak_voltage: Option<f64>,
    mains_hz: u16,
    spread: f64,
    noise: f64,
    turbulence: f64,
    fifth_harmonic: f64,
    rate_hz: Option<f64>,
    speed_sensor: Option<String>,
    reveal: bool,
    name: PathBuf,
}

/// A recording from the virtual rig.
///
/// # Errors
/// As the command.
#[pyfunction]
#[allow(private_interfaces, reason = "what a dictionary of options becomes")]
pub fn simulate(py: Python<'_>, options: Simulate, watch: Watch) -> PyResult<Recording> {
    let name = options.name;
    let request = answers::simulate::Request {
        kind: raised(py, choice("kind", &options.kind))?,
        effects: options.effects,
        faults: options.faults,
        hidden: options.hidden,
        profile: options.profile,
        seed: options.seed,
        seconds: options.seconds,
        peak_voltage_v: options.peak_voltage,
        mains_hz: options.mains_hz,
        spread: options.spread,
        noise: options.noise,
        turbulence: options.turbulence,
        fifth_harmonic: options.fifth_harmonic,
        rate_hz: options.rate_hz,
        speed_sensor: options.speed_sensor,
        reveal: options.reveal,
    };
    work(py, &watch, move |ctx| Ok(request.answer(ctx)?.recording.named(name))).map(Recording::of)
}
