//! Classic NetCDF (CDF-1, CDF-2 and CDF-5), decoded by netcdf-reader; NetCDF-4 is HDF5.
//!
//! Every variable of numbers becomes a column (or several); its attributes are those of [`super::cf`]. Attributes of
//! the whole are metadata.

use std::path::Path;

use netcdf_reader::classic::ClassicFile;
use netcdf_reader::{NcFormat, NcType, NcVariable};

use super::arrays::{Found, TOO_MANY};
use super::cf::{self, Packing};
use super::damage::{damaged, too_large};
use super::table::{MAX_VALUES, Table};
use crate::error::{Error, Result};

/// Longest text that is kept, letters.
const LONGEST_TEXT: u64 = 4096;
/// More variables than this are no recording.
const MOST: usize = 4096;

/// Reads a classic NetCDF file.
///
/// # Errors
/// Damaged content, too many values.
pub fn read(path: &Path) -> Result<Table> {
    // Read into memory, not mapped: a file that is cut short by another program while being read is then an error.
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    let spoilt = |reason: &dyn std::fmt::Display| damaged(path, "classic NetCDF", reason);
    let format = match bytes.get(3) {
        Some(1) => NcFormat::Classic,
        Some(2) => NcFormat::Offset64,
        Some(5) => NcFormat::Cdf5,
        _ => return Err(spoilt(&"its version is none of 1, 2 and 5")),
    };
    let file = ClassicFile::from_vec(bytes, format).map_err(|e| spoilt(&e))?;
    let root = file.root_group();
    if root.variables.len() > MOST {
        return Err(spoilt(&"there are too many variables"));
    }
    let mut found = Found::default();
    for attribute in &root.attributes {
        let number = || attribute.value.as_f64().map(|x| x.to_string());
        if let Some(text) = attribute.value.as_string().or_else(number) {
            found.text(std::slice::from_ref(&attribute.name), text);
        }
    }
    for variable in &root.variables {
        match one(&file, variable, &mut found) {
            Ok(()) => {}
            Err(reason) if reason == TOO_MANY => return Err(too_large(path, TOO_MANY)),
            Err(reason) => return Err(spoilt(&format!("variable {}: {reason}", variable.name))),
        }
    }
    Ok(found.table())
}

fn one(file: &ClassicFile, variable: &NcVariable, found: &mut Found) -> std::result::Result<(), String> {
    let path = std::slice::from_ref(&variable.name);
    let elements = variable.num_elements().map_err(|e| e.to_string())?;
    if elements > MAX_VALUES as u64 {
        return Err(TOO_MANY.into());
    }
    if variable.dtype == NcType::Char {
        if variable.ndim() <= 1 && elements < LONGEST_TEXT {
            found.text(path, file.read_variable_as_string(&variable.name).map_err(|e| e.to_string())?);
        }
        return Ok(());
    }
    // Row-major rows x columns are column-major columns x rows.
    let (rows, columns) = match variable.shape()[..] {
        [] => (1, 1),
        [n] => (n as usize, 1),
        [a, b] => (b as usize, a as usize),
        _ => {
            found.leave_out(path, "it has more than two dimensions");
            return Ok(());
        }
    };
    let values = file.read_variable_as_f64(&variable.name).map_err(|e| e.to_string())?;
    let mut values = values.into_raw_vec_and_offset().0;
    let text = |name: &str| variable.attribute(name).and_then(|a| a.value.as_string());
    // The classic formats know no numbers without sign but by this attribute (NetCDF Users Guide, appendix A).
    let unsigned = text("_Unsigned").is_some_and(|told| told.trim() == "true");
    let wrap = unsigned.then(|| variable.dtype.size().ok()).flatten().map(|size| 2_f64.powi(8 * size as i32));
    let sign_off = |x: &mut f64| match wrap {
        Some(wrap) if *x < 0.0 => *x += wrap,
        _ => {}
    };
    values.iter_mut().for_each(sign_off);
    let numbers = |name: &str| {
        let mut numbers = variable.attribute(name)?.value.as_f64_vec()?;
        let packed = !matches!(name, "scale_factor" | "add_offset");
        numbers.iter_mut().filter(|_| packed).for_each(sign_off);
        Some(numbers)
    };
    Packing::of(numbers, never_written(&variable.dtype)).unpack(&mut values);
    if let Some(unit) = text("units").or_else(|| text("unit")) {
        let time = cf::since(&unit);
        if time.is_some() {
            cf::count_from_first(&mut values);
            found.times.push(path.to_vec());
        }
        found.units.insert(path.to_vec(), time.unwrap_or(&unit).to_owned());
    }
    found.matrix(path, rows, columns, values).map_err(Into::into)
}

/// What stands where nothing was written, unless the variable says otherwise (NetCDF Users Guide, `netcdf.h`). Numbers
/// of one and two bytes have none that could not be a value.
fn never_written(kind: &NcType) -> Option<f64> {
    match kind {
        NcType::Float => Some(f64::from(9.969_21e36_f32)),
        NcType::Double => Some(9.969_209_968_386_869e36),
        NcType::Int => Some(-2_147_483_647.0),
        _ => None,
    }
}
