//! Tests of the host tool, a module per subject.

mod browser;
mod report;
mod synthetic_comparison;
