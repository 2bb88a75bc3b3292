//! HDF5, NetCDF-4 and MATLAB 7.3 (which are HDF5 inside), decoded by hdf5-reader.
//!
//! Every numeric data set of one or two dimensions becomes a column (or several), every field of a table (compound
//! type) one. Attributes `unit`, `units` give the unit; those by which values are packed or missing are those of
//! [`super::cf`]. A fill value that the file itself declares, other than zero, marks what was never written.
//! Scalar data sets and attributes of groups are metadata. pandas' two layouts (fixed and table) give its columns.
//!
//! A data set whose encoding the decoder does not know is left out, and said so; one that is damaged refuses the file.

mod header;
mod lzf;
mod mapped;
mod simulink;

use std::collections::BTreeMap;
use std::path::Path;

use hdf5_reader::error::Error as Hdf5Error;
use hdf5_reader::group::Group;
use hdf5_reader::messages::datatype::CompoundField;
use hdf5_reader::{Attribute, ByteOrder, Dataset, Datatype, FilterRegistry, Hdf5File, OpenOptions};

use super::arrays::{Found, TOO_MANY};
use super::cf::{self, Packing};
use super::damage::{damaged, too_large};
use super::table::{MAX_VALUES, Table};
use crate::error::{Error, Result};
use mapped::Piece;

/// Groups nest; damaged files nest without end.
const DEEPEST: usize = 16;
/// More data sets than this are no recording.
const MOST: usize = 4096;
/// Longest text that is kept, letters.
const LONGEST_TEXT: u64 = 4096;

/// Fields of a complex number, as NumPy's users and MATLAB write it.
const COMPLEX: [[&str; 2]; 2] = [["r", "i"], ["real", "imag"]];

type Walked<T> = std::result::Result<T, String>;

/// Reads an HDF5 file under the name of the format that the user knows.
///
/// # Errors
/// Damaged content, too many values.
pub fn read(path: &Path, format: &str) -> Result<Table> {
    let mut found = Found::default();
    let (root, taken) = open(path, format, &mut found)?;
    let mut walk = Walk { found, taken, root: root.clone(), index: None, left: MOST };
    match walk.group(&root, &[], 0) {
        Ok(()) => Ok(walk.found.table()),
        Err(reason) if reason == TOO_MANY => Err(too_large(path, TOO_MANY)),
        Err(reason) => Err(damaged(path, format, reason)),
    }
}

/// What is taken out of headers, since the decoder does not know it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Attributes,
    Layout,
    Object,
}

/// What was taken out.
#[derive(Default)]
struct Taken {
    /// Attributes, by the path of their object.
    attributes: BTreeMap<Vec<String>, Vec<String>>,
    /// Pieces of virtual data sets, by the address of those.
    pieces: BTreeMap<u64, Vec<Piece>>,
}

/// Opens a file without what keeps the decoder from listing its content, and says what that is.
fn open(path: &Path, format: &str, found: &mut Found) -> Result<(Group, Taken)> {
    let (mut taken, mut done) = (Taken::default(), Vec::new());
    loop {
        let mut bytes = load(path)?;
        for &(base, address, part) in &done {
            if let Some(bytes) = bytes.get_mut(base..) {
                take_out(bytes, address, part);
            }
        }
        let file = Hdf5File::from_vec_with_options(bytes, options()).map_err(|e| damaged(path, format, e))?;
        let root = file.root_group().map_err(|e| damaged(path, format, e))?;
        let Some(unknown) = Unknown::first(&root, &[], 0, &mut { MOST }).filter(|_| done.len() < MOST) else {
            return Ok((root, taken));
        };
        let base = file.superblock().base_address;
        drop((root, file));
        let (Ok(base), Ok(address)) = (usize::try_from(base), usize::try_from(unknown.address)) else {
            return Err(damaged(path, format, unknown.reason));
        };
        let mut bytes = load(path)?;
        let mut take = |part: Part| {
            let place = (base, address, part);
            let out = bytes.get_mut(base..).filter(|_| !done.contains(&place));
            let out = out.and_then(|bytes| take_out(bytes, address, part));
            done.extend(out.is_some().then_some(place));
            out
        };
        if let Some(Out::Attributes(names)) = take(Part::Attributes) {
            let at = if unknown.path.is_empty() { "/".into() } else { unknown.path.join("/") };
            for name in &names {
                found
                    .warnings
                    .push(format!("attribute '{name}' of '{at}' is left out: its type is stored apart from it"));
            }
            taken.attributes.insert(unknown.path, names);
            continue;
        }
        let mut reason = unknown.reason;
        match take(Part::Layout) {
            Some(Out::Pieces(Ok(pieces))) => {
                taken.pieces.insert(unknown.address, pieces);
                continue;
            }
            Some(Out::Pieces(Err(told))) => reason = told.into(),
            _ => {}
        }
        if unknown.is_group || take(Part::Object).is_none() {
            return Err(damaged(path, format, reason));
        }
        found.leave_out(&unknown.path, &reason);
    }
}

/// Reads into memory, not mapped: a file that is cut short by another program while being read is then an error.
fn load(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).map_err(|e| Error::io(path, e))
}

/// What came out of a header.
enum Out {
    Attributes(Vec<String>),
    Pieces(std::result::Result<Vec<Piece>, &'static str>),
    Object,
}

fn take_out(bytes: &mut [u8], address: usize, part: Part) -> Option<Out> {
    match part {
        Part::Attributes => {
            let names = header::without_shared_attributes(bytes, address);
            (!names.is_empty()).then_some(Out::Attributes(names))
        }
        Part::Layout => {
            let layout = header::without_virtual_layout(bytes, address)?;
            Some(Out::Pieces(mapped::pieces(bytes, &layout)))
        }
        Part::Object => header::without_messages(bytes, address).then_some(Out::Object),
    }
}

fn options() -> OpenOptions {
    const MOST_BYTES: usize = MAX_VALUES * 8;
    let mut filters = FilterRegistry::new();
    filters.register(lzf::FILTER, Box::new(|filter, packed, _| lzf::unpack(filter, packed, MOST_BYTES)));
    OpenOptions::default()
        .with_max_read_bytes(MOST_BYTES)
        .with_max_chunk_bytes(MOST_BYTES)
        .with_filter_registry(filters)
}

/// An object whose header the decoder does not know.
struct Unknown {
    path: Vec<String>,
    address: u64,
    reason: String,
    /// It is the group itself, not a member.
    is_group: bool,
}

impl Unknown {
    /// The first one in a group.
    fn first(group: &Group, path: &[String], depth: usize, left: &mut usize) -> Option<Self> {
        *left = left.checked_sub(1)?;
        let error = match group.member_names() {
            Ok((groups, _)) => {
                return groups.iter().filter(|_| depth < DEEPEST).find_map(|name| {
                    let inner = group.group(name).ok()?;
                    Self::first(&inner, &[path, std::slice::from_ref(name)].concat(), depth + 1, left)
                });
            }
            Err(error) => error,
        };
        // The decoder tells the member and its place in words alone.
        let member = match &error {
            Hdf5Error::Context { path, .. } => {
                path.strip_prefix("child '").and_then(|rest| rest.rsplit_once("' at 0x"))
            }
            _ => None,
        };
        let member = member.and_then(|(name, at)| Some((name.to_owned(), u64::from_str_radix(at, 16).ok()?)));
        let Failure::Unknown(reason) = Failure::from(error) else { return None };
        let (mut path, is_group) = (path.to_vec(), member.is_none());
        let address = match member {
            Some((name, address)) => {
                path.push(name);
                address
            }
            None => group.address(),
        };
        Some(Self { path, address, reason, is_group })
    }
}

struct Walk {
    found: Found,
    taken: Taken,
    root: Group,
    /// Name of the index of pandas' tables in the group.
    index: Option<String>,
    left: usize,
}

impl Walk {
    fn group(&mut self, group: &Group, path: &[String], depth: usize) -> Walked<()> {
        if depth > DEEPEST {
            return Err("groups are nested too deeply".into());
        }
        let attributes = group.attributes().unwrap_or_default();
        let class = attributes.iter().find(|a| a.name == "CLASS").and_then(text_of);
        // PyTables keeps indexes of its tables there.
        if matches!(class.as_deref(), Some("TINDEX" | "INDEX")) {
            return Ok(());
        }
        // What pandas and PyTables say about their own layout is no metadata of the recording.
        let own_layout = attributes.iter().any(|a| a.name == "pandas_type" || a.name == "PYTABLES_FORMAT_VERSION");
        for attribute in attributes.iter().filter(|_| !own_layout) {
            if let Some(text) = text_of(attribute) {
                let mut path = path.to_vec();
                path.push(attribute.name.clone());
                if !["MATLAB_", "H5", "_NC", "CLASS", "TITLE", "VERSION"].iter().any(|p| attribute.name.starts_with(p))
                {
                    self.found.text(&path, text);
                }
            }
        }
        let about = attributes.iter().find(|a| a.name == "info").filter(|_| own_layout).and_then(text_of);
        self.index = about.and_then(|about| pickled_name_of_index(&about));
        let (groups, datasets) = group.member_names().map_err(|e| e.to_string())?;
        for name in &datasets {
            // pandas' fixed layout: the names of the columns of a block stand beside it.
            let Some(block) = name.strip_suffix("_items").filter(|_| own_layout) else { continue };
            if let Some(names) = group.dataset(name).ok().and_then(|d| d.read_strings().ok()) {
                let mut values = path.to_vec();
                values.push(format!("{block}_values"));
                self.found.names.insert(values, names);
            }
        }
        let signals = simulink::signals(&self.root, group, &datasets);
        for (name, dataset) in signals.columns {
            self.member(Ok(dataset), path, name)?;
        }
        for name in datasets {
            let shown = signals.label.clone().filter(|_| name == simulink::VALUES).unwrap_or_else(|| name.clone());
            self.member(group.dataset(&name).map_err(Failure::from), path, shown)?;
        }
        for name in groups {
            self.left = self.left.checked_sub(1).ok_or("there are too many groups")?;
            // MATLAB keeps the content of cell arrays and its own tables there.
            if name.starts_with('#') {
                continue;
            }
            let inner = group.group(&name).map_err(|e| e.to_string())?;
            let mut path = path.to_vec();
            path.push(name);
            self.group(&inner, &path, depth + 1)?;
        }
        Ok(())
    }

    /// A data set of a group, under a name.
    fn member(&mut self, dataset: std::result::Result<Dataset, Failure>, path: &[String], name: String) -> Walked<()> {
        self.left = self.left.checked_sub(1).ok_or("there are too many data sets")?;
        let path = [path, &[name]].concat();
        match dataset.and_then(|dataset| self.dataset(&dataset, &path)) {
            Ok(()) => Ok(()),
            Err(Failure::Unknown(reason)) => {
                self.found.leave_out(&path, &reason);
                Ok(())
            }
            Err(Failure::Damaged(reason)) => Err(reason),
        }
    }

    fn dataset(&mut self, dataset: &Dataset, path: &[String]) -> std::result::Result<(), Failure> {
        let shape = dataset.shape().to_vec();
        let elements = dataset.num_elements()?;
        if elements > MAX_VALUES as u64 {
            return Err(Failure::Damaged(TOO_MANY.into()));
        }
        if self.taken.pieces.values().flatten().any(|piece| piece.path == path) {
            // It comes as part of another one.
            return Ok(());
        }
        let changes = |name: &&String| cf::CHANGES_VALUES.contains(&name.as_str());
        if let Some(name) = self.taken.attributes.get(path).and_then(|names| names.iter().find(changes)) {
            return Err(Failure::Unknown(format!("without its attribute '{name}' its numbers are no values")));
        }
        let attribute = |name: &str| dataset.attribute(name).ok().and_then(|a| text_of(&a));
        let kind = dataset.dtype();
        if matches!(kind, Datatype::String { .. } | Datatype::VarLen { .. }) {
            if elements == 1 && matches!(kind, Datatype::String { .. }) {
                self.found.text(path, dataset.read_string()?);
            }
            return Ok(());
        }
        if attribute("NAME").is_some_and(|name| name.starts_with("This is a netCDF dimension but not")) {
            return Ok(());
        }
        let class = attribute("MATLAB_class");
        if dataset.attribute("MATLAB_object_decode").is_ok() {
            let class = class.unwrap_or_default();
            return Err(Failure::Unknown(format!(
                "it is a MATLAB object ({class}): save its time and data as arrays, with save -v7.3 or -v7"
            )));
        }
        // MATLAB marks an empty array by a data set that holds the size instead.
        if elements == 0 || dataset.attribute("MATLAB_empty").is_ok() {
            return Ok(());
        }
        if let Datatype::Compound { size, fields } = kind {
            return self.compound(dataset, path, *size as usize, fields);
        }
        // Row-major rows x columns are column-major columns x rows.
        let (rows, columns) = match shape.as_slice() {
            [] => (1, 1),
            [n] => (*n as usize, 1),
            [a, b] => (*b as usize, *a as usize),
            _ => return Err(Failure::Unknown("it has more than two dimensions".into())),
        };
        if matches!(kind, Datatype::Reference { .. }) {
            return Ok(());
        }
        let mut values = match self.taken.pieces.get(&dataset.address()) {
            Some(pieces) => self.gather(dataset, pieces)?,
            None => numbers(dataset)?,
        };
        if class.as_deref() == Some("char") {
            if elements < LONGEST_TEXT {
                self.found.text(path, values.iter().filter_map(|&c| char::from_u32(c as u32)).collect());
            }
            return Ok(());
        }
        packing(dataset).unpack(&mut values);
        let mut path = path.to_vec();
        if let Some(name) = path.last_mut().filter(|name| name.starts_with("axis") || *name == "index") {
            // pandas' index, which may have a name of its own ("N." is none).
            if let Some(own) = attribute("name").filter(|own| attribute("kind").is_some() && own != "N.") {
                *name = own;
            }
        }
        let told = attribute("kind").or_else(|| attribute("value_type"));
        if let Some(factor) = told.as_deref().and_then(seconds_of_kind) {
            values = self.instants(&path, dataset.read_raw_bytes()?.chunks_exact(8), kind, factor);
        }
        let path = &path[..];
        if let Some(unit) = ["unit", "units", "Unit", "Units"].into_iter().find_map(attribute) {
            let time = cf::since(&unit);
            if time.is_some() {
                cf::count_from_first(&mut values);
                self.found.times.push(path.to_vec());
            }
            self.found.units.insert(path.to_vec(), time.unwrap_or(&unit).to_owned());
        }
        self.found.matrix(path, rows, columns, values).map_err(|e| Failure::Damaged(e.into()))
    }

    /// The values of a virtual data set; what no piece holds is missing.
    fn gather(&self, dataset: &Dataset, pieces: &[Piece]) -> std::result::Result<Vec<f64>, Failure> {
        let elements = usize::try_from(dataset.num_elements()?).unwrap_or(usize::MAX).min(MAX_VALUES);
        let mut values = vec![f64::NAN; elements];
        for piece in pieces {
            let [groups @ .., name] = &piece.path[..] else { continue };
            let mut group = self.root.clone();
            for name in groups {
                group = group.group(name)?;
            }
            let source = group.dataset(name)?;
            if self.taken.pieces.contains_key(&source.address()) {
                return Err(Failure::Unknown("it is put together of data sets that are put together (virtual)".into()));
            }
            let held = numbers(&source)?;
            let places = piece.places(source.shape(), dataset.shape());
            for (from, to) in places.ok_or_else(|| Failure::Damaged("a virtual data set has other sizes".into()))? {
                if let (Some(value), Some(place)) = (held.get(from), values.get_mut(to)) {
                    *place = *value;
                }
            }
        }
        Ok(values)
    }

    /// A table: each field a column, or several where it is itself a row of values.
    fn compound(
        &mut self,
        dataset: &Dataset,
        path: &[String],
        size: usize,
        fields: &[CompoundField],
    ) -> std::result::Result<(), Failure> {
        let bytes = dataset.read_raw_bytes()?;
        if let [real, imaginary] = fields
            && COMPLEX.contains(&[&*real.name, &*imaginary.name])
            && let (Some(number), Some(of_imaginary)) = (number(&real.datatype), number(&imaginary.datatype))
        {
            let part = |row: &[u8], field: &CompoundField, number: fn(&[u8]) -> f64| {
                row.get(field.byte_offset as usize..).map_or(f64::NAN, number)
            };
            if bytes.chunks_exact(size).any(|row| part(row, imaginary, of_imaginary) != 0.0) {
                return Err(Failure::Unknown("it is complex: give real samples".into()));
            }
            let values: Vec<f64> = bytes.chunks_exact(size).map(|row| part(row, real, number)).collect();
            return self.found.matrix(path, values.len(), 1, values).map_err(|e| Failure::Damaged(e.into()));
        }
        let attribute = |name: &str| dataset.attribute(name).ok().and_then(|a| text_of(&a));
        for field in fields {
            let mut path = path.to_vec();
            let index = self.index.clone().filter(|_| field.name == "index");
            path.push(index.unwrap_or_else(|| field.name.clone()));
            let (kind, width) = match &field.datatype {
                Datatype::Array { base, dims } => (&**base, dims.iter().product::<u64>() as usize),
                kind => (kind, 1),
            };
            let from = field.byte_offset as usize;
            let (Some(number), Ok(step)) = (number(kind), hdf5_reader::dtype_element_size(kind)) else {
                self.found.leave_out(&path, "it holds no real numbers");
                continue;
            };
            if from + width * step > size || width == 0 {
                return Err(Failure::Damaged("a field of a table lies outside its row".into()));
            }
            // Names of the columns of a block, as pandas' tables keep them.
            let names = attribute(&format!("{}_kind", field.name)).map(|text| pickled_names(&text)).unwrap_or_default();
            for k in 0..width {
                let at = from + k * step;
                let mut values: Vec<f64> = bytes.chunks_exact(size).map(|row| number(&row[at..at + step])).collect();
                let mut path = path.clone();
                if width > 1 || names.len() == 1 {
                    path.push(names.get(k).cloned().unwrap_or_else(|| format!("{}_{}", field.name, k + 1)));
                }
                // That of an index is its kind, that of other columns the type that they had.
                let told = ["kind", "dtype"].map(|about| attribute(&format!("{}_{about}", field.name)));
                if let Some(factor) = told.iter().flatten().find_map(|told| seconds_of_kind(told)).filter(|_| step == 8)
                {
                    values = self.instants(&path, bytes.chunks_exact(size).map(|row| &row[at..at + 8]), kind, factor);
                }
                let rows = values.len();
                self.found.matrix(&path, rows, 1, values).map_err(|e| Failure::Damaged(e.into()))?;
            }
        }
        Ok(())
    }

    /// Counts since 1970 of eight bytes become seconds since the first one. (As doubles they would be a quarter of a
    /// microsecond apart.)
    fn instants<'a>(
        &mut self,
        path: &[String],
        counts: impl Iterator<Item = &'a [u8]>,
        kind: &Datatype,
        factor: f64,
    ) -> Vec<f64> {
        let big = matches!(kind, Datatype::FixedPoint { byte_order: ByteOrder::BigEndian, .. });
        let count = |bytes: &[u8]| {
            let bytes = bytes.first_chunk().copied().unwrap_or_default();
            if big { i64::from_be_bytes(bytes) } else { i64::from_le_bytes(bytes) }
        };
        let mut first = None;
        let since_first = |count: i64| match count {
            // "Not a time".
            i64::MIN => f64::NAN,
            _ => count.saturating_sub(*first.get_or_insert(count)) as f64 * factor,
        };
        self.found.units.insert(path.to_vec(), "s".into());
        self.found.times.push(path.to_vec());
        counts.map(count).map(since_first).collect()
    }
}

/// Why a data set is not read.
enum Failure {
    /// Its encoding is not known.
    Unknown(String),
    /// Its content does not hold.
    Damaged(String),
}

impl From<Hdf5Error> for Failure {
    fn from(error: Hdf5Error) -> Self {
        use Hdf5Error as E;
        let mut inner = &error;
        while let E::Context { source, .. } = inner {
            inner = source;
        }
        match inner {
            E::UnsupportedFilter(_)
            | E::UnsupportedEncoding(_)
            | E::UnsupportedDatatypeClass(_)
            | E::UnsupportedLayoutClass(_)
            | E::UnsupportedLayoutVersion(_)
            | E::UnsupportedChunkIndexType(_)
            | E::UnsupportedFillValueVersion(_)
            | E::UnsupportedAttributeVersion(_)
            | E::UnsupportedLinkType(_)
            | E::DatasetNotFound(_)
            | E::TypeMismatch { .. } => {
                // Numbers of the format's description say little to whoever reads them.
                // The decoder tells a filter by its number in a text alone; it decides nothing but the words.
                let known = match inner {
                    E::UnsupportedFilter(text) if text.ends_with("32001") => Some("it is packed by Blosc"),
                    E::UnsupportedFilter(text) if text.ends_with("32026") => Some("it is packed by Blosc 2"),
                    E::UnsupportedFilter(text) if text.ends_with("32015") => Some("it is packed by Zstandard"),
                    E::UnsupportedFilter(text) if text.ends_with(" 307") => Some("it is packed by bzip2"),
                    E::UnsupportedLayoutClass(3) => Some("it is put together of other data sets (virtual)"),
                    _ => None,
                };
                Self::Unknown(known.map_or_else(|| error.to_string(), ToOwned::to_owned))
            }
            _ => Self::Damaged(error.to_string()),
        }
    }
}

/// The numbers of a data set as they stand there.
fn numbers(dataset: &Dataset) -> std::result::Result<Vec<f64>, Failure> {
    let Some(number) = number(dataset.dtype()) else {
        return Err(Failure::Unknown("it holds no real numbers".into()));
    };
    let (size, bytes) = (dataset.raw_element_size()?, dataset.read_raw_bytes()?);
    Ok(bytes.chunks_exact(size.max(1)).map(number).collect())
}

/// How the values of a data set are packed.
fn packing(dataset: &Dataset) -> Packing {
    let numbers = |name: &str| -> Option<Vec<f64>> {
        let attribute = dataset.attribute(name).ok()?;
        let (number, size) = (number(&attribute.datatype)?, hdf5_reader::dtype_element_size(&attribute.datatype).ok()?);
        Some(attribute.raw_data.chunks_exact(size.max(1)).map(number).collect())
    };
    let declared = dataset.fill_value().and_then(|fill| Some((number(dataset.dtype())?)(fill.value.as_deref()?)));
    Packing::of(numbers, declared)
}

/// How a value of a type is read, if it is a real number.
fn number(kind: &Datatype) -> Option<fn(&[u8]) -> f64> {
    macro_rules! read {
        ($order:expr, $t:ty, $convert:expr) => {
            match $order {
                ByteOrder::LittleEndian => {
                    |b: &[u8]| b.first_chunk().map_or(f64::NAN, |b| $convert(<$t>::from_le_bytes(*b)))
                }
                ByteOrder::BigEndian => {
                    |b: &[u8]| b.first_chunk().map_or(f64::NAN, |b| $convert(<$t>::from_be_bytes(*b)))
                }
            }
        };
    }
    Some(match kind {
        // Booleans of h5py are bytes with names.
        Datatype::Enum { base, .. } => return number(base),
        Datatype::FloatingPoint { size: 2, byte_order } => read!(byte_order, half::f16, half::f16::to_f64),
        Datatype::FloatingPoint { size: 4, byte_order } => read!(byte_order, f32, f64::from),
        Datatype::FloatingPoint { size: 8, byte_order } => read!(byte_order, f64, |x| x),
        Datatype::FixedPoint { size: 1, signed: true, byte_order } => read!(byte_order, i8, f64::from),
        Datatype::FixedPoint { size: 1, byte_order, .. } => read!(byte_order, u8, f64::from),
        Datatype::FixedPoint { size: 2, signed: true, byte_order } => read!(byte_order, i16, f64::from),
        Datatype::FixedPoint { size: 2, byte_order, .. } => read!(byte_order, u16, f64::from),
        Datatype::FixedPoint { size: 4, signed: true, byte_order } => read!(byte_order, i32, f64::from),
        Datatype::FixedPoint { size: 4, byte_order, .. } => read!(byte_order, u32, f64::from),
        Datatype::FixedPoint { size: 8, signed: true, byte_order } => read!(byte_order, i64, |x| x as f64),
        Datatype::FixedPoint { size: 8, byte_order, .. } => read!(byte_order, u64, |x| x as f64),
        _ => return None,
    })
}

/// Seconds per count of an index that pandas calls a time.
fn seconds_of_kind(kind: &str) -> Option<f64> {
    let rest = kind.strip_prefix("datetime64").or_else(|| kind.strip_prefix("timedelta64"))?;
    Some(match rest.trim_matches(['[', ']']) {
        "s" => 1.0,
        "ms" => 1e-3,
        "us" => 1e-6,
        // Nanoseconds unless told.
        _ => 1e-9,
    })
}

/// The texts of a list that Python has pickled as text (protocol 0).
fn pickled_names(text: &str) -> Vec<String> {
    let mut names = Vec::new();
    for line in text.lines() {
        let line = line.trim_start_matches("(lp0").trim_start_matches('a');
        if let Some(name) = line.strip_prefix('V') {
            names.push(name.to_owned());
        } else if let Some(name) = line.strip_prefix("S'") {
            names.push(name.trim_end_matches('\'').to_owned());
        }
    }
    names
}

/// The name of the index in what pandas has pickled about a table (protocol 0): the text behind that key.
fn pickled_name_of_index(text: &str) -> Option<String> {
    let mut lines = text.lines().skip_while(|line| !line.ends_with("Vindex_name"));
    // The key itself, and where the pickle has put it.
    lines.find_map(|line| line.strip_prefix('V').filter(|name| *name != "index_name")).map(ToOwned::to_owned)
}

fn text_of(attribute: &Attribute) -> Option<String> {
    if let Ok(text) = attribute.read_string() {
        return Some(text);
    }
    attribute.read_as_f64().ok().map(|x| x.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_pandas_columns() {
        // pickle.dumps(['t', 'au'], protocol=0) of Python 3.
        assert_eq!(pickled_names("(lp0\nVt\np1\naVau\np2\na."), ["t", "au"]);
        // As a frame with an index `t` has it.
        assert_eq!(pickled_name_of_index("(dp0\nVindex\np6\n(dp7\nVindex_name\np8\nVt\np9\nss."), Some("t".into()));
        assert_eq!(seconds_of_kind("datetime64[us]"), Some(1e-6));
        assert_eq!(seconds_of_kind("integer"), None);
    }
}
