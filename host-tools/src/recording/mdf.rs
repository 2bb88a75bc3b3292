//! ASAM MDF 4 and 2/3 (INCA, CANape, asammdf), decoded by falcon_mdf. Each channel group is a raster of its own.
//!
//! The decoder takes the length of the data for the truth where the number of cycles contradicts it; then the length of
//! a record is in doubt, too, and the file is refused here (ASAM MDF 4.2, blocks CG and DT). Floats of 16 bits are
//! decoded here.

use std::path::Path;

use falcon_mdf::blocks::channel::DataType;
use falcon_mdf::mdf3::Mdf3File;
use falcon_mdf::{Channel, Conversion, Mf4File, SignalValues};
use half::f16;

use super::damage::{damaged, too_large};
use super::table::{Column, LeftOut, MAX_VALUES, Table};
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
                self.table.leave_out(name, e);
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
    if file.unfinalized().is_none() {
        lengths::check(&file).map_err(|reason| damaged(path, "MDF", reason))?;
    } else {
        build.table.warnings.push("the recorder was stopped before it had finished the file; was it cut off?".into());
    }
    for (raster, group) in file.data_groups().iter().flat_map(|g| &g.channel_groups).enumerate() {
        for channel in &group.channels {
            if !channel.is_numeric() || channel.is_array() {
                let reason = if channel.is_array() { "it holds arrays" } else { "it holds no numbers" };
                build.table.left_out.push(LeftOut { name: channel.name.clone(), reason: reason.into() });
                continue;
            }
            let samples = || {
                let signal = file.signal(channel)?;
                let mut values = match (channel.data_type, channel.bit_count) {
                    (DataType::FloatLe | DataType::FloatBe, 16) => half_precision(&file, channel)?,
                    (DataType::FloatLe | DataType::FloatBe, bits) if bits != 32 && bits != 64 => {
                        return Err(unsupported_float(bits));
                    }
                    _ => signal.values_f64()?,
                };
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

fn unsupported_float(bits: u32) -> falcon_mdf::Mf4Error {
    falcon_mdf::Mf4Error::unsupported(format!("a float of {bits} bits"), "16, 32 and 64 are read")
}

/// Floats of 16 bits, which the decoder takes for nothing: read as integers of their bits.
fn half_precision(file: &Mf4File, channel: &Channel) -> falcon_mdf::error::Result<Vec<f64>> {
    let mut bits = channel.clone();
    bits.data_type = if channel.data_type == DataType::FloatBe { DataType::UIntBe } else { DataType::UIntLe };
    bits.conversion = Conversion::None;
    match file.signal(&bits)?.raw_values()? {
        SignalValues::U16(bits) => {
            Ok(bits.iter().map(|b| channel.conversion.convert(f16::from_bits(*b).to_f64(), true)).collect())
        }
        _ => Err(unsupported_float(16)),
    }
}

/// Whether the number of cycles and the length of a record give the length of the data.
mod lengths {
    use falcon_mdf::Mf4File;

    type Walked<T> = Result<T, String>;

    /// Lists of blocks are short; damaged ones run in circles.
    const MOST_BLOCKS: usize = 1 << 20;

    struct Block {
        id: [u8; 4],
        length: u64,
        links: Vec<u64>,
        data: u64,
    }

    struct Walk<'a> {
        file: &'a Mf4File,
        left: usize,
    }

    /// Where the first data group is linked from: the header block follows the identification of 64 bytes.
    const HEADER: u64 = 64;

    pub fn check(file: &Mf4File) -> Walked<()> {
        let mut walk = Walk { file, left: MOST_BLOCKS };
        let mut next = walk.block(HEADER)?.links.first().copied().unwrap_or(0);
        while next != 0 {
            let group = walk.block(next)?;
            let [following, first, data, ..] = group.links[..] else { return Err("a data group has no links".into()) };
            let record_id = u64::from(walk.bytes::<1>(group.data)?[0]);
            let mut groups = Vec::new();
            let mut at = first;
            while at != 0 {
                let block = walk.block(at)?;
                let (cycles, flags) = (walk.number::<8>(block.data + 8)?, walk.number::<2>(block.data + 16)?);
                let record = walk.number::<4>(block.data + 24)? + walk.number::<4>(block.data + 28)?;
                groups.push((cycles, flags, record));
                at = block.links.first().copied().unwrap_or(0);
            }
            // Groups that share their data tell them apart by an identification before each record. Those of variable
            // length (bit 0), of other files (bit 3) and with their invalidation bits apart have other lengths.
            let fixed = groups.iter().all(|g| g.1 & 0b1001 == 0);
            if let (true, Some(length)) = (fixed, walk.data_length(data)?) {
                let cycle = |g: &(u64, u64, u64)| g.0.checked_mul(g.2 + record_id);
                let sum = groups.iter().try_fold(0_u64, |sum, g| sum.checked_add(cycle(g)?));
                if sum != Some(length) {
                    let count: u64 = groups.iter().fold(0, |sum, g| sum.saturating_add(g.0));
                    return Err(format!("{count} cycles of its records do not make its {length} bytes of data"));
                }
            }
            next = following;
        }
        Ok(())
    }

    impl Walk<'_> {
        fn bytes<const N: usize>(&mut self, at: u64) -> Walked<[u8; N]> {
            let bytes = self.file.read_raw(at, N).map_err(|e| e.to_string())?;
            bytes.try_into().map_err(|_| "a block is cut off".to_owned())
        }

        fn number<const N: usize>(&mut self, at: u64) -> Walked<u64> {
            Ok(self.bytes::<N>(at)?.iter().rev().fold(0, |sum, b| sum << 8 | u64::from(*b)))
        }

        fn block(&mut self, at: u64) -> Walked<Block> {
            self.left = self.left.checked_sub(1).ok_or("its blocks run in a circle")?;
            let id = self.bytes::<4>(at)?;
            let (length, links) = (self.number::<8>(at + 8)?, self.number::<8>(at + 16)?);
            if links > 1 << 16 || length < 24 {
                return Err("a block has an impossible size".into());
            }
            let links = (0..links).map(|k| self.number::<8>(at + 24 + 8 * k)).collect::<Walked<Vec<u64>>>()?;
            let data = at + 24 + 8 * links.len() as u64;
            Ok(Block { id, length, links, data })
        }

        /// Bytes of data behind a link, unpacked; none where they are of a kind that is not counted here.
        fn data_length(&mut self, at: u64) -> Walked<Option<u64>> {
            if at == 0 {
                return Ok(Some(0));
            }
            let block = self.block(at)?;
            match &block.id {
                b"##DT" => Ok(Some(block.length - 24)),
                // The length before it was packed.
                b"##DZ" => self.number::<8>(block.data + 8).map(Some),
                b"##HL" => self.data_length(block.links.first().copied().unwrap_or(0)),
                b"##DL" => {
                    let (mut sum, mut list) = (0_u64, block);
                    loop {
                        for link in list.links[1.min(list.links.len())..].iter().filter(|link| **link != 0) {
                            let part = self.block(*link)?;
                            sum = sum.saturating_add(match &part.id {
                                b"##DT" => part.length - 24,
                                b"##DZ" => self.number::<8>(part.data + 8)?,
                                _ => return Ok(None),
                            });
                        }
                        match list.links.first() {
                            Some(&next) if next != 0 => list = self.block(next)?,
                            _ => return Ok(Some(sum)),
                        }
                    }
                }
                _ => Ok(None),
            }
        }
    }
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
                // Codes of floating point; others of its sizes do not exist.
                let float = matches!(channel.data_type, 2..=6 | 11 | 12 | 15 | 16);
                let samples = || match u32::from(channel.bit_count) {
                    bits if float && bits != 32 && bits != 64 => Err(unsupported_float(bits)),
                    _ => Ok(file.channel_physical(g, c, k)?.to_f64()),
                };
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
