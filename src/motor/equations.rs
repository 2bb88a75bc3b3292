//! The equations of motion: base model plus the contributions of the effects.

use crate::effects::{Acts, Effect, MAX_EFFECTS, Memory, Passed};
use crate::motor::balance::{Balance, OperatingPoint, State};
use crate::motor::gradient::Gradient;
use crate::motor::parameters::{FluxLaw, ParameterError, Parameters};
use crate::scalar::Scalar;
use crate::term::{Op, Target, Term};

/// Time derivatives of the states, and what the decision at standstill needs.
#[derive(Debug, Clone, Copy)]
pub struct Slopes<N: Scalar> {
    /// di/dt, A/s.
    pub current: N,
    /// dω/dt, rad/s².
    pub speed: N,
    /// Incremental inductance, H.
    pub inductance: N,
    /// Direction of the motion: −1, 0 (held by dry friction), 1.
    pub direction: N::Base,
}

/// A validated motor, ready to be stepped.
#[derive(Debug, Clone)]
pub struct Motor<S> {
    parameters: Parameters<S>,
    inverse_inertia: S,
    effects: heapless::Vec<Effect<S>, MAX_EFFECTS>,
    terms: heapless::Vec<Term<S>, MAX_TERMS>,
    lags: bool,
    bends_supply: bool,
    measures: bool,
    remembers: bool,
    /// Those effects that can turn the rotor, a bit each.
    turning: u8,
}

/// How many terms of the user's own a motor can have.
pub const MAX_TERMS: usize = 2;

/// What the effects of a motor remember, in the order of [`Motor::effects`].
pub type Memories<S> = [Memory<S>; MAX_EFFECTS];

/// The same at several places of a recording, effect by effect.
pub type Remembered<S, const PLACES: usize> = [[Memory<S>; PLACES]; MAX_EFFECTS];

impl<S: Scalar<Base = S>> Motor<S> {
    /// Validates the parameters.
    ///
    /// # Errors
    /// A value that is not finite or out of its range, or too many effects.
    pub fn build(parameters: Parameters<S>, effects: &[Effect<S>]) -> Result<Self, ParameterError> {
        parameters.validate()?;
        for effect in effects {
            effect.validate()?;
        }
        let mut effects =
            heapless::Vec::<Effect<S>, MAX_EFFECTS>::from_slice(effects).map_err(|_| ParameterError::TooManyEffects)?;
        // By insertion: they are few, and the library's sort recurses, so that nothing could be said about the stack.
        for end in 1..effects.len() {
            for k in (1..=end).rev() {
                if effects[k - 1].id() <= effects[k].id() {
                    break;
                }
                effects.swap(k - 1, k);
            }
        }
        Ok(Self {
            parameters,
            inverse_inertia: S::ONE / parameters.inertia,
            lags: effects.iter().any(|e| e.id().traits().lags_flux),
            bends_supply: effects.iter().any(|e| e.id().traits().bends_supply),
            measures: effects.iter().any(|e| e.id().traits().acts == Acts::Measuring),
            remembers: effects.iter().any(|e| e.id().traits().remembers),
            turning: effects
                .iter()
                .rev()
                .fold(0, |bits, e| bits << 1 | u8::from(matches!(e.id().traits().acts, Acts::Mechanical | Acts::Both))),
            effects,
            terms: heapless::Vec::new(),
        })
    }

    /// The same motor with terms of the user's own.
    ///
    /// # Errors
    /// More than [`MAX_TERMS`].
    pub fn with_terms(mut self, terms: &[Term<S>]) -> Result<Self, ParameterError> {
        self.terms = heapless::Vec::from_slice(terms).map_err(|_| ParameterError::TooManyEffects)?;
        self.bends_supply |= terms.iter().any(|term| term.ops().any(|op| matches!(op, Op::Voltage)));
        Ok(self)
    }

    /// The terms of the user's own.
    pub fn terms(&self) -> &[Term<S>] {
        &self.terms
    }

    /// The parameters of the base model.
    pub fn parameters(&self) -> &Parameters<S> {
        &self.parameters
    }

    /// The effects, in the order in which they act, which is that of the catalogue.
    pub fn effects(&self) -> &[Effect<S>] {
        &self.effects
    }

    /// What the effects remember when a run begins.
    pub fn memories_at_start(&self, state: State<S>) -> Memories<S> {
        self.memories_after(state, S::ZERO)
    }

    /// What they remember where a run goes on in a state, so long after it began, s.
    pub fn memories_after(&self, state: State<S>, elapsed: S) -> Memories<S> {
        let mut memories = [Memory::default(); MAX_EFFECTS];
        for (effect, memory) in self.effects.iter().zip(&mut memories) {
            *memory = effect.at_start(state, elapsed);
        }
        memories
    }

    /// Whether an effect has a memory that moves.
    pub(crate) fn remembers(&self) -> bool {
        self.remembers
    }

    /// Lets the memories of the effects move on over a step.
    #[inline(always)]
    pub fn advance(&self, passed: &Passed<S>, memories: &mut Memories<S>) {
        if self.remembers {
            for (effect, memory) in self.effects.iter().zip(memories) {
                effect.advance(passed, memory);
            }
        }
    }

    /// What the effects remember at a point of a recording, where nothing is stepped: see
    /// [`crate::effects::PhysicalEffect::around_point`].
    pub fn around_point(&self, memories: &Memories<S>) -> Memories<S> {
        let mut around = *memories;
        for (effect, memory) in self.effects.iter().zip(&mut around) {
            *memory = effect.around_point(memory);
        }
        around
    }

    /// [`Motor::advance`] over many steps, effect by effect: `passed` gives them by their place, and what the effects
    /// remember around the end of each is kept in `remembered`. A place without a step leaves all as it is.
    pub fn advance_over_each<const PLACES: usize>(
        &self,
        passed: impl Fn(usize) -> Option<Passed<S>>,
        memories: &mut Memories<S>,
        remembered: &mut Remembered<S, PLACES>,
    ) {
        for ((effect, memory), remembered) in self.effects.iter().zip(memories).zip(remembered) {
            if effect.id().traits().remembers {
                effect.advance_over_each(&passed, memory, remembered);
            }
        }
    }

    /// What the measuring chain shows of the true state.
    #[inline(always)]
    pub fn measure(&self, memories: &Memories<S>, state: State<S>) -> State<S> {
        if !self.measures {
            return state;
        }
        let mut reading = state;
        for (effect, memory) in self.effects.iter().zip(memories) {
            effect.measure(memory, &mut reading);
        }
        reading
    }

    /// All terms of the voltage and the torque balance at an operating point.
    #[inline(always)]
    pub fn balance<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, memories: &Memories<S>) -> Balance<N> {
        let mut balance = self.base(at);
        self.contribute(at, memories, &mut balance);
        balance
    }

    /// What effects and terms of the user's own change, in place: the balance has more numbers than the processor has
    /// registers.
    #[inline(always)]
    fn contribute<N: Scalar<Base = S>>(
        &self,
        at: &OperatingPoint<N>,
        memories: &Memories<S>,
        balance: &mut Balance<N>,
    ) {
        for (effect, memory) in self.effects.iter().zip(memories) {
            effect.contribute(at, memory, balance);
        }
        self.contribute_terms(at, balance);
    }

    /// What terms of the user's own change.
    #[inline(always)]
    fn contribute_terms<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>, balance: &mut Balance<N>) {
        for term in &self.terms {
            let value = term.value(at.current, at.speed, at.voltage);
            match term.target() {
                Target::Voltage => balance.voltage += value,
                Target::Torque => balance.friction += value,
            }
        }
    }

    /// The terms without effects.
    #[inline(always)]
    fn base<N: Scalar<Base = S>>(&self, at: &OperatingPoint<N>) -> Balance<N> {
        let p = &self.parameters;
        Balance {
            magnetising: at.current,
            flux: N::ONE,
            flux_slope: N::ONE,
            flux_lag: N::ZERO,
            supply: at.voltage,
            resistance: N::lift(p.resistance),
            inductance: N::lift(p.inductance),
            base_inductance: p.inductance,
            voltage: N::ZERO,
            torque: N::ZERO,
            inverse_inertia: self.inverse_inertia,
            dry_friction: N::lift(p.dry_friction),
            dry_asymmetry: S::ZERO,
            viscous_friction: N::lift(p.viscous_friction),
            turbulent_friction: N::lift(p.turbulent_friction),
            friction: N::ZERO,
        }
    }

    /// Rate of di/dt by time, A/s², while the voltage goes from that of `at` to `to` within `interval` seconds.
    /// `slopes` are those at `at`.
    #[inline(always)]
    pub(crate) fn drift(
        &self,
        at: OperatingPoint<S>,
        to: S,
        inverse_interval: S,
        slopes: &Slopes<Gradient<S>>,
        memories: &Memories<S>,
    ) -> S {
        if self.bends_supply {
            let beyond = OperatingPoint { voltage: to, ..at };
            let current = |at| self.current_slope_with_effects(at, slopes.direction, memories);
            (current(&beyond) - current(&at)) * inverse_interval
        } else {
            (to - at.voltage) * inverse_interval / slopes.inductance.value
        }
    }

    /// di/dt, A/s, of a motor with effects or terms. A function by itself: few motors need it, and the code of the
    /// sampling interrupt has little room.
    #[inline(never)]
    fn current_slope_with_effects(&self, at: &OperatingPoint<S>, direction: S, memories: &Memories<S>) -> S {
        let mut balance = self.base(at);
        self.contribute(at, memories, &mut balance);
        self.slopes_of(at, Some(direction), &balance, self.lags).current
    }

    /// K φ, V s/rad: back-EMF per speed, torque per current.
    #[inline(always)]
    pub fn linkage<N: Scalar<Base = S>>(&self, b: &Balance<N>) -> N {
        let k = b.flux.times(self.parameters.flux_coefficient);
        match self.parameters.flux_law {
            FluxLaw::Series => k * b.magnetising,
            FluxLaw::PermanentMagnet => k,
        }
    }

    /// Equations 13 and 14 of Rakar & Juričić (2004), solved for the derivatives:
    /// `L di/dt = u − R i − K φ ω − v` and `J dω/dt = K φ i + τ − s μ0 − μ1 ω − μ2 ω|ω|`.
    ///
    /// Flux that lags by T is φ − T dφ/dt, to first order in T: `(L − K φ' T ω) di/dt = u − R i − K φ ω − v`.
    ///
    /// Without a `direction` the rotor is at rest, and the balance of torques decides: it begins to move if the driving
    /// torque exceeds the dry friction.
    #[inline(always)]
    pub fn slopes<N: Scalar<Base = S>>(
        &self,
        at: &OperatingPoint<N>,
        direction: Option<S>,
        memories: &Memories<S>,
    ) -> Slopes<N> {
        if self.effects.is_empty() && self.terms.is_empty() {
            self.slopes_of(at, direction, &self.base(at), false)
        } else {
            let mut balance = self.base(at);
            self.contribute(at, memories, &mut balance);
            self.slopes_of(at, direction, &balance, self.lags)
        }
    }

    /// [`Motor::slopes`] at many points, given with the directions of the motion there, effect by effect: where nothing
    /// has to be simulated that is quicker than point by point. What was in `balances` and `slopes` is overwritten.
    pub fn slopes_at_each<const PLACES: usize>(
        &self,
        points: &[(OperatingPoint<S>, S); PLACES],
        remembered: &Remembered<S, PLACES>,
        balances: &mut [Balance<S>; PLACES],
        slopes: &mut [Slopes<S>; PLACES],
    ) {
        if self.effects.is_empty() && self.terms.is_empty() {
            for ((at, direction), slopes) in points.iter().zip(slopes) {
                *slopes = self.slopes_of(at, Some(*direction), &self.base(at), false);
            }
            return;
        }
        for ((at, _), balance) in points.iter().zip(&mut *balances) {
            *balance = self.base(at);
        }
        for (effect, memories) in self.effects.iter().zip(remembered) {
            effect.contribute_to_each(points, memories, balances);
        }
        for n in 0..PLACES {
            let (at, direction) = &points[n];
            self.contribute_terms(at, &mut balances[n]);
            slopes[n] = self.slopes_of(at, Some(*direction), &balances[n], self.lags);
        }
    }

    #[inline(always)]
    fn slopes_of<N: Scalar<Base = S>>(
        &self,
        at: &OperatingPoint<N>,
        direction: Option<S>,
        b: &Balance<N>,
        lags: bool,
    ) -> Slopes<N> {
        let linkage = self.linkage(b);
        let mut inductance = b.inductance;
        let left = b.supply - b.resistance * at.current - linkage * at.speed - b.voltage;
        let mut lagged = linkage;
        let slope = b.flux_slope.times(self.parameters.flux_coefficient);
        if lags {
            let lost = b.flux_lag * slope * at.speed / inductance;
            // 1 − x and 1/(1 + x) agree to first order, and the second never turns the inductance negative.
            inductance =
                if lost.value() > S::ZERO { inductance / (N::ONE + lost) } else { inductance * (N::ONE - lost) };
        }
        let current = left / inductance;
        if lags {
            lagged -= slope * b.flux_lag * current;
        }
        let friction = (b.viscous_friction + b.turbulent_friction * at.speed.abs()) * at.speed + b.friction;
        let torque = lagged * at.current + b.torque - friction;
        let direction = direction.unwrap_or_else(|| incipient(torque.value(), b.dry_friction.value()));
        let dry_friction = b.dry_friction.plus(b.dry_asymmetry * direction).times(direction);
        Slopes { current, speed: (torque - dry_friction).times(b.inverse_inertia), inductance, direction }
    }

    /// The torque, N m, that has to be applied from outside (or by the current) for a given motion: friction less the
    /// driving torques of effects, without J dω/dt and K φ i.
    pub fn load_torque(&self, speed: S, direction: S) -> S {
        let at = OperatingPoint::unsupplied(S::ZERO, speed);
        let b = self.balance(&at, &[Memory::default(); MAX_EFFECTS]);
        (b.viscous_friction + b.turbulent_friction * speed.abs()) * speed
            + b.friction
            + direction * (b.dry_friction + b.dry_asymmetry * direction)
            - b.torque
    }

    /// The driving torque on a rotor at rest, the dry friction that holds it, N m, and one over the inertia, 1/(kg m²).
    /// What acts on the circuit alone is left out: it changes no torque at a given current.
    #[inline(always)]
    pub(crate) fn torques_at_rest(&self, current: S, memories: &Memories<S>) -> (S, S, S) {
        const { assert!(MAX_EFFECTS <= 8, "a bit for each") };
        let at = OperatingPoint::unsupplied(current, S::ZERO);
        let mut b = self.base(&at);
        for (n, (effect, memory)) in self.effects.iter().zip(memories).enumerate() {
            if self.turning >> n & 1 == 1 {
                effect.contribute(&at, memory, &mut b);
            }
        }
        if !self.terms.is_empty() {
            for term in self.terms.iter().filter(|term| term.target() == Target::Torque) {
                b.friction += term.value(at.current, at.speed, at.voltage);
            }
        }
        let torque = self.linkage(&b) * current + b.torque - b.friction;
        (torque, b.dry_friction, b.inverse_inertia)
    }
}

/// The direction of the motion that a torque begins: 0 unless it exceeds the dry friction.
#[inline(always)]
fn incipient<S: Scalar>(torque: S, dry_friction: S) -> S {
    if torque > dry_friction {
        S::ONE
    } else if torque < -dry_friction {
        -S::ONE
    } else {
        S::ZERO
    }
}
