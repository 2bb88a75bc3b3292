//! Effects that no recording of voltage, current and speed could separate.

/// Sets of such effects, the default member first.
const CLASSES: &[&[&str]] = &[
    &["saturation", "armature_reaction"],
    &["iron_loss_drag", "stray_load_torque"],
    &["commutation_demagnetisation", "skin_effect"],
];

/// Effects of which any two can take the part of the third while the motor runs on a closed supply: their columns in the
/// voltage balance, K ω, R + K ω and 1, are linearly dependent. A locked rotor or an open supply takes one of them away.
pub const OFFSETS: [&str; 3] = ["remanence", "current_offset", "voltage_offset"];

/// All such sets.
pub fn all() -> &'static [&'static [&'static str]] {
    CLASSES
}

/// The class of an effect, if it shares one.
pub fn class_of(id: &str) -> Option<&'static [&'static str]> {
    CLASSES.iter().copied().find(|class| class.contains(&id))
}

/// Whether two effects are one in the data.
pub fn same(a: &str, b: &str) -> bool {
    a == b || class_of(a).is_some_and(|class| class.contains(&b))
}
