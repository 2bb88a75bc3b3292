//! A bridge with a dead time of which the command is recorded: the current chooses the diode that conducts, and takes
//! V tanh(i/i_0) of the mean voltage; i_0 = 2 % of the nominal peak current stands for the ripple.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "converter_dead_time",
    what: "converter that loses a voltage with the sign of the current; the command is recorded",
    size: "voltage that is lost",
    unit: "V",
    forms: &[],
    universal: Sizes::new(6.0, 0.5, 20.0),
    pm_dc: Sizes::new(0.8, 0.05, 4.0),
    install: |size, _, rig| {
        let i_0 = 0.02 * rig.motor.nameplate.peak_current_a;
        rig.converter = Some(Box::new(move |command: f64, i: f64| command - size * (i / i_0).tanh()));
    },
};
