//! `greyrig train`: the learned correction of what the physical model leaves over.

use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::{Value, json};

use super::anfis::{Bell, notes, parse_bell};
use super::answer::Answer;
use super::input::{self, Answered, Input};
use super::stdout;
use super::terminal::Terminal;
use super::words;
use crate::anfis::{Method, Ridge, Settings, Trained};
use crate::check::Purpose;
use crate::compare::{Comparison, PerSignal, compare};
use crate::error::{Error, Result};
use crate::held_out::split;
use crate::hybrid;
use crate::model::{Model, Origin};
use crate::network::FiringName;
use crate::output;
use crate::recording::Recording;
use crate::report::training::network;
use crate::report::{Curves, Report, Step};

/// Trains the correction (ANFIS) on what the model leaves over, and judges it on data held out.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig train --model model.toml staircase.csv ramp.csv --out hybrid.toml\n\n\
    With several recordings the correction is judged on the last one, which it does not see; with a single one, on the last third of the\n\
    time until all is at rest.")]
pub struct Args {
    #[command(flatten)]
    input: Input,
    /// Model file to correct
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Model file to write
    #[arg(long, value_name = "MODEL2.toml")]
    out: Option<PathBuf>,
    /// Begin of each recording that is neither learnt nor judged, s: the start of the motor, as in the detector
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    blanking: f64,
    /// Epochs at most
    #[arg(long, default_value_t = 60)]
    epochs: usize,
    /// How the premises are trained
    #[arg(long, value_enum, default_value = "varpro")]
    method: Method,
    /// Exponent b of the bells: trained, or fixed for a network that takes half the time on the microcontroller
    #[arg(long, value_name = "free|1|2", default_value = "free", value_parser = parse_bell)]
    bell: Bell,
    /// Ridge of least squares as a fraction of rows over columns
    #[arg(long, default_value_t = hybrid::RIDGE)]
    ridge: f64,
    /// Firing operator
    #[arg(long, value_enum, default_value = "product")]
    firing: FiringName,
    /// Tell what a fourth input would gain, the modelled current so long ago, s. The model that is written has none:
    /// the microcontroller's network has no memory
    #[arg(long, value_name = "S")]
    delay: Option<f64>,
    /// Threads, 0 for all processors
    #[arg(long, default_value_t = 0)]
    threads: usize,
    #[command(flatten)]
    answer: Answer,
}

/// Runs the command.
///
/// # Errors
/// A model or recordings that cannot be used, or a file that cannot be written.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    for path in args.out.iter().chain(&args.answer.report) {
        output::refuse_overwrite(path, args.answer.force)?;
    }
    if let Some(delay) = args.delay.filter(|delay| !(1e-4..=1.0).contains(delay)) {
        return Err(Error::usage(format!("a delay of {delay} s cannot be"), "choose --delay from 0.0001 to 1"));
    }
    let bare = Model { correction: None, detector: None, ..Model::load(&args.model)? };
    let mut recordings = args.input.load(&terminal.context())?;
    let findings = input::question(&mut recordings, bare.kind, Purpose::Fit);
    input::refuse(&findings)?;
    let outcome = Outcome::of(&bare, &recordings, args, terminal)?;
    if let Some(path) = &args.out {
        outcome.model.save(path, args.answer.force)?;
    }
    if let Some(path) = &args.answer.report {
        let files: Vec<Origin> = recordings.iter().map(Origin::from).collect();
        outcome.report(&files).write(path, args.answer.force)?;
        eprintln!("report: {}", path.display());
    }
    if args.answer.json {
        let answer = Answered { answer: outcome.in_json(args), data_findings: &findings };
        stdout::print_json("train", &args.input.names(), answer)?;
        return Ok(ExitCode::SUCCESS);
    }
    outcome.tell(args)?;
    if let Some(path) = &args.out {
        stdout::print_line(&format!("written: {}", path.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// What the correction does, on training data and on data held out.
struct Outcome {
    model: Model,
    trained: Trained,
    /// With a fourth input.
    delayed: Option<Trained>,
    before: [Comparison; 2],
    after: [Comparison; 2],
    share: Option<f64>,
}

impl Outcome {
    fn of(bare: &Model, recordings: &[Recording], args: &Args, terminal: &Terminal) -> Result<Self> {
        let (training, held_out) = split(recordings);
        let settings = Settings {
            exponent: args.bell.0,
            firing: args.firing.into(),
            threads: args.threads,
            ridge: Ridge::Relative(args.ridge),
            ..hybrid::settings(args.method, args.epochs)
        };
        let (model, trained) =
            terminal.watching("training", |ctx| hybrid::train(bare, &training, args.blanking, &settings, ctx))?;
        let ctx = &terminal.context();
        let with_delay =
            |delay| hybrid::with_rows_kept_back(bare, &training, args.blanking, Some(delay), &settings, ctx);
        let delayed = args.delay.map(with_delay).transpose()?;
        let judged = |recordings: &[Recording]| -> Vec<Recording> {
            recordings.iter().map(|r| hybrid::without_start(r, args.blanking)).collect()
        };
        let data = [judged(&training), judged(&held_out)];
        let before = [compare(bare, &data[0], ctx)?, compare(bare, &data[1], ctx)?];
        let after = [compare(&model, &data[0], ctx)?, compare(&model, &data[1], ctx)?];
        let share = hybrid::share_of_correction(&before[1], &after[1]);
        Ok(Self { model, trained, delayed, before, after, share })
    }

    /// Whether the error falls on data held out.
    fn accepted(&self) -> bool {
        self.before[1].esr.falls_to(&self.after[1].esr)
    }

    fn in_words(&self) -> String {
        let current = |c: &Comparison| words::percent(c.esr.current);
        format!(
            "on data held out the error of the current falls from {} to {}; the black box makes {} of the current, physics the rest",
            current(&self.before[1]),
            current(&self.after[1]),
            words::percent(self.share)
        )
    }

    fn report(&self, files: &[Origin]) -> Report<'_> {
        let step = |label: &str, c: &Comparison| Step { label: label.to_owned(), esr: c.esr };
        let held_out = &self.after[1];
        let steps = [step("physical model", &self.before[1]), step("+ correction", held_out)];
        let report = Report::new("The learned correction")
            .lead(self.in_words())
            .waterfall("Error-to-signal ratio on data held out", &steps, held_out.noise_floor)
            .curves("Learning curve", learning_curve(&self.trained));
        network(report, &hybrid::INPUTS.map(str::to_owned), hybrid::TARGET, &self.trained)
            .comparison("With the correction, on data held out", held_out, &self.model)
            .recordings(files)
    }

    fn in_json(&self, args: &Args) -> Value {
        let delayed = |d: &Trained| json!({ "delay_s": args.delay, "rmse_trn": d.rmse_trn, "rmse_chk": d.rmse_chk });
        json!({
            "epochs": self.trained.epochs,
            "rmse_trn": self.trained.rmse_trn,
            "rmse_chk": self.trained.rmse_chk,
            "esr_before": self.before[0].esr,
            "esr_after": self.after[0].esr,
            "held_out_before": self.before[1].esr,
            "held_out_after": self.after[1].esr,
            "noise_floor": self.after[1].noise_floor,
            "correction_share": self.share,
            "accepted": self.accepted(),
            "delayed": self.delayed.as_ref().map(delayed),
            "notes": notes(&self.trained),
            "model": args.out,
        })
    }

    fn tell(&self, args: &Args) -> Result<()> {
        stdout::print_line(&table(&self.before, &self.after))?;
        stdout::print_line(&format!("\n{}", self.in_words()))?;
        if let (Some(d), Some(delay)) = (&self.delayed, args.delay) {
            let chk = |t: &Trained| t.rmse_chk.map_or_else(|| "–".to_owned(), |e| format!("{e:.4} A"));
            stdout::print_line(&format!(
                "with the modelled current of {delay} s ago as a fourth input ({} rules in place of {}) the error on rows kept back would be \
                 {} in place of {}",
                d.net.rules(),
                self.trained.net.rules(),
                chk(d),
                chk(&self.trained)
            ))?;
        }
        for note in notes(&self.trained) {
            stdout::print_line(&format!("note: {note}"))?;
        }
        if !self.accepted() {
            stdout::print_line("not accepted: the error does not fall on data that the training has not seen")?;
        }
        Ok(())
    }
}

fn learning_curve(trained: &Trained) -> Curves {
    let of = |get: &dyn Fn(&crate::anfis::Epoch) -> Option<f64>| -> Vec<(f64, f64)> {
        trained.epochs.iter().enumerate().filter_map(|(k, e)| Some((k as f64 + 1.0, get(e)?))).collect()
    };
    Curves {
        caption: "Root mean square error of the raw current on the rows trained on and on those kept back to tell when to stop"
            .to_owned(),
        x: "epoch".to_owned(),
        y: "A".to_owned(),
        logarithmic: true,
        curves: vec![("training".to_owned(), of(&|e| Some(e.rmse_trn))), ("checking".to_owned(), of(&|e| e.rmse_chk))],
    }
}

fn table(before: &[Comparison; 2], after: &[Comparison; 2]) -> String {
    let mut table = words::table(&["error-to-signal ratio", "current", "speed", "held out: current", "speed"]);
    let row = |label: &str, training: PerSignal, held_out: PerSignal| {
        [label.to_owned()]
            .into_iter()
            .chain([training.current, training.speed, held_out.current, held_out.speed].map(words::percent))
            .collect::<Vec<_>>()
    };
    table.add_row(row("physical model", before[0].esr, before[1].esr));
    table.add_row(row("+ correction", after[0].esr, after[1].esr));
    table.add_row(row("noise floor", after[0].noise_floor, after[1].noise_floor));
    table.to_string()
}
