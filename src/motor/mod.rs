//! The physical model: universal (series) motor and its permanent-magnet sibling.
//!
//! # Equations
//! ```text
//! electrical   u = R i + K φ ω + L di/dt
//! mechanical   J dω/dt = K φ i − s μ0 − μ1 ω − μ2 ω|ω|          s = direction of motion
//! flux         φ = i  (series motor)      φ = 1  (permanent magnets)
//! ```
//! For the series motor and ω > 0 these are equations 13 and 14 of A. Rakar, Đ. Juričić: Modelling for fault detection
//! of electric motors, Strojniški vestnik – Journal of Mechanical Engineering, 2004.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | u | supply voltage | V |
//! | i | current | A |
//! | ω | speed | rad/s |
//! | R, L | resistance and inductance, field and armature together | Ω, H |
//! | K | flux coefficient | V s/(rad A), V s/rad |
//! | J | moment of inertia | kg m² |
//! | μ0, μ1, μ2 | dry, viscous, turbulent friction | N m, N m s/rad, N m s²/rad² |
//!
//! # Validity
//! No saturation, no hysteresis, one lumped flux path, constant temperature: what is missing is what the effects of
//! [`crate::effects`] are for.

mod balance;
mod equations;
mod gradient;
mod parameters;
mod stepper;

pub use balance::{Balance, OperatingPoint, State};
pub use equations::{MAX_TERMS, Memories, Motor, Remembered, Slopes};
pub use gradient::Gradient;
pub use parameters::{BaseParameter, FluxLaw, MAX_EFFECTS, ParameterError, Parameters};
pub use stepper::{Constraints, LIMITS, Snapshot, Stepper};
