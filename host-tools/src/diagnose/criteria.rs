//! By how much an effect has to lower the error on data held out, and what counts as the same.
//!
//! A gain is the fall of the logarithm of the held-out error, summed over both signals
//! ([`HeldOut::log_error`](crate::identify::minimise::HeldOut)).

/// Smallest fall of the held-out error, sum of the logarithms of both balances.
pub const SMALLEST_GAIN: f64 = 0.1;
/// Least part of a candidate's column that has to be its own.
pub const LEAST_INDEPENDENT: f64 = 0.01;
/// Held-out errors within this of each other are the same.
pub const SAME_ERROR: f64 = 0.04;
/// Above this gain (the error divided by e) significance at 1 % suffices, and the checks for collinearity and for a
/// plausible R and K are skipped; the check for vanishing flux and inertia is not.
pub const BEYOND_DOUBT: f64 = 1.0;
/// Largest p-value, over the number of candidates tried. Strict, because turbulence of the load is not quite white and
/// the blocks are not quite alike: at 1 % one healthy motor in twenty would be accused.
pub const SIGNIFICANCE: f64 = 1e-4;
/// An effect has to beat the best decoy's gain by this factor.
pub const OVER_DECOYS: f64 = 2.0;
/// Error of the free run over the noise floor of the recordings above which an acquittal says what is left: three
/// times, where a model that is right stays below 2.5 by what does not repeat.
pub const ABOVE_THE_FLOOR: f64 = 3.0;
