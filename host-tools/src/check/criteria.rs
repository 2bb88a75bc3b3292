//! From where on something counts as found. Each figure is derived here, or named as a debt.
//!
//! Debts, set by sight and tried on `cargo xtask exam --only 'rig-*'`, beside the checks that they belong to: `BETTER`,
//! `BETTER_YET`, `BLAMED` and `PARTS` of shifts and clocks; `ALONE`, `PHASE`, `SWITCHED` and `BY_CONTROL` of lost
//! samples; `LINE` and `NEAR_A_HARMONIC` of interpolation; `CORRELATED` and `ALONE` of means; `SLOPE`, `STANDS_OUT` and
//! `IN_THE_SUPPLY` of colour and hum, `STEADY`, `SCATTER`, `MOST`, `SEEN` and `SPEEDS` of hum that is taken out;
//! `MOST_AROUND`, `PERIODS_AROUND`, `ECHO` and `PULSES` of spikes; `BY_ITSELF` and
//! `ACCELERATES` of speeds of another run; `LEVELS` of silent sensors; the ranges of what is built.

/// Groups that a regression leaves out one at a time. Nineteen degrees of freedom; more would leave too little in each
/// on the shortest recordings.
pub const GROUPS: usize = 20;

/// Student's t of a coefficient whose sign is believed: one false alarm in 10^6 coefficients at 19 degrees of freedom
/// (two-sided).
pub const T_SIGN: f64 = 7.0;

/// Student's t for what only informs: one in 10^4.
pub const T_INFORM: f64 = 4.9;

/// Standard deviations of Gaussian noise that none of 10^9 samples exceeds by chance (p = 1.2e-15 each), with a third
/// on top for an estimate of the deviation that is off by as much.
pub const SIGMAS_OF_OUTLIER: f64 = 12.0;

pub use crate::counts::CHANCE;

/// Shortest window of a balance, s: resolves 50 Hz, and averages ten samples at 2.5 kHz and more.
pub const ELECTRICAL_WINDOW_S: f64 = 4e-3;

/// The same for the mechanical balance: a period of the mains.
pub const MECHANICAL_WINDOW_S: f64 = 20e-3;

/// Fewest samples in a window: the sums over a raised cosine are exact for what is slower than a third of the rate.
pub const WINDOW_SAMPLES: usize = 8;

/// Slowest and fastest sampling of a motor's run, s: 20 Hz to 100 kHz, with a margin of two.
pub const INTERVALS_S: (f64, f64) = (5e-6, 0.1);

/// Longest electrical time constant of a motor up to some kilowatts, s. Ten times that of a large servo drive.
pub const LONGEST_ELECTRICAL_S: f64 = 0.3;

/// Longest mechanical time constant R J/K² of a motor with its load, s: a servo drive with a flywheel of a hundred
/// times its own inertia.
pub const LONGEST_MECHANICAL_S: f64 = 5.0;
