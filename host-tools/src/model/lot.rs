//! What is usual in a lot of motors, as a model file keeps it.

use serde::{Deserialize, Serialize};

/// Rows of a block: what the balances of power and torque leave over, mean current, sparks, ripple.
pub const ROWS: usize = 5;
/// The first of them, which are balances of the model; the others are watched as they are.
pub const BALANCES: usize = 2;

/// A fault. Its size is relative, but where another unit is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// Another resistance.
    Resistance,
    /// Another flux: shorted turns of field or armature, or weaker magnets.
    Turns,
    /// A contact that drops so many V more.
    Contact,
    /// More dry friction, N m.
    DryFriction,
    /// More viscous friction, N m at the lot's top speed.
    ViscousFriction,
    /// Another load by fan or pump, N m at the lot's top speed.
    Load,
    /// Another inertia.
    Inertia,
    /// Another gain of the voltage's sensor.
    VoltageGain,
    /// Another gain of the current's sensor.
    CurrentGain,
    /// Another gain of the speed's sensor.
    SpeedGain,
    /// An offset of the current's sensor, A.
    CurrentOffset,
    /// The gain of the voltage's sensor drifts, 1/s.
    VoltageDrift,
    /// The gain of the current's sensor drifts, 1/s.
    CurrentDrift,
    /// The gain of the speed's sensor drifts, 1/s.
    SpeedDrift,
    /// Sparks: the logarithm of the current above 1 kHz.
    Sparking,
    /// A rotor out of balance: the speed's wave once a turn, rad/s.
    Imbalance,
}

/// Faults that are parameters of the motor, which scatter from one to the next.
pub const PARAMETERS: usize = 7;
/// What differs from motor to motor: parameters, and the levels of what is watched by a row of its own.
pub const OWN: [Fault; PARAMETERS + 3] = [
    Fault::Resistance,
    Fault::Turns,
    Fault::Contact,
    Fault::DryFriction,
    Fault::ViscousFriction,
    Fault::Load,
    Fault::Inertia,
    Fault::CurrentOffset,
    Fault::Sparking,
    Fault::Imbalance,
];

/// When a fault begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Onset {
    /// It was there when the test began.
    Start,
    /// During the test.
    During,
}

/// From which |Z| on a fault is none of chance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limit {
    /// The fault.
    pub fault: Fault,
    /// When it begins.
    pub onset: Onset,
    /// The limit.
    pub z: f64,
    /// Smallest size that 95 % of motors show, in the fault's unit: the median over the times at which it may begin.
    pub seen: f64,
}

/// What is usual in a lot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Population {
    /// Layout of the rows, [`Population::LAYOUT`]; files that do not tell it are of the first.
    #[serde(default = "first_layout")]
    pub layout: u32,
    /// Length of a block, s.
    pub block_s: f64,
    /// Whether the voltage alternates.
    pub alternating: bool,
    /// Speed at which frictions are told, rad/s.
    pub top_speed: f64,
    /// Healthy motors.
    pub motors: usize,
    /// Share of healthy motors that the limits let fail.
    pub false_alarms: f64,
    /// Standard deviations of [`OWN`] over the motors.
    pub scatter: [f64; OWN.len()],
    /// RMS voltage, V, block by block.
    pub voltage: Vec<f64>,
    /// Mean magnitude of the power, W, by which its row is measured, block by block.
    pub power: Vec<f64>,
    /// r̄, of the power as a share of that.
    pub usual: Vec<[f64; ROWS]>,
    /// Shapes, likewise.
    pub shapes: Vec<Vec<[f64; ROWS]>>,
    /// Variances of the rows, likewise.
    pub variance: Vec<[f64; ROWS]>,
    /// Correlation of the two balances.
    pub correlation: Vec<f64>,
    /// From what on a fault is none of chance.
    pub limits: Vec<Limit>,
}

impl Population {
    /// What the rows hold: in the first layout the ripple was the logarithm of the speed above 250 Hz.
    pub const LAYOUT: u32 = 2;
}

const fn first_layout() -> u32 {
    1
}
