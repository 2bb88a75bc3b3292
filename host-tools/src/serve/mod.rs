//! The workbench in the browser: identify, compare, see where the model fails, diagnose, add, watch the error fall.
//!
//! ```text
//! server ─► gate, connections, page
//!   └─► session ─► project, recordings      what is kept
//!          ├─────► task, job, version       what is done
//!          │         └─► correction, judge, planning
//!          └─────► curves ─► simulated, plane ─► pyramid
//! ```
//! A [`Session`] holds a project: recordings, what is wrong with them, and the tree of versions of the model, saved as
//! one works. One task at a time works on them, on threads of its own, and can be stopped; while there is none, what a
//! diagnosis has tried is simulated ahead. The server answers this machine alone, and there whoever knows the token.

mod api;
mod connections;
mod correction;
mod curves;
mod error;
mod gate;
mod job;
mod judge;
mod page;
mod plane;
mod planning;
mod project;
mod pyramid;
mod recordings;
mod server;
mod session;
mod simulated;
mod task;
mod version;

pub use error::Error;
pub use project::EXTENSION;
pub use server::serve;
pub use session::Session;
