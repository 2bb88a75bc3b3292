//! A story on built-in data, without hardware: a motor of the virtual rig that hides something, the ways to a model of
//! it, what is missing in that, and motors that are judged by it.

mod attempts;
mod correction;
mod paper;
mod station;

pub use attempts::{Attempt, Attempts, Data};
pub use correction::Corrected;
pub use paper::figures;
pub use station::Station;

/// What the motor hides; the seed chooses. The first is a motor whose physical model alone is off by the paper's 20 %.
const HIDDEN: [&[&str]; 8] = [
    &["saturation=0.42", "hysteresis"],
    &["saturation:langevin=0.4", "brush_drop=4"],
    &["inductance_saturation=0.6"],
    &["hysteresis=0.4", "channel_delay=150e-6"],
    &["saturation=0.3", "eddy_current=150e-6"],
    &["current_compression=0.07", "brush_drop=3"],
    &["windage_exponent=2.8", "remanence=0.15"],
    &["channel_delay=120e-6"],
];

/// What the motor of a seed hides.
pub fn hidden(seed: u64) -> &'static [&'static str] {
    HIDDEN[(seed.saturating_sub(1) % HIDDEN.len() as u64) as usize]
}
