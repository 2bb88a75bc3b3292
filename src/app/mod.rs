//! The application, the same on every board: sampling, the link, parameters, counters.
//!
//! ```text
//! interrupt, every 100 µs                          thread
//! counts ─► Sampler ─┬─ Shared (counters, wishes) ─┬─ Server ◄─► link to the host
//!                    ├─ queue of raw samples ──────┤     │
//!                    ├─ queue of reports ──────────┤     └─► Store (parameters in flash)
//!                    └─ queue of judged periods ───┘
//! ```
//! [`sampler`] is what the interrupt does with a sample, [`station`] what it does to the rig after it, [`server`] what
//! the thread does with bytes, [`serve`] the thread's loop. A board implements [`Board`] and [`Switchgear`], calls
//! [`Sampler::sample`] and [`Station::sample`] once per sample, and has no logic of its own.
//!
//! # Contract of the interrupt
//! [`Sampler::sample`] has to be called once for every sample, in order, and to be done before the next one is due: 100
//! µs later at 10 kHz. If it is not, the converter overwrites a sample, the filters see a shorter time than has passed,
//! and the residual is wrong for some milliseconds. The board then says how many samples nobody took: they keep their
//! numbers, a recording marks them, and [`Fault::TickOverrun`](crate::faults::Fault::TickOverrun) counts the event.
//!
//! # Safe mode
//! Without a valid block the model does not run and nothing is reported about the motor; raw samples can still be
//! recorded, which is how a rig gets its first parameters.

pub mod bench;
mod board;
pub mod chain;
mod fresh;
pub mod grid;
mod judged;
pub mod lamps;
pub mod plausibility;
mod raw;
pub mod ring;
pub mod sampler;
mod serve;
pub mod server;
mod shared;
pub mod station;
pub mod telemetry;
pub mod time_base;

pub use board::{Board, Switchgear};
pub use lamps::Lamps;
pub use raw::Raw;
pub use sampler::Sampler;
pub use serve::{receive_all, send_waiting, serve};
pub use server::{Outgoing, Server};
pub use shared::Shared;
pub use station::Station;
pub use telemetry::Window;

/// Raw samples that wait for the link: 51 ms at 10 kHz, longer than a page of flash takes to be erased (STM32G474, data
/// sheet DS12288: 22 ms).
pub const RAW_QUEUE: usize = 512;
/// Reports that wait for the link.
pub const REPORT_QUEUE: usize = 8;
/// Periods of a test that wait for the link: 160 ms at 50 Hz.
pub const JUDGED_QUEUE: usize = 8;
