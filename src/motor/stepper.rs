//! One sampling interval of the model: a third-order, L-stable Rosenbrock step.
//!
//! # Scheme
//! The two coupled equations can be stiff (a coreless motor has L/R below 20 µs, and the back-EMF adds Kω/L), so an
//! explicit method is not stable for every motor. The step is the three-stage Rosenbrock method ROS3 of Sandu et al.
//! (1997), order 3, L-stable, with two evaluations of the equations and three solutions of one 2 × 2 system, in
//! closed form. There is no iteration and no branch on data but standstill: the cost is constant.
//!
//! The supply voltage is linear between two samples. (Holding it, a zero-order hold, costs 1.6 % in current at 50 Hz
//! and 10 kHz: half a sample of delay.)
//!
//! # Standstill
//! Dry friction is set-valued at ω = 0. The direction of motion is decided once per step, from the speed or, at rest,
//! from the balance of driving torque and dry friction. When the speed changes its sign within a step, the rotor either
//! sticks (the driving torque does not exceed the dry friction: the speed is set to zero) or has reversed, and the
//! friction is turned round for the part of the step after the crossing. A rotor at rest therefore stays exactly at
//! rest, and no regularisation slope makes the system stiff.
//!
//! # Sub-steps
//! The error of a step grows with (h R/L)³. A motor with an electrical time constant of less than 1.3 samples is
//! stepped several times within a sample; [`Stepper::build`] chooses the number from R/L, and the cost stays constant
//! thereafter.
//!
//! # Stability
//! L-stability covers the linear part for any values. The products K i ω, K i² and μ2 ω² are linearised at the
//! beginning of the step, which is sound as long as they do not change wildly within one: [`Stepper::build`] refuses
//! motors that at [`LIMITS`] would (reaching full speed within a sample, say). No real motor comes near.
//!
//! # Rounding
//! In `f32` at 3,500 rad/s a step of 100 µs changes the speed by less than a rounding unit once dω/dt falls below about
//! 2 rad/s². The states are therefore summed with compensation (Kahan), which costs six additions.
//!
//! # Source
//! A. Sandu, J. G. Verwer, J. G. Blom, E. J. Spee, G. R. Carmichael, F. A. Potra: Benchmarking stiff ODE solvers for
//! atmospheric chemistry problems II: Rosenbrock solvers. Atmospheric Environment 31 (1997) 3459–3472, method ROS3.

use crate::effects::Passed;
use crate::motor::balance::{OperatingPoint, State};
use crate::motor::equations::{Memories, Motor};
use crate::motor::gradient::Gradient;
use crate::motor::parameters::{FluxLaw, ParameterError};
use crate::scalar::Scalar;

/// γ of ROS3: the root of γ³ − 3γ² + 3γ/2 − 1/6 = 0 that gives L-stability.
const GAMMA: f64 = 0.435_866_521_508_458_999_416_019_451_193_56;
/// Sums of the γ coefficients of a stage: weights of h ∂f/∂t.
const GAMMA_SUM: [f64; 3] = [GAMMA, 0.242_919_964_548_168_05, 2.185_138_002_766_406];
/// Coupling of a stage to the earlier ones: C21, C31, C32.
const C: [f64; 3] = [-1.015_617_108_387_770_3, 4.075_995_645_253_77, 9.207_679_429_833_08];
/// Weights of the stages in the result.
const M: [f64; 3] = [1.0, 6.169_794_704_382_824_5, -0.427_722_564_321_857_35];

/// Sub-steps per sample are chosen so that h R/L stays below this; at 0.75 a voltage step is followed to 0.04 % of the
/// current's RMS (tests/core/stepper.rs, coreless motor).
const LARGEST_RATE_STEP: f64 = 0.75;

/// More sub-steps are not spent: beyond, the step stays stable and loses accuracy in the samples after a voltage edge.
const MOST_SUBSTEPS: u8 = 16;

/// The largest current (A) and speed (rad/s) that the model is meant for.
pub const LIMITS: (f64, f64) = (100.0, 10_000.0);

/// What is imposed on the motor during an interval, instead of following from the equations.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Constraints<S> {
    /// ω, rad/s: zero with a locked rotor, the measured speed when the electrical side is looked at alone.
    pub speed: Option<S>,
    /// i, A: zero with an open supply, the measured current when the mechanical side is looked at alone.
    pub current: Option<S>,
}

impl<S: Scalar> Constraints<S> {
    /// Nothing is imposed.
    pub const FREE: Self = Self { speed: None, current: None };
    /// The rotor is held.
    pub const ROTOR_LOCKED: Self = Self { speed: Some(S::ZERO), current: None };
    /// The supply is open: no current flows, the voltage is what the terminals show.
    pub const SUPPLY_OPEN: Self = Self { speed: None, current: Some(S::ZERO) };
}

/// All that a step changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Snapshot<S> {
    /// Current and speed.
    pub state: State<S>,
    /// What the sums of both have lost by rounding.
    pub rounding: State<S>,
    /// What the effects remember.
    pub memories: Memories<S>,
}

/// A motor with its state, stepped from sample to sample.
#[derive(Debug, Clone)]
pub struct Stepper<S> {
    motor: Motor<S>,
    state: State<S>,
    rounding: State<S>,
    memories: Memories<S>,
    crossed_zero: bool,
    substeps: u8,
    inverse_substeps: S,
    /// Of a sub-step, like what follows, s.
    interval: S,
    inverse_interval: S,
    inverse_gamma_interval: S,
    /// [`C`] by the interval, 1/s.
    coupling: [S; 3],
}

impl<S: Scalar<Base = S>> Stepper<S> {
    /// A motor at rest, to be stepped by `interval` seconds.
    ///
    /// # Errors
    /// [`ParameterError::FasterThanSampling`] when, at [`LIMITS`], one of these exceeds 1: the change of the turbulent
    /// friction's rate within a step, 2 h μ2 ω/J; the gain of the loop from current over torque to back-EMF of a series
    /// motor, h K² i²/J · min(1/R, h/L); the share of the speed range gained in a step, h K φ i/(J ω).
    pub fn build(motor: Motor<S>, interval: S) -> Result<Self, ParameterError> {
        let p = motor.parameters();
        let rate = interval * p.resistance / p.inductance;
        let mut substeps = 1;
        while substeps < MOST_SUBSTEPS && rate > S::constant(LARGEST_RATE_STEP * f64::from(substeps)) {
            substeps += 1;
        }
        Self::with_substeps(motor, interval, substeps)
    }

    /// As [`Stepper::build`], with a given number of sub-steps per sample: a fit must not change it on its way.
    ///
    /// # Errors
    /// As [`Stepper::build`].
    pub fn with_substeps(motor: Motor<S>, interval: S, substeps: u8) -> Result<Self, ParameterError> {
        let substeps = substeps.max(1);
        let inverse_substeps = S::ONE / S::constant(f64::from(substeps));
        let p = motor.parameters();
        let (current, speed) = (S::constant(LIMITS.0), S::constant(LIMITS.1));
        let flux = match p.flux_law {
            FluxLaw::Series => current,
            FluxLaw::PermanentMagnet => S::ONE,
        };
        let rate = interval / p.inertia;
        let turbulence = S::constant(2.0) * rate * p.turbulent_friction.abs() * speed;
        let gain = rate * p.flux_coefficient * current * flux / speed;
        let by_inductance = interval / p.inductance;
        let by_resistance = S::ONE / p.resistance;
        let admittance = if by_inductance < by_resistance { by_inductance } else { by_resistance };
        let coupling = match p.flux_law {
            FluxLaw::Series => rate * (p.flux_coefficient * current) * (p.flux_coefficient * current) * admittance,
            FluxLaw::PermanentMagnet => S::ZERO,
        };
        if !(turbulence <= S::ONE && gain <= S::ONE && coupling <= S::ONE) {
            return Err(ParameterError::FasterThanSampling);
        }
        let interval = interval * inverse_substeps;
        let state = State::default();
        Ok(Self {
            substeps,
            inverse_substeps,
            memories: motor.memories_at_start(state),
            motor,
            state,
            rounding: State::default(),
            crossed_zero: false,
            interval,
            inverse_interval: S::ONE / interval,
            inverse_gamma_interval: S::ONE / (S::constant(GAMMA) * interval),
            coupling: C.map(|c| S::constant(c) * (S::ONE / interval)),
        })
    }

    /// The motor.
    pub fn motor(&self) -> &Motor<S> {
        &self.motor
    }

    /// Steps per sample.
    pub fn substeps(&self) -> u8 {
        self.substeps
    }

    /// Current and speed now.
    pub fn state(&self) -> State<S> {
        self.state
    }

    /// Current and speed now, as the measuring chain shows them: what is to be compared with a measurement.
    #[inline(always)]
    pub fn reading(&self) -> State<S> {
        self.motor.measure(&self.memories, self.state)
    }

    /// Whether the rotor was stopped or turned round by the last [`Stepper::step`], which then took longer.
    #[inline(always)]
    pub fn crossed_zero(&self) -> bool {
        self.crossed_zero
    }

    /// All that the steps so far have changed.
    #[inline(always)]
    pub fn snapshot(&self) -> Snapshot<S> {
        Snapshot { state: self.state, rounding: self.rounding, memories: self.memories }
    }

    /// Goes on from where a motor with the same effects was.
    pub fn restore(&mut self, snapshot: &Snapshot<S>) {
        Snapshot { state: self.state, rounding: self.rounding, memories: self.memories } = *snapshot;
    }

    /// Puts the motor into a state, with the memories of its effects as at the start of a run.
    pub fn set_state(&mut self, state: State<S>) {
        self.go_on_in(state, S::ZERO);
    }

    /// Puts the motor into a state, with the memories of its effects as a run goes on so long after it began, s.
    pub fn go_on_in(&mut self, state: State<S>, elapsed: S) {
        self.state = state;
        self.rounding = State::default();
        self.memories = self.motor.memories_after(state, elapsed);
    }

    /// Advances by one interval, during which the voltage goes linearly from `from` to `to` (V), and gives the true
    /// state at its end; [`Stepper::reading`] tells what the measuring chain shows of it.
    #[inline(always)]
    pub fn step(&mut self, from: S, to: S, constraints: Constraints<S>) -> State<S> {
        if constraints.speed.is_none() && constraints.current.is_none() {
            self.step_freely(from, to);
        } else {
            self.step_by(from, to, constraints);
        }
        self.state
    }

    /// A step with nothing imposed, which does not have to ask for it.
    #[inline(never)]
    fn step_freely(&mut self, from: S, to: S) {
        self.step_by(from, to, Constraints::FREE);
    }

    #[inline(always)]
    fn step_by(&mut self, from: S, to: S, constraints: Constraints<S>) {
        self.crossed_zero = false;
        let rise = (to - from) * self.inverse_substeps;
        let mut voltage = from;
        for _ in 1..self.substeps {
            let next = voltage + rise;
            self.substep(voltage, next, constraints);
            voltage = next;
        }
        self.substep(voltage, to, constraints);
    }

    #[inline(always)]
    fn substep(&mut self, from: S, to: S, constraints: Constraints<S>) {
        if let Some(speed) = constraints.speed {
            self.state.speed = speed;
            self.rounding.speed = S::ZERO;
        }
        if let Some(current) = constraints.current {
            self.state.current = current;
            self.rounding.current = S::ZERO;
        }
        let State { current, speed } = self.state;
        let before = self.state;
        let here = OperatingPoint {
            current: Gradient::current(current),
            speed: Gradient::speed(speed),
            voltage: Gradient::lift(from),
        };
        let slopes = self.motor.slopes(&here, moving(speed), &self.memories);
        let direction = slopes.direction;
        let rotor_held = constraints.speed.is_some() || direction == S::ZERO;
        let mut f = [slopes.current.value, slopes.speed.value];
        let mut jacobian =
            [[slopes.current.by_current, slopes.current.by_speed], [slopes.speed.by_current, slopes.speed.by_speed]];
        let begin = OperatingPoint { current, speed, voltage: from };
        let mut drift = self.motor.drift(begin, to, self.inverse_interval, &slopes, &self.memories);
        if constraints.current.is_some() {
            (f[0], jacobian[0], drift) = (S::ZERO, [S::ZERO; 2], S::ZERO);
        }
        if rotor_held {
            (f[1], jacobian[1]) = (S::ZERO, [S::ZERO; 2]);
        }
        let system = System::new(self.inverse_gamma_interval, jacobian);
        let by_time = drift * self.interval;

        let k1 = system.solve([f[0] + by_time * S::constant(GAMMA_SUM[0]), f[1]]);

        let second = OperatingPoint {
            current: current + k1[0],
            speed: speed + k1[1],
            voltage: from + (to - from) * S::constant(GAMMA),
        };
        let slopes = self.motor.slopes(&second, Some(direction), &self.memories);
        let f = [
            if constraints.current.is_some() { S::ZERO } else { slopes.current },
            if rotor_held { S::ZERO } else { slopes.speed },
        ];
        let [c21, c31, c32] = self.coupling;
        let k2 = system.solve([f[0] + c21 * k1[0] + by_time * S::constant(GAMMA_SUM[1]), f[1] + c21 * k1[1]]);

        let k3 = system.solve([
            f[0] + c31 * k1[0] + c32 * k2[0] + by_time * S::constant(GAMMA_SUM[2]),
            f[1] + c31 * k1[1] + c32 * k2[1],
        ]);

        let increment = |n: usize| S::constant(M[0]) * k1[n] + S::constant(M[1]) * k2[n] + S::constant(M[2]) * k3[n];
        compensated_add(&mut self.state.current, &mut self.rounding.current, increment(0));
        compensated_add(&mut self.state.speed, &mut self.rounding.speed, increment(1));
        if constraints.speed.is_none() && direction * self.state.speed < S::ZERO {
            self.state.speed = self.speed_after_crossing(speed, direction);
            self.rounding.speed = S::ZERO;
            self.crossed_zero = true;
        }
        if self.motor.remembers() {
            self.motor.advance(&Passed { interval: self.interval, before, after: self.state }, &mut self.memories);
        }
    }

    /// The speed at the end of a step in which it crossed zero, coming from `before` in `direction`: the step has
    /// counted the dry friction with the old sign throughout, which is wrong by twice the friction after the crossing.
    #[inline(always)]
    fn speed_after_crossing(&self, before: S, direction: S) -> S {
        let State { current, speed: crossed } = self.state;
        let reversed = -direction;
        let (torque, dry_friction, inverse_inertia) = self.motor.torques_at_rest(current, &self.memories);
        if torque * reversed <= dry_friction {
            return S::ZERO;
        }
        let share_after = crossed / (crossed - before);
        let friction = dry_friction * inverse_inertia;
        let corrected = crossed - reversed * S::constant(2.0) * friction * self.interval * share_after;
        if corrected * reversed > S::ZERO { corrected } else { S::ZERO }
    }
}

/// The direction of a motion; none at rest.
#[inline(always)]
fn moving<S: Scalar>(speed: S) -> Option<S> {
    if speed > S::ZERO {
        Some(S::ONE)
    } else if speed < S::ZERO {
        Some(-S::ONE)
    } else {
        None
    }
}

/// The matrix I/(γh) − J, inverted once for the three stages.
struct System<S> {
    inverse: [[S; 2]; 2],
}

impl<S: Scalar<Base = S>> System<S> {
    #[inline(always)]
    fn new(diagonal: S, [[j11, j12], [j21, j22]]: [[S; 2]; 2]) -> Self {
        let (a, b, c, d) = (diagonal - j11, -j12, -j21, diagonal - j22);
        let scale = S::ONE / (a * d - b * c);
        Self { inverse: [[d * scale, -b * scale], [-c * scale, a * scale]] }
    }
    #[inline(always)]
    fn solve(&self, [x, y]: [S; 2]) -> [S; 2] {
        let [[a, b], [c, d]] = self.inverse;
        [a * x + b * y, c * x + d * y]
    }
}

/// Kahan's compensated summation: `rounding` holds what the last additions lost.
#[inline(always)]
fn compensated_add<S: Scalar>(sum: &mut S, rounding: &mut S, increment: S) {
    let corrected = increment - *rounding;
    let next = *sum + corrected;
    *rounding = (next - *sum) - corrected;
    *sum = next;
}
