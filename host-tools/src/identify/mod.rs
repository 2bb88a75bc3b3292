//! From recordings to physical parameters.
