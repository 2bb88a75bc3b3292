//! Tests of the host tool, a module per subject.
