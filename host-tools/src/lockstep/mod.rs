//! Motors that hardly differ, stepped together: as many as a vector register has lanes, in the time of two.
//!
//! What derivatives by forward differences want is the same free run again and again with one parameter changed by a
//! millionth. All branches of the model are then taken alike but for a few steps at which a current or a speed goes
//! through zero, or a loop turns round; such a step is done again, motor by motor. Each motor gets the bits that it
//! gets alone.

mod lanes;

use std::array;
use std::borrow::Borrow;

use greyrig::effects::Effect;
use greyrig::motor::{Constraints, Motor, Parameters, Snapshot, State, Stepper};

pub use lanes::{LANES, Lanes};

use crate::experiment::Stepped;

/// Motors from which on it is quicker to treat them as one, which takes about as long as two.
const WORTH: usize = 3;

/// A few motors, if it is worth while to treat them as one; lanes that are left over go along with the first.
pub fn as_many_as_lanes(motors: &[impl Borrow<Motor<f64>>]) -> Option<[Motor<f64>; LANES]> {
    let worth = (WORTH..=LANES).contains(&motors.len());
    worth.then(|| array::from_fn(|k| motors.get(k).unwrap_or(&motors[0]).borrow().clone()))
}

/// What comes out if motors are treated as one; `None` where their branches part, their effects differ or they have
/// terms of the user's own.
pub fn in_agreement<T>(motors: &[Motor<f64>; LANES], of: impl FnOnce(&Motor<Lanes>) -> T) -> Option<T> {
    lanes::disagreed();
    let result = of(&as_one(motors)?);
    (!lanes::disagreed()).then_some(result)
}

/// Motors in lockstep.
#[derive(Debug)]
pub struct Lockstep {
    together: Stepper<Lanes>,
    alone: [Stepper<f64>; LANES],
    reading: State<Lanes>,
    /// Steps in which the branches parted.
    apart: usize,
}

impl Lockstep {
    /// Motors to be stepped by `interval` seconds in `substeps`. `None`: their effects differ, they have terms of the
    /// user's own, or [`Stepper::with_substeps`] refuses one of them.
    pub fn build(motors: &[Motor<f64>; LANES], interval: f64, substeps: u8) -> Option<Self> {
        let stepper = |motor: &Motor<f64>| Stepper::with_substeps(motor.clone(), interval, substeps).ok();
        let alone: Vec<_> = motors.iter().map(stepper).collect::<Option<_>>()?;
        let together = Stepper::with_substeps(as_one(motors)?, Lanes([interval; LANES]), substeps).ok()?;
        Some(Self { reading: together.state(), together, alone: alone.try_into().ok()?, apart: 0 })
    }

    fn each_alone(&mut self, before: &Snapshot<Lanes>, from: Lanes, to: Lanes, constraints: Constraints<Lanes>) {
        self.apart += 1;
        for (k, stepper) in self.alone.iter_mut().enumerate() {
            stepper.restore(&lane(before, k));
            let of_lane = |value: Option<Lanes>| value.map(|lanes| lanes.0[k]);
            let constraints = Constraints { speed: of_lane(constraints.speed), current: of_lane(constraints.current) };
            stepper.step(from.0[k], to.0[k], constraints);
        }
        self.go_on_from_alone();
    }

    fn go_on_from_alone(&mut self) {
        self.together.restore(&of_lanes(&self.alone.each_ref().map(Stepper::snapshot)));
        self.reading = state_of_lanes(&self.alone.each_ref().map(Stepper::reading));
    }
}

impl Stepped<Lanes> for Lockstep {
    fn begin(&mut self, state: State<Lanes>, elapsed: Lanes) {
        self.together.go_on_in(state, elapsed);
        self.reading = self.together.reading();
        if lanes::disagreed() {
            let before = self.together.snapshot();
            for (k, stepper) in self.alone.iter_mut().enumerate() {
                stepper.go_on_in(lane(&before, k).state, elapsed.0[k]);
            }
            self.go_on_from_alone();
        }
    }

    fn step(&mut self, from: Lanes, to: Lanes, constraints: Constraints<Lanes>) {
        let before = self.together.snapshot();
        self.together.step(from, to, constraints);
        self.reading = self.together.reading();
        if lanes::disagreed() {
            self.each_alone(&before, from, to, constraints);
        }
    }

    fn state(&self) -> State<Lanes> {
        self.together.state()
    }

    fn reading(&self) -> State<Lanes> {
        self.reading
    }

    fn put(&mut self, state: State<Lanes>) {
        let memories = self.together.snapshot().memories;
        self.together.restore(&Snapshot { state, rounding: State::default(), memories });
        self.reading = self.together.reading();
        if lanes::disagreed() {
            let before = self.together.snapshot();
            for (k, stepper) in self.alone.iter_mut().enumerate() {
                stepper.restore(&lane(&before, k));
            }
            self.go_on_from_alone();
        }
    }
}

/// Motors as one whose numbers have lanes.
fn as_one(motors: &[Motor<f64>; LANES]) -> Option<Motor<Lanes>> {
    let first = &motors[0];
    let alike = |motor: &Motor<f64>| {
        let ids = |m: &Motor<f64>| m.effects().iter().map(Effect::id).collect::<Vec<_>>();
        ids(motor) == ids(first)
            && motor.parameters().flux_law == first.parameters().flux_law
            && motor.terms().is_empty()
    };
    if !motors.iter().all(alike) {
        return None;
    }
    let values = motors.each_ref().map(|motor| motor.parameters().values());
    let values = array::from_fn(|p| Lanes::from_each(|k| values[k][p]));
    let effects: Vec<Effect<Lanes>> = (0..first.effects().len())
        .map(|e| {
            let values = motors.each_ref().map(|motor| motor.effects()[e].values());
            let lanes: Vec<Lanes> = (0..values[0].len()).map(|p| Lanes::from_each(|k| values[k][p])).collect();
            Effect::new(first.effects()[e].id(), &lanes)
        })
        .collect();
    Motor::build(Parameters::from_values(first.parameters().flux_law, values), &effects).ok()
}

fn lane(all: &Snapshot<Lanes>, k: usize) -> Snapshot<f64> {
    let state = |state: State<Lanes>| State { current: state.current.0[k], speed: state.speed.0[k] };
    Snapshot {
        state: state(all.state),
        rounding: state(all.rounding),
        memories: all.memories.map(|memory| memory.map(|x| x.0[k])),
    }
}

fn of_lanes(each: &[Snapshot<f64>; LANES]) -> Snapshot<Lanes> {
    Snapshot {
        state: state_of_lanes(&each.map(|snapshot| snapshot.state)),
        rounding: state_of_lanes(&each.map(|snapshot| snapshot.rounding)),
        memories: array::from_fn(|e| array::from_fn(|m| Lanes::from_each(|k| each[k].memories[e][m]))),
    }
}

fn state_of_lanes(each: &[State<f64>; LANES]) -> State<Lanes> {
    State { current: Lanes::from_each(|k| each[k].current), speed: Lanes::from_each(|k| each[k].speed) }
}

#[cfg(test)]
mod tests {
    use greyrig::effects::Description;
    use greyrig::motor::FluxLaw;

    use super::*;

    const INTERVAL_S: f64 = 2e-4;

    /// Every effect of the catalogue, in motors that hardly differ and in such that do, so that branches are taken
    /// apart: driven to and fro, with the rotor held and the supply open for a while, each has the bits that it has
    /// alone.
    #[test]
    fn each_motor_has_the_bits_that_it_has_alone() {
        let mut apart = 0;
        for (difference, law) in [(1e-6, FluxLaw::Series), (0.1, FluxLaw::Series), (0.1, FluxLaw::PermanentMagnet)] {
            for d in Description::all() {
                let motors: [Motor<f64>; LANES] = array::from_fn(|k| {
                    let factor = 1.0 + difference * k as f64;
                    let k_phi = if law == FluxLaw::Series { 0.01 } else { 0.05 };
                    let base = [2.2, 0.02, k_phi * factor, 2e-5, 0.015, 8e-6, 3e-8];
                    let values: Vec<f64> =
                        d.parameters.iter().map(|p| (p.start * factor).clamp(p.range.0, p.range.1)).collect();
                    let effect = Effect::new(d.id, &values);
                    Motor::build(Parameters::from_values(law, base), &[effect]).unwrap()
                });
                let mut together = Lockstep::build(&motors, INTERVAL_S, 2).unwrap();
                let mut alone = motors.each_ref().map(|m| Stepper::with_substeps(m.clone(), INTERVAL_S, 2).unwrap());
                let begin = State { current: 0.5, speed: 10.0 };
                together
                    .begin(State { current: Lanes([0.5; LANES]), speed: Lanes([10.0; LANES]) }, Lanes([0.0; LANES]));
                alone.iter_mut().for_each(|stepper| stepper.set_state(begin));
                let voltage = |n: usize| 60.0 * (0.06 * n as f64).sin() + 20.0 * (0.004 * n as f64).cos();
                for n in 1..3000 {
                    let held = |begin: usize| (begin..begin + 200).contains(&n).then_some(0.0);
                    let constraints = Constraints { speed: held(1000), current: held(2000) };
                    let lanes = constraints.speed.map(|x| Lanes([x; LANES]));
                    let lanes = Constraints { speed: lanes, current: constraints.current.map(|x| Lanes([x; LANES])) };
                    let [from, to] = [voltage(n - 1), voltage(n)];
                    together.step(Lanes([from; LANES]), Lanes([to; LANES]), lanes);
                    let reading = together.reading();
                    for (k, stepper) in alone.iter_mut().enumerate() {
                        stepper.step(from, to, constraints);
                        let bits = |s: State<f64>| [s.current.to_bits(), s.speed.to_bits()];
                        let of_lane = State { current: reading.current.0[k], speed: reading.speed.0[k] };
                        assert_eq!(bits(of_lane), bits(stepper.reading()), "{} {law:?} lane {k} step {n}", d.id);
                    }
                }
                apart += together.apart;
            }
        }
        // The test would say nothing of steps that are done again if there were none.
        assert!(apart > 1000, "{apart}");
    }
}
