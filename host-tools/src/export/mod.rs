//! The model for other simulators: a functional mock-up unit (FMU) for co-simulation, FMI 3.0 or 2.0, or its equations
//! as Modelica text ([`modelica`]).
//!
//! A unit is a zip file. It holds a description ([`description`]), the libraries that a simulator loads ([`library`]),
//! and as resources the block of parameters that the microcontroller gets, too, and the model file. What a library
//! makes of that is in the crate `greyrig-fmi`.

pub mod description;
pub mod library;
pub mod modelica;
mod units;
mod variables;

use std::io::{Cursor, Write};
use std::path::Path;

use greyrig::motor::BaseParameter;
use greyrig::parameters::block::Header;
use greyrig::parameters::{MAX_TEXT, Settings};
use sha2::{Digest, Sha256};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use crate::device::{RIG, parameters};
use crate::error::{Error, Place, Result};
use crate::model::Model;
use library::Library;
pub use variables::{Causality, Described};

/// Version of the interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Version {
    /// FMI 3.0
    #[default]
    #[value(name = "3")]
    Three,
    /// FMI 2.0
    #[value(name = "2")]
    Two,
}

impl Version {
    /// As the standard writes it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Three => "3.0",
            Self::Two => "2.0",
        }
    }
}

/// The interval of the rig, s: that of the microcontroller.
pub fn usual_interval_s() -> f64 {
    1.0 / f64::from(RIG.sample_rate_hz)
}

/// A unit.
#[derive(Debug, Clone)]
pub struct Unit {
    /// Its variables.
    pub variables: Vec<Described>,
    /// By which description and library know each other: a hash of all that it is made from.
    pub token: String,
    /// The zip file.
    pub bytes: Vec<u8>,
}

/// Files of the resources, as `greyrig-fmi` reads them.
const BLOCK: &str = "resources/motor.bin";
const TOKEN: &str = "resources/token.txt";
/// The same for people.
const MODEL: &str = "resources/model.toml";

/// Makes a unit of a model, which is stepped by an interval, s; `path` is where it comes from.
///
/// # Errors
/// A model that cannot be run from a voltage, or not by this interval; no library, or two for the same platform.
pub fn unit(model: &Model, path: &Path, version: Version, interval_s: f64, libraries: &[Library]) -> Result<Unit> {
    require(model, path)?;
    for (n, library) in libraries.iter().enumerate() {
        if libraries[..n].iter().any(|other| other.platform == library.platform) {
            return Err(Error::usage(
                format!("{} is a second library for {}", library.path.display(), library.platform),
                "give one for each platform",
            ));
        }
    }
    let settings = settings(model, path, interval_s)?;
    let payload = parameters::payload(&settings, path)?;
    let block = [&Header::seal(0, &payload).to_bytes()[..], &payload].concat();
    let variables = variables::of(model, &settings);
    let description = |token: &str| description::text(model, version, interval_s, &variables, token);
    let mut hash = Sha256::new();
    hash.update(description("")?);
    hash.update(&block);
    libraries.iter().for_each(|library| hash.update(&library.bytes));
    let token = token(&hash.finalize());
    let folder = |library: &Library| match version {
        Version::Three => library.platform.tuple(),
        Version::Two => library.platform.fmi2(),
    };
    let mut files =
        vec![("modelDescription.xml".to_owned(), description(&token)?.into_bytes()), (BLOCK.to_owned(), block)];
    files.push((TOKEN.to_owned(), format!("{token}\n").into_bytes()));
    files.push((MODEL.to_owned(), model.text()?.into_bytes()));
    for library in libraries {
        let name = format!("binaries/{}/{}{}", folder(library), description::IDENTIFIER, library.platform.suffix());
        files.push((name, library.bytes.clone()));
    }
    let bytes =
        zipped(&files).map_err(|e| Error::usage(format!("the unit cannot be packed: {e}"), "report this as a bug"))?;
    Ok(Unit { variables, token, bytes })
}

/// A voltage drives the whole motor.
fn require(model: &Model, path: &Path) -> Result<()> {
    let missing: Vec<&str> = BaseParameter::POSITIVE
        .into_iter()
        .filter(|parameter| model.base_parameter(*parameter).is_none())
        .map(BaseParameter::name)
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    Err(Error::input(
        Place::file(path),
        format!("the model has no {}, and a voltage alone does not drive it", missing.join(", ")),
        "identify it from recordings that hold the missing side, or give it with --fix",
    ))
}

fn settings(model: &Model, path: &Path, interval_s: f64) -> Result<Settings> {
    if !(interval_s > 0.0 && interval_s.is_finite()) {
        return Err(Error::usage(format!("an interval of {interval_s} s cannot be"), "give --interval such as 1e-4"));
    }
    // What a simulator does not ask for: no detector, and a name only if the block has room for it.
    let motor = model.motor.clone().filter(|name| name.len() <= MAX_TEXT);
    let model = Model { detector: None, motor, ..model.clone() };
    let filter = model.filter.at(interval_s);
    parameters::settings_at(&model, path, filter)
}

/// A hash in the form that the older version of the interface wants.
fn token(hash: &[u8]) -> String {
    let hex: String = hash.iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    format!("{{{}-{}-{}-{}-{}}}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
}

/// The same files make the same bytes: no time is in them.
fn zipped(files: &[(String, Vec<u8>)]) -> zip::result::ZipResult<Vec<u8>> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::default())
        .unix_permissions(0o644);
    for (name, bytes) in files {
        zip.start_file(name.as_str(), options)?;
        zip.write_all(bytes)?;
    }
    Ok(zip.finish()?.into_inner())
}
