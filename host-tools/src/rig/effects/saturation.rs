//! Saturation of the main flux, φ = x g(x).
//!
//! Generalised Froelich g = [1 + (|x|/x_s)^n]^(-1/n) with n = 2.6, the knee of real gapped iron, or Langevin g = 3
//! (coth y − 1/y)/y, y = x/a, softer. x_s and a follow from the flux lost at the nominal peak current, against the line
//! through the origin. K and L_m are scaled so that the nameplate stays true. Valid for any current; remanence and
//! hysteresis are effects of their own.

use super::Effect;
use crate::rig::Sizes;
use crate::rig::parts::FluxLaw;

/// The effect.
pub const EFFECT: Effect = Effect {
    id: "saturation",
    what: "saturation of the main flux: less back-EMF and torque at high current, and less inductance",
    size: "fraction of the linear flux lost at nominal peak current",
    unit: "",
    forms: &["froelich", "langevin"],
    universal: Sizes::new(0.35, 0.02, 0.7),
    pm_dc: None,
    install: |size, form, rig| {
        let peak = rig.motor.nameplate.peak_current_a;
        rig.flux_laws.push(if form == "langevin" { langevin(size, peak) } else { froelich(size, peak) });
    },
};

/// Exponent of the generalised Froelich knee.
const SHARPNESS: f64 = 2.6;

fn froelich(lost: f64, peak: f64) -> Box<dyn FluxLaw> {
    let x_s = peak / ((1.0 - lost).powf(-SHARPNESS) - 1.0).powf(1.0 / SHARPNESS);
    Box::new(move |x: f64| (1.0 + (x / x_s).powf(SHARPNESS)).powf(-1.0 / SHARPNESS))
}

fn langevin(lost: f64, peak: f64) -> Box<dyn FluxLaw> {
    // The loss grows with y without end towards 1: bisection cannot miss.
    let (mut low, mut high) = (0.0, 1e3);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if 1.0 - chord(middle) < lost {
            low = middle;
        } else {
            high = middle;
        }
    }
    let a = peak / low;
    Box::new(move |x: f64| chord(x / a))
}

/// 3 (coth y − 1/y)/y; by its series near zero, where the closed form cancels.
fn chord(y: f64) -> f64 {
    let q = y * y;
    if y < 0.1 { 1.0 - q / 15.0 + 2.0 * q * q / 315.0 } else { 3.0 * (1.0 / y.tanh() - 1.0 / y) / y }
}
