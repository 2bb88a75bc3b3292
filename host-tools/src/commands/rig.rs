//! `greyrig rig`: what belongs to a rig.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use greyrig::detector::Verdict;
use greyrig::units::Scale;
use serde_json::json;

use super::paint::{DOUBT, painted};
use super::stdout;
use super::table::{Column, Table};
use super::terminal::Terminal;
use crate::answers::next::{CommandLine, unused};
use crate::device::rig::{self, Rig};
use crate::device::{Port, connection, parameters, sequence, update};
use crate::error::Result;

/// What belongs to a rig: its name, its channels' calibration, its supply, the motor type on board, and how it is.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  greyrig rig --port /dev/ttyACM0\n  \
    greyrig rig --port /dev/ttyACM0 --name \"rig 3\" --calibration rig.toml\n\n\
    Name and calibration are the rig's own: they stand in a block by themselves, which `greyrig flash` leaves as it is.\n\
    Exit code: 0 done, 2 wrong usage, 3 trouble with the link.")]
pub struct Args {
    /// A serial device, a pseudo-terminal, or tcp:HOST:PORT
    #[arg(long, value_name = "PORT")]
    port: String,
    /// File in which a virtual board publishes its time (`greyrig board --clock`): time-outs follow it, not real time
    #[arg(long, value_name = "FILE")]
    clock: Option<PathBuf>,
    /// Name to give to the rig
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Calibration to write: [voltage], [current], [speed], each with zero (counts) and per_count (V, A, rad/s)
    #[arg(long, value_name = "RIG.toml")]
    calibration: Option<PathBuf>,
    /// The supply that the station's sequence commands: ac:PEAK_V:HZ or dc:V at full command; none: somebody else
    /// switches
    #[arg(long, value_name = "SUPPLY")]
    supply: Option<String>,
    /// Forget the faults that it has counted
    #[arg(long)]
    clear_faults: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// A calibration that cannot be read, a name that is too long, trouble with the link.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let calibration = args.calibration.as_deref().map(parameters::calibration).transpose()?;
    let name = args.name.as_deref().map(parameters::rig_name).transpose()?;
    let supply =
        args.supply.as_deref().map(|text| (text != "none").then(|| sequence::supply(text)).transpose()).transpose()?;
    let port = Port { name: args.port.clone(), clock: args.clock.clone().into() };
    let ctx = terminal.context();
    let mut there = rig::read(&port, &ctx)?;
    let changes = name.is_some() || calibration.is_some() || supply.is_some();
    if changes {
        if there.rig.is_none() && calibration.is_none() {
            eprintln!(
                "greyrig: no --calibration, and the rig has none: the usual ranges, ±400 V, ±40 A, 0 to 5000 rad/s"
            );
        }
        let before = there.rig.take().unwrap_or_default();
        let rig = greyrig::parameters::Rig {
            name: name.unwrap_or(before.name),
            calibration: calibration.unwrap_or(before.calibration),
            supply: supply.unwrap_or(before.supply),
        };
        let payload = parameters::rig_payload(&rig)?;
        terminal.watching("writing", |ctx| update::write_rig(&port, &payload, ctx))?;
    }
    if args.clear_faults {
        rig::clear_faults(&port, &ctx)?;
    }
    if changes || args.clear_faults {
        there = rig::read(&port, &ctx)?;
    }
    if args.json {
        stdout::print_json("rig", &[], told(&there, &args.port, changes))?;
    } else {
        print(&there, &args.port, changes)?;
        let next = CommandLine::new("record").option("--port", [&args.port]);
        let next = next.option("--clock", args.clock.as_ref().map(|clock| clock.display()));
        let next = next.with(["--seconds", "10", "--out"]).files([&unused(Path::new("run.csv"))]);
        stdout::print_next(Some(&next))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The channels with their scales and units.
fn channels(rig: &Rig) -> Vec<(&'static str, Scale, &'static str)> {
    let of = |c: &greyrig::units::CalibrationSettings| {
        vec![("voltage", c.voltage, "V"), ("current", c.current, "A"), ("speed", c.speed, "rad/s")]
    };
    rig.rig.as_ref().map_or_else(Vec::new, |rig| of(&rig.calibration))
}

/// A verdict in words.
const fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "pass",
        Verdict::Fail => "fail",
        Verdict::CannotJudge => "cannot judge",
    }
}

fn print(rig: &Rig, port: &str, written: bool) -> Result<()> {
    let Rig { device, status, settings, rig: own } = rig;
    let named = |text: &str| if text.is_empty() { "–".to_owned() } else { text.to_owned() };
    let mut table = Table::new([Column::text(""), Column::text(port)]);
    let mut row = |what: &str, value: String| {
        table.row([what.to_owned(), value]);
    };
    row("rig", own.as_ref().map_or_else(|| "–".into(), |rig| named(&rig.name)));
    row("motor type on board", settings.as_ref().map_or_else(|| "–".into(), |s| named(&s.motor_type)));
    if let Some(origin) = settings.as_ref().and_then(|s| s.origin.as_ref()) {
        row("written by", format!("greyrig {} to build {}", origin.greyrig, connection::hexadecimal(&origin.build)));
    }
    row("board", format!("{}, firmware {}, build {}", device.board, device.firmware, device.build));
    row("chip", device.chip.clone());
    row("runs", connection::mode(status.mode).to_owned());
    row("samples a second", device.sample_rate_hz.to_string());
    let [current, speed] = device.skew_s.map(|s| 1e6 * s);
    row("sampled after the voltage", format!("current {current:.2} µs, speed {speed:.2} µs"));
    for (channel, scale, unit) in channels(rig) {
        row(channel, format!("(counts − {}) · {} {unit}", scale.zero, scale.per_count));
    }
    if let Some(supply) = own.as_ref().and_then(|rig| rig.supply.as_ref()) {
        row("supply", sequence::in_words(supply));
    }
    if let Some(sequence) = settings.as_ref().and_then(|s| s.sequence.as_ref()) {
        row("sequence on board", format!("{:.1} s, {} segments", sequence.seconds(), sequence.segments.len()));
    }
    if own.is_none() {
        row("calibration", "none: the usual ranges; set it with --calibration".into());
    }
    let limits = settings.as_ref().is_some_and(|s| s.detector.is_some());
    let so_far = if limits { verdict(status.verdict) } else { "no limits on board: greyrig calibrate, greyrig flash" };
    row("test under way", format!("{}: {so_far}", status.test));
    stdout::print_line(&table.to_string())?;
    if let Some(incident) = &status.incident {
        stdout::print_line(&format!("the last end of the program: {}", connection::incident(incident)))?;
    }
    for fault in connection::faults(status) {
        stdout::print_line(&painted(DOUBT, fault))?;
    }
    if written {
        stdout::print_line("written and verified")?;
    }
    Ok(())
}

fn told(rig: &Rig, port: &str, written: bool) -> serde_json::Value {
    let Rig { device, status, settings, rig: own } = rig;
    let of_channel = |(channel, scale, unit): (&str, Scale, &str)| json!({ "channel": channel, "zero": scale.zero, "per_count": scale.per_count, "unit": unit });
    let name = |text: &str| (!text.is_empty()).then(|| text.to_owned());
    json!({
        "port": port,
        "device": device,
        "rig": own.as_ref().and_then(|rig| name(&rig.name)),
        "motor": settings.as_ref().and_then(|s| name(&s.motor_type)),
        "mode": connection::mode(status.mode),
        "calibration": channels(rig).into_iter().map(of_channel).collect::<Vec<_>>(),
        "supply": own.as_ref().and_then(|rig| rig.supply.as_ref()).map(sequence::in_words),
        "sequence_s": settings.as_ref().and_then(|s| s.sequence.as_ref()).map(greyrig::sequence::Settings::seconds),
        "test": status.test,
        "verdict": verdict(status.verdict).replace(' ', "_"),
        "faults": connection::faults(status),
        "origin": settings.as_ref().and_then(|s| s.origin.as_ref()).map(|origin| json!({
            "greyrig": origin.greyrig.as_str(), "build": connection::hexadecimal(&origin.build),
        })),
        "plausible": status.plausible,
        "incident": status.incident.as_ref().map(|i| json!({
            "cause": i.cause, "at": i.at, "from": i.from, "status": i.status, "samples": i.samples, "place": i.place.as_str(),
            "text": connection::incident(i),
        })),
        "written": written,
    })
}
