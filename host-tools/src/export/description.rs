//! `modelDescription.xml`: what a simulator reads of a unit before it loads it.
//!
//! Sources: Modelica Association, Functional Mock-up Interface Specification, versions 3.0.2 and 2.0.5.

use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};

use super::Version;
use super::units::{Exponents, NAMES};
use super::variables::{Causality, Described};
use crate::error::{Error, Result};
use crate::model::Model;

/// Name of the library, without what the system puts behind it.
pub const IDENTIFIER: &str = "greyrig_fmi";

type Attributes<'a> = Vec<(&'a str, String)>;

/// The description.
///
/// # Errors
/// None that a model could cause.
pub fn text(model: &Model, version: Version, interval_s: f64, variables: &[Described], token: &str) -> Result<String> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    write(&mut xml, model, version, interval_s, variables, token)
        .map_err(|e| Error::usage(format!("the description cannot be written: {e}"), "report this as a bug"))?;
    let mut text = String::from_utf8_lossy(&xml.into_inner()).into_owned();
    text.push('\n');
    Ok(text)
}

type Xml = Writer<Vec<u8>>;

fn empty(xml: &mut Xml, name: &str, attributes: &Attributes) -> io::Result<()> {
    let attributes = attributes.iter().map(|(key, value)| (*key, value.as_str()));
    xml.create_element(name).with_attributes(attributes).write_empty()?;
    Ok(())
}

fn holding(
    xml: &mut Xml,
    name: &str,
    attributes: &Attributes,
    inner: impl FnOnce(&mut Xml) -> io::Result<()>,
) -> io::Result<()> {
    let attributes = attributes.iter().map(|(key, value)| (*key, value.as_str()));
    xml.create_element(name).with_attributes(attributes).write_inner_content(inner)?;
    Ok(())
}

fn write(
    xml: &mut Xml,
    model: &Model,
    version: Version,
    interval_s: f64,
    variables: &[Described],
    token: &str,
) -> io::Result<()> {
    let named = model.motor.as_deref().filter(|name| !name.trim().is_empty());
    let name = named.map_or_else(|| format!("{} motor", model.kind), str::to_owned);
    let token_key = match version {
        Version::Three => "instantiationToken",
        Version::Two => "guid",
    };
    let head = vec![
        ("fmiVersion", version.name().to_owned()),
        ("modelName", name),
        (token_key, token.to_owned()),
        ("description", format!("Grey-box model of a {} motor, stepped by {interval_s} s", model.kind)),
        ("generationTool", format!("greyrig {}", env!("CARGO_PKG_VERSION"))),
        ("variableNamingConvention", "structured".to_owned()),
    ];
    let yes = || "true".to_owned();
    let mut co_simulation =
        vec![("modelIdentifier", IDENTIFIER.to_owned()), ("canHandleVariableCommunicationStepSize", yes())];
    match version {
        Version::Three => {
            co_simulation.push(("canGetAndSetFMUState", yes()));
            co_simulation.push(("fixedInternalStepSize", interval_s.to_string()));
        }
        Version::Two => co_simulation.push(("canGetAndSetFMUstate", yes())),
    }
    let mut units: Vec<&str> = variables.iter().filter_map(|v| v.unit).collect();
    units.sort_unstable();
    units.dedup();

    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    holding(xml, "fmiModelDescription", &head, |xml| {
        empty(xml, "CoSimulation", &co_simulation)?;
        holding(xml, "UnitDefinitions", &Vec::new(), |xml| {
            units.iter().try_for_each(|unit| unit_definition(xml, unit))
        })?;
        holding(xml, "LogCategories", &Vec::new(), |xml| {
            empty(xml, "Category", &vec![("name", "logStatusError".to_owned())])
        })?;
        let experiment = [("startTime", 0.0), ("stopTime", 1.0), ("stepSize", interval_s)];
        empty(xml, "DefaultExperiment", &experiment.map(|(key, value)| (key, value.to_string())).to_vec())?;
        holding(xml, "ModelVariables", &Vec::new(), |xml| {
            variables.iter().try_for_each(|v| variable(xml, version, v))
        })?;
        holding(xml, "ModelStructure", &Vec::new(), |xml| structure(xml, version, variables))
    })
}

fn unit_definition(xml: &mut Xml, unit: &str) -> io::Result<()> {
    let name = vec![("name", unit.to_owned())];
    let Some(exponents) = Exponents::parse(unit) else { return empty(xml, "Unit", &name) };
    let of = NAMES.into_iter().zip(exponents.of).filter(|(_, exponent)| *exponent != 0);
    let of = of.map(|(base, exponent)| (base, exponent.to_string())).collect();
    holding(xml, "Unit", &name, |xml| empty(xml, "BaseUnit", &of))
}

fn variable(xml: &mut Xml, version: Version, v: &Described) -> io::Result<()> {
    let common = vec![
        ("name", v.name.clone()),
        ("valueReference", v.variable.number().to_string()),
        ("description", v.meaning.clone()),
        ("causality", v.causality.name().to_owned()),
        ("variability", v.causality.variability().to_owned()),
    ];
    let mut real: Attributes = Vec::new();
    real.extend(v.unit.map(|unit| ("unit", unit.to_owned())));
    if let Some((least, greatest)) = v.range {
        real.extend([("min", least.to_string()), ("max", greatest.to_string())]);
    }
    real.extend(v.start.map(|start| ("start", start.to_string())));
    match version {
        Version::Three => empty(xml, "Float64", &common.into_iter().chain(real).collect()),
        Version::Two => holding(xml, "ScalarVariable", &common, |xml| empty(xml, "Real", &real)),
    }
}

fn structure(xml: &mut Xml, version: Version, variables: &[Described]) -> io::Result<()> {
    let outputs = variables.iter().enumerate().filter(|(_, v)| v.causality == Causality::Output);
    let outputs: Vec<(usize, u32)> = outputs.map(|(n, v)| (n + 1, v.variable.number())).collect();
    match version {
        Version::Three => ["Output", "InitialUnknown"].into_iter().try_for_each(|name| {
            outputs.iter().try_for_each(|(_, number)| empty(xml, name, &vec![("valueReference", number.to_string())]))
        }),
        Version::Two => ["Outputs", "InitialUnknowns"].into_iter().try_for_each(|name| {
            holding(xml, name, &Vec::new(), |xml| {
                outputs.iter().try_for_each(|(index, _)| empty(xml, "Unknown", &vec![("index", index.to_string())]))
            })
        }),
    }
}
