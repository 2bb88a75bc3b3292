//! Parameters by a debug probe (ST-LINK, J-Link, CMSIS-DAP v2): the same bytes as over the link, to the same place.

use greyrig::parameters::block::FLASH_ADDRESS;
use probe_rs::Permissions;
use probe_rs::flashing::DownloadOptions;
use probe_rs::integration::FakeProbe;
use probe_rs::probe::list::Lister;

use super::image;
use crate::error::{Error, Result};

/// Erases both slots, writes the block to the first, and lets the probe verify it; then restarts the processor. A dry run
/// checks the place against the chip's memory map and touches no probe. Not run on silicon.
///
/// # Errors
/// No probe, a chip that is not known, a flash that does not hold what was written.
pub fn write(payload: &[u8], chip: &str, dry_run: bool) -> Result<()> {
    let probe = if dry_run {
        FakeProbe::with_mocked_core().into_probe()
    } else {
        let probes = Lister::new().list_all();
        let first = probes.first().ok_or_else(|| {
            Error::link("no debug probe was found", "connect one, and check that you may use it (udev rules on Linux)")
        })?;
        first.open().map_err(trouble)?
    };
    let mut session = probe.attach(chip, Permissions::default()).map_err(trouble)?;
    let slots = image::slots(payload);
    let mut loader = session.target().flash_loader();
    loader.add_data(FLASH_ADDRESS.into(), &slots).map_err(trouble)?;
    let mut options = DownloadOptions::default();
    options.verify = true;
    options.keep_unwritten_bytes = true;
    options.dry_run = dry_run;
    loader.commit(&mut session, options).map_err(trouble)?;
    if !dry_run {
        session.core(0).and_then(|mut core| core.reset()).map_err(trouble)?;
    }
    Ok(())
}

/// An error with its causes, in one line.
fn trouble(error: impl std::error::Error) -> Error {
    let mut what = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        what += &format!(": {error}");
        cause = error.source();
    }
    Error::link(what.replace('\n', " "), "check the probe, the cable and the name of the chip")
}
