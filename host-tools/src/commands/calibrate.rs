//! `greyrig calibrate`: the detector's limits from healthy motors.

use std::path::PathBuf;
use std::process::ExitCode;

use greyrig::motor::BaseParameter;

use super::input::{self, Input};
use super::stdout;
use super::table::{Column, Table};
use super::terminal::Terminal;
use crate::answers::calibrate::Request;
use crate::answers::next::CommandLine;
use crate::error::Result;
use crate::model::lot::{Fault, Limit, Onset, Population};
use crate::model::{DetectorEntry, Model};
use crate::monitor::calibrate::{Calibration, FALSE_ALARMS, Shown};
use crate::monitor::lot::{Labels, OperatingPoint, Outsider};
use crate::monitor::parameters;
use crate::monitor::tolerance::moments;
use crate::output;

/// Learns from runs of healthy motors what the detector takes for healthy.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig calibrate healthy-*.csv --model hybrid.toml --out station.toml\n\n\
    All runs have to follow the profile of the test. Ten motors are usual; with fewer the limits are wider. Runs with the\n\
    same serial number (# serial: in the file) are of the same motor.")]
pub struct Args {
    #[command(flatten)]
    input: Input,
    /// Model file, with or without a learned correction
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Model file to write
    #[arg(long, value_name = "MODEL2.toml")]
    out: Option<PathBuf>,
    /// Begin of each run that is not judged, s
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    blanking: f64,
    /// Share of healthy motors that may fail by what is watched, and as many by the parameters and by the balances
    #[arg(long, value_name = "SHARE", default_value_t = FALSE_ALARMS)]
    false_alarms: f64,
    /// A few of the motors may be bad, a quarter at most: those that the others do not take for theirs are named and
    /// teach nothing
    #[arg(long)]
    unlabelled: bool,
    /// Print what more or fewer false alarms would show
    #[arg(long)]
    what_would_be_seen: bool,
    /// Replace existing files
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// A model or recordings that cannot be used, or a file that cannot be written.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    if let Some(path) = &args.out {
        output::refuse_overwrite(path, args.force)?;
    }
    let model = Model::load(&args.model)?;
    let labels = if args.unlabelled { Labels::Unknown } else { Labels::Healthy };
    let request = Request { blanking_s: args.blanking, false_alarms: args.false_alarms, labels };
    let given = request.question(&model, args.input.load(&terminal.context())?);
    input::tell(&given.findings);
    let answer = terminal.watching("calibration", |ctx| request.answer(&model, given, ctx))?;
    if let Some(path) = &args.out {
        answer.model.save(path, args.force)?;
    }
    if args.json {
        stdout::print_as_it_is(&answer.as_json(args.out.as_deref())?.to_string())?;
        return Ok(ExitCode::SUCCESS);
    }
    let Calibration { detector, shown, without_lot, outsiders, operating_points } = &answer.calibration;
    stdout::print_line(&table(detector, shown))?;
    stdout::print_line(&format!(
        "\nlimits from {} runs of {} motors: they hold {} % of healthy motors with {:.0} % confidence, if errors and noise are lognormal and \
         deviations normal over the motors",
        detector.runs,
        detector.motors,
        percent(detector.holds[0]),
        100.0 * detector.holds[1]
    ))?;
    for line in of_parameters(&answer.model, detector) {
        stdout::print_line(&line)?;
    }
    let what_of_it = match labels {
        Labels::Healthy => "calibrate without it, or with --unlabelled, if it is not healthy",
        Labels::Unknown => "left out",
    };
    for Outsider { recording, finding, .. } in outsiders {
        stdout::print_line(&format!(
            "{recording} looks like none of the others: {}, {:.1} times what they allow; {what_of_it}",
            finding.text, finding.ratio
        ))?;
    }
    if let Some(lot) = &detector.lot {
        stdout::print_line(&format!("\n{}", smallest(lot)))?;
        stdout::print_line(
            "\nsmallest faults that 95 % of motors of this lot show in this test, by the balances of power and torque; \
             what is there from the start has to exceed the lot's own scatter",
        )?;
    }
    if args.what_would_be_seen && !operating_points.is_empty() {
        for (onset, words) in [(Onset::During, "begins during the test"), (Onset::Start, "is there from the start")] {
            stdout::print_line(&format!("\n{}", by_false_alarms(operating_points, onset)))?;
            stdout::print_line(&format!(
                "\nsmallest fault that {words} which 95 % of motors show, by the share of healthy ones that fail"
            ))?;
        }
    }
    if let Some(why) = without_lot {
        stdout::print_line(&format!(
            "without what is usual in the lot: {why}; give whole runs of one profile to find smaller faults"
        ))?;
    }
    if let Some(path) = &args.out {
        stdout::print_line(&format!("written: {}", path.display()))?;
        let next = args.input.files().again(CommandLine::new("monitor")).option("--model", [path.display()]);
        stdout::print_next(Some(&next))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// What is known of the motors' own parameters.
fn of_parameters(model: &Model, detector: &DetectorEntry) -> Vec<String> {
    let undetermined: Vec<&str> = BaseParameter::POSITIVE
        .into_iter()
        .filter(|p| model.base_parameter(*p).is_some() && !detector.parameters.contains_key(p.name()))
        .filter_map(parameters::described)
        .collect();
    let mut lines = Vec::new();
    if !detector.parameters.is_empty() {
        lines.push(
            "the limits of the parameters, which `greyrig monitor` estimates where nothing else calls, hold as many again"
                .to_owned(),
        );
    }
    if !undetermined.is_empty() {
        lines.push(format!(
            "not determined within {:.0} % by every run: {}; a model with the effects that it lacks, or runs with the run-up, would tell more",
            100.0 * parameters::PRECISION,
            undetermined.join(", ")
        ));
    }
    lines
}

/// The smallest faults that are seen.
fn smallest(lot: &Population) -> String {
    let mut table =
        Table::new([Column::text("fault"), Column::text("during the test"), Column::text("from the start")]);
    for fault in Fault::ALL {
        let [during, start] = [Onset::During, Onset::Start].map(|onset| seen(&lot.limits, fault, onset));
        table.row([fault.words().to_owned(), during, start]);
    }
    table.to_string()
}

/// The same by how many healthy motors fail.
fn by_false_alarms(points: &[OperatingPoint], onset: Onset) -> String {
    let shares = points.iter().map(|point| Column::text(format!("{} %", percent(point.false_alarms))));
    let mut table = Table::new([Column::text("fault")].into_iter().chain(shares));
    for fault in
        Fault::ALL.into_iter().filter(|fault| points[0].limits.iter().any(|l| l.fault == *fault && l.onset == onset))
    {
        let cells = points.iter().map(|point| seen(&point.limits, fault, onset));
        table.row(std::iter::once(fault.words().to_owned()).chain(cells));
    }
    table.to_string()
}

fn seen(limits: &[Limit], fault: Fault, onset: Onset) -> String {
    let limit = limits.iter().find(|limit| limit.fault == fault && limit.onset == onset);
    let told = limit.filter(|limit| fault.holds(limit.seen)).map(|limit| fault.told(limit.seen));
    told.unwrap_or_else(|| "–".to_owned())
}

/// A share in per cent, without what rounding adds.
fn percent(share: f64) -> f64 {
    (1e8 * share).round() / 1e6
}

fn table(detector: &DetectorEntry, shown: &[Shown]) -> String {
    let mut table = Table::new([
        Column::text("watched"),
        Column::figure("mean of the runs"),
        Column::figure("largest"),
        Column::figure("limit"),
    ]);
    let mut row = |name: &str, values: Vec<f64>, limit: String, unit: f64, suffix: &str| {
        let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let number = |x: f64| format!("{:.3}{suffix}", unit * x);
        table.row([name.to_owned(), number(moments(&values).0), number(largest), limit]);
    };
    let percent = |x: f64| format!("{:.2} %", 100.0 * x);
    let of = |get: &dyn Fn(&Shown) -> f64| shown.iter().map(get).collect::<Vec<f64>>();
    row("error of the current", of(&|s| s.current), percent(detector.current), 100.0, " %");
    row("error of the speed", of(&|s| s.speed), percent(detector.speed), 100.0, " %");
    row("current above 1 kHz", of(&|s| s.sparking), format!("{:.4} A", detector.sparking), 1.0, " A");
    row("abrupt change of the current", of(&|s| s.current_jump), percent(detector.current_jump), 100.0, " %");
    row("abrupt change of the speed", of(&|s| s.speed_jump), percent(detector.speed_jump), 100.0, " %");
    let band = |[centre, half]: [f64; 2]| format!("{} … {}", percent(centre - half), percent(centre + half));
    row("deviation of the current", of(&|s| s.current_deviation[1]), band(detector.current_deviation), 100.0, " %");
    row("deviation of the speed", of(&|s| s.speed_deviation[1]), band(detector.speed_deviation), 100.0, " %");
    for (name, limits) in &detector.parameters {
        let words = BaseParameter::of_name(name).and_then(parameters::described).unwrap_or(name.as_str());
        let own = of(&|s| s.parameters.get(name).map_or(f64::NAN, |x| x.exp_m1()));
        let [low, high] = [limits[0] - limits[1], limits[0] + limits[1]].map(f64::exp_m1);
        row(&format!("{words}, from the model's"), own, format!("{} … {}", percent(low), percent(high)), 100.0, " %");
    }
    table.to_string()
}
