//! `greyrig anfis`: the trainer of the correction on any table.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Subcommand;
use greyrig::anfis;
use serde_json::json;

use super::answer::Answer;
use super::stdout;
use super::table::{Column, Table};
use super::terminal::Terminal;
use crate::anfis::csv::{self, Named};
use crate::anfis::{Epoch, Keep, Method, Ridge, Settings, Trained, train};
use crate::error::{Error, Result};
use crate::network::{FiringName, ShapeName};
use crate::output;
use crate::report::training;

/// How far outside the trained box the output fades to zero, as a fraction of the box.
const MARGIN: f64 = 0.1;

/// Fuzzy networks (ANFIS) on any table.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Train a network on a table x1,…,xn,y.
    Fit(Fit),
}

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  greyrig anfis fit train.csv --check check.csv --mfs 3 --epochs 50 --out net.toml --report net.html\n  \
    greyrig anfis fit train.csv --mfs 2 --epochs 200 --range 1:6 --method hybrid --step 0.1 --json"
)]
struct Fit {
    /// Training table: a line of names, then rows of numbers; the target is column y or the last one
    #[arg(value_name = "TRAIN.csv")]
    train: PathBuf,
    /// Checking table of the same columns
    #[arg(long, value_name = "CHECK.csv")]
    check: Option<PathBuf>,
    /// Membership functions of each input
    #[arg(long, default_value_t = 3)]
    mfs: usize,
    /// Epochs at most
    #[arg(long, default_value_t = 100)]
    epochs: usize,
    /// Range over which the first membership functions are spread: one for all inputs, or one for each in turn
    /// [default: that of the data]
    #[arg(long, value_name = "LO:HI", value_parser = parse_range, allow_hyphen_values = true)]
    range: Vec<(f64, f64)>,
    /// How the premises are trained
    #[arg(long, value_enum, default_value = "varpro")]
    method: Method,
    /// Form of the membership functions
    #[arg(long, value_enum, default_value = "bell")]
    shape: ShapeName,
    /// Exponent b of the bells: trained, or fixed for a cheaper network
    #[arg(long, value_name = "free|1|2", default_value = "free", value_parser = parse_bell)]
    bell: Bell,
    /// Firing operator
    #[arg(long, value_enum, default_value = "product")]
    firing: FiringName,
    /// Ridge of least squares as a fraction of rows over columns [default: 1e-6; with hybrid 1e-6 as it is]
    #[arg(long)]
    ridge: Option<f64>,
    /// First step size of the hybrid method
    #[arg(long, default_value_t = 0.1)]
    step: f64,
    /// Which epoch's network is kept [default: checking; with hybrid training]
    #[arg(long, value_enum)]
    keep: Option<Keep>,
    /// Epochs without a smaller checking error after which training stops, 0 for never [default: 10; with hybrid 0]
    #[arg(long)]
    patience: Option<usize>,
    /// Rules whose share exceeds this nowhere get zero consequents, 0 for none [default: 0.01; with hybrid 0]
    #[arg(long)]
    prune: Option<f64>,
    /// Threads, 0 for all processors
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// File to write the network to
    #[arg(long, value_name = "NET.toml")]
    out: Option<PathBuf>,
    #[command(flatten)]
    answer: Answer,
}

/// Exponent of the bells, if it is fixed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bell(pub(super) Option<f64>);

pub(super) fn parse_bell(text: &str) -> std::result::Result<Bell, String> {
    match text {
        "free" => Ok(Bell(None)),
        "1" => Ok(Bell(Some(1.0))),
        "2" => Ok(Bell(Some(2.0))),
        _ => Err(format!("{text:?} is none of free, 1, 2")),
    }
}

fn parse_range(text: &str) -> std::result::Result<(f64, f64), String> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
    text.split_once(':')
        .and_then(|(low, high)| Some((number(low)?, number(high)?)))
        .filter(|(low, high)| low < high)
        .ok_or_else(|| format!("{text:?} is not LO:HI, such as -1:1"))
}

/// Runs the command.
///
/// # Errors
/// Tables that cannot be read or trained on, or a file that cannot be written.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    match &args.command {
        Command::Fit(args) => fit(args, terminal),
    }
}

impl Fit {
    fn settings(&self, inputs: usize) -> Settings {
        let mut settings = Settings::new(self.method, self.mfs, self.epochs);
        settings.shape = self.shape.into();
        settings.exponent = self.bell.0;
        settings.firing = self.firing.into();
        settings.step = self.step;
        settings.threads = self.threads;
        settings.ranges = match self.range.as_slice() {
            [] => None,
            [one] => Some(vec![*one; inputs]),
            several => Some(several.to_vec()),
        };
        settings.ridge = self.ridge.map_or(settings.ridge, Ridge::Relative);
        settings.keep = self.keep.unwrap_or(settings.keep);
        if let Some(patience) = self.patience {
            settings.patience = Some(patience).filter(|p| *p > 0);
        }
        if let Some(prune) = self.prune {
            settings.prune = Some(prune).filter(|p| *p != 0.0);
        }
        settings
    }
}

fn fit(args: &Fit, terminal: &Terminal) -> Result<ExitCode> {
    for path in [&args.out, &args.answer.report].into_iter().flatten() {
        output::refuse_overwrite(path, args.answer.force)?;
    }
    let data = csv::read(&args.train, &terminal.context())?;
    let check = args.check.as_deref().map(|path| csv::read(path, &terminal.context())).transpose()?;
    if let Some(other) = check.as_ref().filter(|c| c.inputs != data.inputs || c.target != data.target) {
        return Err(Error::usage(
            format!("the checking table has the columns {}, the training table {}", columns(other), columns(&data)),
            "give both the same columns in the same order",
        ));
    }
    let settings = args.settings(data.inputs.len());
    let check = check.as_ref().map(|c| &c.table);
    let trained = terminal.watching("training", |ctx| train(&data.table, check, &settings, ctx))?;
    for note in trained.notes() {
        eprintln!("greyrig: {note}");
    }
    if let Some(path) = &args.out {
        trained.reach.check(trained.output)?;
        trained.file(args.method, MARGIN, &data.inputs, &data.target).save(path, args.answer.force)?;
    }
    if let Some(path) = &args.answer.report {
        let words: Vec<String> = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
        let command = format!("greyrig {}", words.join(" "));
        training::report(&data, &trained, &command).write(path, args.answer.force)?;
    }
    if args.answer.json {
        let names: Vec<String> =
            [Some(&args.train), args.check.as_ref()].into_iter().flatten().map(|p| p.display().to_string()).collect();
        stdout::print_json("anfis fit", &names, as_json(&data, &trained, args))?;
        return Ok(ExitCode::SUCCESS);
    }
    print(&data, &trained)?;
    for path in [&args.out, &args.answer.report].into_iter().flatten() {
        stdout::print_line(&format!("written: {}", path.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn columns(table: &Named) -> String {
    let mut names = table.inputs.clone();
    names.push(format!("{} (target)", table.target));
    names.join(", ")
}

fn as_json(data: &Named, trained: &Trained, args: &Fit) -> serde_json::Value {
    let net = &trained.net;
    let (n, m) = (net.inputs, net.functions);
    let at = |index: Option<usize>| index.map(|k| json!({ "epoch": k + 1, "errors": trained.epochs[k] }));
    let best = |get: fn(&Epoch) -> Option<f64>| {
        let errors = trained.epochs.iter().enumerate().filter_map(|(k, e)| get(e).map(|x| (k, x)));
        errors.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
    };
    json!({
        "epochs": trained.epochs,
        "rmse_trn": trained.rmse_trn,
        "rmse_chk": trained.rmse_chk,
        "kept_epoch": trained.best + 1,
        "best_trn": at(best(|e| Some(e.rmse_trn))),
        "best_chk": at(best(|e| e.rmse_chk)),
        "stopped": trained.stopped,
        "method": args.method,
        "ridge": trained.ridge,
        "inputs": data.inputs,
        "target": data.target,
        "rows": data.table.rows(),
        "rules": net.rules(),
        "premise_parameters": anfis::premise_parameters(n, m),
        "consequent_parameters": anfis::consequent_parameters(n, m),
        "nodes": anfis::nodes(n, m),
        "premise": net.premise.iter().map(|p| [p.a, p.b, p.c]).collect::<Vec<_>>(),
        "support": trained.support,
        "reach": trained.reach,
        "notes": trained.notes(),
        "net": args.out,
        "report": args.answer.report,
    })
}

fn print(data: &Named, trained: &Trained) -> Result<()> {
    let mut table = Table::new([Column::text(""), Column::figure("training"), Column::figure("checking")]);
    let chk = |e: Option<f64>| e.map_or_else(|| "–".into(), |e| format!("{e:.6}"));
    let mut row = |name: String, e: &Epoch| {
        table.row([name, format!("{:.6}", e.rmse_trn), chk(e.rmse_chk)]);
    };
    row("RMS error, epoch 1".into(), &trained.epochs[0]);
    row(format!("epoch {}, kept", trained.best + 1), &trained.epochs[trained.best]);
    let kept = Epoch { rmse_trn: trained.rmse_trn, rmse_chk: trained.rmse_chk, step: None };
    if trained.support.iter().any(|s| s.pruned) {
        row("after dropping rules".into(), &kept);
    }
    stdout::print_line(&table.to_string())?;
    let net = &trained.net;
    stdout::print_line(&format!(
        "{} rows, {} rules, {} epochs ({})",
        data.table.rows(),
        net.rules(),
        trained.epochs.len(),
        match trained.stopped {
            crate::anfis::Stopped::Epochs => "all that were asked for",
            crate::anfis::Stopped::Converged => "the error falls no more",
            crate::anfis::Stopped::Check => "the checking error falls no more",
            crate::anfis::Stopped::Diverged => "then the error was no number any more",
            crate::anfis::Stopped::Asked => "stopped",
        }
    ))?;
    let figures = ["function", "a", "b", "c"].map(Column::figure);
    let mut table = Table::new([Column::text("input")].into_iter().chain(figures));
    for (k, p) in net.premise.iter().enumerate() {
        table.row([
            data.inputs[k / net.functions].clone(),
            (k % net.functions + 1).to_string(),
            format!("{:.5}", p.a),
            format!("{:.4}", p.b),
            format!("{:.5}", p.c),
        ]);
    }
    stdout::print_line(&table.to_string())
}
