//! `greyrig store ls`: what the store holds.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::json;

use super::super::stdout;
use super::super::table::{Column, Table};
use super::super::terminal::Terminal;
use super::{counted, tell};
use crate::error::Result;
use crate::numbers::NONE;
use crate::store::listing::{About, ResultShare, Share, each, results, shares};
use crate::store::partition::Partition;
use crate::store::{Filter, Store};

/// What the store holds, folder by folder, or recording by recording.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  greyrig store ls motors\n  \
    greyrig store ls motors --where line=A3,from=2026-11-01 --each --json")]
pub struct Args {
    /// Folder of the store
    #[arg(value_name = "STORE")]
    store: PathBuf,
    /// Which recordings: line=…,type=…,day=…,from=…,to=…,serial=…
    #[arg(long = "where", value_name = "CONDITIONS", default_value = "")]
    filter: Filter,
    /// List each recording
    #[arg(long)]
    each: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// A folder that is no store.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let store = Store::open(&args.store)?;
    let shares = terminal.watching("store", |ctx| shares(&store, &args.filter, ctx, &tell))?;
    let results = terminal.watching("store", |ctx| results(&store, &args.filter, ctx, &tell))?;
    let mut all: Vec<About> = Vec::new();
    if args.each {
        terminal.watching("store", |ctx| each(&store, &args.filter, ctx, &|_, _| (), &mut |about| all.push(about)))?;
    }
    if args.json {
        let recordings: usize = shares.iter().map(|share| share.recordings).sum();
        let mut body = json!({ "store": args.store, "count": recordings, "folders": shares });
        let counted = |(share, count): (&ResultShare, &usize)| {
            let mut share = json!(share);
            share["count"] = json!(count);
            share
        };
        body["results"] = results.iter().map(counted).collect();
        if args.each {
            body["entries"] = json!(all);
        }
        stdout::print_json("store ls", &[], body)?;
        return Ok(ExitCode::SUCCESS);
    }
    if args.each {
        stdout::print_line(&recordings(&all))?;
    } else {
        stdout::print_line(&folders(&shares))?;
    }
    let (number, seconds) = (shares.iter().map(|s| s.recordings).sum(), shares.iter().map(|s| s.seconds).sum::<f64>());
    let bytes: u64 = shares.iter().map(|s| s.bytes).sum();
    stdout::print_line(&format!("{}, {seconds:.0} s, {}", counted(number, "recording"), size(bytes)))?;
    if !args.each && !results.is_empty() {
        stdout::print_line(&format!("\n{}", outcomes(&results)))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn outcomes(results: &BTreeMap<ResultShare, usize>) -> String {
    let mut table = Table::new([
        Column::text("question"),
        Column::text("model"),
        Column::text("version"),
        Column::text("outcome"),
        Column::figure("results"),
    ]);
    for (share, count) in results {
        let digest = share.model.get(..8).unwrap_or(&share.model);
        let model = match &share.model_name {
            Some(name) => format!("{name} ({digest})"),
            None => share.model.clone(),
        };
        table.row([&share.job, &model, &share.code, &share.outcome, &count.to_string()]);
    }
    table.to_string()
}

fn known(value: Option<&str>) -> String {
    value.unwrap_or(NONE).to_owned()
}

fn place(partition: &Partition) -> [String; 3] {
    let day = partition.day.map(|day| day.to_string());
    [known(partition.line.as_deref()), known(partition.motor.as_deref()), known(day.as_deref())]
}

fn folders(shares: &[Share]) -> String {
    let figures = ["recordings", "seconds", "files", "size"].map(Column::figure);
    let mut table = Table::new(["line", "type", "day"].map(Column::text).into_iter().chain(figures));
    for share in shares {
        let figures =
            [share.recordings.to_string(), format!("{:.0}", share.seconds), share.files.to_string(), size(share.bytes)];
        table.row(place(&share.partition).into_iter().chain(figures));
    }
    table.to_string()
}

fn recordings(all: &[About]) -> String {
    let names = ["sha256", "serial", "line", "type", "time"].map(Column::text);
    let mut table = Table::new(names.into_iter().chain(["samples", "Hz"].map(Column::figure)));
    for about in all {
        let [line, motor, day] = place(&about.partition);
        table.row([
            about.sha256.get(..12).unwrap_or_default().to_owned(),
            known(about.serial.as_deref()),
            line,
            motor,
            about.time.clone().unwrap_or(day),
            about.samples.to_string(),
            format!("{:.0}", 1.0 / about.sample_time_s),
        ]);
    }
    table.to_string()
}

/// Bytes in a unit that leaves at most four digits.
fn size(bytes: u64) -> String {
    let units = ["B", "kB", "MB", "GB", "TB"];
    let (mut value, mut unit) = (bytes as f64, 0);
    while value >= 9999.5 && unit + 1 < units.len() {
        value /= 1000.0;
        unit += 1;
    }
    format!("{value:.0} {}", units[unit])
}
