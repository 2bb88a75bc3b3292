//! The parameters of a fit: which are free, how the optimiser sees them, and the model that a point stands for.

use greyrig::effects::Effect;
use greyrig::motor::{Motor, ParameterError, Parameters};

use crate::model::{BASE_PARAMETERS, Base, Kind};

/// What may happen to a parameter in a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Freedom {
    /// It is estimated, within bounds if there are any.
    Free(Option<(f64, f64)>),
    /// It keeps its value, as the user said.
    Fixed,
    /// The recordings cannot tell it; it keeps its value.
    Pinned,
    /// The model does not have it.
    Absent,
}

/// Where a parameter belongs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Home {
    Base(usize),
    Effect(usize, usize),
}

/// One parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
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
    home: Home,
}

impl Entry {
    /// Whether it belongs to an effect, with a start value of its own.
    pub fn of_effect(&self) -> bool {
        matches!(self.home, Home::Effect(..))
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
    effects: Vec<&'static str>,
    /// Base parameters in the core's order, then those of the effects.
    pub entries: Vec<Entry>,
}

impl Space {
    /// All parameters of a kind of motor with a base and effects, all free, with neutral values.
    pub fn new(kind: Kind, base: Base, effects: &[&'static str]) -> Self {
        let mut entries: Vec<Entry> = BASE_PARAMETERS
            .iter()
            .enumerate()
            .map(|(k, name)| {
                let positive = !name.starts_with("mu");
                Entry {
                    name: (*name).to_owned(),
                    value: if positive { 1.0 } else { 0.0 },
                    freedom: if base.has(name) { Freedom::Free(None) } else { Freedom::Absent },
                    positive,
                    scale: 1.0,
                    home: Home::Base(k),
                }
            })
            .collect();
        for (e, id) in effects.iter().enumerate() {
            let Some(effect) = Effect::<f64>::from_id(id, &[]) else { continue };
            for (j, p) in effect.description().parameters.iter().enumerate() {
                entries.push(Entry {
                    name: p.name.to_owned(),
                    value: p.start,
                    freedom: Freedom::Free(None),
                    positive: p.range.0 > 0.0,
                    scale: if p.start == 0.0 { 1.0 } else { p.start.abs() },
                    home: Home::Effect(e, j),
                });
            }
        }
        Self { kind, effects: effects.to_vec(), entries }
    }

    /// Kind of motor.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// The entry with a name.
    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|e| e.name == name)
    }

    /// The entry with a name, to change it.
    pub fn get_mut(&mut self, name: &str) -> Option<&mut Entry> {
        self.entries.iter_mut().find(|e| e.name == name)
    }

    /// The value of a base parameter.
    pub fn value(&self, name: &str) -> f64 {
        self.get(name).map_or(0.0, |e| e.value)
    }

    /// Sets a start value; fixed and absent parameters keep theirs.
    pub fn start(&mut self, name: &str, value: f64) {
        if let Some(entry) = self.get_mut(name)
            && matches!(entry.freedom, Freedom::Free(_))
            && value.is_finite()
            && (!entry.positive || value > 0.0)
        {
            entry.value = value;
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
        let mut theta = theta.iter();
        for entry in &self.entries {
            let value = match entry.freedom {
                Freedom::Free(_) => theta.next().map_or(entry.value, |t| entry.decode(*t)),
                _ => entry.value,
            };
            match entry.home {
                Home::Base(k) => base[k] = value,
                Home::Effect(e, j) => effects[e][j] = value,
            }
        }
        let effects: Vec<_> =
            self.effects.iter().zip(&effects).filter_map(|(id, values)| Effect::from_id(id, values)).collect();
        Motor::build(Parameters::from_values(self.kind.flux_law(), base), &effects)
    }

    /// The motor at the present values.
    ///
    /// # Errors
    /// Values that no motor can have.
    pub fn motor(&self) -> Result<Motor<f64>, ParameterError> {
        self.motor_at(&self.coordinates())
    }
}
