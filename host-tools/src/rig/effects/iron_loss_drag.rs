//! Iron loss of the armature as a torque (Jordan): hysteresis P_h ∝ f B^1.6 and eddy currents P_e ∝ (f B)², half each
//! at nominal speed and current; B from the current.

use super::Effect;
use crate::rig::Sizes;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "iron_loss_drag",
    what: "iron loss of the armature brakes the rotor",
    size: "loss at nominal speed and current",
    unit: "W",
    forms: &[],
    universal: Sizes::new(50.0, 5.0, 300.0),
    pm_dc: Sizes::new(1.0, 0.05, 10.0),
    install: |size, _, rig| {
        let (nominal, rms) = (rig.motor.nameplate.speed_rad_s, rig.motor.nameplate.rms_current_a);
        rig.torques.push(Box::new(move |i: f64, omega: f64, _: f64, _: f64| {
            let b = (i / rms).abs();
            // The loss torque of hysteresis does not depend on the speed; it fades where the rotor stands.
            -0.5 * size / nominal * (b.powf(1.6) * (omega / 2.0).tanh() + b * b * omega / nominal)
        }));
    },
};
