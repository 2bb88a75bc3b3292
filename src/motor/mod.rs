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
//! # Example
//! ```
//! use greyrig::motor::{Constraints, FluxLaw, Motor, ParameterError, Parameters, Stepper};
//!
//! // A magnet motor on 24 V, sampled at 10 kHz: R, L, K, J and the friction terms.
//! let values = [2.0, 1e-3, 0.05, 2e-5, 0.001, 8e-6, 0.0];
//! let motor = Motor::build(Parameters::from_values(FluxLaw::PermanentMagnet, values), &[])?;
//! let mut stepper = Stepper::build(motor, 1e-4)?;
//! (0..20_000).for_each(|_| _ = stepper.step(24.0, 24.0, Constraints::FREE));
//!
//! // Steady: K i = μ0 + μ1 ω and u = R i + K ω.
//! let steady = (0.05 * 24.0 / 2.0 - 0.001) / (0.05 * 0.05 / 2.0 + 8e-6);
//! assert!((stepper.reading().speed / steady - 1.0f64).abs() < 1e-6);
//! # Ok::<(), ParameterError>(())
//! ```

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
