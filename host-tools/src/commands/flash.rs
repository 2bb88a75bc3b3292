//! `greyrig flash`: a model becomes the parameters of the microcontroller.

use std::path::PathBuf;
use std::process::ExitCode;

use greyrig::parameters::block::payload_crc;
use greyrig::parameters::{Settings, section};
use greyrig::units::CalibrationSettings;
use serde_json::json;

use super::stdout;
use super::terminal::Terminal;
use crate::context::Context;
use crate::device::connection::check_layout;
use crate::device::{Connection, Port, image, parameters, update};
use crate::error::{Error, Result};
use crate::model::Model;

/// Write a model to the microcontroller, verified by reading back.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig flash --model model.toml --port /dev/ttyACM0")]
#[command(group = clap::ArgGroup::new("to").required(true).args(["port", "image", "probe"]))]
pub struct Args {
    /// The model
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Over the link: a serial device, a pseudo-terminal, or tcp:HOST:PORT
    #[arg(long, value_name = "PORT")]
    port: Option<String>,
    /// File in which a virtual board publishes its time (`greyrig board --clock`): time-outs follow it, not real time
    #[arg(long, value_name = "FILE", conflicts_with_all = ["image", "probe"])]
    clock: Option<PathBuf>,
    /// Into a file for another programmer: .bin or .hex
    #[arg(long, value_name = "FILE")]
    image: Option<PathBuf>,
    /// By a debug probe (cargo greyrig-full); the chip is an STM32G474RETx unless another is named
    #[arg(long, value_name = "CHIP", num_args = 0..=1, default_missing_value = "STM32G474RETx")]
    probe: Option<String>,
    /// Calibration of the rig's channels, TOML (docs/wiring.md); without it the rig keeps its own over --port, and gets
    /// the usual ranges elsewhere
    #[arg(long, value_name = "RIG.toml")]
    calibration: Option<PathBuf>,
    /// Serial number or name of the rig; without it the rig keeps its own over --port
    #[arg(long, value_name = "NAME")]
    rig: Option<String>,
    /// Also a model of which the data held out said that what was added last does not belong to it
    #[arg(long)]
    unaccepted: bool,
    /// Check everything, write nothing
    #[arg(long)]
    dry_run: bool,
    /// Replace an existing image
    #[arg(long)]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// A model that cannot be used, trouble with the link.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let model = Model::load(&args.model)?;
    if !args.unaccepted {
        model.require_accepted(&args.model)?;
    }
    let given = args.calibration.as_deref().map(parameters::calibration).transpose()?;
    let port = args.port.clone().map(|name| Port { name, clock: args.clock.clone().into() });
    // Over the link the rig keeps what nobody gives anew.
    let there = match &port {
        Some(port) if given.is_none() || args.rig.is_none() => in_force(port, given.is_none(), &terminal.context())?,
        _ => None,
    };
    let (calibration, source) = match (given, &there) {
        (Some(given), _) => (given, Calibration::Given),
        (None, Some(there)) => (there.calibration, Calibration::Kept),
        (None, None) => (CalibrationSettings::default(), Calibration::Usual),
    };
    let kept = there.as_ref().map_or("", |settings| settings.rig.as_str());
    let rig = args.rig.as_deref().unwrap_or(kept);
    let settings = parameters::settings(&model, &args.model, calibration, rig)?;
    let payload = parameters::payload(&settings, &args.model)?;
    let mut told = json!({
        "model": args.model.display().to_string(),
        "bytes": payload.len(),
        "crc32": format!("{:08x}", payload_crc(&payload)),
        "calibration": source,
        "rig": rig,
        "dry_run": args.dry_run,
        "verified": !args.dry_run,
    });
    let mut add = |key: &str, value: serde_json::Value| told[key] = value;
    let where_to = if let Some(port) = &port {
        let name = &port.name;
        add("port", json!(name));
        if args.dry_run {
            let (mut connection, device) = Connection::open(port, &terminal.context())?;
            check_layout(&device)?;
            let same = connection.read_parameters()? == payload;
            add("device", json!(device));
            add("already_there", json!(same));
            format!("{} on {name}{}", device.board, if same { ", which has them already" } else { "" })
        } else {
            let (device, block) = terminal.watching("writing", |ctx| update::write(port, &payload, ctx))?;
            add("device", json!(device));
            add("slot", json!(block.slot));
            add("sequence", json!(block.sequence));
            format!("{} on {name}, slot {}, block {}", device.board, block.slot, block.sequence)
        }
    } else if let Some(path) = &args.image {
        add("image", json!(path.display().to_string()));
        if !args.dry_run {
            image::write(&payload, path, args.force)?;
        }
        path.display().to_string()
    } else if let Some(chip) = &args.probe {
        add("chip", json!(chip));
        by_probe(&payload, chip, args.dry_run)?;
        format!("{chip} by debug probe")
    } else {
        return Err(Error::usage("there is nowhere to write to", "give --port, --image or --probe"));
    };
    match source {
        Calibration::Given => {}
        Calibration::Kept => eprintln!("greyrig: no --calibration: the rig keeps the one that it has"),
        Calibration::Usual if port.is_some() => {
            eprintln!(
                "greyrig: no --calibration, and the rig has none: the usual ranges, ±400 V, ±40 A, 0 to 5000 rad/s"
            );
        }
        Calibration::Usual => eprintln!(
            "greyrig: no --calibration: the usual ranges, ±400 V, ±40 A, 0 to 5000 rad/s, in the place of any that the rig has; \
             over --port it would keep its own"
        ),
    }
    if args.json {
        stdout::print_json("flash", &[], told)?;
    } else {
        let verb = if args.dry_run { "would be written" } else { "written and verified" };
        stdout::print_line(&format!("{} bytes of parameters {verb}: {where_to}", payload.len()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Where the calibration that is written comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
enum Calibration {
    /// From a file.
    Given,
    /// The rig's own, read back.
    Kept,
    /// The usual ranges.
    Usual,
}

/// The parameters that the rig runs with, none if it has none. Where its calibration is wanted, parameters that cannot
/// be read are an error: nobody may guess it.
fn in_force(port: &Port, calibration: bool, ctx: &Context) -> Result<Option<Settings>> {
    let (mut connection, device) = Connection::open(port, ctx)?;
    check_layout(&device)?;
    let payload = connection.read_parameters()?;
    match section::decode(&payload) {
        Ok(settings) => Ok(Some(settings)),
        Err(error) if calibration && !payload.is_empty() => Err(Error::link(
            format!("the rig's parameters cannot be read, and so not its calibration: {error}"),
            "give --calibration RIG.toml",
        )),
        Err(_) => Ok(None),
    }
}

#[cfg(feature = "probe")]
fn by_probe(payload: &[u8], chip: &str, dry_run: bool) -> Result<()> {
    Ok(crate::device::probe::write(payload, chip, dry_run)?)
}

#[cfg(not(feature = "probe"))]
fn by_probe(_: &[u8], _: &str, _: bool) -> Result<()> {
    Err(Error::usage(
        "this greyrig was built without debug probes",
        "use `cargo greyrig-full flash …`, or --port or --image",
    ))
}
