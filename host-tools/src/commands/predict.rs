//! `greyrig predict`: what a model makes of a voltage.

use std::path::PathBuf;
use std::process::ExitCode;

use super::input;
use super::stdout;
use super::terminal::Terminal;
use crate::answers::next::{CommandLine, Files};
use crate::answers::predict::Request;
use crate::check;
use crate::error::Result;
use crate::forecast::{Band, Extrapolation, Prediction, Settings, Source, Stretch, Supply};
use crate::model::{Assignment, Model};
use crate::output;
use crate::recording::{Channel, MapArgs, check_extension};

/// Stretches that are told; the rest is counted, and all are in the JSON.
const MOST_TOLD: usize = 8;

/// The model's free run on any voltage, with bands.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  greyrig predict voltage.csv --model model.toml --out series.csv --band 95\n  \
    greyrig predict steps.csv --model model.toml --out series.parquet --input held --initial i_a=0,omega_rad_s=120\n\n\
    The input needs t_s and u_v. Its rotor_locked and supply_open are obeyed; measured i_a and omega_rad_s are carried \
    along as measured_i_a and measured_omega_rad_s, and the run begins from them where --initial says nothing else.")]
pub struct Args {
    /// The voltage, in any supported format
    #[arg(value_name = "INPUT")]
    input: PathBuf,
    #[command(flatten)]
    map: MapArgs,
    /// Model file
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Series to write, .csv or .parquet: t_s, u_v, i_a, omega_rad_s, their bands, and what else the input holds
    #[arg(long, value_name = "SERIES")]
    out: PathBuf,
    /// What the voltage does between its samples
    #[arg(long = "input", value_enum, value_name = "COURSE", default_value = "as-fitted")]
    course: Supply,
    /// State at the first sample, such as i_a=0,omega_rad_s=120 [default: what was measured, or else rest]
    #[arg(long, value_name = "NAME=VALUE", value_delimiter = ',')]
    initial: Vec<Assignment>,
    /// Percentage of what this motor does, on inputs like those of the fit, that bands shall hold
    #[arg(long, value_name = "PERCENT")]
    band: Option<f64>,
    /// Replace an existing file
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// A model or an input that cannot be used, or a file that cannot be written.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    output::refuse_overwrite(&args.out, args.force)?;
    check_extension(&args.out)?;
    let settings =
        Settings { input: args.course, band: args.band.map(|percent| percent / 100.0), ..Default::default() };
    let mut request = Request { settings };
    args.initial.iter().try_for_each(|part| request.begin_with(part))?;
    let model = Model::load(&args.model)?;
    let recordings = input::load(std::slice::from_ref(&args.input), &args.map, &terminal.context())?;
    let given = request.question(&model, recordings);
    if given.recordings.iter().any(check::is_recorded) {
        input::tell(&given.findings);
    }
    input::tell_stops(&given.findings);
    let answer = terminal.watching("predict", |ctx| request.answer(&model, given, ctx))?;
    answer.series.write(&args.out, args.force, &terminal.context())?;
    if args.json {
        stdout::print_as_it_is(&answer.as_json(Some(&args.model), Some(&args.out))?.to_string())?;
    } else {
        stdout::print_line(&in_words(&answer.prediction, &model))?;
        stdout::print_line(&format!("\nwritten: {}", args.out.display()))?;
        let files = Files { recordings: vec![args.input.clone()], map: args.map.map.clone() };
        let compare = || files.again(CommandLine::new("compare")).option("--model", [args.model.display()]);
        stdout::print_next(answer.given.recordings.iter().all(check::is_recorded).then(compare).as_ref())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn in_words(prediction: &Prediction, model: &Model) -> String {
    let unit = |channel: Channel| channel.unit(model.motion);
    let mut lines = Vec::new();
    let from = |source: Source| match source {
        Source::Given => "as given",
        Source::Measured => "as measured",
        Source::AtRest => "taken as zero",
    };
    let begin = &prediction.begin;
    lines.push(format!("{} samples, {} s apart", prediction.recorded(), short(prediction.interval_s)));
    lines.push(format!(
        "begins at {:.4} s: {} A, {}; {} {}, {}",
        prediction.start_s,
        short(begin.i_a),
        from(begin.i_a_from),
        short(begin.omega_rad_s),
        unit(Channel::Speed),
        from(begin.omega_rad_s_from)
    ));
    if let Some(n) = prediction.last() {
        let band = prediction.band.as_ref();
        let of = |values: &[f64], band: Option<&[Vec<f64>; 2]>| {
            let band = band.map(|[low, high]| format!(" ({} … {})", short(low[n]), short(high[n])));
            format!("{}{}", short(values[n]), band.unwrap_or_default())
        };
        lines.push(format!(
            "ends at {:.4} s: {} A, {} {}",
            prediction.time_s(n),
            of(&prediction.current, band.and_then(|band| band.current.as_ref())),
            of(&prediction.speed, band.and_then(|band| band.speed.as_ref())),
            unit(Channel::Speed)
        ));
    }
    lines.push(format!("voltage between its samples: {}", prediction.course));
    if let Some(sensor) = prediction.speed_sensor {
        lines.push(format!("speed {}, as the measured one", sensor.in_words()));
    }
    if let Some(Band { share, current, speed }) = &prediction.band {
        lines.push(format!("band: {} % of what this motor does on inputs like those of the fit", 100.0 * share));
        for (name, band) in [("current", current), ("speed", speed)] {
            if band.is_none() {
                lines.push(format!("band of the {name}: none, since the model was not fitted to a {name}"));
            }
        }
    }
    lines.extend(extrapolated(prediction.extrapolation.as_ref(), model));
    lines.join("\n")
}

fn extrapolated(extrapolation: Option<&Extrapolation>, model: &Model) -> Vec<String> {
    let Some(Extrapolation { stretches, .. }) = extrapolation else {
        return vec!["extrapolated: not known, since this model file does not tell what its fit has seen".to_owned()];
    };
    let told = |stretch: &Stretch| {
        let channel = Channel::ALL.into_iter().find(|channel| channel.column() == stretch.quantity);
        let unit = channel.map_or("", |channel| channel.unit(model.motion));
        let [low, high] = stretch.seen.map(short);
        format!(
            "extrapolated: {} from {:.4} s to {:.4} s, up to {} {unit} beyond the {low} … {high} {unit} of the fit",
            stretch.quantity,
            stretch.from_s,
            stretch.to_s,
            short(stretch.beyond)
        )
    };
    let mut lines: Vec<String> = stretches.iter().take(MOST_TOLD).map(told).collect();
    if let Some(more) = stretches.len().checked_sub(MOST_TOLD).filter(|more| *more > 0) {
        lines.push(format!("extrapolated: and {more} stretches more, all of them in --json"));
    }
    lines
}

/// A number with five significant digits at most.
fn short(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let decimals = (4.0 - x.abs().log10().floor()).clamp(0.0, 12.0) as usize;
    let text = format!("{x:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}
