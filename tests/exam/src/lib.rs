//! The examination of the diagnosis: blind cases from the virtual rig, and what they say.

pub mod alone;
pub mod balances;
pub mod calibration;
pub mod cases;
pub mod ending;
pub mod export;
pub mod lot;
pub mod recovery;
pub mod rig;
pub mod roc;
pub mod score;
pub mod share;
pub mod spread;
