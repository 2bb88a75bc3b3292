//! Parameters by a debug probe (ST-LINK, J-Link, CMSIS-DAP v2): the same bytes as over the link, to the same place.

use probe_rs::Permissions;
use probe_rs::config::Registry;
use probe_rs::flashing::DownloadOptions;
use probe_rs::probe::list::Lister;

use super::error::{Error, Result};
use super::image::Image;

/// Erases the image's slots, writes its blocks to the first of them, and lets the probe verify them; then restarts the processor. A dry
/// run checks the place against the chip's memory map and looks for no probe. Not run on silicon.
///
/// # Errors
/// No probe, a chip that is not known, a flash that does not hold what was written.
pub fn write(image: &Image, chip: &str, dry_run: bool) -> Result<()> {
    let target = Registry::from_builtin_families().get_target_by_name(chip).map_err(trouble)?;
    let mut loader = target.flash_loader();
    loader.add_data(image.address().into(), &image.bytes()).map_err(trouble)?;
    if dry_run {
        return Ok(());
    }
    let probes = Lister::new().list_all();
    let first = probes.first().ok_or(Error::NoProbe)?;
    let mut session = first.open().map_err(trouble)?.attach(target, Permissions::default()).map_err(trouble)?;
    let mut options = DownloadOptions::default();
    options.verify = true;
    options.keep_unwritten_bytes = true;
    loader.commit(&mut session, options).map_err(trouble)?;
    session.core(0).and_then(|mut core| core.reset()).map_err(trouble)
}

/// An error with its causes, in one line.
fn trouble(error: impl std::error::Error) -> Error {
    let mut what = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        what += &format!(": {error}");
        cause = error.source();
    }
    Error::Probe(what.replace('\n', " "))
}
