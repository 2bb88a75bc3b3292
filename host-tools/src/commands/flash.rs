//! `greyrig flash`: a model becomes the parameters of the microcontroller.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use greyrig::parameters::block::payload_crc;
use greyrig::parameters::{Rig, Text, section};
use greyrig::units::CalibrationSettings;
use serde_json::json;

use super::stdout;
use super::terminal::Terminal;
use crate::answers::next::{CommandLine, unused};
use crate::context::Context;
use crate::device::connection::check_layout;
use crate::device::image::{self, Image};
use crate::device::{Connection, Port, parameters, rig, sequence, update};
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
    /// Calibration of the rig's channels, TOML (docs/wiring.md); without it the rig keeps its own
    #[arg(long, value_name = "RIG.toml")]
    calibration: Option<PathBuf>,
    /// What the station runs by itself, TOML (docs/sequence.md); without it the board only listens
    #[arg(long, value_name = "SEQUENCE.toml")]
    sequence: Option<PathBuf>,
    /// Serial number or name of the rig; without it the rig keeps its own
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

impl Args {
    /// The command that goes on over the link: a motor is judged by what was written, or recorded where that has no
    /// limits.
    fn next(&self, has_limits: bool) -> Option<CommandLine> {
        let port = self.port.as_ref().filter(|_| !self.dry_run)?;
        let line = CommandLine::new(if has_limits { "monitor" } else { "record" }).option("--port", [port]);
        let line = line.option("--clock", self.clock.as_ref().map(|clock| clock.display()));
        Some(match has_limits {
            true => line.option("--model", [self.model.display()]),
            false => line.with(["--seconds", "10", "--out"]).files([&unused(Path::new("run.csv"))]),
        })
    }
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
    let mut settings = parameters::settings(&model, &args.model)?;
    settings.sequence = args.sequence.as_deref().map(|path| sequence::read(path, model.kind)).transpose()?;
    let calibration = args.calibration.as_deref().map(parameters::calibration).transpose()?;
    let name = args.rig.as_deref().map(parameters::rig_name).transpose()?;
    let port = args.port.clone().map(|name| Port { name, clock: args.clock.clone().into() });
    let rig = match &port {
        Some(port) => of_port(port, name, calibration, &terminal.context())?,
        None => of_image(name, calibration)?,
    };
    if let Some(rig) = &rig.known {
        sequence::suits(&settings, rig)?;
    }
    settings.origin = Some(parameters::origin(rig.build));
    let payload = parameters::payload(&settings, &args.model)?;
    let rig_payload = rig.write.as_ref().map(parameters::rig_payload).transpose()?;
    let mut told = json!({
        "model": args.model.display().to_string(),
        "bytes": payload.len(),
        "crc32": format!("{:08x}", payload_crc(&payload)),
        "calibration": rig.source,
        "rig": rig.name,
        "sequence_s": settings.sequence.as_ref().map(greyrig::sequence::Settings::seconds),
        "rig_written": rig.write.is_some() && !args.dry_run,
        "dry_run": args.dry_run,
        "verified": !args.dry_run,
    });
    let mut add = |key: &str, value: serde_json::Value| told[key] = value;
    let image = Image { parameters: payload.clone(), rig: rig_payload.clone() };
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
            // The rig first: a motor never runs with another rig's calibration.
            if let Some(rig) = &rig_payload {
                terminal.watching("writing the rig", |ctx| update::write_rig(port, rig, ctx))?;
            }
            let (device, block) = terminal.watching("writing", |ctx| update::write(port, &payload, ctx))?;
            add("device", json!(device));
            add("slot", json!(block.slot));
            add("sequence", json!(block.sequence));
            format!("{} on {name}, slot {}, block {}", device.board, block.slot, block.sequence)
        }
    } else if let Some(path) = &args.image {
        add("image", json!(path.display().to_string()));
        add("address", json!(image.address()));
        if !args.dry_run {
            image::write(&image, path, args.force)?;
        }
        format!("{}, for {:#010X}", path.display(), image.address())
    } else if let Some(chip) = &args.probe {
        add("chip", json!(chip));
        by_probe(&image, chip, args.dry_run)?;
        format!("{chip} by debug probe")
    } else {
        return Err(Error::usage("there is nowhere to write to", "give --port, --image or --probe"));
    };
    match rig.source {
        Calibration::Given => {}
        Calibration::Kept => eprintln!("greyrig: no --calibration: the rig keeps the one that it has"),
        Calibration::Usual => eprintln!(
            "greyrig: no --calibration, and the rig has none: the usual ranges, ±400 V, ±40 A, 0 to 5000 rad/s; set one with \
             `greyrig rig --calibration`"
        ),
        Calibration::Untouched => {
            eprintln!("greyrig: no --calibration: what the rig has of its own stays as it is");
        }
    }
    if args.json {
        stdout::print_json("flash", &[], told)?;
    } else {
        let verb = if args.dry_run { "would be written" } else { "written and verified" };
        stdout::print_line(&format!("{} bytes of parameters {verb}: {where_to}", payload.len()))?;
        stdout::print_next(args.next(model.detector.is_some()).as_ref())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Where the calibration that the motor runs with comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
enum Calibration {
    /// From a file.
    Given,
    /// The rig's own.
    Kept,
    /// The usual ranges.
    Usual,
    /// The rig was not asked: whatever it has.
    Untouched,
}

/// What of the rig goes with the motor's parameters.
struct OfRig {
    /// Its block, if one is to be written.
    write: Option<Rig>,
    /// All that it has, where that is known.
    known: Option<Rig>,
    /// Its name, as far as that is known.
    name: String,
    source: Calibration,
    /// The image of the firmware on board, where that was asked.
    build: [u8; 8],
}

/// Over the link the rig keeps what nobody gives anew. Where it stands in a motor's block of before, which is about to
/// be replaced, it gets a block of its own. Parameters that cannot be read are an error: nobody may guess a
/// calibration.
fn of_port(port: &Port, name: Option<Text>, calibration: Option<CalibrationSettings>, ctx: &Context) -> Result<OfRig> {
    let (mut connection, device) = Connection::open(port, ctx)?;
    check_layout(&device)?;
    let own = connection.read_rig()?;
    let there = if own.is_empty() {
        let payload = connection.read_parameters()?;
        match section::decode(&payload) {
            Ok(settings) => settings.rig,
            Err(error) if calibration.is_none() && !payload.is_empty() => {
                return Err(Error::link(
                    format!("the rig's parameters cannot be read, and so not its calibration: {error}"),
                    "give --calibration RIG.toml",
                ));
            }
            Err(_) => None,
        }
    } else {
        // One that cannot be read is replaced where all of it is given; its supply would be, too.
        match rig::of(&mut connection, None) {
            Err(crate::device::Error::UnreadableRig(_)) if calibration.is_some() && name.is_some() => None,
            there => there?,
        }
    };
    let source = match (&calibration, &there) {
        (Some(_), _) => Calibration::Given,
        (None, Some(_)) => Calibration::Kept,
        (None, None) => Calibration::Usual,
    };
    let changes = calibration.is_some() || name.is_some() || (own.is_empty() && there.is_some());
    let before = there.unwrap_or_default();
    let rig = Rig {
        name: name.unwrap_or(before.name),
        calibration: calibration.unwrap_or(before.calibration),
        supply: before.supply,
    };
    let (write, known) = (changes.then(|| rig.clone()), Some(rig.clone()));
    Ok(OfRig { name: rig.name.to_string(), write, known, source, build: device.digest() })
}

/// An image and a probe cannot ask the rig: its block is written whole, or stays as it is.
fn of_image(name: Option<Text>, calibration: Option<CalibrationSettings>) -> Result<OfRig> {
    match (name, calibration) {
        (Some(_), None) => Err(Error::usage(
            "the rig's name cannot be written without its calibration here",
            "give --calibration RIG.toml, too, or set the name with greyrig rig --port PORT --name NAME",
        )),
        (name, Some(calibration)) => {
            let rig = Rig { name: name.unwrap_or_default(), calibration, supply: None };
            let (name, write) = (rig.name.to_string(), Some(rig));
            Ok(OfRig { name, write, known: None, source: Calibration::Given, build: [0; 8] })
        }
        (None, None) => {
            let source = Calibration::Untouched;
            Ok(OfRig { write: None, known: None, name: String::new(), source, build: [0; 8] })
        }
    }
}

#[cfg(feature = "probe")]
fn by_probe(image: &Image, chip: &str, dry_run: bool) -> Result<()> {
    Ok(crate::device::probe::write(image, chip, dry_run)?)
}

#[cfg(not(feature = "probe"))]
fn by_probe(_: &Image, _: &str, _: bool) -> Result<()> {
    Err(Error::usage(
        "this greyrig was built without debug probes",
        "use `cargo greyrig-full flash …`, or --port or --image",
    ))
}
