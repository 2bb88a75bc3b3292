//! Units of the parameters of a rotary and of a linear drive.

use crate::recording::Motion;

/// The unit that a parameter has in a drive, from that of a rotary one.
pub fn unit(rotary: &'static str, motion: Motion) -> &'static str {
    match motion {
        Motion::Rotary => rotary,
        Motion::Linear => linear(rotary),
    }
}

/// The linear counterpart of a rotary unit.
fn linear(unit: &'static str) -> &'static str {
    match unit {
        "N m" => "N",
        "N m s/rad" => "N s/m",
        "N m s2/rad2" => "N s2/m2",
        "V s/(rad A)" => "V s/(m A)",
        "V s/rad" => "V s/m",
        "kg m2" => "kg",
        "rad/s" => "m/s",
        "rad" => "m",
        other => other,
    }
}
