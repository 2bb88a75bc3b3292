//! `greyrig check`: what is wrong with recordings, and what mends it.

use std::process::ExitCode;

use super::input::Input;
use super::paint::{BAD, DOUBT, FAINT, GOOD, painted};
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
    /// The command that goes on: what mends the recordings, or else what is identified from them; none where nothing
    /// does.
    fn next(&self, found: &[DataFinding]) -> Option<CommandLine> {
        let files = self.input.files();
        let with_kind = |line: CommandLine| line.option("--kind", self.kind.map(Kind::name));
        if let Some(remedy) = found.iter().find_map(|f| f.remedy.as_deref().filter(|words| words.starts_with("--"))) {
            let line = files.again_with(CommandLine::new("check"), remedy);
            return Some(if remedy.starts_with("--kind") { line } else { with_kind(line) });
        }
        let identify = || with_kind(files.again(CommandLine::new("identify"))).option("--out", ["model.toml"]);
        stop(found).is_none().then(identify)
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
        stdout::print_line(&in_words(found))?;
        stdout::print_next(args.next(found).as_ref())?;
    }
    Ok(if stop(found).is_some() { ExitCode::from(EXIT_BAD_INPUT) } else { ExitCode::SUCCESS })
}

fn in_words(found: &[DataFinding]) -> String {
    if found.is_empty() {
        return format!("{}\n", painted(GOOD, "nothing is wrong"));
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
    match (stop(found), remedies.is_empty()) {
        (_, false) => format!("{table}\n\nwhat mends it:\n  {}", remedies.join("\n  ")),
        (Some(_), true) => format!("{table}\n\nnothing can be told from these recordings as they are"),
        (None, true) => format!("{table}\n"),
    }
}

/// As in JSON.
fn as_written(value: impl serde::Serialize) -> String {
    serde_json::to_value(value).ok().and_then(|v| Some(v.as_str()?.to_owned())).unwrap_or_default()
}
