//! ASAM MDF 4 and 2/3 (INCA, CANape, asammdf), decoded by falcon_mdf. Each channel group is a raster of its own.

use std::path::Path;

use falcon_mdf::Mf4File;
use falcon_mdf::mdf3::Mdf3File;

use super::damage::{damaged, too_large};
use super::table::{Column, MAX_VALUES, Table};
use crate::error::Result;

/// Reads an MDF file.
///
/// # Errors
/// Whatever the decoder refuses, and too many values. A channel that cannot be decoded is left out with a warning.
pub fn read(path: &Path) -> Result<Table> {
    let mut head = [0; 16];
    let mut file = std::fs::File::open(path).map_err(|e| crate::error::Error::io(path, e))?;
    std::io::Read::read_exact(&mut file, &mut head).map_err(|e| damaged(path, "MDF", e))?;
    // Bytes 8 to 11 of the identification block hold the version in letters, "4.10" or "3.30".
    match head[8] {
        b'2' | b'3' => read_3(path),
        _ => read_4(path),
    }
}

struct Builder<'a> {
    path: &'a Path,
    table: Table,
    paths: Vec<String>,
    values: usize,
}

impl Builder<'_> {
    /// One channel; `samples` decodes it.
    fn add(
        &mut self,
        raster: usize,
        (name, unit, is_time): (&str, &str, bool),
        count: u64,
        samples: impl FnOnce() -> falcon_mdf::error::Result<Vec<f64>>,
    ) -> Result<()> {
        self.values = self.values.saturating_add(usize::try_from(count).unwrap_or(usize::MAX));
        if self.values > MAX_VALUES {
            return Err(too_large(self.path, &format!("more than {count} samples in a channel group")));
        }
        match samples() {
            Ok(values) if values.len() as u64 == count => {
                let unit = Some(unit.trim().to_owned()).filter(|u| !u.is_empty());
                let column = Column { unit, raster, is_time, ..Column::new(name, values) };
                self.table.columns.push(column);
                self.paths.push(format!("group{}/{name}", raster + 1));
                Ok(())
            }
            // Without its time a group is of no use, and half a channel is damage, not a property of the file.
            Ok(values) => {
                Err(damaged(self.path, "MDF", format!("channel {name} has {} of {count} samples", values.len())))
            }
            Err(e) if is_time || !matches!(e, falcon_mdf::error::Mf4Error::Unsupported { .. }) => {
                Err(damaged(self.path, "MDF", e))
            }
            Err(e) => {
                self.table.warnings.push(format!("channel '{name}' is left out: {e}"));
                Ok(())
            }
        }
    }

    fn finish(mut self) -> Table {
        let paths = std::mem::take(&mut self.paths);
        self.table.make_names_unique(&paths);
        self.table
    }
}

fn read_4(path: &Path) -> Result<Table> {
    // Buffered, not memory-mapped: a file that is cut short by another program while being read is then an error.
    let file = Mf4File::open_buffered(path).map_err(|e| damaged(path, "MDF", e))?;
    let mut build = Builder { path, table: Table::default(), paths: Vec::new(), values: 0 };
    for (raster, group) in file.data_groups().iter().flat_map(|g| &g.channel_groups).enumerate() {
        for channel in group.channels.iter().filter(|c| c.is_numeric() && !c.is_array()) {
            let samples = || {
                let signal = file.signal(channel)?;
                let mut values = signal.values_f64()?;
                if let Some(valid) = signal.validity() {
                    for (x, _) in values.iter_mut().zip(valid).filter(|(_, ok)| !ok) {
                        *x = f64::NAN;
                    }
                }
                Ok(values)
            };
            let unit = if channel.is_time_channel() && channel.unit.is_empty() { "s" } else { &channel.unit };
            build.add(raster, (&channel.name, unit, channel.is_time_channel()), group.sample_count, samples)?;
        }
    }
    for (key, value) in [("comment", file.comment().trim())] {
        if !value.is_empty() && !value.contains('<') {
            build.table.metadata.insert(key.into(), value.split_whitespace().collect::<Vec<_>>().join(" "));
        }
    }
    Ok(build.finish())
}

fn read_3(path: &Path) -> Result<Table> {
    let file = Mdf3File::open(path).map_err(|e| damaged(path, "MDF", e))?;
    let mut build = Builder { path, table: Table::default(), paths: Vec::new(), values: 0 };
    let mut raster = 0;
    for (g, data_group) in file.data_groups().iter().enumerate() {
        for (c, group) in data_group.channel_groups.iter().enumerate() {
            for (k, channel) in group.channels.iter().enumerate() {
                let unit = if channel.is_time() && channel.unit.is_empty() { "s" } else { &channel.unit };
                // Names carry the device behind a backslash ("u\ES910"); the quantity is before it.
                let name = channel.name.split('\\').next().unwrap_or(&channel.name);
                let samples = || Ok(file.channel_physical(g, c, k)?.to_f64());
                build.add(raster, (name, unit, channel.is_time()), u64::from(group.cycle_count), samples)?;
            }
            raster += 1;
        }
    }
    let comment = file.comment().trim();
    if !comment.is_empty() && !comment.contains('<') {
        build.table.metadata.insert("comment".into(), comment.split_whitespace().collect::<Vec<_>>().join(" "));
    }
    Ok(build.finish())
}
