//! Sparking brushes: far more commutator bars spark than in a healthy motor.

use super::Fault;
use crate::rig::Sizes;
use crate::rig::effects::brush_arcing::Arcs;

/// The fault.
pub const FAULT: Fault = Fault {
    id: "sparking",
    what: "sparking brushes: arcs at many commutator bars, at any current",
    size: "fraction of bar passages that spark",
    unit: "",
    universal: Sizes::new(0.5, 0.01, 1.0),
    pm_dc: Sizes::new(0.5, 0.01, 1.0),
    install: |size, onset_s, rig| rig.drops.push(Box::new(Arcs::faulty(size, onset_s, rig))),
};
