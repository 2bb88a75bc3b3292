//! `greyrig check`: what is wrong with recordings, and what mends it.

use std::process::ExitCode;

use super::input::Input;
use super::stdout;
use super::terminal::Terminal;
use super::words;
use crate::answers::check::Request;
use crate::check::stop;
use crate::error::{EXIT_BAD_INPUT, Result};
use crate::model::Kind;
use crate::recording::finding::DataFinding;

/// What is wrong with the recordings, and what mends it; the first step of every other command, too.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  greyrig check run.csv\n  greyrig check train.csv check.csv --kind pm-dc --json\n\n\
    Ends with code 2 where something was found that makes every answer meaningless (`stop`), else with 0."
)]
pub struct Args {
    #[command(flatten)]
    input: Input,
    /// Kind of motor that the recordings will be taken for; by itself what they tell, or else any
    #[arg(long, value_enum)]
    kind: Option<Kind>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// Recordings that cannot be read.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let recordings = args.input.load(&terminal.context())?;
    let answer = Request { kind: args.kind }.answer(&recordings);
    let found = &answer.findings;
    if args.json {
        stdout::print_as_it_is(&answer.as_json()?.to_string())?;
    } else {
        stdout::print_line(&in_words(found, &args.input.names()))?;
    }
    Ok(if stop(found).is_some() { ExitCode::from(EXIT_BAD_INPUT) } else { ExitCode::SUCCESS })
}

fn in_words(found: &[DataFinding], names: &[String]) -> String {
    let next = format!("next: greyrig identify {} --out model.toml", names.join(" "));
    if found.is_empty() {
        return format!("nothing is wrong\n\n{next}");
    }
    let mut table = words::table(&["", "finding", "what", "handled"]);
    for finding in found {
        table.add_row([
            as_written(finding.severity),
            finding.code.to_string(),
            format!("{}: {}", finding.recording.display(), finding.text),
            as_written(finding.handled),
        ]);
    }
    let remedies: Vec<&str> = found.iter().filter_map(|f| f.remedy.as_deref()).collect();
    let last = match (stop(found), remedies.is_empty()) {
        (_, false) => format!("what mends it:\n  {}", remedies.join("\n  ")),
        (Some(_), true) => "nothing can be told from these recordings as they are".to_owned(),
        (None, true) => next,
    };
    format!("{table}\n\n{last}")
}

/// As in JSON.
fn as_written(value: impl serde::Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|v| Some(v.as_str()?.to_owned())).unwrap_or_default()
}
