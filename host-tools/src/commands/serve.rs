//! `greyrig serve`: the loop in the browser.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde_json::json;

use super::stdout;
use super::terminal::Terminal;
use crate::error::{Error, Result};
use crate::model::Kind;
use crate::recording::MapArgs;
use crate::serve::{EXTENSION, Session, serve};

/// The same loop in the browser, on 127.0.0.1: identify, compare, see where the model fails, diagnose, add, watch the
/// error fall.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  greyrig serve\n  greyrig serve staircase.csv ramp.csv\n  greyrig serve motor.greyrig staircase.csv ramp.csv\n\n\
    Everything is saved as one works, in the project's folder; without one a new project begins in the user's state folder\n\
    ($XDG_STATE_HOME or ~/.local/state, greyrig/projects), which the page names. Without recordings the page offers a\n\
    built-in motor. Only whoever knows the printed address can reach the page, on this machine. It ends with Ctrl-C."
)]
pub struct Args {
    /// Recordings of one motor type, in any supported format, and a project NAME.greyrig to keep them in
    #[arg(value_name = "RUN|PROJECT")]
    arguments: Vec<PathBuf>,
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
/// A project that cannot be opened, or a port that is taken.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let is_project =
        |path: &Path| path.extension().is_some_and(|e| e == EXTENSION) || path.join("project.json").exists();
    let (projects, files): (Vec<PathBuf>, Vec<PathBuf>) = args.arguments.iter().cloned().partition(|p| is_project(p));
    if let [_, second, ..] = &projects[..] {
        let what = format!("{} is a second project", second.display());
        return Err(Error::usage(what, "name one; another greyrig serve takes the other, with --port 0"));
    }
    args.map.mapping()?;
    let session = Session::open(projects.first().map(PathBuf::as_path), &files, &args.map.map, args.kind)?;
    for sentence in session.unusable() {
        eprintln!("greyrig: {sentence}");
    }
    let names: Vec<String> = files.iter().map(|p| p.display().to_string()).collect();
    let (project, token) = (session.folder().display().to_string(), session.token().to_owned());
    let listening = |address: std::net::SocketAddr| {
        let url = format!("http://{address}/?token={token}");
        match args.json {
            true => stdout::print_json("serve", &names, json!({ "url": url, "project": project })),
            false => stdout::print_as_it_is(&format!("{url} (project {project}; Ctrl-C ends it)")),
        }
    };
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(|e| Error::usage(format!("the page cannot be served: {e}"), "free some memory and try again"))?;
    let served = runtime.block_on(serve(session.clone(), args.port, terminal.cancel_flag(), listening));
    session.leave();
    served?;
    Ok(ExitCode::SUCCESS)
}
