//! Voltage measured upstream of an impedance: R_s, and L_s of 1 mH per ohm (a reactance of 0.3 R_s at 50 Hz).

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "supply_impedance",
    what: "voltage measured upstream of an impedance",
    size: "resistance",
    unit: "ohm",
    forms: &[],
    universal: Sizes::new(0.6, 0.05, 5.0),
    pm_dc: Sizes::new(0.3, 0.02, 5.0),
    install: |size, _, rig| {
        rig.supply_impedance.0 += size;
        rig.supply_impedance.1 += 1e-3 * size;
    },
};
