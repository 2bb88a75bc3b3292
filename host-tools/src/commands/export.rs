//! `greyrig export`: the model for other simulators.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde_json::json;

use super::stdout;
use crate::error::Result;
use crate::export::library::Library;
use crate::export::{self, Causality, Version, modelica};
use crate::model::Model;
use crate::output;

/// The model for other simulators.
#[derive(Debug, clap::Args)]
#[command(group = clap::ArgGroup::new("to").required(true).args(["fmu", "modelica"]))]
#[command(after_help = "Example:\n  greyrig export --model model.toml --fmu motor.fmu\n  \
    greyrig export --model model.toml --modelica motor.mo\n\n\
    The unit is for co-simulation. It holds a library that `cargo build --release -p greyrig-fmi` builds.\n\
    Voltage and load are held within a communication step; docs/fmi.md says what a step computes.")]
pub struct Args {
    /// The model
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// The functional mock-up unit to write
    #[arg(long, value_name = "FILE.fmu")]
    fmu: Option<PathBuf>,
    /// The laws as equations in Modelica, to write
    #[arg(long, value_name = "FILE.mo")]
    modelica: Option<PathBuf>,
    /// Version of the interface
    #[arg(long, value_enum, default_value_t, conflicts_with = "modelica")]
    fmi: Version,
    /// Interval by which the model is stepped, s; the rig's unless given
    #[arg(long, value_name = "S", conflicts_with = "modelica")]
    interval: Option<f64>,
    /// Library to pack, one for each platform; that beside the program unless given
    #[arg(long, value_name = "FILE", conflicts_with = "modelica")]
    library: Vec<PathBuf>,
    /// Also a model of which the data held out said that what was added last does not belong to it
    #[arg(long)]
    unaccepted: bool,
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
/// A model that cannot be exported; no library; a file that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    let model = Model::load(&args.model)?;
    if !args.unaccepted {
        model.require_accepted(&args.model)?;
    }
    // One of them is given.
    if let Some(out) = &args.modelica {
        let text = modelica::text(&model, &args.model)?;
        output::write_file(out, args.force, |file| file.write_all(text.as_bytes()))?;
        if args.json {
            let told = json!({ "modelica": out.display().to_string(), "model": args.model.display().to_string() });
            stdout::print_json("export", &[], told)?;
        } else {
            stdout::print_line(&format!("{}: the model as a class of Modelica", out.display()))?;
        }
    }
    args.fmu.as_deref().map_or(Ok(()), |out| export_unit(args, &model, out))?;
    Ok(ExitCode::SUCCESS)
}

fn export_unit(args: &Args, model: &Model, out: &Path) -> Result<()> {
    output::refuse_overwrite(out, args.force)?;
    let libraries = match args.library.as_slice() {
        [] => vec![Library::find()?],
        given => given.iter().map(|path| Library::read(path)).collect::<Result<_>>()?,
    };
    let interval_s = args.interval.unwrap_or_else(export::usual_interval_s);
    let unit = export::unit(model, &args.model, args.fmi, interval_s, &libraries)?;
    output::write_file(out, args.force, |file| file.write_all(&unit.bytes))?;

    let platforms: Vec<String> = libraries.iter().map(|library| library.platform.to_string()).collect();
    let bound = libraries.iter().filter(|library| !library.is_portable);
    for library in bound.clone() {
        eprintln!(
            "greyrig: {} runs on processors like the one that built it alone; for others: \
             RUSTFLAGS=-Ctarget-cpu=generic cargo build --release -p greyrig-fmi",
            library.path.display()
        );
    }
    if args.json {
        let variables: Vec<_> = unit
            .variables
            .iter()
            .map(|v| {
                json!({
                    "name": v.name, "value_reference": v.variable.number(), "causality": v.causality.name(),
                    "unit": v.unit, "start": v.start,
                })
            })
            .collect();
        stdout::print_json(
            "export",
            &[],
            json!({
                "fmu": out.display().to_string(), "model": args.model.display().to_string(),
                "fmi": args.fmi.name(), "token": unit.token, "interval_s": interval_s, "platforms": platforms,
                "portable": bound.count() == 0, "bytes": unit.bytes.len(), "variables": variables,
            }),
        )?;
        return Ok(());
    }
    let named = |causality: Causality| {
        let names = unit.variables.iter().filter(|v| v.causality == causality).map(|v| v.name.as_str());
        names.collect::<Vec<_>>().join(", ")
    };
    stdout::print_line(&format!(
        "{}: FMI {} for co-simulation, {}\n  inputs      {}, held within a communication step\n  outputs     {}\n  \
         parameters  {}\n  interval    {interval_s} s",
        out.display(),
        args.fmi.name(),
        platforms.join(", "),
        named(Causality::Input),
        named(Causality::Output),
        named(Causality::Parameter),
    ))
}
