//! `greyrig effects`: the catalogue, explained.

use std::process::ExitCode;

use greyrig::effects::{Description, Effect};
use serde_json::json;

use super::words;
use crate::error::{Error, Result};
use crate::output;

/// The catalogue of physical effects, explained.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  greyrig effects saturation")]
pub struct Args {
    /// Identifier of one effect
    id: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// An effect that is not in the catalogue.
pub fn run(args: &Args) -> Result<ExitCode> {
    let catalogue = Effect::<f64>::CATALOGUE;
    let chosen: Vec<&Description> = match &args.id {
        None => catalogue.iter().collect(),
        Some(id) => vec![catalogue.iter().find(|d| d.id == id).ok_or_else(|| {
            let ids: Vec<&str> = catalogue.iter().map(|d| d.id).collect();
            Error::usage(format!("there is no effect {id}"), format!("known are {}", ids.join(", ")))
        })?],
    };
    if args.json {
        let effects: Vec<_> = chosen.iter().map(|d| as_json(d)).collect();
        output::print_json("effects", &[], json!({ "effects": effects }))?;
    } else if args.id.is_some() {
        for description in chosen {
            output::print_line(&explained(description))?;
        }
    } else {
        let mut table = words::table(&["effect", "what", "equation"]);
        for d in chosen {
            table.add_row([d.id, d.name, d.equation]);
        }
        output::print_line(&table.to_string())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn explained(d: &Description) -> String {
    let mut text = format!("{} – {}\n\n  {}\n\nparameters\n", d.id, d.name, d.equation);
    for p in d.parameters {
        text += &format!("  {} ({}): {}; {} to {}\n", p.name, p.unit, p.meaning, p.range.0, p.range.1);
    }
    text += &format!("\nsignature      {}\n", d.signature);
    text += &format!("confused with  {}\n", d.confused_with.join(", "));
    text += &format!("separated by   {}\n", d.separated_by);
    text + &format!("source         {}", d.source)
}

fn as_json(d: &Description) -> serde_json::Value {
    json!({
        "id": d.id,
        "name": d.name,
        "equation": d.equation,
        "parameters": d.parameters.iter().map(|p| json!({
            "name": p.name, "unit": p.unit, "meaning": p.meaning, "range": [p.range.0, p.range.1], "start": p.start,
        })).collect::<Vec<_>>(),
        "signature": d.signature,
        "confused_with": d.confused_with,
        "separated_by": d.separated_by,
        "source": d.source,
    })
}
