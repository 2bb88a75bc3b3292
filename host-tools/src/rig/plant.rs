//! The motor itself, in continuous time, with equations and an integrator of its own: nothing here is shared with the
//! model that the host tool fits.
//!
//! Universal motor, with magnetising current ξ and main flux φ = f(ξ) in amperes, L_m = χ L, L_σ = (1 − χ) L:
//!
//! ```text
//! u = R (1 + rise) i + drops(i, ω) + K s φ ω + L_σ di/dt + L_m dφ/dt
//! J dω/dt = K s φ i − μ1 ω − μ2 ω |ω| + torques − sign(ω) (μ0 + dry(|ω|))
//! ```
//!
//! ξ = i + i_r, then the hysteresis; s is the share of the flux that reaches the armature; with eddy lag φ follows
//! τ dφ/dt = f(ξ) − φ. Without effects φ = i, and L_σ + L_m = L. A magnet motor has φ = 1 in the products with K
//! and dφ/dt = 0. The same K s φ stands in both equations: air-gap power is mechanical power.
//!
//! Classical Runge–Kutta of fourth order at a fixed step. Switching is not smeared over a step: at a zero of the speed
//! (dry friction turns round) or of a current that extinguishes, the step is cut at the zero, found by the Illinois
//! variant of regula falsi (Dowell and Jarratt, BIT 11, 1971). At rest the rotor stays until the torque exceeds the
//! friction at zero speed; this is looked at once in each step.

use super::motor::Kind;
use super::parts::{
    Assembly, Converter, DryFriction, FluxHistory, FluxLag, FluxLaw, FluxShare, InductanceLaw, Instant, ResistanceRise,
    Torque, VoltageDrop,
};

/// What the integrator advances.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct State {
    /// Current, A.
    pub i: f64,
    /// Speed, rad/s.
    pub omega: f64,
    /// Angle, rad.
    pub theta: f64,
    /// Main flux where it lags, A.
    pub flux: f64,
}

/// How the rotor moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rotor {
    /// Held by a clamp: the speed is zero.
    Locked,
    /// At rest, held by dry friction.
    Resting,
    /// Turning forwards (1) or backwards (−1).
    Turning(f64),
}

/// The contact between supply and motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    /// Connected.
    Closed,
    /// Connected until the current is zero: a TRIAC without gate current, a freewheeling diode.
    UntilZero,
    /// Open: no current, and the terminals show what the motor induces.
    Open,
}

#[derive(Debug, Clone, Copy)]
struct Slopes {
    i: f64,
    omega: f64,
    flux: f64,
}

/// f(ξ) and its slope on a grid, odd in ξ, so that a law with powers costs no more than a few multiplications.
struct FluxTable {
    per_ampere: f64,
    /// Coefficients of s⁰ … s³, s from 0 to 1 across the interval.
    pieces: Vec<[f64; 4]>,
    last: i32,
}

/// Grid intervals to a nominal peak current.
const TABLE_DENSITY: u32 = 200;
/// Where the table ends, in nominal peak currents: beyond û/R of the universal motor.
const TABLE_REACH: u32 = 25;

impl FluxTable {
    /// Cubic Hermite pieces: the relative error of the flux is below 1e-7 for every law with a knee as sharp as n = 4.
    /// Beyond the end the flux goes on in a straight line.
    fn new(laws: &[Box<dyn FluxLaw>], peak_current_a: f64) -> Self {
        let per_ampere = f64::from(TABLE_DENSITY) / peak_current_a;
        let flux = |node: f64| {
            let x = node / per_ampere;
            laws.iter().fold(x, |f, law| f * law.factor(x.abs()))
        };
        // Two nodes more on either side for the five-point central difference; slopes are per grid interval.
        let values: Vec<f64> = (0..TABLE_DENSITY * TABLE_REACH + 5).map(|n| flux(f64::from(n) - 2.0)).collect();
        let nodes: Vec<(f64, f64)> =
            values.windows(5).map(|v| (v[2], (v[0] - 8.0 * v[1] + 8.0 * v[3] - v[4]) / 12.0)).collect();
        let mut pieces: Vec<[f64; 4]> = nodes
            .windows(2)
            .map(|pair| {
                let ((f0, m0), (f1, m1)) = (pair[0], pair[1]);
                [f0, m0, 3.0 * (f1 - f0) - 2.0 * m0 - m1, 2.0 * (f0 - f1) + m0 + m1]
            })
            .collect();
        pieces.extend(nodes.last().map(|&(f, m)| [f, m, 0.0, 0.0]));
        Self { per_ampere, pieces, last: (TABLE_DENSITY * TABLE_REACH) as i32 }
    }

    #[inline]
    fn at(&self, x: f64) -> (f64, f64) {
        let place = x.abs() * self.per_ampere;
        // By way of i32, which converts in one instruction each way.
        let n = (place as i32).min(self.last);
        let s = place - f64::from(n);
        let [c0, c1, c2, c3] = self.pieces[n as usize];
        let flux = (c0 + s * c1) + (s * s) * (c2 + s * c3);
        let slope = (c1 + s * (2.0 * c2)) + (s * s) * (3.0 * c3);
        (flux.copysign(x), slope * self.per_ampere)
    }
}

/// A motor with its effects, its load and the contact to its supply.
pub struct Plant {
    universal: bool,
    r: f64,
    r_supply: f64,
    l_leakage: f64,
    l_main: f64,
    l_supply: f64,
    k: f64,
    per_inertia: f64,
    mu0: f64,
    mu1: f64,
    mu2: f64,
    remanence: f64,
    table: Option<FluxTable>,
    history: Option<Box<dyn FluxHistory>>,
    lags: Vec<Box<dyn FluxLag>>,
    shares: Vec<Box<dyn FluxShare>>,
    inductance: Vec<Box<dyn InductanceLaw>>,
    drops: Vec<Box<dyn VoltageDrop>>,
    rises: Vec<Box<dyn ResistanceRise>>,
    dry: Vec<Box<dyn DryFriction>>,
    torques: Vec<Box<dyn Torque>>,
    converter: Option<Box<dyn Converter>>,
    /// Whether any of the lists above has an entry; a motor without is simulated at twice the speed.
    has_parts: bool,
    /// Where the motor is now.
    pub state: State,
    /// How the rotor moves.
    pub rotor: Rotor,
    /// Whether the supply is connected.
    pub contact: Contact,
    /// Relative excess of the speed-dependent load (turbulence); constant within a step.
    pub gust: f64,
}

/// Cuts of a step at zeros; more would mean that a mode switches without end.
const MOST_CUTS: usize = 8;

impl Plant {
    /// A motor at rest without current, with the parts of an assembly.
    pub fn new(parts: Assembly) -> (Self, [super::parts::ChannelParts; 3]) {
        let motor = parts.motor;
        let (r_supply, l_supply) = parts.supply_impedance;
        let has_parts = !(parts.flux_lags.is_empty()
            && parts.flux_shares.is_empty()
            && parts.inductance_laws.is_empty()
            && parts.drops.is_empty()
            && parts.rises.is_empty()
            && parts.dry.is_empty()
            && parts.torques.is_empty());
        let mut plant = Self {
            has_parts,
            universal: motor.kind == Kind::Universal,
            r: motor.r,
            r_supply,
            l_leakage: (1.0 - motor.main_share) * motor.l,
            l_main: motor.main_share * motor.l,
            l_supply,
            k: motor.k,
            per_inertia: 1.0 / motor.j,
            mu0: motor.mu0,
            mu1: motor.mu1,
            mu2: motor.mu2,
            remanence: parts.remanence,
            table: (!parts.flux_laws.is_empty())
                .then(|| FluxTable::new(&parts.flux_laws, motor.nameplate.peak_current_a)),
            history: parts.flux_history,
            lags: parts.flux_lags,
            shares: parts.flux_shares,
            inductance: parts.inductance_laws,
            drops: parts.drops,
            rises: parts.rises,
            dry: parts.dry,
            torques: parts.torques,
            converter: parts.converter,
            state: State::default(),
            rotor: Rotor::Resting,
            contact: Contact::Closed,
            gust: 0.0,
        };
        plant.state.flux = plant.static_flux(0.0).0;
        (plant, parts.channels)
    }

    /// Clamps the rotor, or lets it go.
    pub fn lock(&mut self, locked: bool) {
        if locked {
            self.state.omega = 0.0;
            self.rotor = Rotor::Locked;
        } else if self.rotor == Rotor::Locked {
            self.rotor = Rotor::Resting;
        }
    }

    /// Sets the rotor turning, as another drive would (for tests of coast-down).
    pub fn spin(&mut self, omega: f64) {
        self.state.omega = omega;
        self.rotor = if omega == 0.0 { Rotor::Resting } else { Rotor::Turning(omega.signum()) };
    }

    /// Total torque but for dry friction, N m, at the present state.
    fn torque(&self, x: &State, pull: f64) -> f64 {
        let air_gap = pull * x.i;
        let mut torque = self.base_torque(x, pull);
        for part in &self.torques {
            torque += part.torque(x.i, x.omega, x.theta, air_gap);
        }
        torque
    }

    /// The same of the base model.
    fn base_torque(&self, x: &State, pull: f64) -> f64 {
        pull * x.i - x.omega * (self.mu1 + self.mu2 * x.omega.abs()) * (1.0 + self.gust)
    }

    fn dry_friction(&self, speed: f64, direction: f64) -> f64 {
        self.dry.iter().fold(self.mu0, |sum, part| sum + part.level(speed, direction))
    }

    /// Main flux without lag, and the magnetising current after hysteresis, dφ/dξ.
    #[inline]
    fn static_flux(&self, i: f64) -> (f64, f64) {
        let x = i + self.remanence;
        let x = self.history.as_ref().map_or(x, |h| h.value(x));
        self.table.as_ref().map_or((x, 1.0), |t| t.at(x))
    }

    fn share(&self, x: &State) -> f64 {
        self.shares.iter().fold(1.0, |s, part| s * part.factor(x.i, x.omega))
    }

    /// K s φ: volts per rad/s, and newton metres per ampere.
    fn pull(&self, x: &State, flux: f64) -> f64 {
        let k = self.linear_pull(flux);
        if self.shares.is_empty() { k } else { k * self.share(x) }
    }

    /// The same where all flux reaches the armature.
    fn linear_pull(&self, flux: f64) -> f64 {
        if self.universal { self.k * flux } else { self.k }
    }

    /// Flux in the iron and its rate of change where it lags.
    fn lagging(&self, x: &State, target: f64) -> Option<(f64, f64)> {
        if self.lags.is_empty() {
            return None;
        }
        let tau: f64 = self.lags.iter().map(|lag| lag.time_constant(x.omega)).sum();
        Some((x.flux, (target - x.flux) / tau))
    }

    #[inline]
    fn slopes<const PARTS: bool>(&self, x: &State, u: f64) -> Slopes {
        let (target, saturation) = if self.universal { self.static_flux(x.i) } else { (1.0, 0.0) };
        let lag = if PARTS && self.universal { self.lagging(x, target) } else { None };
        let (flux, dflux) = lag.unwrap_or((target, 0.0));
        let pull = if PARTS { self.pull(x, flux) } else { self.linear_pull(flux) };
        let di = if self.contact == Contact::Open {
            0.0
        } else {
            let mut r = self.r;
            if PARTS && !self.rises.is_empty() {
                r *= self.rises.iter().fold(1.0, |sum, part| sum + part.rise(x.omega));
            }
            let mut left = u - (r + self.r_supply) * x.i - pull * x.omega;
            if PARTS {
                left -= self.l_main * dflux;
                for part in &self.drops {
                    left -= part.volts(x.i, x.omega);
                }
            }
            let mut l = self.l_leakage;
            if lag.is_none() {
                let history = self.history.as_ref().map_or(1.0, |h| h.slope(x.i + self.remanence, left > 0.0));
                l += self.l_main * saturation * history;
            }
            if PARTS {
                for law in &self.inductance {
                    l *= law.factor(x.i);
                }
            }
            // The reciprocal does not wait for the voltage.
            left * (1.0 / (l + self.l_supply))
        };
        let domega = match self.rotor {
            Rotor::Locked | Rotor::Resting => 0.0,
            Rotor::Turning(direction) => {
                let (torque, dry) = if PARTS {
                    (self.torque(x, pull), self.dry_friction(x.omega.abs(), direction))
                } else {
                    (self.base_torque(x, pull), self.mu0)
                };
                (torque - direction * dry) * self.per_inertia
            }
        };
        Slopes { i: di, omega: domega, flux: dflux }
    }

    /// One Runge–Kutta step; `u` at the step's begin, middle and end. Nothing is kept.
    fn runge_kutta(&self, h: f64, u: [f64; 3]) -> State {
        if self.has_parts { self.step::<true>(h, u) } else { self.step::<false>(h, u) }
    }

    fn step<const PARTS: bool>(&self, h: f64, u: [f64; 3]) -> State {
        let x = self.state;
        let at = |s: Slopes, h: f64| State {
            i: x.i + h * s.i,
            omega: x.omega + h * s.omega,
            theta: x.theta + h * x.omega,
            flux: x.flux + h * s.flux,
        };
        let half = 0.5 * h;
        let a = self.slopes::<PARTS>(&x, u[0]);
        let xb = at(a, half);
        let b = self.slopes::<PARTS>(&xb, u[1]);
        let xc = at(b, half);
        let c = self.slopes::<PARTS>(&xc, u[1]);
        let xd = at(c, h);
        let d = self.slopes::<PARTS>(&xd, u[2]);
        let sixth = h / 6.0;
        State {
            i: x.i + sixth * (a.i + 2.0 * (b.i + c.i) + d.i),
            omega: x.omega + sixth * (a.omega + 2.0 * (b.omega + c.omega) + d.omega),
            theta: x.theta + sixth * (x.omega + 2.0 * (xb.omega + xc.omega) + xd.omega),
            flux: x.flux + sixth * (a.flux + 2.0 * (b.flux + c.flux) + d.flux),
        }
    }

    /// Advances by `h` seconds under a voltage that is smooth within the step: `u` at its begin, middle and end, and
    /// `wave` the voltage at any time from the step's begin, for the rare step that has to be cut.
    pub fn advance(&mut self, h: f64, u: [f64; 3], wave: impl Fn(f64) -> f64) {
        let present = self.state.i;
        let whole = self.runge_kutta(h, u.map(|u| self.applied(u, present)));
        if !self.stops(&whole) && !self.extinguishes(&whole) {
            self.accept(whole);
            return;
        }
        let mut done = 0.0;
        for cut in 0..=MOST_CUTS {
            let rest = h - done;
            let step = |plant: &Self, part: f64| {
                let u = [0.0, 0.5 * part, part].map(|t| plant.applied(wave(done + t), present));
                plant.runge_kutta(part, u)
            };
            if self.state.omega == 0.0 && self.stops(&step(self, rest)) {
                self.rotor = Rotor::Resting;
            }
            let end = step(self, rest);
            let stop = self.stops(&end).then(|| first_zero(rest, self.state.omega, |part| step(self, part).omega));
            let out = self.extinguishes(&end).then(|| first_zero(rest, self.state.i, |part| step(self, part).i));
            let part = stop.unwrap_or(rest).min(out.unwrap_or(rest));
            if part >= rest || cut == MOST_CUTS {
                self.accept(end);
                return;
            }
            let mut next = step(self, part);
            if stop == Some(part) {
                next.omega = 0.0;
                self.rotor = Rotor::Resting;
            }
            if out == Some(part) {
                next.i = 0.0;
                self.contact = Contact::Open;
            }
            self.accept(next);
            done += part;
        }
    }

    /// The voltage behind the converter, V.
    fn applied(&self, command: f64, i: f64) -> f64 {
        self.converter.as_ref().map_or(command, |c| c.output(command, i))
    }

    fn stops(&self, next: &State) -> bool {
        matches!(self.rotor, Rotor::Turning(direction) if next.omega * direction < 0.0)
    }

    fn extinguishes(&self, next: &State) -> bool {
        self.contact == Contact::UntilZero && self.state.i * next.i < 0.0
    }

    fn accept(&mut self, next: State) {
        self.state = next;
        if let Some(history) = &mut self.history {
            history.commit(next.i + self.remanence);
        }
        self.settle();
    }

    /// Lets a resting rotor go when the torque exceeds the friction that holds it.
    fn settle(&mut self) {
        if self.rotor == Rotor::Resting {
            let torque = self.torque(&self.state, self.pull(&self.state, self.flux()));
            if torque.abs() > self.dry_friction(0.0, torque.signum()) {
                self.rotor = Rotor::Turning(torque.signum());
            }
        }
    }

    /// Lets the parts with a memory move on; `now` is the state at the end of the step.
    pub fn tick(&mut self, dt: f64, now: &Instant) {
        self.shares.iter_mut().for_each(|p| p.tick(dt, now));
        self.drops.iter_mut().for_each(|p| p.tick(dt, now));
        self.rises.iter_mut().for_each(|p| p.tick(dt, now));
        self.dry.iter_mut().for_each(|p| p.tick(dt, now));
        self.torques.iter_mut().for_each(|p| p.tick(dt, now));
    }

    /// Main flux, A; 1 in a magnet motor.
    pub fn flux(&self) -> f64 {
        if !self.universal {
            return 1.0;
        }
        let target = self.static_flux(self.state.i).0;
        self.lagging(&self.state, target).map_or(target, |(flux, _)| flux)
    }

    /// K s φ, V s/rad, at the end of a path of currents, A, at a steady speed, rad/s: slow enough that no flux lags.
    pub fn linkage(mut self, path: impl Iterator<Item = f64>, speed: f64) -> f64 {
        for current in path {
            self.state = State { i: current, omega: speed, ..self.state };
            if let Some(history) = &mut self.history {
                history.commit(current + self.remanence);
            }
        }
        let flux = if self.universal { self.static_flux(self.state.i).0 } else { 1.0 };
        self.pull(&self.state, flux)
    }

    /// What the terminals show while the supply is open, V.
    pub fn open_voltage(&self) -> f64 {
        let x = &self.state;
        if !self.universal {
            return self.pull(x, 1.0) * x.omega;
        }
        let target = self.static_flux(x.i).0;
        let (flux, dflux) = self.lagging(x, target).unwrap_or((target, 0.0));
        self.pull(x, flux) * x.omega + self.l_main * dflux
    }
}

/// The part of a step at which a quantity that starts at `begin` and has changed sign at `end_time` is zero.
fn first_zero(end_time: f64, begin: f64, quantity: impl Fn(f64) -> f64) -> f64 {
    let (mut a, mut fa) = (0.0, begin);
    let (mut b, mut fb) = (end_time, quantity(end_time));
    if fa == 0.0 {
        return 0.0;
    }
    for _ in 0..12 {
        let c = b - fb * (b - a) / (fb - fa);
        let fc = quantity(c);
        if fc.abs() <= 1e-12 * begin.abs() {
            return c;
        }
        if fc * fb < 0.0 {
            (a, fa) = (b, fb);
        } else {
            // Illinois: without this the same end would stay for good.
            fa *= 0.5;
        }
        (b, fb) = (c, fc);
    }
    b
}
