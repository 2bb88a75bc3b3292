//! `greyrig record`: raw samples from the microcontroller.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;

use greyrig::faults::TABLE;
use greyrig::link::message::Status;
use greyrig::parameters::{Rig, section};
use serde_json::json;

use super::kept::{keep, keep_elsewhere};
use super::stdout;
use super::terminal::Terminal;
use crate::answers::next::CommandLine;
use crate::context::Context;
use crate::device::capture::{self, Capture, Ended};
use crate::device::connection::{faults, mode};
use crate::device::{self, Connection, Port, RIG, recorded, rig};
use crate::error::{EXIT_HARDWARE, Error, Result};
use crate::output;
use crate::recording;

/// Longest recording, s: what a recording may hold.
const LONGEST_S: f64 = 1000.0;
/// Share of samples that may be lost. With more, what is between straight lines begins to count. Nothing derives this
/// number.
const MOST_LOST: f64 = 0.2;

/// Record raw samples from the microcontroller.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig record --port /dev/ttyACM0 --seconds 10 --out run.csv\n\n\
    After Ctrl-C, where the link is lost, or where many samples are missing, what there is is kept as run.incomplete.csv.\n\
    Exit code: 0 complete, 3 trouble with the link or many samples missing, 130 after Ctrl-C.")]
pub struct Args {
    /// A serial device, a pseudo-terminal, or tcp:HOST:PORT
    #[arg(long, value_name = "PORT")]
    port: String,
    /// File in which a virtual board publishes its time (`greyrig board --clock`): time-outs follow it, not real time
    #[arg(long, value_name = "FILE")]
    clock: Option<PathBuf>,
    /// How long, s
    #[arg(long, value_name = "S")]
    seconds: f64,
    /// The recording: .csv or .parquet
    #[arg(long, value_name = "RUN")]
    out: PathBuf,
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
/// Trouble with the link; a file that cannot be written.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let count = args.seconds * f64::from(RIG.sample_rate_hz);
    if !(2.0..=LONGEST_S * f64::from(RIG.sample_rate_hz)).contains(&count) {
        return Err(Error::usage(
            format!("a recording of {} s cannot be", args.seconds),
            format!("choose --seconds between 0.0002 and {LONGEST_S}"),
        ));
    }
    output::refuse_overwrite(&args.out, args.force)?;
    let port = Port { name: args.port.clone(), clock: args.clock.clone().into() };
    let (mut connection, device) = Connection::open(&port, &terminal.context())?;
    let settings = section::decode(&connection.read_parameters()?).ok();
    let rig = rig::of(&mut connection, settings.as_ref())?;
    if rig.is_none() {
        eprintln!(
            "greyrig: the rig has no calibration: the usual ranges, ±400 V, ±40 A, 0 to 5000 rad/s; set one with `greyrig rig`"
        );
    }
    let Rig { name, calibration, .. } = rig.unwrap_or_default();
    let named = [("motor", settings.map(|settings| settings.motor_type).unwrap_or_default()), ("rig", name)];
    let named = named.into_iter().filter(|(_, name)| !name.is_empty());
    let mut metadata: BTreeMap<_, _> = named.map(|(key, name)| (key.to_owned(), name.to_string())).collect();
    recorded::describe(&mut metadata, &device);
    let Ended { capture, early } =
        terminal.watching("recording", |ctx| capture::record(&port, &device, connection, count as usize, ctx))?;
    metadata.insert("first sample".into(), capture.first.to_string());
    // What there is of it can be written after a Ctrl-C; the next one stops that, too.
    terminal.cancel_flag().clear();
    let cut = Cut::of(&capture, count as usize, early);
    if let Some(cut) = &cut {
        metadata.insert("incomplete".into(), cut.told.clone());
    }
    let recording = recorded::recording(&capture, &calibration, metadata)?;
    let out = match &cut {
        None => {
            recording::write(&recording, &args.out, args.force, &terminal.context())
                .map_err(|error| keep_elsewhere(&recording, &args.out, error, &terminal.context()))?;
            args.out.clone()
        }
        Some(_) => keep(&recording, &args.out, "incomplete", &terminal.context())?,
    };

    let (lost, missing) = (capture.lost(), capture.missing());
    if missing > 0 {
        eprintln!("greyrig: {missing} samples were lost in {} places and are marked invalid", lost.len());
    }
    let status = status(&port, &terminal.context());
    if args.json {
        let places: Vec<_> = lost.iter().map(|range| [range.start, range.end]).collect();
        stdout::print_json(
            "record",
            &[],
            json!({
                "out": out.display().to_string(), "port": args.port, "device": device,
                "samples": capture.samples.len(), "sample_time_s": recording.sample_time_s(), "first_sample": capture.first,
                "lost": missing, "lost_places": places, "reconnections": capture.reconnections,
                "complete": cut.is_none(), "incomplete": cut.as_ref().map(|cut| &cut.told),
                "status": status.as_ref().map(told),
            }),
        )?;
    } else {
        let line = format!("{}: {} samples from {}", out.display(), capture.samples.len(), device.board);
        stdout::print_line(&line)?;
        stdout::print_next(Some(&CommandLine::new("check").files([&out])))?;
    }
    for line in status.iter().flat_map(faults) {
        eprintln!("greyrig: the microcontroller: {line}");
    }
    let Some(cut) = cut else { return Ok(ExitCode::SUCCESS) };
    eprintln!("greyrig: {}; {}; what there is of it is in {}", cut.told, cut.remedy, out.display());
    Ok(ExitCode::from(cut.exit_code))
}

/// Why a recording is not what was asked for.
struct Cut {
    told: String,
    remedy: String,
    exit_code: u8,
}

impl Cut {
    /// What keeps a recording of `count` samples from being complete, if anything does.
    fn of(capture: &Capture, count: usize, early: Option<device::Error>) -> Option<Self> {
        let seconds = |samples: usize| samples as f64 / f64::from(RIG.sample_rate_hz);
        if let Some(error) = early.map(Error::from) {
            let told = format!("{} s of {} s were recorded", seconds(capture.samples.len()), seconds(count));
            let exit_code = error.exit_code();
            return Some(match error {
                Error::Interrupted => {
                    Self { told: format!("{told}, then interrupted"), remedy: "record again".into(), exit_code }
                }
                error => {
                    let told = format!("{told}, then the link was lost");
                    Self { told, remedy: error.to_string(), exit_code }
                }
            });
        }
        let share = capture.missing() as f64 / count as f64;
        (share > MOST_LOST).then(|| Self {
            told: format!("{:.0} % of the samples were lost on the way", 100.0 * share),
            remedy: "connect nothing else to the port, use a shorter cable, and record again".into(),
            exit_code: EXIT_HARDWARE,
        })
    }
}

/// How the microcontroller is after the recording, which is there already: a link that has gone is no matter, nor is
/// the wish to stop.
fn status(port: &Port, ctx: &Context) -> Option<Status> {
    let (mut connection, _) = Connection::open(port, ctx).ok()?;
    connection.status().ok()
}

fn told(status: &Status) -> serde_json::Value {
    let counted = TABLE.iter().zip(status.faults).filter(|(_, count)| *count > 0);
    let faults: Vec<_> = counted.map(|(d, count)| json!({ "number": d.fault.number(), "count": count })).collect();
    json!({
        "mode": mode(status.mode), "samples": status.samples, "faults": faults,
        "cycles_last": status.cycles[0], "cycles_most": status.cycles[1], "deepest_stack": status.deepest_stack,
    })
}
