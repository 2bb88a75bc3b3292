//! A trained network as a TOML file.

use std::path::Path;

use greyrig::anfis::{Firing, Premise, Shape};
use serde::{Deserialize, Serialize};

use super::net::Net;
use crate::error::{Error, Place, Result};
use crate::output;

/// Version of the layout.
pub const FORMAT: u32 = 1;

/// What is in the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Version of the layout.
    pub anfis: u32,
    /// Form of the membership functions.
    pub shape: ShapeName,
    /// Firing operator.
    pub firing: FiringName,
    /// Name of the target.
    pub target: String,
    /// Smallest and largest training target.
    pub output: [f64; 2],
    /// How far outside the box the output fades to zero, as a fraction of the box.
    pub margin: f64,
    /// How it was trained.
    pub training: Training,
    /// The inputs with their membership functions.
    pub input: Vec<Input>,
    /// The rules in the order of their functions, that of the last input varying fastest.
    pub rule: Vec<Rule>,
}

/// Forms by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeName {
    /// Generalised bell.
    Bell,
    /// Gaussian.
    Gaussian,
}

impl From<ShapeName> for Shape {
    fn from(name: ShapeName) -> Self {
        match name {
            ShapeName::Bell => Self::Bell,
            ShapeName::Gaussian => Self::Gaussian,
        }
    }
}

impl From<Shape> for ShapeName {
    fn from(shape: Shape) -> Self {
        match shape {
            Shape::Bell => Self::Bell,
            Shape::Gaussian => Self::Gaussian,
        }
    }
}

/// Operators by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum FiringName {
    /// Product of the memberships.
    Product,
    /// Smallest membership.
    #[value(name = "min")]
    Min,
}

impl From<FiringName> for Firing {
    fn from(name: FiringName) -> Self {
        match name {
            FiringName::Product => Self::Product,
            FiringName::Min => Self::Minimum,
        }
    }
}

impl From<Firing> for FiringName {
    fn from(firing: Firing) -> Self {
        match firing {
            Firing::Product => Self::Product,
            Firing::Minimum => Self::Min,
        }
    }
}

/// Where the network comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Version of the program.
    pub greyrig: String,
    /// Method.
    pub method: String,
    /// Ridge λ.
    pub ridge: f64,
    /// Epochs done.
    pub epochs: usize,
    /// RMS error on the training data.
    pub rmse_trn: f64,
    /// RMS error on the checking data.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rmse_chk: Option<f64>,
}

/// An input.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// Its name.
    pub name: String,
    /// The trained box: smallest and largest value.
    pub range: [f64; 2],
    /// Premise parameters a, b, c of each membership function.
    pub functions: Vec<[f64; 3]>,
}

/// A rule.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rule {
    /// Slope by each input.
    pub slopes: Vec<f64>,
    /// Constant.
    pub constant: f64,
    /// Largest normalised firing strength on any training row.
    pub support: f64,
}

impl File {
    /// The network in the file.
    ///
    /// # Errors
    /// Lists whose lengths do not fit together; `path` is where they are from.
    pub fn net(&self, path: &Path) -> Result<Net> {
        let fail =
            |what: String| Err(Error::input(Place::file(path), what, "write the file again by greyrig anfis fit"));
        let (inputs, functions) = (self.input.len(), self.input.first().map_or(0, |i| i.functions.len()));
        if inputs == 0 || functions == 0 || self.input.iter().any(|i| i.functions.len() != functions) {
            return fail("the inputs do not all have the same number of membership functions".into());
        }
        let rules = u32::try_from(inputs).ok().and_then(|n| functions.checked_pow(n));
        if rules != Some(self.rule.len()) || self.rule.iter().any(|r| r.slopes.len() != inputs) {
            return fail(format!("{} rules do not make a full grid of {inputs} inputs", self.rule.len()));
        }
        Ok(Net {
            shape: self.shape.into(),
            firing: self.firing.into(),
            inputs,
            functions,
            premise: self.input.iter().flat_map(|i| &i.functions).map(|&[a, b, c]| Premise { a, b, c }).collect(),
            consequents: self.rule.iter().flat_map(|r| r.slopes.iter().copied().chain([r.constant])).collect(),
        })
    }

    /// Reads a file.
    ///
    /// # Errors
    /// No such file, or not this layout.
    pub fn load(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
        let file: Self = toml::from_str(&text).map_err(|e| {
            let before = &text[..e.span().map_or(0, |s| s.start.min(text.len()))];
            let line = before.matches('\n').count() + 1;
            let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
            let what = e.message().lines().collect::<Vec<_>>().join(" ");
            Error::input(Place::at(path, line, column), what, "compare with a file that greyrig anfis fit writes")
        })?;
        if file.anfis != FORMAT {
            return Err(Error::input(
                Place::file(path),
                format!("the layout is version {}, known is {FORMAT}", file.anfis),
                "use the greyrig that wrote it",
            ));
        }
        Ok(file)
    }

    /// Writes a file, whole or not at all.
    ///
    /// # Errors
    /// An existing file without `force`; whatever the system refuses.
    pub fn save(&self, path: &Path, force: bool) -> Result<()> {
        let text = toml::to_string(self)
            .map_err(|e| Error::usage(format!("the network cannot be written: {e}"), "report this as a bug"))?;
        output::write_file(path, force, |out| out.write_all(text.as_bytes()))
    }
}
