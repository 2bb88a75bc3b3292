//! A sensor whose gain has changed: a shunt that has aged, a tacho wheel that slips.

use super::Fault;
use crate::rig::Sizes;
use crate::rig::parts::{Assembly, Instant, Measured};

/// Gain of the current sensor.
pub const CURRENT: Fault = Fault {
    id: "current_sensor",
    what: "gain of the current sensor",
    size: "relative change of the gain",
    unit: "",
    universal: Sizes::new(0.1, -0.5, 0.5),
    pm_dc: Sizes::new(0.1, -0.5, 0.5),
    install: |size, onset_s, rig| install(Measured::Current, size, onset_s, rig),
};

/// Gain of the speed sensor.
pub const SPEED: Fault = Fault {
    id: "speed_sensor",
    what: "gain of the speed sensor",
    size: "relative change of the gain",
    unit: "",
    universal: Sizes::new(-0.1, -0.5, 0.5),
    pm_dc: Sizes::new(-0.1, -0.5, 0.5),
    install: |size, onset_s, rig| install(Measured::Speed, size, onset_s, rig),
};

fn install(channel: Measured, size: f64, onset_s: f64, rig: &mut Assembly) {
    let sense = move |x: f64, now: &Instant, _: f64| if now.t >= onset_s { (1.0 + size) * x } else { x };
    rig.channel(channel).sensors.push(Box::new(sense));
}
