//! The hybrid model: the physical model, and in parallel a learned correction of its current.
//!
//! ```text
//! u ──► physical model ──┬─ î ────────────────(+)──► corrected current
//!  │                     ├─ ω̂ ─────► ANFIS ────┘
//!  └─────────────────────┴─ î ─────►
//! ```
//! The inputs are the supply voltage, the *modelled* current and the *modelled* speed. Nothing that was measured but
//! the voltage gets in: a correction that saw the measured current or speed would learn to follow a faulty motor. (The
//! modelled speed is taken rather than the measured one, so that neither a bad tacho nor a brake changes what is
//! expected of the current.)
//!
//! Source: A. Rakar, Đ. Juričić, 2004, section 2.3 and figure 5.

use crate::anfis::{Anfis3x3, Correction};
use crate::motor::{Constraints, State};

/// The modelled current and speed with the correction at a voltage (V), and the correction's validity. Where the
/// current is imposed (an open supply) there is nothing to correct.
#[inline(always)]
pub fn corrected(
    correction: &Anfis3x3,
    voltage: f32,
    modelled: State<f32>,
    constraints: Constraints<f32>,
) -> (State<f32>, f32) {
    if constraints.current.is_some() {
        return (modelled, 1.0);
    }
    let learned = learned(correction, voltage, modelled.current, modelled.speed);
    (State { current: modelled.current + learned.value, speed: modelled.speed }, learned.validity)
}

/// By numbers, not by references, which go through memory.
#[inline(never)]
fn learned(correction: &Anfis3x3, voltage: f32, current: f32, speed: f32) -> Correction<f32> {
    correction.correct([voltage, current, speed])
}
