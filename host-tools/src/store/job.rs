//! What is done with each recording of a store.

use std::path::Path;

use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::entry::Content;
use super::results::Estimated;
use crate::check::{self, Purpose};
use crate::compare::{PerSignal, compare_along, same_type};
use crate::context::Context;
use crate::diagnose::{self, Options, change};
use crate::error::{Error, Result, if_possible};
use crate::identify::{self, Settings};
use crate::model::{Kind, Model};
use crate::monitor::test;
use crate::recording::Recording;
use crate::recording::finding::Severity;

/// A question to each recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Job {
    /// Physical parameters, of the model's effects where one is given.
    Identify,
    /// Which physical effect is missing.
    Diagnose,
    /// Whether the motor passes.
    Monitor,
    /// What is wrong with the recording.
    Check,
}

impl Job {
    /// Its name in commands and folders.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Identify => "identify",
            Self::Diagnose => "diagnose",
            Self::Monitor => "monitor",
            Self::Check => "check",
        }
    }
}

/// A job with what it needs.
#[derive(Debug, Clone)]
pub struct Task {
    /// The job.
    pub job: Job,
    /// What its results are known by beside the recording: SHA-256 of the model file, or the settings.
    pub model_key: String,
    /// Name of the model file.
    pub model_name: Option<String>,
    model: Option<Model>,
    kind: Option<Kind>,
}

/// What came of one recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// In a word.
    pub outcome: String,
    /// In a sentence.
    pub text: String,
    /// Free-run error-to-signal ratios.
    pub esr: PerSignal,
    /// Parameters.
    pub parameters: Vec<Estimated>,
    /// All of it.
    pub json: Value,
}

impl Answer {
    fn new(outcome: impl Into<String>, text: impl Into<String>, json: Value) -> Self {
        let (esr, parameters) = (PerSignal::default(), Vec::new());
        Self { outcome: outcome.into(), text: text.into(), esr, parameters, json }
    }
}

impl Task {
    /// A job, with a model file or, without one, a kind of motor; by itself each recording's own.
    ///
    /// # Errors
    /// A model that cannot be read, or that the job cannot do with.
    pub fn new(job: Job, model: Option<&Path>, kind: Option<Kind>) -> Result<Self> {
        let read = |path| std::fs::read_to_string(path).map_err(|e| Error::io(path, e));
        let text = model.map(read).transpose()?;
        Self::with(job, model.zip(text.as_deref()), kind)
    }

    /// The same with the text of the model file, wherever that is; results are known by its digest.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with(job: Job, model: Option<(&Path, &str)>, kind: Option<Kind>) -> Result<Self> {
        let told = |kind: Option<Kind>| format!("kind={}", kind.map_or("as told", Kind::name));
        let Some((path, text)) = model else {
            if job == Job::Monitor {
                let what = "monitor judges by the limits of a model, and none is given";
                return Err(Error::usage(what, "give --model MODEL.toml, after greyrig calibrate"));
            }
            return Ok(Self { job, model_key: told(kind), model_name: None, model: None, kind });
        };
        let loaded = Model::parse(text, path)?;
        if job == Job::Monitor {
            loaded.limits(path)?;
        }
        if job == Job::Check {
            // Of the model only the kind of motor is asked for.
            let kind = Some(loaded.kind);
            return Ok(Self { job, model_key: told(kind), model_name: None, model: None, kind });
        }
        Ok(Self {
            job,
            model_key: Content(Sha256::digest(text.as_bytes()).into()).to_string(),
            model_name: path.file_name().map(|name| name.to_string_lossy().into_owned()),
            kind: Some(loaded.kind),
            model: Some(loaded),
        })
    }

    /// Whether the model is of another type of motor than the recording.
    pub fn is_of_another_type(&self, recording: &Recording) -> bool {
        self.model.as_ref().is_some_and(|model| same_type(model, recording).is_err())
    }

    /// Asks a recording. What cannot be asked of it is an answer, too: `refused`.
    ///
    /// # Errors
    /// An interrupt; whatever the system refuses.
    pub fn ask(&self, recording: Recording, ctx: &Context) -> Result<Answer> {
        let answer = match self.job {
            Job::Identify => self.identify(recording, ctx),
            Job::Diagnose => self.diagnose(recording, ctx),
            Job::Monitor => self.monitor(recording, ctx),
            Job::Check => Ok(self.check(recording)),
        };
        match answer {
            Err(error @ (Error::Input { .. } | Error::Insufficient { .. } | Error::Usage { .. })) => {
                let json = json!({ "error": { "what": error.what(), "remedy": error.remedy() } });
                Ok(Answer::new("refused", error.what(), json))
            }
            other => other,
        }
    }

    fn settings(&self, recordings: &[Recording]) -> Settings {
        match &self.model {
            Some(model) => Settings::of_model(model),
            None => Settings::new(Kind::of(self.kind, recordings)),
        }
    }

    fn identify(&self, recording: Recording, ctx: &Context) -> Result<Answer> {
        let mut recordings = [recording];
        let mut settings = self.settings(&recordings);
        let findings = check::question(&mut recordings, settings.kind, Purpose::Fit);
        if let Some(stop) = check::stop(&findings) {
            return Ok(Answer::new("refused", &stop.text, json!({ "data_findings": findings })));
        }
        change::hold(&mut settings, &recordings, ctx)?;
        let identification = identify::identify(&recordings, &settings, ctx)?;
        let comparison = if_possible(compare_along(&identification.model, &recordings, None, ctx))?;
        let esr = comparison.as_ref().map(|c| c.esr).unwrap_or_default();
        let parameters = identification.parameters.iter().map(|estimate| Estimated {
            name: estimate.name.clone(),
            value: estimate.value,
            unit: estimate.unit.clone(),
            ci95: estimate.ci95,
            identifiable: estimate.identifiable,
        });
        let parameters: Vec<Estimated> = parameters.collect();
        let json = json!({
            "kind": settings.kind,
            "parameters": identification.parameters,
            "flux_at_peak": identification.flux,
            "condition": identification.condition,
            "esr": comparison.as_ref().map(|c| c.esr),
            "noise_floor": comparison.as_ref().map(|c| c.noise_floor),
            "notes": identification.notes,
            "data_findings": findings,
        });
        Ok(Answer { esr, parameters, ..Answer::new("identified", identification.notes.join("; "), json) })
    }

    fn diagnose(&self, recording: Recording, ctx: &Context) -> Result<Answer> {
        let mut recordings = [recording];
        let settings = self.settings(&recordings);
        let findings = check::question(&mut recordings, settings.kind, Purpose::Fit);
        if let Some(stop) = check::stop(&findings) {
            return Ok(Answer::new("refused", &stop.text, json!({ "data_findings": findings })));
        }
        let options = Options { settings, exclude: Vec::new(), candidates_refined: true };
        let diagnosis = diagnose::diagnose(&recordings, &options, ctx)?;
        let mut json = diagnosis.as_json(None);
        json["data_findings"] = json!(findings);
        let kind = json["verdict"]["kind"].as_str().unwrap_or_default().to_owned();
        Ok(Answer { esr: diagnosis.esr_before, ..Answer::new(kind, diagnosis.headline(), json) })
    }

    fn monitor(&self, recording: Recording, ctx: &Context) -> Result<Answer> {
        let Some((model, detector)) = self.model.as_ref().and_then(|model| Some((model, model.detector.as_ref()?)))
        else {
            return Err(Error::usage("the model holds no limits", "learn them with greyrig calibrate"));
        };
        let mut recordings = [recording];
        let findings = check::question(&mut recordings, model.kind, Purpose::Detection);
        let [recording] = recordings;
        let test = test::test(model, detector, &recording, ctx)?;
        let alarm = test.alarms.first().map(|alarm| format!("{} at {:.1} times the limit", alarm.cause, alarm.ratio));
        let why: Vec<String> = test.reasons.iter().cloned().chain(alarm).collect();
        let outcome = json!(test.verdict).as_str().unwrap_or_default().to_owned();
        let mut json = json!(test);
        json["data_findings"] = json!(findings);
        Ok(Answer::new(outcome, why.join("; "), json))
    }

    fn check(&self, recording: Recording) -> Answer {
        let recordings = [recording];
        let found = check::check(&recordings, self.kind.or_else(|| Some(Kind::of(None, &recordings))));
        let outcome = match found.iter().map(|finding| finding.severity).max() {
            Some(Severity::Stop) => "stop",
            Some(Severity::Warning) => "warning",
            Some(Severity::Info) | None => "good",
        };
        let codes: Vec<String> = found.iter().map(|finding| finding.code.to_string()).collect();
        Answer::new(outcome, codes.join(", "), json!({ "data_findings": found }))
    }
}
