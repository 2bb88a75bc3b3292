//! `greyrig effects`: the catalogue, explained.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::ValueEnum;
use greyrig::effects::{Description, InWords, Seen};
use greyrig::motor::FluxLaw;
use serde_json::json;

use super::paint::{STRONG, painted};
use super::stdout;
use super::table::{Cell, Column, Table};
use super::terminal::Terminal;
use super::words;
use crate::answers::next::{CommandLine, unused};
use crate::diagnose::classes;
use crate::error::Result;
use crate::handbook;
use crate::handbook::words::{diagnosed_in, enters, excited_by, prior, shows, size, tried, turns_into};
use crate::model::{Kind, catalogue};
use crate::output;
use crate::rig;

/// The catalogue of physical effects, explained.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig effects saturation")]
pub struct Args {
    /// Identifier of one effect
    id: Option<String>,
    /// Print the catalogue as the page of the documentation
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
    /// Write a page for each effect, and a figure of what it changes, into this folder
    #[arg(long, value_name = "DIR", conflicts_with_all = ["json", "markdown"])]
    book: Option<PathBuf>,
    /// Replace pages that exist
    #[arg(long, requires = "book")]
    force: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// An effect that is not in the catalogue.
pub fn run(args: &Args, terminal: &Terminal) -> Result<ExitCode> {
    let chosen: Vec<&Description> = match &args.id {
        None => Description::all().collect(),
        Some(id) => vec![catalogue::effect(id)?.description()],
    };
    if let Some(folder) = &args.book {
        write_book(folder, args.force, &chosen, terminal)?;
    } else if args.markdown {
        stdout::print_as_it_is(&page(&chosen))?;
    } else if args.json {
        let effects: Vec<_> = chosen.iter().map(|d| as_json(d)).collect();
        stdout::print_json("effects", &[], json!({ "effects": effects }))?;
    } else if args.id.is_some() {
        for description in chosen {
            stdout::print_line(&explained(description))?;
            stdout::print_next(on_the_rig(description).as_ref())?;
        }
    } else {
        let mut table = Table::new([
            Column::text("effect"),
            Column::text("enters"),
            Column::text("shows in"),
            Column::prose("what"),
        ]);
        for d in chosen {
            let shows = match d.seen {
                Seen::FreeRun => "free run",
                Seen::Invisible(_) => "nothing",
                Seen::InvisibleInSeries(_) => "free run, with magnets",
                Seen::Variance => "variance",
                Seen::Orders => "orders",
                Seen::Course => "course",
                Seen::Samples => "samples",
            };
            table.row([words::strong(d.id.id()), Cell::from(enters(d)), shows.into(), d.name.into()]);
        }
        stdout::print_line(&table.to_string())?;
        stdout::print_next(Some(&CommandLine::new("effects").with(["saturation"])))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A motor of the virtual rig that has an effect, if that can be.
fn on_the_rig(d: &Description) -> Option<CommandLine> {
    let part = rig::EFFECTS.iter().find(|effect| effect.id == d.id.id())?;
    let kind = Kind::value_variants().iter().copied().find(|kind| part.sizes(*kind).is_some())?;
    let kind = (kind != Kind::Universal).then_some(kind);
    let line = CommandLine::new("simulate").option("--kind", kind).option("--effect", [part.id]);
    Some(line.option("--out", [unused(Path::new("run.csv")).display()]))
}

/// Writes the pages, each file whole or not at all.
fn write_book(folder: &Path, force: bool, effects: &[&Description], terminal: &Terminal) -> Result<()> {
    let pages: Result<Vec<_>> =
        terminal.watching("pages", |ctx| effects.iter().map(|d| handbook::files(d, ctx)).collect());
    let files = pages?.concat();
    for file in &files {
        output::refuse_overwrite(&folder.join(&file.name), force)?;
    }
    for file in &files {
        output::write_file(&folder.join(&file.name), force, |out| out.write_all(file.text.as_bytes()))?;
    }
    stdout::print_line(&format!("{}: {} files", folder.display(), files.len()))
}

/// The catalogue as a page of the documentation.
fn page(effects: &[&Description]) -> String {
    let mut text = String::from(
        "# The catalogue of physical effects\n\nMade by `greyrig effects --markdown` from the text beside the equations in \
         `src/effects/`. The order is that in which effects act. Each has a page of its own: why it bends the curves, how large it \
         is, what looks like it, how it is modelled.\n\nEffects that no recording of voltage, current and speed could separate count as one: \n\n",
    );
    for class in classes::all() {
        let members = class.members.iter().map(|id| format!("`{id}`")).collect::<Vec<_>>().join(", ");
        let motors = match class.law {
            None => "",
            Some(FluxLaw::Series) => " (series motors)",
            Some(FluxLaw::PermanentMagnet) => " (magnet motors)",
        };
        text += &format!("- {members}{motors}\n");
    }
    text += "\n| effect | what | enters | shows |\n| --- | --- | --- | --- |\n";
    for d in effects {
        text += &format!("| [`{0}`](effects/{0}.md) | {1} | {2} | {3} |\n", d.id, d.name, enters(d), shows(d));
    }
    text.trim_end().to_owned()
}

/// Columns of what a line is about.
const LABELS: usize = 15;

fn explained(d: &Description) -> String {
    let mut text = format!("{} – {}\n\n  {}\n\nparameters\n", painted(STRONG, d.id), d.name, d.equation);
    for p in d.parameters {
        let unit = if p.unit == "1" { String::new() } else { format!(" ({})", words::unit(p.unit)) };
        let range = format!("{} to {} {}", p.range.0, p.range.1, words::unit(p.unit));
        text += &format!("  {}{unit}: {}; {}\n", p.name, p.meaning, range.trim_end());
    }
    let mut lines = vec![
        ("enters", enters(d).to_owned()),
        ("shows", shows(d)),
        ("diagnosed", tried(d)),
        ("signature", d.signature.to_owned()),
        ("its size", size(d)),
        ("excited by", excited_by(d)),
        ("expected", prior(d)),
    ];
    if let Some((other, beyond)) = turns_into(d) {
        lines.push(("turns into", format!("{other} with {beyond}")));
    }
    if !d.confused_with.is_empty() {
        lines.push(("confused with", catalogue::joined(d.confused_with, ", ")));
        lines.push(("separated by", InWords(d.separated_by).to_string()));
    }
    lines.push(("source", d.source.to_owned()));
    let lines: Vec<String> = lines.iter().map(|(label, told)| stdout::labelled(label, told, LABELS)).collect();
    format!("{text}\n{}", lines.join("\n"))
}

fn as_json(d: &Description) -> serde_json::Value {
    json!({
        "id": d.id,
        "name": d.name,
        "equation": d.equation,
        "parameters": d.parameters.iter().map(|p| json!({
            "name": p.name, "unit": p.unit, "meaning": p.meaning, "range": [p.range.0, p.range.1], "start": p.start,
        })).collect::<Vec<_>>(),
        "enters": enters(d),
        "shows": shows(d),
        "diagnosed_in": diagnosed_in(d),
        "why": d.why,
        "noticed": d.noticed,
        "remedy": d.remedy,
        "signature": d.signature,
        "size_in_words": size(d),
        "excited_by": d.excited_by.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "prior": { "share": d.prior.share, "because": d.prior.because },
        "turns_into": turns_into(d).map(|(other, beyond)| json!({ "effect": other, "with": beyond })),
        "confused_with": d.confused_with,
        "separated_by": InWords(d.separated_by).to_string(),
        "source": d.source,
    })
}
