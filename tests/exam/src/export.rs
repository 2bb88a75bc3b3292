//! Cases as files, for other tools: what is diagnosed, the recording that judges, and the truth.

use std::path::Path;

use greyrig_host::context::Context;
use greyrig_host::diagnose::base;
use greyrig_host::error::{Error, Place, Result};
use greyrig_host::identify::Settings;
use greyrig_host::recording::write;

use crate::cases::Case;

/// Writes a case to the directory `<folder>/<seed>`: `<profile>.csv` for each recording (`<profile>-again.csv` for a
/// second one), `held-out.csv` and `truth.json`, which has the base model's free-run error-to-signal ratios too: they
/// say whether the effects stand out.
///
/// # Errors
/// A directory or a file that cannot be written, an interrupt.
pub fn export(case: &Case, folder: &Path) -> Result<()> {
    let folder = folder.join(case.seed.to_string());
    std::fs::create_dir_all(&folder).map_err(|e| refused(&folder, &e))?;
    let recordings = case.recordings()?;
    let mut names: Vec<String> = Vec::new();
    for ((profile, _), recording) in case.excitation.profiles().iter().zip(&recordings) {
        let once = format!("{profile}.csv");
        let name = if names.contains(&once) { format!("{profile}-again.csv") } else { once };
        write(recording, &folder.join(&name), true, &Context::quiet())?;
        names.push(name);
    }
    write(&case.held_out()?, &folder.join("held-out.csv"), true, &Context::quiet())?;
    let truth = serde_json::json!({
        "seed": case.seed,
        "truth": case.truth,
        "effects": case.effects,
        "withheld": case.exclude,
        "excitation": case.excitation.name(),
        "noise": case.noise,
        "base_error": base::error(&recordings, &Settings::new(case.excitation.kind()), &Context::quiet())?,
        "recordings": names,
        "held_out": "held-out.csv",
    });
    let path = folder.join("truth.json");
    std::fs::write(&path, format!("{truth:#}\n")).map_err(|e| refused(&path, &e))
}

fn refused(path: &Path, error: &std::io::Error) -> Error {
    Error::input(Place::file(path), error.to_string(), "name a directory that can be written")
}
