//! `greyrig plan`: the recording that would best tell rival effects apart.

use std::path::PathBuf;
use std::process::ExitCode;

use greyrig::effects::EffectId;

use super::stdout;
use super::table::{Cell, Column, Table};
use super::terminal::Terminal;
use super::words;
use crate::answers::plan::rehearsed;
use crate::error::{Error, Result};
use crate::model::{Kind, Model, catalogue};
use crate::plan::{Contest, Limits, Plan, Proposal, Take, plan};

/// The recording that would best tell rival effects apart, by simulating them within the limits of the rig.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  greyrig plan --model model.toml\n  \
    greyrig plan --model model.toml --rivals saturation,current_compression --seconds 12 --max-current 8")]
pub struct Args {
    /// Model file
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Effects to tell apart, with commas between them [default: pairs that are known to be confused]
    #[arg(long, value_name = "ID,ID", value_delimiter = ',')]
    rivals: Vec<String>,
    /// Length of all recordings of a proposal together, s
    #[arg(long, value_name = "S", default_value_t = 8.0)]
    seconds: f64,
    /// Peak voltage, V [default: 325 for universal, 24 for pm-dc]
    #[arg(long, value_name = "V")]
    max_voltage: Option<f64>,
    /// Peak current, A [default: 10 for universal, 15 for pm-dc]
    #[arg(long, value_name = "A")]
    max_current: Option<f64>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// A model that cannot be run, rivals that nothing tells apart, or impossible limits.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let limit = |given: Option<f64>, usual: f64, option: &str| match given {
        Some(x) if !(x > 0.0 && x.is_finite()) => Err(Error::usage(
            format!("{option} must be positive"),
            format!("give it in V or A, such as {option} {usual}"),
        )),
        x => Ok(x.unwrap_or(usual)),
    };
    let model = Model::load(&args.model)?;
    let rivals = catalogue::effects(&args.rivals)?;
    let usual = Limits::usual(model.kind);
    let limits = Limits {
        voltage_v: limit(args.max_voltage, usual.voltage_v, "--max-voltage")?,
        current_a: limit(args.max_current, usual.current_a, "--max-current")?,
    };
    let result = terminal.watching("plan", |ctx| plan(&model, &rivals, args.seconds, limits, ctx))?;
    if args.json {
        stdout::print_json("plan", &[], &result)?;
    } else {
        print(&result, model.kind)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Proposals that are shown where there is one pair.
const SHOWN: usize = 10;

fn print(plan: &Plan, kind: Kind) -> Result<()> {
    let one = plan.contests.len() == 1;
    let tables = if one { plan.contests.iter().map(ranking).collect() } else { best_of_each(plan) };
    stdout::print_line(&tables)?;
    stdout::print_line(
        "separation: what remains of one effect after the other one, in multiples of the noise, at 1 % of the current",
    )?;
    for contest in &plan.contests {
        let hidden = contest.proposals.first().is_none_or(|p| p.separation < 1.0);
        stdout::print_line(&format!(
            "{}: {}{}",
            catalogue::joined(&contest.rivals, " or "),
            if hidden { "no profile shows more than the noise; known is " } else { "" },
            contest.separated_by
        ))?;
    }
    stdout::print_line(if one { "\nbest:" } else { "\nbest over all pairs:" })?;
    for take in &plan.best {
        stdout::print_line(&format!("  {}", instruction(take)))?;
    }
    let simulated = rehearsed(&plan.best, kind);
    if simulated.is_some() {
        stdout::print_line("on the virtual rig:")?;
    }
    stdout::print_next(simulated.as_ref())
}

fn ranking(contest: &Contest) -> String {
    let [a, b] = contest.rivals.map(EffectId::id);
    let figures = ["separation", a, b, "peak voltage", "peak current"].map(Column::figure);
    let mut table = Table::new([Column::text("recording")].into_iter().chain(figures));
    for p in contest.proposals.iter().take(SHOWN) {
        let peak = |of: fn(&Take) -> f64| p.recordings.iter().map(of).fold(0.0, f64::max);
        table.row([
            Cell::from(names(p)),
            words::strong(format!("{:.2}", p.separation)),
            format!("{:.2}", p.each[0]).into(),
            format!("{:.2}", p.each[1]).into(),
            words::quantity(peak(|t| t.peak_voltage_v), "V").into(),
            words::quantity(peak(|t| t.peak_current_a), "A").into(),
        ]);
    }
    table.to_string()
}

fn best_of_each(plan: &Plan) -> String {
    let mut table = Table::new([Column::text("rivals"), Column::text("recording"), Column::figure("separation")]);
    for contest in &plan.contests {
        let Some(best) = contest.proposals.first() else { continue };
        let separation = words::strong(format!("{:.2}", best.separation));
        table.row([Cell::from(catalogue::joined(&contest.rivals, ", ")), names(best).into(), separation]);
    }
    table.to_string()
}

fn names(p: &Proposal) -> String {
    p.recordings.iter().map(|t| t.profile).collect::<Vec<_>>().join(" + ")
}

fn instruction(take: &Take) -> String {
    format!(
        "{} of {} s, up to {} and {}",
        take.profile,
        take.seconds,
        words::quantity(take.peak_voltage_v, "V"),
        words::quantity(take.peak_current_a, "A")
    )
}
