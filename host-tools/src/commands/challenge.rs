//! `greyrig challenge`: from what size on the recordings would have revealed each effect.

use std::path::PathBuf;
use std::process::ExitCode;

use super::input::{self, Answered, Input};
use super::stdout;
use super::table::{Cell, Column, Table};
use super::terminal::Terminal;
use super::words;
use crate::answers::next::{CommandLine, unused};
use crate::challenge::{Challenge, Challenged, challenge};
use crate::check::{self, Purpose};
use crate::error::Result;
use crate::model::{Model, catalogue};

/// Is there really nothing else? From what size on these recordings would have revealed each effect.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  greyrig challenge staircase.csv --model model.toml\n  \
    greyrig challenge staircase.csv --model model.toml --effect brush_drop --effect saturation\n\n\
    Each effect that the model lacks is put into the recordings at known sizes, and diagnosis has to find it.")]
pub struct Args {
    #[command(flatten)]
    input: Input,
    /// Model file
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Effect to try (repeatable) [default: all that the model lacks]
    #[arg(long, value_name = "ID")]
    effect: Vec<String>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

impl Args {
    /// The command that goes on: what was found is added, what is left is looked for, what stays hidden is told apart
    /// by another recording.
    fn next(&self, c: &Challenge) -> Option<CommandLine> {
        let files = self.input.files();
        let model = |line: CommandLine| line.option("--model", [self.model.display()]);
        if !c.found.is_empty() {
            let add = files.again(model(CommandLine::new("add").with(&c.found)));
            return Some(add.option("--out", [unused(&self.model).display()]));
        }
        if c.unexplained {
            return Some(model(files.again(CommandLine::new("diagnose"))));
        }
        let hidden = c.effects.iter().any(|e| e.revealed_from.is_none());
        (hidden || c.out_of_reach.iter().any(|o| !o.invisible)).then(|| model(CommandLine::new("plan")))
    }
}

/// Runs the command.
///
/// # Errors
/// A model or recordings that cannot be used.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let model = Model::load(&args.model)?;
    let effects = catalogue::effects(&args.effect)?;
    let mut recordings = args.input.load(&terminal.context())?;
    let findings = input::question(&mut recordings, model.kind, Purpose::Fit);
    check::refuse(&findings)?;
    let result = terminal.watching("challenge", |ctx| challenge(&recordings, &model, &effects, ctx))?;
    if args.json {
        let answer = Answered { answer: &result, data_findings: &findings };
        stdout::print_json("challenge", &args.input.names(), answer)?;
    } else {
        print(&result)?;
        stdout::print_next(args.next(&result).as_ref())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn print(c: &Challenge) -> Result<()> {
    if !c.found.is_empty() {
        stdout::print_line(&format!(
            "diagnosis finds {} without any challenge; the challenged model has it (greyrig add {})",
            catalogue::joined(&c.found, " and "),
            catalogue::joined(&c.found, " ")
        ))?;
    }
    if c.unexplained {
        stdout::print_line("structure is left that no effect explains, which hides small effects (greyrig diagnose)")?;
    }
    if !c.effects.is_empty() {
        stdout::print_line(&table(c))?;
    }
    if !c.out_of_reach.is_empty() {
        stdout::print_line("\nnot to be told from these recordings:")?;
        for o in &c.out_of_reach {
            stdout::print_line(&format!("  {}: {}", o.name, o.text))?;
        }
    }
    Ok(())
}

fn table(c: &Challenge) -> String {
    let mut table = Table::new([
        Column::text("effect"),
        Column::text("revealed"),
        Column::figure("current error"),
        Column::figure("speed error"),
        Column::prose("smaller ones"),
    ]);
    for e in &c.effects {
        table.row([
            Cell::from(e.name),
            words::strong(from(e)),
            words::percent(e.esr.current).into(),
            words::percent(e.esr.speed).into(),
            smaller(e).into(),
        ]);
    }
    table.to_string()
}

/// Error of the free run below which an effect does nothing.
const NOTHING: f64 = 1e-9;

/// From what size on an effect is revealed, in words.
fn from(e: &Challenged) -> String {
    match (e.revealed_from, e.hidden_up_to) {
        (Some(size), _) => format!("from {} on", words::quantity(size, e.unit)),
        (None, Some(_)) if [e.esr.current, e.esr.speed].iter().flatten().all(|x| *x < NOTHING) => {
            "it does nothing in this model".to_owned()
        }
        (None, Some(size)) => format!("not even at {}", words::quantity(size, e.unit)),
        (None, None) => "the model cannot be run with it".to_owned(),
    }
}

/// What happens to smaller sizes, in words.
fn smaller(e: &Challenged) -> String {
    match (e.mistaken_for, e.objection) {
        (Some(other), _) => format!("taken for {other}"),
        (None, Some(objection)) => objection.to_owned(),
        (None, None) => String::new(),
    }
}
