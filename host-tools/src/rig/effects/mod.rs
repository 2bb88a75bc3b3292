//! Physical effects beyond the base model, as the virtual motor has them: a file each.
//!
//! The forms differ on purpose from those that the host tool offers to a model: a fit has to find the physics, not the
//! formula. Where effects change the motor's parameters (a fan law in place of μ2) they do so in the order given.

mod adc_clipping;
mod adc_resolution;
mod armature_reaction;
mod asymmetric_friction;
mod bearing_warmup;
pub mod brush_arcing;
mod brush_drop;
mod channel_delay;
mod commutation_demagnetisation;
mod commutation_resistance;
mod converter_dead_time;
mod coulomb_friction;
mod current_compression;
mod current_gain;
mod current_offset;
mod eddy_current;
mod fan_dynamics;
mod gain_drift;
mod hysteresis;
mod imbalance;
mod inductance_saturation;
mod iron_loss_drag;
mod magnet_temperature;
mod position_load;
mod quadratic_load;
mod remanence;
mod saturation;
mod sensor_hysteresis;
mod skin_effect;
mod speed_gain;
mod speed_lag;
mod speed_ripple;
mod speed_sign_lost;
mod stray_load_torque;
mod stribeck;
mod supply_dead_zone;
mod supply_impedance;
mod torque_offset;
mod torque_ripple;
mod transformer_emf;
mod two_mass;
mod voltage_gain;
mod voltage_offset;
mod windage_exponent;
mod winding_temperature;

use std::fmt;

use serde::Serialize;

use super::motor::Kind;
use super::parts::Assembly;
use super::{Error, Result, Sizes, number};

/// An effect: what it is, its sizes, and how it gets into the rig.
#[derive(Debug)]
pub struct Effect {
    /// Identifier, as in the catalogue of the model.
    pub id: &'static str,
    /// What it does.
    pub what: &'static str,
    /// What its size means.
    pub size: &'static str,
    /// Unit of the size; empty: a ratio.
    pub unit: &'static str,
    /// Functional forms to choose from, the usual one first; empty: there is one only.
    pub forms: &'static [&'static str],
    /// Sizes for a universal motor; none: it cannot have this effect.
    pub universal: Option<Sizes>,
    /// Sizes for a magnet motor.
    pub pm_dc: Option<Sizes>,
    /// Adds the effect's parts: size, form.
    pub install: fn(f64, &str, &mut Assembly),
}

/// All effects, in the order of the catalogue.
pub static EFFECTS: &[Effect] = &[
    saturation::EFFECT,
    inductance_saturation::EFFECT,
    hysteresis::EFFECT,
    eddy_current::EFFECT,
    transformer_emf::EFFECT,
    remanence::EFFECT,
    armature_reaction::EFFECT,
    brush_drop::EFFECT,
    brush_arcing::EFFECT,
    winding_temperature::EFFECT,
    commutation_resistance::EFFECT,
    commutation_demagnetisation::EFFECT,
    skin_effect::EFFECT,
    supply_impedance::EFFECT,
    supply_dead_zone::EFFECT,
    coulomb_friction::EFFECT,
    asymmetric_friction::EFFECT,
    stribeck::EFFECT,
    torque_offset::EFFECT,
    quadratic_load::EFFECT,
    windage_exponent::EFFECT,
    fan_dynamics::EFFECT,
    iron_loss_drag::EFFECT,
    stray_load_torque::EFFECT,
    torque_ripple::EFFECT,
    imbalance::EFFECT,
    bearing_warmup::EFFECT,
    current_gain::EFFECT,
    voltage_gain::EFFECT,
    speed_gain::EFFECT,
    current_offset::EFFECT,
    voltage_offset::EFFECT,
    current_compression::EFFECT,
    channel_delay::EFFECT,
    speed_lag::EFFECT,
    speed_ripple::EFFECT,
    speed_sign_lost::EFFECT,
    adc_clipping::EFFECT,
    adc_resolution::EFFECT,
    magnet_temperature::EFFECT,
    converter_dead_time::EFFECT,
    two_mass::EFFECT,
    position_load::EFFECT,
    sensor_hysteresis::EFFECT,
    gain_drift::EFFECT,
];

impl Effect {
    /// Its sizes for a kind of motor.
    pub const fn sizes(&self, kind: Kind) -> Option<Sizes> {
        match kind {
            Kind::Universal => self.universal,
            Kind::PmDc => self.pm_dc,
        }
    }
}

/// An effect with its form and its size.
#[derive(Debug, Clone, Serialize)]
pub struct ChosenEffect {
    /// Which one.
    #[serde(rename = "id", serialize_with = "only_id")]
    pub effect: &'static Effect,
    /// Functional form; empty where there is one only.
    pub form: &'static str,
    /// How large, in the effect's unit.
    pub size: f64,
}

impl PartialEq for ChosenEffect {
    fn eq(&self, other: &Self) -> bool {
        self.effect.id == other.effect.id && self.form == other.form && self.size == other.size
    }
}

fn only_id<S: serde::Serializer>(effect: &&'static Effect, to: S) -> std::result::Result<S::Ok, S::Error> {
    to.serialize_str(effect.id)
}

impl ChosenEffect {
    /// An effect at its usual size and form.
    ///
    /// # Errors
    /// A kind of motor that cannot have it.
    pub fn usual(effect: &'static Effect, kind: Kind) -> Result<Self> {
        let size = Sizes::choose(effect.sizes(kind), effect.id, effect.unit, kind, None)?;
        Ok(Self { effect, form: effect.forms.first().copied().unwrap_or_default(), size })
    }

    /// Reads `ID[:FORM][=SIZE]`.
    ///
    /// # Errors
    /// Unknown names, sizes out of range.
    pub fn parse(text: &str, kind: Kind) -> Result<Self> {
        let (name, size) = match text.split_once('=') {
            Some((name, size)) => (name, Some(number(size, text)?)),
            None => (text, None),
        };
        let (id, form) = match name.split_once(':') {
            Some((id, form)) => (id, Some(form)),
            None => (name, None),
        };
        let effect = EFFECTS
            .iter()
            .find(|e| e.id == id)
            .ok_or_else(|| Error::unknown("effect", id, EFFECTS.iter().map(|e| e.id), "known are"))?;
        let usual = Self::usual(effect, kind)?;
        let size = Sizes::choose(effect.sizes(kind), id, effect.unit, kind, size)?;
        let form = match form {
            None => usual.form,
            Some(_) if effect.forms.is_empty() => {
                return Err(Error::usage(format!("{id} has one form only"), format!("write {id} alone")));
            }
            Some(form) => effect
                .forms
                .iter()
                .copied()
                .find(|f| *f == form)
                .ok_or_else(|| Error::unknown("form", form, effect.forms.iter().copied(), "known are"))?,
        };
        Ok(Self { effect, form, size })
    }
}

impl fmt::Display for ChosenEffect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.form {
            "" => write!(f, "{}={}", self.effect.id, self.size),
            form => write!(f, "{}:{form}={}", self.effect.id, self.size),
        }
    }
}
