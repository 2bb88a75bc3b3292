//! `greyrig serve`: the loop in the browser.

use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::json;

use super::input;
use super::stdout;
use super::terminal::Terminal;
use crate::error::{Error, Result};
use crate::model::Kind;
use crate::recording::MapArgs;
use crate::serve::{Session, serve};

/// The same loop in the browser, on 127.0.0.1: identify, compare, see where the model fails, diagnose, add, watch the
/// error fall.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig serve staircase.csv ramp.csv\n\n\
    Only programs on this machine can reach the page. It ends with Ctrl-C; what is to be kept is downloaded as a model file.")]
pub struct Args {
    /// Recordings of one motor type, in any supported format; more can be added on the page
    #[arg(value_name = "RUN")]
    recordings: Vec<PathBuf>,
    #[command(flatten)]
    map: MapArgs,
    /// Kind of motor; by itself what the recordings tell as their `motor`, or else universal
    #[arg(long, value_enum)]
    kind: Option<Kind>,
    /// Port of the page; 0 for any free one
    #[arg(long, default_value_t = 8470)]
    port: u16,
    /// Print one JSON object with the page's address
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// Recordings that cannot be used, or a port that is taken.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let recordings = input::load(&args.recordings, &args.map, &terminal.context())?;
    let session = Session::new(recordings, args.map.mapping()?, args.kind)?;
    let names: Vec<String> = args.recordings.iter().map(|p| p.display().to_string()).collect();
    let listening = |address: std::net::SocketAddr| {
        let url = format!("http://{address}/");
        match args.json {
            true => stdout::print_json("serve", &names, json!({ "url": url })),
            false => stdout::print_line(&format!("{url} (Ctrl-C ends it)")),
        }
    };
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|e| Error::usage(format!("the page cannot be served: {e}"), "free some memory and try again"))?;
    runtime.block_on(serve(session, args.port, terminal.cancel_flag(), listening))?;
    Ok(ExitCode::SUCCESS)
}
