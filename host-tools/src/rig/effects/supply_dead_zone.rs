//! Dead zone of a converter or amplifier: the motor gets sign(u) max(|u| − d, 0), the recording shows the command u.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "supply_dead_zone",
    what: "dead zone of the converter, and the recorded voltage is the command",
    size: "half width of the dead zone",
    unit: "V",
    forms: &[],
    universal: Sizes::new(3.0, 0.2, 30.0),
    pm_dc: Sizes::new(1.0, 0.05, 8.0),
    install: |size, _, rig| {
        rig.converter = Some(Box::new(move |u: f64, _: f64| (u.abs() - size).max(0.0).copysign(u)));
    },
};
