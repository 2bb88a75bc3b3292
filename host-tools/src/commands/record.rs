//! `greyrig record`: raw samples from the microcontroller.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;

use greyrig::faults::TABLE;
use greyrig::link::message::Status;
use greyrig::parameters::{SAMPLE_RATE_HZ, section};
use greyrig::units::CalibrationSettings;
use serde_json::json;

use crate::device::capture;
use crate::device::connection::{faults, mode};
use crate::device::{Connection, Port, recorded};
use crate::error::{Error, Result};
use crate::output;
use crate::recording;

/// Longest recording, s: what a recording may hold.
const LONGEST_S: f64 = 1000.0;

/// Record raw samples from the microcontroller.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig record --port /dev/ttyACM0 --seconds 10 --out run.csv")]
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
pub fn run(args: &Args) -> Result<ExitCode> {
    let count = args.seconds * f64::from(SAMPLE_RATE_HZ);
    if !(2.0..=LONGEST_S * f64::from(SAMPLE_RATE_HZ)).contains(&count) {
        return Err(Error::usage(
            format!("a recording of {} s cannot be", args.seconds),
            format!("choose --seconds between 0.0002 and {LONGEST_S}"),
        ));
    }
    output::refuse_overwrite(&args.out, args.force)?;
    let port = Port { name: args.port.clone(), clock: args.clock.clone().into() };
    let (mut connection, device) = Connection::open(&port)?;
    let payload = connection.read_parameters()?;
    let (calibration, mut metadata) = match section::decode(&payload) {
        Ok(settings) => {
            let named = [("motor", settings.motor_type), ("rig", settings.rig)];
            let named = named.into_iter().filter(|(_, name)| !name.is_empty());
            (settings.calibration, named.map(|(key, name)| (key.to_owned(), name.to_string())).collect())
        }
        Err(_) => {
            eprintln!(
                "greyrig: the microcontroller has no parameters: the usual ranges, ±400 V, ±40 A, 0 to 5000 rad/s"
            );
            (CalibrationSettings::default(), BTreeMap::new())
        }
    };
    recorded::describe(&mut metadata, &device);
    let capture = capture::record(&port, &device, connection, count as usize)?;
    metadata.insert("first sample".into(), capture.first.to_string());
    let recording = recorded::recording(&capture, &calibration, metadata)?;
    recording::write(&recording, &args.out, args.force)?;

    let lost = capture.lost();
    let missing: usize = lost.iter().map(std::ops::Range::len).sum();
    if missing > 0 {
        eprintln!("greyrig: {missing} samples were lost in {} places and are marked invalid", lost.len());
    }
    let status = status(&port);
    if args.json {
        let places: Vec<_> = lost.iter().map(|range| [range.start, range.end]).collect();
        output::print_json(
            "record",
            &[],
            json!({
                "out": args.out.display().to_string(), "port": args.port, "device": device,
                "samples": capture.samples.len(), "sample_time_s": recording.sample_time_s(), "first_sample": capture.first,
                "lost": missing, "lost_places": places, "reconnections": capture.reconnections,
                "status": status.as_ref().map(told),
            }),
        )?;
    } else {
        let line = format!("{}: {} samples from {}", args.out.display(), capture.samples.len(), device.board);
        output::print_line(&line)?;
    }
    for line in status.iter().flat_map(faults) {
        eprintln!("greyrig: the microcontroller: {line}");
    }
    Ok(ExitCode::SUCCESS)
}

/// How the microcontroller is after the recording, which is there already: a link that has gone is no matter.
fn status(port: &Port) -> Option<Status> {
    let (mut connection, _) = Connection::open(port).ok()?;
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
