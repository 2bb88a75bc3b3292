//! Units of the parameters.

use greyrig::effects::Description;

use super::Kind;
use crate::recording::Motion;

/// The unit of a base parameter or, by the core's name for it, of an effect's parameter.
pub fn unit(name: &str, kind: Kind, motion: Motion) -> &'static str {
    let rotary = motion == Motion::Rotary;
    match name {
        "R" => "ohm",
        "L" => "H",
        "K" => match (kind, rotary) {
            (Kind::Universal, true) => "V s/(rad A)",
            (Kind::Universal, false) => "V s/(m A)",
            (Kind::PmDc, true) => "V s/rad",
            (Kind::PmDc, false) => "V s/m",
        },
        "J" => {
            if rotary {
                "kg m2"
            } else {
                "kg"
            }
        }
        "mu0" => {
            if rotary {
                "N m"
            } else {
                "N"
            }
        }
        "mu1" => {
            if rotary {
                "N m s/rad"
            } else {
                "N s/m"
            }
        }
        "mu2" => {
            if rotary {
                "N m s2/rad2"
            } else {
                "N s2/m2"
            }
        }
        other => {
            if rotary {
                other_unit(other)
            } else {
                linear(other_unit(other))
            }
        }
    }
}

/// Unit of an effect's parameter.
fn other_unit(name: &str) -> &'static str {
    Description::all().flat_map(|d| d.parameters).find(|p| p.name == name).map_or("1", |p| p.unit)
}

/// The linear counterpart of a rotary unit.
fn linear(unit: &'static str) -> &'static str {
    match unit {
        "N m" => "N",
        "N m s/rad" => "N s/m",
        "rad/s" => "m/s",
        "rad" => "m",
        other => other,
    }
}
