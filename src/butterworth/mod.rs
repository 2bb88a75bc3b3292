//! The low-pass filter in front of everything: Butterworth, order 1 to 8, on every signal alike.
//!
//! Settings in the user's units are checked once and become coefficients ([`Settings::build`]); the coefficients are
//! shared by all channels, and each channel has a state of its own ([`Cascade`], or [`Bank`] of several that are
//! filtered at once):
//!
//! ```
//! use greyrig::butterworth::{Cascade, Settings};
//!
//! let coefficients = Settings::default().build::<f32>()?;
//! let mut current = Cascade::default();
//! current.reset_to(1.5);
//! assert_eq!(current.process(&coefficients, 1.5), 1.5);
//! # Ok::<(), greyrig::butterworth::SettingsError>(())
//! ```
//!
//! # Equations
//!
//! The analogue prototype of order n has the poles s = −exp(±jθ_i), equally spaced on the left half of the unit
//! circle (S. Butterworth, "On the theory of filter amplifiers", 1930). A complex pair makes a section of damping
//! k_i = 2 cos θ_i, and odd orders have a pole at −1 besides. The bilinear transform, pre-warped so that the
//! attenuation at the cut-off is exactly 3.01 dB, leads to
//!
//! |H(f)|² = 1 / (1 + (tan(π f/fs) / tan(π fc/fs))^(2n)).
//!
//! A section is computed as two trapezoidal integrators in a loop, with g = tan(π fc/fs) and D = 1 + g k + g²:
//!
//! ```text
//! v  = x − s2                      what is left to follow
//! d  = α s1 + β v                  α = g/D, β = g²/D
//! y  = s2 + d
//! s1 ← s1 + 2 (α v − γ s1)         γ = (g k + g²)/D
//! s2 ← y + d
//! ```
//!
//! and the first-order section as one such integrator: d = (x − s) g/(1 + g), y = s + d, s ← y + d. Its transfer
//! function is that of the direct forms, and [`Settings::second_order_sections`] lists it in the usual way.
//!
//! # Example
//! ```
//! use greyrig::butterworth::{Cascade, Settings, SettingsError};
//!
//! let settings = Settings { order: 4, cutoff_hz: 250.0, sample_rate_hz: 10_000.0 };
//! let coefficients = settings.build::<f32>()?;
//! let mut channel = Cascade::default();
//! let step = (0..settings.settling_samples()?).map(|_| channel.process(&coefficients, 1.0));
//! assert!((step.last().unwrap_or_default() - 1.0).abs() < 2e-3);
//! # Ok::<(), SettingsError>(())
//! ```
//!
//! | symbol | meaning | unit |
//! | --- | --- | --- |
//! | fc, fs | cut-off (−3.01 dB) and sampling frequency | Hz |
//! | x, y | sample before and after the section | the signal's |
//! | s1, s2 | states; in the steady state s1 = 0 and s2 = x | the signal's |
//!
//! # Why this form
//!
//! A direct form holds its poles in two coefficients near −2 and 1, whose difference carries the cut-off: at 10 Hz and
//! 10 kHz, six of the seven digits of an `f32` are spent on the 1 and the 2. Here the cut-off is in g itself. At that
//! cut-off the noise of the `f32` filter is some 700 times below that of the direct forms, which exceeds the
//! quantisation noise of a 12-bit converter (figures and command in `docs/filter.md`), a constant input is reproduced
//! exactly because the gain at zero frequency depends on no coefficient, and coefficients may be exchanged while the
//! filter runs, because the states mean the same whatever the cut-off. It takes 11 additions and multiplications a
//! section, transposed direct form 2 nine.
//!
//! Sections stand in the order of falling damping, the resonant ones last, and each has unit gain at zero frequency:
//! no section then sees more than a few times the input, which is what keeps fixed point from overflowing.
//!
//! # Which arithmetic
//!
//! `f32` is the default on a processor with a floating-point unit: no scaling, and noise far below that of a 12-bit
//! converter. [`fixed`] is for processors without one and for integer signal paths; `f64` is the reference.
//!
//! # Bad samples
//!
//! A NaN, an infinity, or a magnitude above 1e30 is replaced by the last sample that was none of these, so the
//! filter carries on as if the signal had been held, and its output is always finite.

mod cascade;
mod design;
pub mod fixed;
mod high_pass;

use core::fmt;

pub use cascade::{Bank, Cascade, Coefficients};
pub use high_pass::HighPass;

use crate::scalar::Scalar;

/// Highest order.
pub const MAX_ORDER: u8 = 8;
/// Number of second-order sections of the highest order.
pub const MAX_SECTIONS: usize = MAX_ORDER as usize / 2;
/// Lowest cut-off as a fraction of the sampling rate. An increment of a state below half its last digit is lost, so a
/// section in `f32` stops following a step when about k ε/g is left, which at this cut-off is 2e-4 (3.4e-4 measured
/// for the worst order), and ten times that a decade below.
pub const MIN_CUTOFF_RATIO: f64 = 1e-4;
/// Highest cut-off as a fraction of the sampling rate. Towards one half the poles approach −1 and the filter rings
/// for ever.
pub const MAX_CUTOFF_RATIO: f64 = 0.49;
/// The filter counts as settled once the response to a step stays within this fraction of the step.
pub const SETTLED: f64 = 1e-3;
/// Output, in the unit of the input, below which a filter in `f64` that a host keeps after its input has become zero
/// counts as at rest. It would ring on in subnormal numbers, which a desktop's processor is slow with.
pub const AT_REST: f64 = 1e-200;

/// What the user chooses.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// Order n, 1 to [`MAX_ORDER`]. Each further order takes another 6 dB per octave away above the cut-off and
    /// lengthens delay and settling.
    pub order: u8,
    /// Cut-off frequency fc (−3.01 dB), Hz, between [`MIN_CUTOFF_RATIO`] and [`MAX_CUTOFF_RATIO`] of the sampling
    /// rate. Lower: less noise, slower.
    pub cutoff_hz: f64,
    /// Sampling rate fs, Hz.
    pub sample_rate_hz: f64,
}

impl Default for Settings {
    /// Rakar and Juričić (2004), section 2.2, sample at 10 kHz and cut off at 250 Hz; they leave the order open. Order
    /// 4 takes 49 dB from the ripple of a commutator at 1 kHz and settles in 11 ms.
    fn default() -> Self {
        Self { order: 4, cutoff_hz: 250.0, sample_rate_hz: 10_000.0 }
    }
}

/// Settings that no filter can be made from; carries the parameter's name and the range that it has to lie in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SettingsError {
    /// The parameter: a field of [`Settings`].
    pub name: &'static str,
    /// Lowest value allowed.
    pub min: f64,
    /// Highest value allowed.
    pub max: f64,
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, min, max } = self;
        write!(f, "{name} has to lie between {min} and {max}")
    }
}

impl core::error::Error for SettingsError {}

impl Settings {
    /// Checks the settings and computes the coefficients, in `f64` whatever `S` is.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn build<S: Scalar>(&self) -> Result<Coefficients<S>, SettingsError> {
        Ok(Coefficients::new(&self.design(MAX_CUTOFF_RATIO)?))
    }

    /// As [`Settings::build`], for 32-bit integers; the cut-off may reach [`fixed::MAX_CUTOFF_RATIO`].
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn build_fixed(&self) -> Result<fixed::Coefficients, SettingsError> {
        Ok(fixed::Coefficients::new(&self.design(fixed::MAX_CUTOFF_RATIO)?))
    }

    /// The same filter in the usual notation: rows b0 b1 b2 a0 a1 a2 of
    /// y\[t\] = b0 x\[t\] + b1 x\[t−1\] + b2 x\[t−2\] − a1 y\[t−1\] − a2 y\[t−2\], a0 = 1, each with unit gain at zero
    /// frequency, in the order in which they are computed.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn second_order_sections(&self) -> Result<heapless::Vec<[f64; 6], MAX_SECTIONS>, SettingsError> {
        Ok(self.design(MAX_CUTOFF_RATIO)?.second_order_sections())
    }

    /// Samples after which the response to a step stays within [`SETTLED`] of its end. A recording has to be longer
    /// than this to say anything. The step response is computed, which takes time on a microcontroller.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn settling_samples(&self) -> Result<u32, SettingsError> {
        let design = self.design(MAX_CUTOFF_RATIO)?;
        let coefficients = Coefficients::<f64>::new(&design);
        let mut cascade = Cascade::default();
        let mut settled_from = 0;
        for sample in 0..design.decayed_after(SETTLED * 1e-3) {
            if (cascade.process(&coefficients, 1.0) - 1.0).abs() > SETTLED {
                settled_from = sample + 1;
            }
        }
        Ok(settled_from)
    }

    fn design(&self, max_ratio: f64) -> Result<design::Design, SettingsError> {
        check("order", f64::from(self.order), 1.0, f64::from(MAX_ORDER))?;
        check("sample_rate_hz", self.sample_rate_hz, 1e-6, 1e9)?;
        let (min, max) = (MIN_CUTOFF_RATIO * self.sample_rate_hz, max_ratio * self.sample_rate_hz);
        check("cutoff_hz", self.cutoff_hz, min, max)?;
        Ok(design::Design::new(self.order, self.cutoff_hz / self.sample_rate_hz))
    }
}

/// A NaN is in no range.
fn check(name: &'static str, value: f64, min: f64, max: f64) -> Result<(), SettingsError> {
    if (min..=max).contains(&value) { Ok(()) } else { Err(SettingsError { name, min, max }) }
}
