//! Arguments of commands that can write a report beside what they print.

use std::path::PathBuf;

/// How a command answers.
#[derive(Debug, clap::Args)]
pub struct Answer {
    /// Report to write, one HTML file that needs no network
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// Replace existing files
    #[arg(long)]
    pub force: bool,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}
