//! HDF5 and MATLAB 7.3 (which is HDF5 behind a user block), decoded by hdf5-reader.
//!
//! Every numeric data set of one or two dimensions becomes a column (or several); attributes `unit`, `units` give the
//! unit, scalar data sets and attributes of groups are metadata.

use std::path::Path;

use hdf5_reader::group::Group;
use hdf5_reader::{Attribute, Dataset, Datatype, Hdf5File, OpenOptions};

use super::arrays::Found;
use super::damage::{damaged, too_large};
use super::table::{MAX_VALUES, Table};
use crate::error::Result;

/// Groups nest; damaged files nest without end.
const DEEPEST: usize = 16;
/// More data sets than this are no recording.
const MOST: usize = 4096;

/// Reads an HDF5 file under the name of the format that the user knows.
///
/// # Errors
/// Damaged content, too many values. A data set that cannot be decoded is an error, since it may be the one needed.
pub fn read(path: &Path, format: &str) -> Result<Table> {
    let options = OpenOptions::default().with_max_read_bytes(MAX_VALUES * 8).with_max_chunk_bytes(MAX_VALUES * 8);
    // Read into memory, not mapped: a file that is cut short by another program while being read is then an error.
    let bytes = std::fs::read(path).map_err(|e| crate::error::Error::io(path, e))?;
    let file = Hdf5File::from_vec_with_options(bytes, options).map_err(|e| damaged(path, format, e))?;
    let root = file.root_group().map_err(|e| damaged(path, format, e))?;
    let mut walk = Walk { found: Found::default(), left: MOST };
    match walk.group(&root, &[], 0) {
        Ok(()) => Ok(walk.found.table()),
        Err(reason) if reason == "too many values" => Err(too_large(path, "too many values")),
        Err(reason) => Err(damaged(path, format, reason)),
    }
}

struct Walk {
    found: Found,
    left: usize,
}

impl Walk {
    fn group(&mut self, group: &Group, path: &[String], depth: usize) -> std::result::Result<(), String> {
        if depth > DEEPEST {
            return Err("groups are nested too deeply".into());
        }
        for attribute in group.attributes().unwrap_or_default() {
            if let Some(text) = text_of(&attribute) {
                let mut path = path.to_vec();
                path.push(attribute.name.clone());
                if !attribute.name.starts_with("MATLAB_") && !attribute.name.starts_with("H5") {
                    self.found.text(&path, text);
                }
            }
        }
        let (groups, datasets) = group.members().map_err(|e| e.to_string())?;
        for dataset in &datasets {
            self.left = self.left.checked_sub(1).ok_or("there are too many data sets")?;
            let mut path = path.to_vec();
            path.push(dataset.name().rsplit('/').next().unwrap_or("").to_owned());
            self.dataset(dataset, &path)?;
        }
        for inner in &groups {
            self.left = self.left.checked_sub(1).ok_or("there are too many groups")?;
            let name = inner.name().rsplit('/').next().unwrap_or("").to_owned();
            // MATLAB keeps the content of cell arrays and its own tables there.
            if name.starts_with('#') {
                continue;
            }
            let mut path = path.to_vec();
            path.push(name);
            self.group(inner, &path, depth + 1)?;
        }
        Ok(())
    }

    fn dataset(&mut self, dataset: &Dataset, path: &[String]) -> std::result::Result<(), String> {
        let shape = dataset.shape().to_vec();
        let elements = dataset.num_elements().map_err(|e| e.to_string())?;
        if elements > MAX_VALUES as u64 {
            return Err("too many values".into());
        }
        let attribute = |name: &str| dataset.attribute(name).ok().and_then(|a| text_of(&a));
        if matches!(dataset.dtype(), Datatype::String { .. }) {
            if elements == 1 {
                self.found.text(path, dataset.read_string().map_err(|e| e.to_string())?);
            }
            return Ok(());
        }
        let class = attribute("MATLAB_class");
        // MATLAB marks an empty array by a data set that holds the size instead.
        if elements == 0 || dataset.attribute("MATLAB_empty").is_ok() {
            return Ok(());
        }
        let Some(values) = values_of(dataset)? else { return Ok(()) };
        if class.as_deref() == Some("char") {
            if elements < 4096 {
                self.found.text(path, values.iter().filter_map(|&c| char::from_u32(c as u32)).collect());
            }
            return Ok(());
        }
        for name in ["unit", "units", "Unit", "Units"] {
            if let Some(unit) = attribute(name) {
                self.found.units.insert(path.to_vec(), unit);
                break;
            }
        }
        // Row-major rows x columns are column-major columns x rows.
        let (rows, columns) = match shape.as_slice() {
            [] => (1, 1),
            [n] => (*n as usize, 1),
            [a, b] => (*b as usize, *a as usize),
            _ => return Ok(()),
        };
        self.found.matrix(path, rows, columns, values).map_err(Into::into)
    }
}

fn values_of(dataset: &Dataset) -> std::result::Result<Option<Vec<f64>>, String> {
    macro_rules! read {
        ($t:ty) => {{
            let array = dataset.read_array::<$t>().map_err(|e| e.to_string())?;
            Ok(Some(array.iter().map(|&x| x as f64).collect()))
        }};
    }
    match dataset.dtype() {
        // Booleans of h5py are bytes with names.
        Datatype::Enum { base, .. } if matches!(**base, Datatype::FixedPoint { size: 1, .. }) => {
            let bytes = dataset.read_native_bytes().map_err(|e| e.to_string())?;
            Ok(Some(bytes.iter().map(|&b| f64::from(b as i8)).collect()))
        }
        Datatype::FloatingPoint { size: 4, .. } => read!(f32),
        Datatype::FloatingPoint { size: 8, .. } => read!(f64),
        Datatype::FixedPoint { size: 1, signed: true, .. } => read!(i8),
        Datatype::FixedPoint { size: 1, .. } => read!(u8),
        Datatype::FixedPoint { size: 2, signed: true, .. } => read!(i16),
        Datatype::FixedPoint { size: 2, .. } => read!(u16),
        Datatype::FixedPoint { size: 4, signed: true, .. } => read!(i32),
        Datatype::FixedPoint { size: 4, .. } => read!(u32),
        Datatype::FixedPoint { size: 8, signed: true, .. } => read!(i64),
        Datatype::FixedPoint { size: 8, .. } => read!(u64),
        _ => Ok(None),
    }
}

fn text_of(attribute: &Attribute) -> Option<String> {
    if let Ok(text) = attribute.read_string() {
        return Some(text);
    }
    attribute.read_as_f64().ok().map(|x| x.to_string())
}
