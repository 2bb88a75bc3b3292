//! The loop in the browser: identify, compare, see where the model fails, diagnose, add, watch the error fall.
//!
//! ```text
//! server ─► session ─► task ─► version, error
//!    │        └────► questioned
//!    └────► page
//! ```
//! A [`Session`] holds the recordings, what is wrong with them, and the versions of the model. One task at a time works
//! on them, on threads of its own, and can be stopped. The server answers this machine alone.

mod error;
mod page;
mod questioned;
mod server;
mod session;
mod task;
mod version;

pub use error::Error;
pub use server::serve;
pub use session::Session;
