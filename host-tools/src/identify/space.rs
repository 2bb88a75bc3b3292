//! The parameters of a fit: which are free, how the optimiser sees them, and the model that a point stands for.

use greyrig::effects::{Effect, EffectId, EffectParameter, Role};
use greyrig::motor::{BaseParameter, Motor, ParameterError, Parameters};
use greyrig::term::Target;

use super::scales::Scales;
use crate::experiment::Experiment;
use crate::model::{Assignment, Base, Kind, Model, unit};
use crate::recording::Motion;
use crate::term::Formula;

/// Distance from a limit, in the optimiser's coordinate, within which a value lies at it.
const AT_REST: f64 = 1e-9;
/// Share of the end of a shape's range from which it rests there.
const AT_THE_LIMIT: f64 = 0.99;

/// What may happen to a parameter in a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Freedom {
    /// It is estimated, within bounds if there are any.
    Free(Option<(f64, f64)>),
    /// It keeps its value, as the user said.
    Fixed,
    /// The recordings cannot tell it; it keeps its value.
    Pinned,
    /// The recordings do not hold what it acts on; its value means nothing.
    Untold,
    /// The model does not have it.
    Absent,
}

/// Which parameter of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Key {
    /// Of the base model.
    Base(BaseParameter),
    /// Of an effect, by its place among the effect's parameters.
    Effect(EffectId, usize),
    /// An unknown of a term of the user's own, by the places of both.
    Term(usize, usize),
}

impl Key {
    /// The size of an effect.
    pub const fn size_of(id: EffectId) -> Self {
        Self::Effect(id, 0)
    }

    /// All parameters of an effect, in their order.
    pub fn all_of(id: EffectId) -> impl Iterator<Item = Self> + Clone {
        (0..id.description().parameters.len()).map(move |place| Self::Effect(id, place))
    }

    /// Those of them that are no size.
    pub fn shapes_of(id: EffectId) -> impl Iterator<Item = Self> + Clone {
        Self::all_of(id).skip(1)
    }

    /// The parameter of the base model, if it is one.
    pub const fn base(self) -> Option<BaseParameter> {
        match self {
            Self::Base(parameter) => Some(parameter),
            Self::Effect(..) | Self::Term(..) => None,
        }
    }

    /// The parameter of an effect, if it is one.
    pub fn of_effect(self) -> Option<&'static EffectParameter> {
        match self {
            Self::Effect(id, place) => id.description().parameters.get(place),
            Self::Base(_) | Self::Term(..) => None,
        }
    }

    /// Unit in a kind of drive.
    pub fn unit(self, kind: Kind, motion: Motion) -> &'static str {
        let rotary = match self {
            Self::Base(parameter) => parameter.unit(kind.flux_law()),
            Self::Effect(..) | Self::Term(..) => self.of_effect().map_or("1", |p| p.unit),
        };
        unit(rotary, motion)
    }
}

impl From<BaseParameter> for Key {
    fn from(parameter: BaseParameter) -> Self {
        Self::Base(parameter)
    }
}

/// One parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Which parameter it is.
    pub key: Key,
    /// Name in files and on the command line.
    pub name: String,
    /// Value, SI.
    pub value: f64,
    /// What may happen to it.
    pub freedom: Freedom,
    /// Positive by nature: the optimiser sees its logarithm.
    pub positive: bool,
    /// Typical size, for parameters that may pass zero.
    pub scale: f64,
    /// Physical range.
    pub range: (f64, f64),
}

impl Entry {
    /// Whether it belongs to an effect, with a start value of its own.
    pub fn of_effect(&self) -> bool {
        !matches!(self.key, Key::Base(_))
    }

    /// Whether it is the size of an effect, which is absent at zero.
    pub fn is_size(&self) -> bool {
        self.role() == Some(Role::Size)
    }

    /// Whether it belongs to an effect and is not its size.
    pub fn is_shape(&self) -> bool {
        self.role().is_some_and(|role| role != Role::Size)
    }

    /// What it is to its effect.
    fn role(&self) -> Option<Role> {
        self.key.of_effect().map(|p| p.role)
    }

    /// The usual value of a shape, in the optimiser's coordinate: its scale is what it started from.
    pub fn usual(&self) -> Option<f64> {
        self.is_shape().then(|| self.encode(self.scale))
    }

    /// Whether a fit has left it at the lower end of its physical range.
    fn rests_at_its_least(&self) -> bool {
        self.freedom == Freedom::Free(None) && self.value <= self.range.0 / AT_THE_LIMIT
    }

    /// Whether the optimiser's coordinate is the logarithm: of what is positive and has no bounds but its physical
    /// range.
    pub fn is_logarithmic(&self) -> bool {
        self.positive && !matches!(self.freedom, Freedom::Free(Some(_)))
    }

    /// Whether the value lies at an end of its range.
    pub fn rests_at_a_limit(&self) -> bool {
        let (x, (low, high)) = (self.encode(self.value), self.limits());
        x - low < AT_REST || high - x < AT_REST
    }

    /// The range in the optimiser's coordinate.
    pub fn limits(&self) -> (f64, f64) {
        match self.freedom {
            Freedom::Free(Some(_)) => (f64::NEG_INFINITY, f64::INFINITY),
            _ if self.positive => (self.range.0.ln(), self.range.1.ln()),
            _ => (self.range.0 / self.scale, self.range.1 / self.scale),
        }
    }

    fn encode(&self, value: f64) -> f64 {
        match self.freedom {
            Freedom::Free(Some((low, high))) => {
                let share = ((value - low) / (high - low)).clamp(1e-3, 1.0 - 1e-3);
                (2.0 * share - 1.0).asin()
            }
            _ if self.positive => value.ln(),
            _ => value / self.scale,
        }
    }

    fn decode(&self, theta: f64) -> f64 {
        match self.freedom {
            Freedom::Free(Some((low, high))) => low + (high - low) * 0.5 * (1.0 + theta.sin()),
            _ if self.positive => theta.exp(),
            _ => theta * self.scale,
        }
    }

    /// dvalue/dθ at a point.
    pub fn slope(&self, theta: f64) -> f64 {
        match self.freedom {
            Freedom::Free(Some((low, high))) => (high - low) * 0.5 * theta.cos(),
            _ if self.positive => theta.exp(),
            _ => self.scale,
        }
    }

    /// How far a step may go from a point, in steps from where a fit begins.
    pub fn reach(&self, theta: f64) -> f64 {
        let grows = self.freedom == Freedom::Free(None) && !self.positive && !self.is_shape();
        if grows { theta.abs().max(1.0) } else { 1.0 }
    }

    /// Whether the value has run into a bound.
    pub fn at_bound(&self) -> bool {
        matches!(self.freedom, Freedom::Free(Some((low, high)))
            if (self.value - low).min(high - self.value) < 1e-3 * (high - low))
    }
}

/// All parameters of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    kind: Kind,
    effects: Vec<EffectId>,
    terms: Vec<Formula>,
    /// Base parameters in the core's order, then those of the effects.
    pub entries: Vec<Entry>,
}

impl Space {
    /// All parameters of a kind of motor with a base and effects, all free, with neutral values.
    pub fn new(kind: Kind, base: Base, effects: &[EffectId]) -> Self {
        let of_base = |parameter: BaseParameter| {
            let positive = parameter.is_positive();
            Entry {
                key: Key::Base(parameter),
                name: parameter.name().to_owned(),
                value: if positive { 1.0 } else { 0.0 },
                freedom: if base.has(parameter) { Freedom::Free(None) } else { Freedom::Absent },
                positive,
                scale: 1.0,
                range: if positive { (1e-10, 1e5) } else { (-1e4, 1e5) },
            }
        };
        let of_effect = |key: Key| {
            let p = key.of_effect()?;
            Some(Entry {
                key,
                name: p.name.to_owned(),
                value: p.start,
                freedom: match p.role {
                    Role::Instant | Role::Parameter => Freedom::Fixed,
                    _ => Freedom::Free(None),
                },
                positive: p.range.0 > 0.0,
                scale: p.start.abs(),
                range: p.range,
            })
        };
        let of_effects = effects.iter().flat_map(|id| Key::all_of(*id)).filter_map(of_effect);
        let entries = BaseParameter::ALL.into_iter().map(of_base).chain(of_effects).collect();
        Self { kind, effects: effects.to_vec(), terms: Vec::new(), entries }
    }

    /// The same with terms of the user's own; their unknowns start from absence where the term is proportional to them,
    /// and from one otherwise.
    #[must_use]
    pub fn with_terms(mut self, terms: &[Formula]) -> Self {
        self.entries.retain(|e| !matches!(e.key, Key::Term(..)));
        for (t, formula) in terms.iter().enumerate() {
            for (j, name) in formula.unknowns().iter().enumerate() {
                self.entries.push(Entry {
                    key: Key::Term(t, j),
                    name: name.clone(),
                    value: if is_proportional(formula, j) { 0.0 } else { 1.0 },
                    freedom: Freedom::Free(None),
                    positive: false,
                    scale: 1.0,
                    range: (f64::NEG_INFINITY, f64::INFINITY),
                });
            }
        }
        self.terms = terms.to_vec();
        self
    }

    /// Unit of a parameter in a drive; `SI` where a formula does not determine that of its unknown.
    pub fn unit(&self, key: Key, motion: Motion) -> String {
        match key {
            Key::Term(t, j) => self.terms[t].unit(j, motion == Motion::Linear).unwrap_or_else(|| "SI".to_owned()),
            Key::Base(_) | Key::Effect(..) => key.unit(self.kind, motion).to_owned(),
        }
    }

    /// Typical sizes in recordings, by the present values of K and R.
    pub fn scales(&self, experiments: &[Experiment]) -> Scales {
        Scales::of(self.kind, self.value(BaseParameter::K), self.value(BaseParameter::R), experiments)
    }

    /// Takes the typical sizes of the recordings: scales of friction and of effects, and effects at their start values.
    pub fn take_scales(&mut self, scales: &Scales) {
        for entry in &mut self.entries {
            match entry.key {
                Key::Base(parameter) => {
                    if let Some(power) = parameter.power_of_speed() {
                        entry.scale = scales.friction_per_speed(power);
                    }
                }
                Key::Term(t, j) => entry.scale = unknown_scale(&self.terms[t], j, scales),
                Key::Effect(id, j) => {
                    let p = &id.description().parameters[j];
                    let typical = (p.start * scales.size(p.relative)).clamp(p.range.0, p.range.1);
                    entry.scale = if typical == 0.0 { 1.0 } else { typical.abs() };
                    if matches!(entry.freedom, Freedom::Free(None)) {
                        entry.value = typical;
                    }
                }
            }
        }
    }

    /// Takes the values of a model, by name.
    pub fn take_model(&mut self, model: &Model) {
        let effects = model.effects.iter().flat_map(|e| &e.parameters);
        let terms = model.terms.iter().flat_map(|t| &t.parameters);
        for (name, parameter) in model.parameters.iter().chain(effects).chain(terms) {
            if let Some(entry) = self.named_mut(name) {
                entry.value = parameter.value;
            }
        }
    }

    /// Takes the values of the parameters that both have.
    pub fn take_values(&mut self, from: &Self) {
        for entry in &mut self.entries {
            if let Some(known) = from.get(entry.key) {
                (entry.value, entry.scale) = (known.value, known.scale);
            }
        }
    }

    /// Takes the order of magnitude of a small motor, from which the regression starts.
    pub fn take_typical_values(&mut self) {
        for entry in &mut self.entries {
            if let Key::Base(parameter) = entry.key
                && matches!(entry.freedom, Freedom::Free(None))
            {
                entry.value = match parameter {
                    BaseParameter::R => 1.0,
                    BaseParameter::L => 1e-3,
                    BaseParameter::K => 1e-2,
                    BaseParameter::J => 1e-4,
                    BaseParameter::Mu0 | BaseParameter::Mu1 | BaseParameter::Mu2 => entry.value,
                };
            }
        }
    }

    /// Gives free parameters another freedom.
    pub fn hold(&mut self, keys: impl IntoIterator<Item = impl Into<Key>>, freedom: Freedom) {
        for key in keys {
            if let Some(entry) = self.get_mut(key)
                && matches!(entry.freedom, Freedom::Free(_))
            {
                entry.freedom = freedom;
            }
        }
    }

    /// Sets the sizes of all free effects to zero: absent.
    pub fn remove_sizes(&mut self) {
        for entry in &mut self.entries {
            if entry.is_size() && matches!(entry.freedom, Freedom::Free(None)) {
                entry.value = 0.0;
            }
        }
    }

    /// The effects.
    pub fn effects(&self) -> &[EffectId] {
        &self.effects
    }

    /// The same with one more effect, at its start values, as a candidate: its shapes stay where it is what its name
    /// says ([`greyrig::effects::Description::turns_into`]).
    #[must_use]
    pub fn with_effect(&self, id: EffectId, scales: &Scales) -> Self {
        let mut all = self.effects.clone();
        all.push(id);
        let mut more = Self::new(self.kind, Base::Full, &all).with_terms(&self.terms);
        more.take_scales(scales);
        let d = id.description();
        if let Some(turn) = d.turns_into
            && let Some(entry) = more.get_mut(Key::Effect(id, turn.parameter))
        {
            // Without any speed there is no telling; the range must not turn round.
            entry.range.1 =
                entry.range.1.min(turn.beyond * scales.size(d.parameters[turn.parameter].relative)).max(entry.range.0);
        }
        for entry in &mut more.entries {
            if let Some(known) = self.get(entry.key) {
                *entry = known.clone();
            }
        }
        more
    }

    /// The effect that another one, tried as a candidate, has come to the limit of: its shape rests where it would
    /// cease to be what its name says.
    pub fn turned(&self, id: EffectId) -> Option<EffectId> {
        let turn = id.description().turns_into?;
        let shape = self.get(Key::Effect(id, turn.parameter))?;
        (shape.value >= AT_THE_LIMIT * shape.range.1).then_some(turn.into)
    }

    /// A time of an effect that a fit has left at the shortest that it takes: what is faster is another effect.
    pub fn at_its_shortest(&self, id: EffectId) -> Option<Key> {
        let is_time = |key: &Key| key.of_effect().is_some_and(|p| p.role == Role::Time);
        Key::all_of(id).filter(is_time).find(|key| self.get(*key).is_some_and(Entry::rests_at_its_least))
    }

    /// The same without an effect.
    #[must_use]
    pub fn without_effect(&self, id: EffectId) -> Self {
        let left: Vec<EffectId> = self.effects.iter().copied().filter(|e| *e != id).collect();
        let mut less = Self::new(self.kind, Base::Full, &left).with_terms(&self.terms);
        for entry in &mut less.entries {
            if let Some(known) = self.get(entry.key) {
                *entry = known.clone();
            }
        }
        less
    }

    /// The base model alone, without effects and terms.
    #[must_use]
    pub fn bare(&self) -> Self {
        self.effects.clone().into_iter().fold(self.clone().with_terms(&[]), |less, id| less.without_effect(id))
    }

    /// Kind of motor.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// A parameter.
    pub fn get(&self, key: impl Into<Key>) -> Option<&Entry> {
        let key = key.into();
        self.entries.iter().find(|e| e.key == key)
    }

    /// A parameter, to change it.
    pub fn get_mut(&mut self, key: impl Into<Key>) -> Option<&mut Entry> {
        let key = key.into();
        self.entries.iter_mut().find(|e| e.key == key)
    }

    /// The parameter with a name in files and on the command line, to change it.
    pub fn named_mut(&mut self, name: &str) -> Option<&mut Entry> {
        self.entries.iter_mut().find(|e| e.name == name)
    }

    /// The value of a parameter; zero of what the model does not have.
    pub fn value(&self, key: impl Into<Key>) -> f64 {
        self.get(key).map_or(0.0, |e| e.value)
    }

    /// Sets a start value; fixed and absent parameters keep theirs.
    pub fn start(&mut self, key: impl Into<Key>, value: f64) {
        if let Some(entry) = self.get_mut(key)
            && matches!(entry.freedom, Freedom::Free(_))
            && value.is_finite()
            && (!entry.positive || value > 0.0)
        {
            entry.value = value;
        }
    }

    /// The same from values that a model has. `None`: it has no effect, whose fit would depend on where it begins.
    #[must_use]
    pub fn started_at(&self, known: &[Assignment]) -> Option<Self> {
        let mut space = self.clone();
        for Assignment { name, value } in known {
            if let Some(key) = space.named_mut(name).map(|entry| entry.key) {
                space.start(key, *value);
            }
        }
        let is_known = |entry: &Entry| entry.of_effect() && known.iter().any(|a| a.name == entry.name);
        let has_effects = space.free().any(is_known);
        has_effects.then_some(space)
    }

    /// Takes the values of an effect's parameters over from another space.
    pub fn start_from(&mut self, other: &Self, effect: EffectId) {
        for key in Key::all_of(effect) {
            if let Some(entry) = other.get(key) {
                self.start(key, entry.value);
            }
        }
    }

    /// Free parameters, as the optimiser counts them.
    pub fn free(&self) -> impl Iterator<Item = &Entry> {
        self.entries.iter().filter(|e| matches!(e.freedom, Freedom::Free(_)))
    }

    /// The optimiser's coordinates of the present values.
    pub fn coordinates(&self) -> Vec<f64> {
        self.free().map(|e| e.encode(e.value)).collect()
    }

    /// Takes the values of a point.
    pub fn set_coordinates(&mut self, theta: &[f64]) {
        let free = self.entries.iter_mut().filter(|e| matches!(e.freedom, Freedom::Free(_)));
        for (entry, theta) in free.zip(theta) {
            entry.value = entry.decode(*theta);
        }
    }

    /// The motor at a point.
    ///
    /// # Errors
    /// Values that no motor can have.
    pub fn motor_at(&self, theta: &[f64]) -> Result<Motor<f64>, ParameterError> {
        let mut base = [0.0; 7];
        let mut effects = vec![[0.0; greyrig::effects::MAX_EFFECT_PARAMETERS]; self.effects.len()];
        let mut unknowns: Vec<Vec<f64>> = self.terms.iter().map(|t| vec![0.0; t.unknowns().len()]).collect();
        let mut theta = theta.iter();
        for entry in &self.entries {
            let value = match entry.freedom {
                Freedom::Free(_) => theta.next().map_or(entry.value, |t| entry.decode(*t)),
                _ => entry.value,
            };
            match entry.key {
                Key::Base(parameter) => base[parameter as usize] = value,
                Key::Effect(id, j) => {
                    if let Some(e) = self.effects.iter().position(|other| *other == id) {
                        effects[e][j] = value;
                    }
                }
                Key::Term(t, j) => unknowns[t][j] = value,
            }
        }
        let effects: Vec<_> = self.effects.iter().zip(&effects).map(|(id, values)| Effect::new(*id, values)).collect();
        let motor = Motor::build(Parameters::from_values(self.kind.flux_law(), base), &effects)?;
        if self.terms.is_empty() {
            return Ok(motor);
        }
        let terms: Vec<_> = self.terms.iter().zip(&unknowns).map(|(formula, values)| formula.term(values)).collect();
        motor.with_terms(&terms)
    }

    /// The motor at the present values.
    ///
    /// # Errors
    /// Values that no motor can have.
    pub fn motor(&self) -> Result<Motor<f64>, ParameterError> {
        self.motor_at(&self.coordinates())
    }
}

/// Operating points, as shares of the largest current, speed and voltage, at which a formula is looked at.
const PROBES: [[f64; 3]; 4] = [[1.0, 1.0, 1.0], [0.5, 0.3, 0.6], [-0.7, 0.9, -0.4], [0.2, 0.6, 0.9]];

/// Largest value of a formula at the probes, with one unknown at `value` and the others at one.
fn largest_value(formula: &Formula, unknown: usize, value: f64, scales: [f64; 3]) -> f64 {
    let mut values = vec![1.0; formula.unknowns().len()];
    values[unknown] = value;
    let term = formula.term::<f64>(&values);
    PROBES.iter().map(|p| term.value(p[0] * scales[0], p[1] * scales[1], p[2] * scales[2]).abs()).fold(0.0, f64::max)
}

/// Whether a formula vanishes with an unknown and doubles when it doubles.
fn is_proportional(formula: &Formula, unknown: usize) -> bool {
    let at = |value: f64| largest_value(formula, unknown, value, [1.0; 3]);
    let once = at(1.0);
    at(0.0) == 0.0 && once.is_finite() && (at(2.0) - 2.0 * once).abs() <= 1e-9 * once
}

/// The value of an unknown at which a term is 1 % of the voltage or as large as friction.
fn unknown_scale(formula: &Formula, unknown: usize, scales: &Scales) -> f64 {
    let typical = match formula.target() {
        Target::Voltage => 0.01 * scales.voltage,
        Target::Torque => scales.friction,
    };
    let at_one = largest_value(formula, unknown, 1.0, [scales.current, scales.speed, scales.voltage]);
    if is_proportional(formula, unknown) && at_one > 0.0 && at_one.is_finite() { typical / at_one } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_candidate_turns_at_the_end_of_its_shape() {
        let scales = Scales { voltage: 300.0, current: 10.0, heat: 100.0, speed: 3000.0, friction: 0.1 };
        let mut space = Space::new(Kind::Universal, Base::Full, &[]).with_effect(EffectId::TransformerEmf, &scales);
        assert_eq!(space.turned(EffectId::TransformerEmf), None);
        space.start(Key::Effect(EffectId::TransformerEmf, 1), 2.99e3);
        assert_eq!(space.turned(EffectId::TransformerEmf), Some(EffectId::EddyCurrent));
        assert_eq!(space.turned(EffectId::Saturation), None);
    }

    #[test]
    fn the_shortest_time_is_told_but_no_long_one_and_no_share() {
        const WARMUP_TIME: Key = Key::Effect(EffectId::BearingWarmup, 1);
        let scales = Scales { voltage: 300.0, current: 10.0, heat: 100.0, speed: 3000.0, friction: 0.1 };
        let space = Space::new(Kind::Universal, Base::Full, &[]).with_effect(EffectId::BearingWarmup, &scales);
        let mut space = space.with_effect(EffectId::EddyCurrent, &scales);
        space.start(Key::Effect(EffectId::EddyCurrent, 1), 1.0);
        assert_eq!(space.at_its_shortest(EffectId::EddyCurrent), None);
        for (time, shortest) in [(0.5, Some(WARMUP_TIME)), (0.52, None), (1000.0, None)] {
            space.start(WARMUP_TIME, time);
            assert_eq!(space.at_its_shortest(EffectId::BearingWarmup), shortest);
        }
        // A time that the recordings cannot tell has not been put there by them.
        space.start(WARMUP_TIME, 0.5);
        space.hold([WARMUP_TIME], Freedom::Pinned);
        assert_eq!(space.at_its_shortest(EffectId::BearingWarmup), None);
    }

    #[test]
    fn a_model_with_effects_starts_at_its_own_values() {
        let values = [("R", 2.2), ("K", -1.0), ("brush_drop", 2.6), ("not_there", 1.0)];
        let known = values.map(|(name, value)| Assignment { name: name.to_owned(), value });
        let mut space = Space::new(Kind::Universal, Base::Full, &[EffectId::BrushDrop]);
        space.hold([BaseParameter::L], Freedom::Fixed);
        let held = space.value(BaseParameter::L);
        let begun = space.started_at(&known).unwrap();
        assert_eq!([begun.value(BaseParameter::R), begun.value(Key::size_of(EffectId::BrushDrop))], [2.2, 2.6]);
        assert_eq!(begun.value(BaseParameter::K), space.value(BaseParameter::K), "no motor has a negative K");
        let fixed = Assignment { name: "L".to_owned(), value: 9.0 };
        let begun = space.started_at(&[known[2].clone(), fixed]).unwrap();
        assert_eq!(begun.value(BaseParameter::L), held);
        // Without an effect, or where nothing is known of it, there is one start.
        assert!(Space::new(Kind::Universal, Base::Full, &[]).started_at(&known).is_none());
        assert!(space.started_at(&known[..2]).is_none());
    }
}
