//! `greyrig convert`: any supported file to CSV or Parquet, in SI units under the interface's names.

use std::path::PathBuf;
use std::process::ExitCode;

use serde::Serialize;

use super::stdout;
use super::terminal::Terminal;
use crate::answers::next::CommandLine;
use crate::check::check;
use crate::error::Result;
use crate::output;
use crate::recording::finding::DataFinding;
use crate::recording::{self, Channel, MapArgs, Recording};

/// Arguments of `greyrig convert`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: greyrig convert scope.csv --out run.csv --map u_v=CH1*10 i_a=CH2*0.1 'omega_rad_s=CH3*100[rpm]'"
)]
pub struct Args {
    /// The file to read: CSV, Parquet, MATLAB, HDF5, MDF, TDMS, WAV, Arrow, NumPy.
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// The file to write: .csv or .parquet.
    #[arg(long, value_name = "OUT")]
    pub out: PathBuf,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub map: MapArgs,
    /// Replace the output file if it exists.
    #[arg(long)]
    pub force: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    pub json: bool,
}

#[derive(Serialize)]
struct Summary {
    channel: String,
    unit: Option<&'static str>,
    min: f64,
    max: f64,
    rms: f64,
}

#[derive(Serialize)]
struct Report<'a> {
    out: String,
    samples: usize,
    valid_samples: usize,
    sample_time_s: f64,
    start_s: f64,
    motion: recording::Motion,
    channels: Vec<Summary>,
    metadata: &'a std::collections::BTreeMap<String, String>,
    sha256: &'a str,
    warnings: &'a [String],
    data_findings: Vec<DataFinding>,
}

/// Runs the command.
///
/// # Errors
/// Whatever reading or writing refuses.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    output::refuse_overwrite(&args.out, args.force)?;
    let recording = recording::load(&args.input, &args.map.mapping()?, &terminal.context())?;
    for warning in recording.warnings() {
        eprintln!("greyrig: {}: warning: {warning}", args.input.display());
    }
    recording::write(&recording, &args.out, args.force, &terminal.context())?;
    let channels = summaries(&recording);
    if args.json {
        let report = Report {
            out: args.out.display().to_string(),
            samples: recording.len(),
            valid_samples: recording.valid().iter().filter(|&&ok| ok).count(),
            sample_time_s: recording.sample_time_s(),
            start_s: recording.start_s(),
            motion: recording.motion(),
            channels,
            metadata: recording.metadata(),
            sha256: recording.sha256(),
            warnings: recording.warnings(),
            data_findings: check(std::slice::from_ref(&recording), None),
        };
        stdout::print_json("convert", &[args.input.display().to_string()], report)?;
    } else {
        stdout::print_line(&format!(
            "{}: {} samples, {:.6} s apart",
            args.out.display(),
            recording.len(),
            recording.sample_time_s()
        ))?;
        for s in channels {
            let unit = s.unit.map(|u| format!(" {u}")).unwrap_or_default();
            stdout::print_line(&format!(
                "  {:<14} {:.5} to {:.5}{unit}, RMS {:.5}{unit}",
                s.channel, s.min, s.max, s.rms
            ))?;
        }
        stdout::print_next(Some(&CommandLine::new("check").files([&args.out])))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Extremes and RMS of each column, over the valid samples.
fn summaries(recording: &Recording) -> Vec<Summary> {
    let named = Channel::ALL
        .into_iter()
        .filter_map(|c| Some((c.column().to_owned(), Some(c.unit(recording.motion())), recording.channel(c)?)));
    let extras = recording.extras().iter().map(|e| (e.name.clone(), None, e.values.as_slice()));
    named
        .chain(extras)
        .map(|(channel, unit, values)| {
            let used: Vec<f64> = values.iter().zip(recording.valid()).filter(|(_, ok)| **ok).map(|(x, _)| *x).collect();
            // All samples may be invalid; zeros are then better than infinities, which JSON does not know.
            let used = if used.is_empty() { vec![0.0] } else { used };
            Summary {
                channel,
                unit,
                min: used.iter().copied().fold(f64::INFINITY, f64::min),
                max: used.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                rms: (used.iter().map(|x| x * x).sum::<f64>() / used.len() as f64).sqrt(),
            }
        })
        .collect()
}
