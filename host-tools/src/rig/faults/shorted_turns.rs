//! Turns of the field that are shorted: less flux at the same current.

use super::Fault;
use crate::rig::Sizes;
use crate::rig::parts::FluxShare;

/// The fault.
pub const FAULT: Fault = Fault {
    id: "shorted_turns",
    what: "shorted turns of the field: less flux at the same current, from the start on",
    size: "fraction of the flux that is lost",
    unit: "",
    universal: Sizes::new(0.1, 0.001, 0.5),
    pm_dc: None,
    install: |size, _, rig| rig.flux_shares.push(Box::new(Less(1.0 - size))),
};

struct Less(f64);

impl FluxShare for Less {
    fn factor(&self, _i: f64, _omega: f64) -> f64 {
        self.0
    }
}
