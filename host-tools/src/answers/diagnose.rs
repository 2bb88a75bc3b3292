//! Which physical effect a model is missing.

use std::path::Path;

use clap::ValueEnum;
use greyrig::effects::EffectId;
use serde_json::{Value, json};

use super::next::{CommandLine, Files, unused};
use super::{Given, object};
use crate::between::Course;
use crate::check::{self, Purpose};
use crate::compare::{Comparison, PerSignal, compare_along};
use crate::context::Context;
use crate::diagnose::shape::Shape;
use crate::diagnose::{Diagnosis, Options, Ranked, VerdictKind, diagnose_telling};
use crate::error::{Result, if_possible};
use crate::identify::{Settings, identify};
use crate::model::{Assignment, Base, Kind, Model};
use crate::numbers::{figure, percent_in_column};
use crate::recording::finding::DataFinding;
use crate::recording::{Channel, Recording};
use crate::report::{Curves, Report, Table};

/// What is looked for, and from where on.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Request {
    /// Kind of motor, without a model; by itself what the recordings tell, or else universal.
    pub kind: Option<Kind>,
    /// Friction terms of the base model, without a model.
    pub base: Option<Base>,
    /// Parameters with a known value, SI.
    pub fixed: Vec<Assignment>,
    /// Effects that are not to be considered.
    pub exclude: Vec<EffectId>,
    /// What the voltage does between its samples; by itself what the data tell.
    pub course: Option<Course>,
}

impl Request {
    /// Questions recordings, as this request takes them.
    pub fn question(&self, model: Option<&Model>, recordings: Vec<Recording>) -> Given {
        let kind = model.map_or_else(|| Kind::of(self.kind, &recordings), |model| model.kind);
        Given::questioned(recordings, kind, Purpose::Fit)
    }

    /// The answer from a model, or without one from the base model, and recordings. `ranked` is told the candidates
    /// that a first screening puts foremost, with their gain.
    ///
    /// # Errors
    /// A model or recordings that cannot be used; an interrupt.
    pub fn answer(&self, model: Option<&Model>, given: Given, ctx: &Context, ranked: &Ranked<'_>) -> Result<Answer> {
        if check::stop(&given.findings).is_some() {
            return Ok(Answer { given, diagnosis: None, fitted: None, comparison: None });
        }
        let recordings = &given.recordings;
        let mut settings = match model {
            Some(model) => Settings::of_model(model),
            None => {
                let kind = Kind::of(self.kind, recordings);
                Settings { base: self.base.unwrap_or(Base::usual(kind)), ..Settings::new(kind) }
            }
        };
        settings.course = self.course;
        settings.fixed.extend(self.fixed.iter().cloned());
        let options = Options { settings: settings.clone(), exclude: self.exclude.clone(), candidates_refined: true };
        let quietly = &ctx.quietly();
        // What is compared is the base model as these recordings would have it: an effect is not to pass for a wrong R.
        let compared = || -> Result<Option<(Model, Option<Comparison>)>> {
            let along = |model: &Model| if_possible(compare_along(model, recordings, self.course, quietly));
            let identified = if_possible(identify(recordings, &settings, quietly))?;
            let Some(fitted) = identified.map(|identified| identified.model) else { return Ok(None) };
            let mut comparison = along(&fitted)?;
            // The noise of the voltage goes through the model: of the one that was given, so that the floor is that of
            // `compare`.
            let given = model.map(along).transpose()?.flatten();
            if let (Some(comparison), Some(given)) = (&mut comparison, given) {
                comparison.noise_floor = given.noise_floor;
                comparison.noise_floor_source = given.noise_floor_source;
            }
            Ok(Some((fitted, comparison)))
        };
        let (diagnosis, compared) = rayon::join(|| diagnose_telling(recordings, &options, ctx, ranked), compared);
        let diagnosis = diagnosis?;
        let (fitted, comparison) = compared?.unzip();
        let comparison = comparison.flatten();
        let floor = comparison.as_ref().map_or_else(PerSignal::default, |comparison| comparison.noise_floor);
        Ok(Answer { given, diagnosis: Some(diagnosis.held_against(&floor)), fitted, comparison })
    }

    /// The command that goes on from an answer, if one does: what is missing is added, rivals are told apart, a model
    /// that lacks nothing is identified, or asked what these recordings would have shown, and what stops is mended.
    /// `files` and `model` are where recordings and model come from.
    pub fn next_command(&self, answer: &Answer, files: &Files, model: Option<&Path>) -> Option<CommandLine> {
        let Some(d) = &answer.diagnosis else {
            let remedy = check::stop(&answer.given.findings)?.remedy.as_ref()?;
            let again = files.again_with(CommandLine::new("diagnose"), remedy);
            let kind = self.kind.filter(|_| !remedy.starts_with("--kind"));
            return Some(again.option("--kind", kind).option("--model", model.map(|model| model.display())));
        };
        let verdict = &d.verdict;
        let with_more = |effects: &[EffectId], terms: &[String]| self.with_more(files, model, effects, terms);
        match verdict.kind {
            VerdictKind::MissingEffect if d.can_be_added => Some(with_more(&verdict.effects, &[])),
            VerdictKind::None => Some(match model {
                Some(model) => files.again(CommandLine::new("challenge")).option("--model", [model.display()]),
                None => with_more(&[], &[]),
            }),
            VerdictKind::Ambiguous if verdict.effects.len() > 1 => {
                let known = model.map_or_else(|| unused(Path::new("model.toml")), Path::to_owned);
                let rivals: Vec<&str> = verdict.effects.iter().map(|id| id.id()).collect();
                let largest = |channel| {
                    let values = answer.given.recordings.iter().filter_map(|r| r.channel(channel)).flatten();
                    let largest = values.map(|x| x.abs()).fold(0.0, f64::max);
                    (largest > 0.0).then(|| figure(largest, 3))
                };
                let plan = CommandLine::new("plan")
                    .option("--model", [known.display()])
                    .option("--rivals", [rivals.join(",")])
                    .option("--max-voltage", largest(Channel::Voltage))
                    .option("--max-current", largest(Channel::Current));
                Some(match model {
                    Some(_) => plan,
                    None => with_more(&[], &[]).then(plan),
                })
            }
            VerdictKind::OutsideCatalogue if !d.lead.as_arguments().is_empty() => {
                Some(with_more(&[], &d.lead.as_arguments()))
            }
            _ => None,
        }
    }

    /// The command that gives the model effects and terms more, from the same recordings.
    fn with_more(&self, files: &Files, model: Option<&Path>, effects: &[EffectId], terms: &[String]) -> CommandLine {
        if let Some(model) = model {
            let add =
                CommandLine::new("add").with(effects).option("--term", terms).option("--model", [model.display()]);
            return files.again(add).option("--out", [unused(model).display()]);
        }
        let base = self.base.and_then(|base| base.to_possible_value()).map(|base| base.get_name().to_owned());
        files
            .again(CommandLine::new("identify"))
            .option("--kind", self.kind)
            .option("--base", base)
            .option("--fix", self.fixed.iter().map(|fixed| format!("{}={}", fixed.name, fixed.value)))
            .option("--input", self.course.map(Course::name))
            .option("--effect", effects)
            .option("--term", terms)
            .option("--out", [unused(Path::new("model.toml")).display()])
    }
}

/// A diagnosis, and how far the model is off without what is missing.
#[derive(Debug, Clone)]
pub struct Answer {
    /// What it rests on.
    pub given: Given,
    /// The verdict and what led to it; none: the recordings stop every answer, as their findings say.
    pub diagnosis: Option<Diagnosis>,
    /// The base model as these recordings would have it, where it can be identified from them.
    pub fitted: Option<Model>,
    /// The same against them, where it can be simulated.
    pub comparison: Option<Comparison>,
}

impl Answer {
    /// Why there is no diagnosis, in a sentence.
    pub fn stopped(&self) -> Option<String> {
        let stop = check::stop(&self.given.findings).filter(|_| self.diagnosis.is_none())?;
        Some(format!("the recording: {}", DataFinding::sentence(stop)))
    }

    /// The JSON object of the interface; `next` is the command that goes on from here.
    ///
    /// # Errors
    /// As [`object`].
    pub fn as_json(&self, next: Option<&CommandLine>) -> Result<Value> {
        let mut body = match &self.diagnosis {
            Some(diagnosis) => diagnosis.as_json(self.comparison.as_ref()),
            None => json!({
                "esr_before": PerSignal::default(), "esr_after": PerSignal::default(), "noise_floor": null, "where": null,
                "verdict": {
                    "kind": VerdictKind::InsufficientData, "effects": [], "sizes": [], "probability": null,
                    "text": self.stopped(), "next_experiment": null, "remaining": null,
                },
                "remaining": null, "classes": [], "candidates": [], "screening": [], "lead": null, "shape": null,
                "decoy_gain": null, "dithered": [],
            }),
        };
        body["next_command"] = json!(next.map(CommandLine::to_string));
        body["data_findings"] = json!(self.given.findings);
        object("diagnose", &self.given.names(), body)
    }

    /// The report; none: there is no diagnosis, or nothing to show beside it.
    pub fn report(&self) -> Option<Report<'_>> {
        let (d, model, comparison) = (self.diagnosis.as_ref()?, self.fitted.as_ref()?, self.comparison.as_ref()?);
        let mut report = Report::new("Which effect is missing").lead(d.headline()).text("Why", d.verdict.text.clone());
        if let Some(shape) = &d.shape {
            report = report.curves("The shape of what is missing", shape_in_report(shape));
        }
        let report = report.table("Candidates", candidates_in_report(d));
        Some(report.comparison("The model as it is", comparison, model).recordings(&self.given.origins()))
    }
}

/// Title of what a candidate is ranked by.
pub const GAIN_COLUMN: &str = "held-out error falls by";

/// Titles of [`candidate_rows`].
pub const CANDIDATE_COLUMNS: [&str; 7] = ["step", "candidate", GAIN_COLUMN, "current", "speed", "p", "objection"];

/// The candidates, best first, a row each.
pub fn candidate_rows(d: &Diagnosis) -> Vec<Vec<String>> {
    d.candidates
        .iter()
        .map(|c| {
            vec![
                c.step.to_string(),
                c.effect.to_string(),
                format!("{:.1} %", 100.0 * c.held_out_gain.max(0.0)),
                percent_in_column(c.esr_after.current),
                percent_in_column(c.esr_after.speed),
                if c.p_value < 1e-6 { "< 1e-6".to_owned() } else { figure(c.p_value, 2) },
                c.objection.unwrap_or("").to_owned(),
            ]
        })
        .collect()
}

/// The candidates as a table of the report.
pub fn candidates_in_report(d: &Diagnosis) -> Table {
    Table {
        caption: "Candidates step by step, best first; current and speed are free-run error-to-signal ratios"
            .to_owned(),
        columns: CANDIDATE_COLUMNS.map(str::to_owned).to_vec(),
        rows: candidate_rows(d),
    }
}

/// What the shape of what is missing says, in a sentence.
pub fn shape_caption(shape: &Shape) -> String {
    format!(
        "the shape of what is missing in the {} balance: {} orders it best ({:.0} % of its variance; current and speed together \
         {:.0} %)",
        shape.balance,
        shape.axis,
        100.0 * shape.explains,
        100.0 * shape.map_explains
    )
}

fn shape_in_report(shape: &Shape) -> Curves {
    Curves {
        caption: shape_caption(shape),
        x: format!("{}, {}", shape.axis, shape.axis_unit),
        y: format!("missing, {}", shape.unit),
        logarithmic: false,
        curves: vec![("what is missing".to_owned(), shape.curve.iter().map(|p| (p.at, p.missing)).collect())],
    }
}
