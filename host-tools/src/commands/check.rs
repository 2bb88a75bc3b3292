//! `greyrig check`: what is wrong with recordings, and what mends it.

use std::process::ExitCode;

use super::input::Input;
use super::paint::{BAD, DOUBT, FAINT};
use super::stdout;
use super::table::{Cell, Column, Table};
use super::terminal::Terminal;
use crate::answers::check::Request;
use crate::answers::next::CommandLine;
use crate::check::stop;
use crate::error::{EXIT_BAD_INPUT, Result};
use crate::model::Kind;
use crate::recording::finding::{DataFinding, Severity};

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

impl Args {
    /// The command that goes on with recordings of which nothing has to be mended.
    fn goes_on(&self) -> CommandLine {
        let line = self.input.files().again(CommandLine::new("identify"));
        line.option("--kind", self.kind.map(Kind::name)).option("--out", ["model.toml"])
    }
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
        stdout::print_line(&in_words(found, &args.goes_on()))?;
    }
    Ok(if stop(found).is_some() { ExitCode::from(EXIT_BAD_INPUT) } else { ExitCode::SUCCESS })
}

fn in_words(found: &[DataFinding], next: &CommandLine) -> String {
    let next = format!("next: {next}");
    if found.is_empty() {
        return format!("nothing is wrong\n\n{next}");
    }
    let mut table =
        Table::new([Column::text(""), Column::text("finding"), Column::text("handled"), Column::prose("what")]);
    for finding in found {
        let style = match finding.severity {
            Severity::Stop => BAD,
            Severity::Warning => DOUBT,
            Severity::Info => FAINT,
        };
        table.row([
            Cell::painted(style, as_written(finding.severity)),
            finding.code.to_string().into(),
            as_written(finding.handled).into(),
            format!("{}: {}", finding.recording.display(), finding.text).into(),
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
