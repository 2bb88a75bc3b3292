//! Simulink's "structure with time" in MATLAB 7.3: an array of structures is a group whose data sets hold references to
//! the fields of its elements, which stand in the group `#refs#`.

use hdf5_reader::error::Result;
use hdf5_reader::group::Group;
use hdf5_reader::reference::read_object_references;
use hdf5_reader::{Dataset, Datatype};

/// Field that holds the samples of a signal.
pub const VALUES: &str = "values";
/// Fields that tell its name: its own, or that of the block that it comes from.
const NAMES: [&str; 2] = ["label", "blockName"];
/// MATLAB's own group of what is referred to.
const REFERRED: &str = "#refs#";
/// More signals than this are no recording.
const MOST: usize = 1024;
/// Longest name, letters.
const LONGEST: u64 = 4096;

/// The signals of a group.
#[derive(Default)]
pub struct Signals {
    /// Name and samples of each, where there are several.
    pub columns: Vec<(String, Dataset)>,
    /// The name of a single one.
    pub label: Option<String>,
}

/// The signals of a group with these data sets, if it holds any.
pub fn signals(root: &Group, group: &Group, datasets: &[String]) -> Signals {
    let has = |name: &str| datasets.iter().any(|own| own == name);
    if !has(VALUES) || !NAMES.into_iter().any(has) {
        return Signals::default();
    }
    let Ok(values) = group.dataset(VALUES) else { return Signals::default() };
    if !matches!(values.dtype(), Datatype::Reference { .. }) {
        let told = |field: &str| group.dataset(field).ok().and_then(|dataset| last_part(&dataset));
        return Signals { label: NAMES.into_iter().find_map(told), ..Signals::default() };
    }
    let Ok(referred) = root.group(REFERRED) else { return Signals::default() };
    let fields: Vec<Vec<Dataset>> = NAMES.iter().map(|name| elements(&referred, group, name)).collect();
    let named = elements(&referred, group, VALUES).into_iter().take(MOST).enumerate().map(|(k, dataset)| {
        let told = fields.iter().find_map(|field| field.get(k).and_then(last_part));
        (told.unwrap_or_else(|| format!("signal{}", k + 1)), dataset)
    });
    Signals { columns: named.collect(), label: None }
}

/// What the elements of a field refer to.
fn elements(referred: &Group, group: &Group, field: &str) -> Vec<Dataset> {
    let addresses = || -> Result<Vec<u64>> {
        let dataset = group.dataset(field)?;
        read_object_references(&dataset.read_raw_bytes()?, group.offset_size())
    };
    let find = |address: u64| referred.dataset(&referred.child_name_by_address(address).ok()??).ok();
    addresses().unwrap_or_default().into_iter().take(MOST).map_while(find).collect()
}

/// The last part of a name, which may be a path of blocks.
fn last_part(dataset: &Dataset) -> Option<String> {
    let empty = dataset.attribute("MATLAB_empty").is_ok();
    if empty || dataset.num_elements().ok()? > LONGEST || dataset.raw_element_size().ok()? != 2 {
        return None;
    }
    let units: Vec<u16> =
        dataset.read_raw_bytes().ok()?.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
    let text = String::from_utf16_lossy(&units);
    text.rsplit('/').next().map(str::trim).filter(|name| !name.is_empty()).map(ToOwned::to_owned)
}
