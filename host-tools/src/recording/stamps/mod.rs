//! Time stamps that are not those of a uniform run: gaps, scatter, a rate that wanders, too few digits.
//!
//! [`read()`] brings the samples to the rows of a uniform raster and keeps what the stamps say beyond that:
//! which rows are missing, and how far each sample lies beside its row. Whether a sample was taken when its stamp says,
//! or only printed then, the samples decide ([`scatter`]); if so they are interpolated to the rows ([`resampling`]).

mod coarse;
mod doubled;
mod placement;
mod raster;
mod reading;
mod resampling;
mod resolution;
mod scatter;
mod tracking;

pub use doubled::leave_out as leave_out_doubled;
pub use placement::Placement;
pub use reading::read;
pub use resampling::at_rows;
pub use scatter::{Taken, judge};
