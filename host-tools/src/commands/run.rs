//! `greyrig run`: the station's sequence over the link.

use std::path::PathBuf;
use std::process::ExitCode;

use greyrig::link::message::{Request, Run};
use greyrig::sequence::State;
use serde_json::{Value, json};

use super::stdout;
use super::terminal::Terminal;
use crate::device::{self, Device, Port, RIG, run};
use crate::error::{Error, Result};

/// Exit code of a motor that fails its test.
const FAILED: u8 = 1;
/// Exit code where there is no verdict.
const NO_VERDICT: u8 = 4;

/// Have the board run its sequence: the profile, the rotor's rest, the verdict.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  greyrig rig --port /dev/ttyACM0 --supply ac:325:50\n  \
    greyrig flash --model station.toml --sequence sequence.toml --port /dev/ttyACM0\n  \
    greyrig run --port /dev/ttyACM0 --acknowledge\n  greyrig run --port /dev/ttyACM0\n\n\
    The board does it without a host, too, by its START button. Ctrl-C aborts the run.\n\
    Exit code: 0 the motor passes, 1 it fails, 4 no verdict or the station was stopped, 3 trouble with the link, 130 after Ctrl-C.")]
pub struct Args {
    /// A serial device, a pseudo-terminal, or tcp:HOST:PORT
    #[arg(long, value_name = "PORT")]
    port: String,
    /// File in which a virtual board publishes its time (`greyrig board --clock`): time-outs follow it, not real time
    #[arg(long, value_name = "FILE")]
    clock: Option<PathBuf>,
    /// Only say what the station does
    #[arg(long, group = "what")]
    state: bool,
    /// Stop the run that is under way
    #[arg(long, group = "what")]
    abort: bool,
    /// What has stopped the station, or how the last run ended, has been seen: a run may begin
    #[arg(long, group = "what")]
    acknowledge: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// A station without a sequence, one that is stopped, trouble with the link.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let port = Port { name: args.port.clone(), clock: args.clock.clone().into() };
    let ctx = terminal.context();
    let (mut connection, device) = run::open(&port, &ctx)?;
    let asked = match args {
        Args { abort: true, .. } => Some(Request::AbortRun),
        Args { acknowledge: true, .. } => Some(Request::Acknowledge),
        _ => None,
    };
    if let Some(request) = asked {
        connection.tell(request)?;
    }
    if asked.is_some() || args.state {
        let now = run::state(&mut connection)?;
        told(args, &device, &now, false)?;
        return Ok(ExitCode::SUCCESS);
    }
    let before = run::state(&mut connection)?;
    if let State::Stopped(stop) = before.state {
        return Err(Error::link(
            format!("the station is stopped: {}", stop.words()),
            "look at the rig; then greyrig run --acknowledge, or press START",
        ));
    }
    let begun = run::start(&mut connection, &port, &ctx)?;
    let length = u64::from(begun.length.div_ceil(RIG.sample_rate_hz));
    let followed = terminal.watching("running", |ctx| {
        let steps = ctx.steps("seconds of the profile", length);
        let mut shown = 0;
        run::follow(&mut connection, begun.runs, &port, ctx, &mut |now| {
            let seconds = now.elapsed.min(now.length) / RIG.sample_rate_hz;
            (shown..seconds).for_each(|_| steps.next());
            shown = shown.max(seconds);
        })
    });
    if matches!(followed, Err(device::Error::Interrupted(_))) {
        // The next Ctrl-C stops this, too; the run ends all the same by its profile or a button.
        terminal.cancel_flag().clear();
        connection.tell(Request::AbortRun)?;
        eprintln!("greyrig: the run is aborted");
    }
    let ended = followed?;
    told(args, &device, &ended, true)?;
    Ok(match ended.state {
        State::Passed => ExitCode::SUCCESS,
        State::Failed => ExitCode::from(FAILED),
        _ => ExitCode::from(NO_VERDICT),
    })
}

fn seconds(samples: u32) -> f64 {
    f64::from(samples) / f64::from(RIG.sample_rate_hz)
}

fn told(args: &Args, device: &Device, run: &Run, ended: bool) -> Result<()> {
    if args.json {
        return stdout::print_json("run", &[], json!({ "port": args.port, "device": device, "run": object(run) }));
    }
    let number = if run.runs == 0 { "no run yet".to_owned() } else { format!("run {}", run.runs) };
    let after = format!("after {:.1} s", seconds(run.elapsed));
    let line = match run.state {
        State::Stopped(stop) if ended => {
            format!("{number}: stopped {after}: {}; then greyrig run --acknowledge", stop.words())
        }
        State::Stopped(stop) => format!("{number}; stopped: {}", stop.words()),
        State::Running => {
            format!("{number}: running, {:.1} of {:.1} s", seconds(run.elapsed), seconds(run.length))
        }
        State::Passed => format!("{number}: the motor passes, {after}"),
        State::Failed => format!("{number}: the motor fails, {after}"),
        State::Unjudged => format!("{number}: no verdict, {after}; see greyrig rig for limits and faults"),
        state => format!("{number}; {}", state.name()),
    };
    stdout::print_line(&line)?;
    for contact in contacts(run) {
        stdout::print_line(contact)?;
    }
    Ok(())
}

/// What of the contacts keeps a run from beginning.
fn contacts(run: &Run) -> Vec<&'static str> {
    let told = [
        (!run.emergency_closed, "the emergency stop is open"),
        (!run.abort_closed, "ABORT is open"),
        (run.tripped, "the over-current trip has cut the supply"),
    ];
    told.into_iter().filter_map(|(is, what)| is.then_some(what)).collect()
}

fn object(run: &Run) -> Value {
    let stop = if let State::Stopped(stop) = run.state { Some(stop.words()) } else { None };
    let verdict = match run.state {
        State::Passed => Some("pass"),
        State::Failed => Some("fail"),
        State::Unjudged => Some("cannot_judge"),
        _ => None,
    };
    json!({
        "state": run.state.name(), "stop": stop, "verdict": verdict, "runs": run.runs, "test": run.test,
        "elapsed_s": seconds(run.elapsed), "profile_s": seconds(run.length), "command": run.command,
        "start_pressed": run.start, "abort_closed": run.abort_closed, "emergency_closed": run.emergency_closed, "tripped": run.tripped,
    })
}
