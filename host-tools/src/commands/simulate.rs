//! `greyrig simulate`: a recording from the virtual rig.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde_json::json;

use super::stdout;
use super::table::{Cell, Column, Table};
use super::terminal::Terminal;
use super::words;
use crate::answers::next::{CommandLine, unused};
use crate::answers::simulate::{Answer, Request};
use crate::error::{Error, Result};
use crate::output;
use crate::recording;
use crate::rig::{EFFECTS, FAULTS, Kind, PROFILES, Sizes};

/// Arguments of `greyrig simulate`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  greyrig simulate --effect saturation=0.35 --profile staircase --seed 1 --out run.csv\n  \
                        greyrig simulate --kind pm-dc --fault resistance_up=0.2@5 --out faulty.csv\n  \
                        greyrig simulate --list"
)]
pub struct Args {
    /// An effect beyond the base model, with its form and size if not the usual ones; may be repeated
    #[arg(long = "effect", value_name = "ID[:FORM][=SIZE]")]
    pub effects: Vec<String>,

    /// A fault, with its size and the time of its onset in seconds; may be repeated
    #[arg(long = "fault", value_name = "ID[=SIZE][@T]")]
    pub faults: Vec<String>,

    /// An effect that this seed chooses and nothing names: a puzzle
    #[arg(long, value_name = "SEED")]
    pub hidden: Option<u64>,

    /// Excitation; staircase by default, dc-steps for a magnet motor
    #[arg(long, value_name = "NAME")]
    pub profile: Option<String>,

    /// Kind of motor
    #[arg(long, value_enum, default_value = "universal")]
    pub kind: Kind,

    /// Seed of all randomness: the same seed gives the same bits
    #[arg(long, default_value_t = 0)]
    pub seed: u64,

    /// Length of the run; the profile stretches. Its own length by default
    #[arg(long, value_name = "S")]
    pub seconds: Option<f64>,

    /// Largest voltage of the run; the profile is scaled. Its own by default
    #[arg(long, value_name = "V")]
    pub peak_voltage: Option<f64>,

    /// Mains frequency, Hz
    #[arg(long, value_name = "HZ", default_value_t = 50, value_parser = clap::value_parser!(u16).range(10..=400))]
    pub mains: u16,

    /// Scatter of the motor's parameters: a unit of the production lot instead of the nominal motor (0.03: 3 %)
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0)]
    pub spread: f64,

    /// Factor on the noise of the channels (0: none)
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    pub noise: f64,

    /// Fluctuation of the load, relative
    #[arg(long, value_name = "FRACTION", default_value_t = 0.003)]
    pub turbulence: f64,

    /// Fifth harmonic of the mains, relative
    #[arg(long, value_name = "FRACTION", default_value_t = 0.0)]
    pub fifth_harmonic: f64,

    /// Samples a second that are kept, a whole part of the rig's 10,000; all by default
    #[arg(long, value_name = "HZ")]
    pub rate: Option<f64>,

    /// How the speed is measured: counts:PULSES:WINDOW, period:PULSES, mean:WINDOW or held:WINDOW, windows in seconds;
    /// sampled by default
    #[arg(long, value_name = "SENSOR")]
    pub speed_sensor: Option<String>,

    /// Write the true parameters, effects and faults into the file's metadata
    #[arg(long)]
    pub reveal: bool,

    /// The file to write
    #[arg(long, value_name = "RUN.csv", required_unless_present = "list")]
    pub out: Option<PathBuf>,

    /// Replace the file if it exists
    #[arg(long)]
    pub force: bool,

    /// List effects, faults and profiles for this kind of motor
    #[arg(long)]
    pub list: bool,

    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

/// Runs the command.
///
/// # Errors
/// Unknown names, impossible sizes, whatever keeps the file from being written.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    if args.list {
        return list(args);
    }
    let Some(path) = &args.out else {
        return Err(Error::usage("no file to write", "give --out RUN.csv"));
    };
    output::refuse_overwrite(path, args.force)?;
    let request = request(args);
    let Answer { setup, recording } = terminal.watching("simulation", |ctx| request.answer(ctx))?;
    recording::write(&recording, path, args.force, &terminal.context())?;
    let name = path.display().to_string();
    if args.json {
        let body = json!({
            "path": name,
            "samples": recording.len(),
            "seconds": recording.duration_s(),
            "motor": setup.motor.kind.name(),
            "profile": setup.profile.id,
            "seed": setup.seed,
        });
        stdout::print_json("simulate", &[name], body)?;
    } else {
        stdout::print_line(&format!(
            "{name}: {} samples, {} s, {} motor on {}",
            recording.len(),
            recording.duration_s(),
            setup.motor.kind.name(),
            setup.profile.id
        ))?;
        let next = CommandLine::new("identify").with([&name]);
        stdout::print_next(Some(&next.option("--out", [unused(Path::new("model.toml")).display()])))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn request(args: &Args) -> Request {
    Request {
        kind: args.kind,
        effects: args.effects.clone(),
        faults: args.faults.clone(),
        hidden: args.hidden,
        profile: args.profile.clone(),
        seed: args.seed,
        seconds: args.seconds,
        peak_voltage_v: args.peak_voltage,
        mains_hz: args.mains,
        spread: args.spread,
        noise: args.noise,
        turbulence: args.turbulence,
        fifth_harmonic: args.fifth_harmonic,
        rate_hz: args.rate,
        speed_sensor: args.speed_sensor.clone(),
        reveal: args.reveal,
    }
}

fn list(args: &Args) -> Result<ExitCode> {
    let kind = args.kind;
    if args.json {
        let effects: Vec<_> = EFFECTS
            .iter()
            .filter_map(|e| {
                let sizes = e.sizes(kind)?;
                Some(json!({"id": e.id, "what": e.what, "size": e.size, "unit": e.unit, "forms": e.forms,
                    "default": sizes.default, "least": sizes.least, "most": sizes.most}))
            })
            .collect();
        let faults: Vec<_> = FAULTS
            .iter()
            .filter_map(|f| {
                let sizes = f.sizes(kind)?;
                Some(json!({"id": f.id, "what": f.what, "size": f.size, "unit": f.unit,
                    "default": sizes.default, "least": sizes.least, "most": sizes.most}))
            })
            .collect();
        let profiles: Vec<_> = fitting_profiles(kind)
            .map(|p| json!({"id": p.id, "what": p.what, "identifies": p.identifies, "seconds": p.seconds}))
            .collect();
        let body = json!({"kind": kind, "effects": effects, "faults": faults, "profiles": profiles});
        stdout::print_json("simulate", &[], body)?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut effects = table(["effect", "usual size", "range", "what", "size is"]);
    for e in EFFECTS {
        if let Some(sizes) = e.sizes(kind) {
            let id = if e.forms.is_empty() { e.id.to_owned() } else { format!("{}[:{}]", e.id, e.forms.join("|")) };
            effects.row(sized(&id, e.what, sizes, e.unit, e.size));
        }
    }
    let mut faults = table(["fault", "usual size", "range", "what", "size is"]);
    for f in FAULTS {
        if let Some(sizes) = f.sizes(kind) {
            faults.row(sized(f.id, f.what, sizes, f.unit, f.size));
        }
    }
    let mut profiles = table(["profile", "seconds", "what", "identifies"]);
    for p in fitting_profiles(kind) {
        profiles.row([words::strong(p.id), Cell::from(p.seconds.to_string()), p.what.into(), p.identifies.into()]);
    }
    stdout::print_line(&format!("For --kind {}:\n\n{effects}\n\n{faults}\n\n{profiles}", kind.name()))?;
    let (effect, profile) = match kind {
        Kind::Universal => ("saturation", "staircase"),
        Kind::PmDc => ("brush_drop", "dc-steps"),
    };
    let next = CommandLine::new("simulate").option("--kind", [kind]).option("--effect", [effect]);
    let next = next.option("--profile", [profile]);
    stdout::print_next(Some(&next.option("--out", [unused(Path::new("run.csv")).display()])))?;
    Ok(ExitCode::SUCCESS)
}

fn fitting_profiles(kind: Kind) -> impl Iterator<Item = &'static crate::rig::Profile> {
    PROFILES.iter().filter(move |p| p.pm_dc || kind == Kind::Universal)
}

/// A table by the titles of its columns.
fn table<const N: usize>(titles: [&str; N]) -> Table {
    Table::new(titles.map(|title| match title {
        "usual size" | "range" | "seconds" => Column::figure(title),
        "what" | "size is" | "identifies" => Column::prose(title),
        name => Column::text(name),
    }))
}

/// A row of what has a size.
fn sized(id: &str, what: &str, sizes: Sizes, unit: &str, size: &str) -> [Cell; 5] {
    let with_unit = |text: String| format!("{text} {unit}").trim_end().to_owned();
    let range = with_unit(format!("{} … {}", short(sizes.least), short(sizes.most)));
    [words::strong(id), with_unit(short(sizes.default)).into(), range.into(), what.into(), size.into()]
}

/// Small figures with an exponent, the others without.
fn short(x: f64) -> String {
    if x != 0.0 && x.abs() < 1e-3 { format!("{x:e}") } else { x.to_string() }
}
