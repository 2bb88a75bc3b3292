//! What an effect or a fault may change: the parts from which the plant, its supply and the measuring chain are put
//! together. An effect adds parts to an [`Assembly`]; the plant knows none of the effects by name.
//!
//! A part without a memory is a closure. Parts see the true state ([`Instant`]). Those with a memory get `tick`, once
//! after each integration step (10 µs): their state is constant within a step, which is exact enough for anything
//! slower than about 1 ms, and for switching events places them on the grid of steps.

use rand_chacha::ChaCha8Rng;

use super::motor::Motor;
use super::streams::Streams;

/// The true state at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Instant {
    /// Time, s.
    pub t: f64,
    /// Voltage where it is measured, V.
    pub u: f64,
    /// Current, A.
    pub i: f64,
    /// Speed, rad/s.
    pub omega: f64,
    /// Angle of the rotor, rad.
    pub theta: f64,
}

/// Static magnetisation: the main flux is φ = x Π g(x) of the magnetising current x. Several laws multiply.
pub trait FluxLaw: Send {
    /// The factor g at magnetising current `x`, A; even in `x`, 1 at zero, and such that x g(x) never falls.
    fn factor(&self, x: f64) -> f64;
}

/// Magnetisation with a memory: the effective magnetising current ξ for the true one x.
pub trait FluxHistory: Send {
    /// ξ at `x`, when x has moved monotonically since the last `commit`.
    fn value(&self, x: f64) -> f64;
    /// dξ/dx at `x`, for x about to rise or to fall.
    fn slope(&self, x: f64, rising: bool) -> f64;
    /// Makes `x` the point that the next step starts from.
    fn commit(&mut self, x: f64);
}

/// Flux that lags: τ dφ/dt = F(x) − φ.
pub trait FluxLag: Send {
    /// The time constant τ at speed `omega`, s.
    fn time_constant(&self, omega: f64) -> f64;
}

/// Flux that reaches the armature conductors: K φ is multiplied by this in back-EMF and torque alike.
pub trait FluxShare: Send {
    /// The factor at current `i` and speed `omega`.
    fn factor(&self, i: f64, omega: f64) -> f64;
    /// Moves on by `dt` seconds.
    fn tick(&mut self, _dt: f64, _now: &Instant) {}
}

/// Inductance that depends on the current: all inductance is multiplied by this.
pub trait InductanceLaw: Send {
    /// The factor of dλ/di at current `i`.
    fn factor(&self, i: f64) -> f64;
}

/// A voltage in series with the winding that opposes the current.
pub trait VoltageDrop: Send {
    /// The drop, V, with the sign of the current.
    fn volts(&self, i: f64, omega: f64) -> f64;
    /// Moves on by `dt` seconds.
    fn tick(&mut self, _dt: f64, _now: &Instant) {}
}

/// Resistance that varies: R is multiplied by 1 + Σ rise.
pub trait ResistanceRise: Send {
    /// The relative rise at speed `omega`.
    fn rise(&self, omega: f64) -> f64;
    /// Moves on by `dt` seconds.
    fn tick(&mut self, _dt: f64, _now: &Instant) {}
}

/// Friction that holds a rotor at rest: opposes the motion, whatever its speed.
pub trait DryFriction: Send {
    /// The torque, N m, at |ω| = `speed` and direction of motion `direction` (±1); added to μ0.
    fn level(&self, speed: f64, direction: f64) -> f64;
    /// Moves on by `dt` seconds.
    fn tick(&mut self, _dt: f64, _now: &Instant) {}
}

/// Any other torque on the rotor: added to the right-hand side of J dω/dt.
pub trait Torque: Send {
    /// The torque, N m, at current `i`, speed `omega`, rotor angle `theta`; `air_gap` is the electromagnetic torque.
    fn torque(&self, i: f64, omega: f64, theta: f64, air_gap: f64) -> f64;
    /// Moves on by `dt` seconds.
    fn tick(&mut self, _dt: f64, _now: &Instant) {}
}

/// A supply whose output is not what it is told: the recording shows the command.
pub trait Converter: Send {
    /// The voltage at the motor, V, for a command and the present current.
    fn output(&self, command: f64, i: f64) -> f64;
}

/// An analogue element between a true quantity and the anti-alias filter of its channel; runs once per integration
/// step.
pub trait Sensor: Send {
    /// What comes out when `value` goes in.
    fn sense(&mut self, value: f64, now: &Instant, dt: f64) -> f64;
}

/// The three measured channels, in the order in which the converter samples them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measured {
    /// Voltage.
    Voltage = 0,
    /// Current.
    Current = 1,
    /// Speed.
    Speed = 2,
}

/// A channel's front end and converter, as effects may change it.
#[derive(Default)]
pub struct ChannelParts {
    /// Analogue elements, in the order in which the signal passes.
    pub sensors: Vec<Box<dyn Sensor>>,
    /// The amplifier's output limits in units of the channel, where they are narrower than the converter's range.
    pub limits: Option<(f64, f64)>,
    /// Effective bits, where they are fewer than the converter's.
    pub bits: Option<u32>,
}

/// A rig in the making: the motor, and the parts that effects add.
pub struct Assembly {
    /// The motor; effects may change its base parameters (a fan law in place of μ2).
    pub motor: Motor,
    /// Random streams, told apart by identifier.
    pub streams: Streams,
    /// Remanent flux, as a magnetising current, A.
    pub remanence: f64,
    /// Static magnetisation.
    pub flux_laws: Vec<Box<dyn FluxLaw>>,
    /// Magnetisation with a memory: one at most.
    pub flux_history: Option<Box<dyn FluxHistory>>,
    /// Lag of the flux: the time constants add.
    pub flux_lags: Vec<Box<dyn FluxLag>>,
    /// Weakening of the flux in the armature.
    pub flux_shares: Vec<Box<dyn FluxShare>>,
    /// Inductance laws.
    pub inductance_laws: Vec<Box<dyn InductanceLaw>>,
    /// Voltage drops.
    pub drops: Vec<Box<dyn VoltageDrop>>,
    /// Rises of the resistance.
    pub rises: Vec<Box<dyn ResistanceRise>>,
    /// Dry friction beside μ0.
    pub dry: Vec<Box<dyn DryFriction>>,
    /// Other torques.
    pub torques: Vec<Box<dyn Torque>>,
    /// Resistance and inductance between the voltage measurement and the motor, Ω and H.
    pub supply_impedance: (f64, f64),
    /// What stands between the command and the motor.
    pub converter: Option<Box<dyn Converter>>,
    /// Front ends, indexed by [`Measured`].
    pub channels: [ChannelParts; 3],
}

impl Assembly {
    /// A motor without any effect.
    pub fn new(motor: Motor, streams: Streams) -> Self {
        Self {
            motor,
            streams,
            remanence: 0.0,
            flux_laws: Vec::new(),
            flux_history: None,
            flux_lags: Vec::new(),
            flux_shares: Vec::new(),
            inductance_laws: Vec::new(),
            drops: Vec::new(),
            rises: Vec::new(),
            dry: Vec::new(),
            torques: Vec::new(),
            supply_impedance: (0.0, 0.0),
            converter: None,
            channels: Default::default(),
        }
    }

    /// Scales the flux so that the nameplate stays true: with saturation, the mean torque at the nominal current (a
    /// sine of the nominal peak) is still K I². K and L_m become those of the unsaturated motor, larger by the same
    /// factor.
    ///
    /// Without this a saturated motor would draw nearly twice its nominal current, and be another motor.
    pub fn keep_nameplate(&mut self) {
        if self.flux_laws.is_empty() {
            return;
        }
        let peak = self.motor.nameplate.peak_current_a;
        let points = 200;
        let (mut linear, mut actual) = (0.0, 0.0);
        for n in 0..points {
            let sine = ((f64::from(n) + 0.5) / f64::from(points) * std::f64::consts::FRAC_PI_2).sin();
            linear += sine * sine;
            actual += self.flux_laws.iter().fold(sine * sine, |product, law| product * law.factor(peak * sine));
        }
        let gain = linear / actual;
        let main = gain * self.motor.main_share * self.motor.l;
        let leakage = (1.0 - self.motor.main_share) * self.motor.l;
        self.motor.k *= gain;
        self.motor.l = leakage + main;
        self.motor.main_share = main / self.motor.l;
    }

    /// The parts of a channel.
    pub fn channel(&mut self, channel: Measured) -> &mut ChannelParts {
        &mut self.channels[channel as usize]
    }

    /// A stream of random numbers for an effect or a fault.
    pub fn rng(&self, id: &str) -> ChaCha8Rng {
        self.streams.named(id)
    }
}

impl<F: Fn(f64) -> f64 + Send> FluxLaw for F {
    fn factor(&self, x: f64) -> f64 {
        self(x)
    }
}

impl<F: Fn(f64) -> f64 + Send> FluxLag for F {
    fn time_constant(&self, omega: f64) -> f64 {
        self(omega)
    }
}

impl<F: Fn(f64, f64) -> f64 + Send> FluxShare for F {
    fn factor(&self, i: f64, omega: f64) -> f64 {
        self(i, omega)
    }
}

impl<F: Fn(f64) -> f64 + Send> InductanceLaw for F {
    fn factor(&self, i: f64) -> f64 {
        self(i)
    }
}

impl<F: Fn(f64, f64) -> f64 + Send> VoltageDrop for F {
    fn volts(&self, i: f64, omega: f64) -> f64 {
        self(i, omega)
    }
}

impl<F: Fn(f64) -> f64 + Send> ResistanceRise for F {
    fn rise(&self, omega: f64) -> f64 {
        self(omega)
    }
}

impl<F: Fn(f64, f64) -> f64 + Send> DryFriction for F {
    fn level(&self, speed: f64, direction: f64) -> f64 {
        self(speed, direction)
    }
}

impl<F: Fn(f64, f64, f64, f64) -> f64 + Send> Torque for F {
    fn torque(&self, i: f64, omega: f64, theta: f64, air_gap: f64) -> f64 {
        self(i, omega, theta, air_gap)
    }
}

impl<F: Fn(f64, f64) -> f64 + Send> Converter for F {
    fn output(&self, command: f64, i: f64) -> f64 {
        self(command, i)
    }
}

impl<F: FnMut(f64, &Instant, f64) -> f64 + Send> Sensor for F {
    fn sense(&mut self, value: f64, now: &Instant, dt: f64) -> f64 {
        self(value, now, dt)
    }
}
