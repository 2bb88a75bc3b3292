//! What an effect is, in words and equations: the text of `greyrig effects` and of the catalogue in the documentation.

use super::knowledge::{Excitation, Prior, Representative, Sum};
use super::separation::Separation;
use super::{EffectId, MAX_EFFECT_PARAMETERS};
use crate::motor::{BaseParameter, FluxLaw};

/// What a start value is relative to, so that one figure serves a watch motor and a traction drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Relative {
    /// Absolute.
    Absolute,
    /// The largest current in the recordings.
    Current,
    /// One over the square of the largest current.
    InverseCurrentSquared,
    /// One over the largest integral of the squared current over a recording, which heats.
    InverseHeat,
    /// The largest voltage.
    Voltage,
    /// The largest voltage over the largest current.
    Impedance,
    /// The same over the largest speed.
    ImpedancePerSpeed,
    /// The largest speed.
    Speed,
    /// The largest speed times the root of the largest current.
    SpeedRootCurrent,
    /// One over the largest speed.
    InverseSpeed,
    /// One over its square.
    InverseSpeedSquared,
    /// A tenth of the largest driving torque.
    Friction,
    /// The same over the largest speed.
    FrictionPerSpeed,
    /// The same over its square.
    FrictionPerSpeedSquared,
    /// A tenth of the largest driving torque over the square of the largest current and the largest speed.
    FrictionPerCurrentSquaredSpeed,
    /// The same over the square of the largest speed.
    FrictionPerCurrentSquaredSpeedSquared,
}

/// What a parameter is to its effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The size: at zero the effect is absent. The first parameter of each.
    Size,
    /// A second size, as the sine beside the cosine of an angle: the effect is absent where both are zero.
    SecondSize,
    /// A shape: a knee, an exponent, a speed at which something fades.
    Shape,
    /// A frequency at which something swings: far from it a fit does not find the way, so that it starts from several.
    Frequency,
    /// An instant, s since the start of a run: looked for over time, not by a slope.
    Instant,
    /// The number of a base parameter: looked for one by one.
    Parameter,
    /// A time constant beside the size: far below what the recordings resolve, the effect is another one.
    Time,
    /// The share of the inductance that goes with the flux.
    Linked,
}

/// A parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectParameter {
    /// Name within the effect.
    pub name: &'static str,
    /// Unit of a rotary drive.
    pub unit: &'static str,
    /// What it is to the effect.
    pub role: Role,
    /// Physical range.
    pub range: (f64, f64),
    /// A typical value, where a fit starts, in units of `relative`.
    pub start: f64,
    /// What the start value is relative to.
    pub relative: Relative,
    /// What it is.
    pub meaning: &'static str,
}

/// A shape beyond which an effect is not what its name says: its law has become that of another one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// Place of the shape among the effect's parameters.
    pub parameter: usize,
    /// Largest value with which the effect is still itself, in what the start value of the shape is relative to.
    pub beyond: f64,
    /// The effect that it turns into.
    pub into: EffectId,
}

/// Which equation an effect enters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acts {
    /// The voltage balance.
    Electrical,
    /// The torque balance.
    Mechanical,
    /// Both.
    Both,
    /// The measuring chain.
    Measuring,
}

/// How an effect shows in recordings of voltage, current and speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// In the error of the free run.
    FreeRun,
    /// Not at all: other parameters take its place exactly. Says what has to be known besides.
    Invisible(&'static str),
    /// In a series motor not at all, for the same reason; else in the error of the free run.
    InvisibleInSeries(&'static str),
    /// In the variance of the residual, not in its mean.
    Variance,
    /// In what a model with constant parameters leaves before and after an instant.
    Course,
    /// In lines at multiples of the rotation, above the filter.
    Orders,
    /// In the samples themselves, before any fit.
    Samples,
}

/// Which motors can have an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motors {
    /// All.
    All,
    /// Those whose flux depends on the current.
    Series,
    /// Those with permanent magnets.
    Magnets,
}

/// What an effect is, in words and equations.
///
/// The first parameter is the effect's size: at zero the effect is absent.
#[derive(Debug, Clone, Copy)]
pub struct Description {
    /// Its name in the catalogue.
    pub id: EffectId,
    /// The field's name of it.
    pub name: &'static str,
    /// The equation, with units.
    pub equation: &'static str,
    /// Which equation it enters.
    pub acts: Acts,
    /// How it shows.
    pub seen: Seen,
    /// Which motors can have it.
    pub motors: Motors,
    /// The base model's friction term that it is, where the base is without it or has it fixed.
    pub stands_for: Option<BaseParameter>,
    /// Whether it makes the flux lag.
    pub lags_flux: bool,
    /// Whether the voltage that reaches the motor is another function of the recorded one than itself plus a constant.
    pub bends_supply: bool,
    /// Whether the recorded voltage is not that of the terminals because of it, while the supply conducts.
    pub of_supply: bool,
    /// Whether it remembers: whether its `advance` does anything.
    pub remembers: bool,
    /// Its parameters.
    pub parameters: &'static [EffectParameter],
    /// What its size means, as a sentence with `{}` for the size.
    pub size_in_words: &'static str,
    /// The same for its second size, where that says something else.
    pub second_size_in_words: Option<&'static str>,
    /// What a recording has to hold for it to show.
    pub excited_by: &'static [Excitation],
    /// On how many rigs it is to be expected.
    pub prior: Prior,
    /// Effects that stand for it, as no recording separates them: they are a class, which is named by that effect.
    pub represented_by: &'static [Representative],
    /// The effect that it is while the rotor stands still: without a speed the flux shows in the inductance alone, a
    /// lag fades by nothing, and a constant current is a constant voltage over R.
    pub at_standstill: Option<EffectId>,
    /// Two others that take its part while the motor runs on a closed supply: the columns of the three in the voltage
    /// balance, K ω, R + K ω and 1, are linearly dependent. A locked rotor or an open supply takes one of them away.
    pub two_make_it: Option<[EffectId; 2]>,
    /// Two others that are together what it is by itself.
    pub sum_of: Option<Sum>,
    /// Effects of which a little takes up the difference between two forms of its law, on which no two sources agree.
    pub rest_of_law: &'static [EffectId],
    /// Effects that a straight line credits with the rest of its law, where the law's own shape can take that up on a
    /// curved way: of a motor with saturation that runs steadily an inductance seemed to earn a fifth of all, and
    /// earned nothing.
    pub overrated_beside: &'static [EffectId],
    /// Whether it takes flux away where the current is large.
    pub weakens_flux: bool,
    /// What it is no fault but, where its size is half a sampling interval.
    pub half_an_interval: Option<&'static str>,
    /// Whether it changes what is shown of the speed, and of nothing else.
    pub on_speed_channel: bool,
    /// Whether it is a finding about the data, in the samples, and nothing that a model of the motor lacks.
    pub of_data: bool,
    /// Why it bends the curves, in sentences for whoever reads its page.
    pub why: &'static str,
    /// What one would see and hear at the motor and in the recording, in sentences.
    pub noticed: &'static str,
    /// What to do about it, in sentences.
    pub remedy: &'static str,
    /// What it leaves in the residual of a model without it.
    pub signature: &'static str,
    /// Where a shape makes another effect of it.
    pub turns_into: Option<Turn>,
    /// Effects that look alike.
    pub confused_with: &'static [EffectId],
    /// What tells them apart.
    pub separated_by: &'static [Separation],
    /// Where the equation comes from.
    pub source: &'static str,
}

/// What a motor has to know of an effect to run it.
///
/// The microcontroller asks for this and no more, so that the words of a [`Description`] take no room there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Traits {
    /// Which equation it enters.
    pub acts: Acts,
    /// Whether it makes the flux lag.
    pub lags_flux: bool,
    /// [`Description::bends_supply`].
    pub bends_supply: bool,
    /// Whether it remembers.
    pub remembers: bool,
}

/// Name and physical range of a parameter.
pub type Limits = (&'static str, f64, f64);

impl Description {
    /// What a motor has to know of it.
    pub const fn traits(&self) -> Traits {
        let Self { acts, lags_flux, bends_supply, remembers, .. } = *self;
        Traits { acts, lags_flux, bends_supply, remembers }
    }

    /// Names and physical ranges of its parameters, and of none beyond the last one.
    pub const fn limits(&self) -> [Limits; MAX_EFFECT_PARAMETERS] {
        let mut limits = [("", 0.0, 0.0); MAX_EFFECT_PARAMETERS];
        let mut n = 0;
        while n < self.parameters.len() {
            let EffectParameter { name, range: (least, greatest), .. } = self.parameters[n];
            limits[n] = (name, least, greatest);
            n += 1;
        }
        limits
    }

    /// The parameter that is its size: where that is zero, there is no effect.
    pub const fn size(&self) -> &'static EffectParameter {
        &self.parameters[0]
    }

    /// How it shows in a motor with a flux law: what [`Seen::InvisibleInSeries`] comes to.
    pub const fn seen_with(&self, law: FluxLaw) -> Seen {
        match (self.seen, law) {
            (Seen::InvisibleInSeries(needed), FluxLaw::Series) => Seen::Invisible(needed),
            (Seen::InvisibleInSeries(_), FluxLaw::PermanentMagnet) => Seen::FreeRun,
            (seen, _) => seen,
        }
    }

    /// Whether a motor with a flux law can have it.
    pub const fn fits(&self, law: FluxLaw) -> bool {
        match self.motors {
            Motors::All => true,
            Motors::Series => matches!(law, FluxLaw::Series),
            Motors::Magnets => matches!(law, FluxLaw::PermanentMagnet),
        }
    }

    /// Whether a diagnosis tries it in a motor with a flux law: it can be there, and shows in the error of a free run.
    pub const fn is_tried(&self, law: FluxLaw) -> bool {
        matches!(self.seen_with(law), Seen::FreeRun) && !self.of_data && self.fits(law)
    }

    /// Whether speed and torque alone can show it, without voltage and current.
    pub const fn shows_in_motion(&self) -> bool {
        matches!(self.acts, Acts::Mechanical) || self.on_speed_channel
    }

    /// The effect that is named in its place in a motor with a flux law: itself, if it is in no class or stands for
    /// one.
    pub fn named_as(&self, law: FluxLaw) -> EffectId {
        let here = |r: &&Representative| r.law.is_none_or(|of| of == law);
        self.represented_by.iter().find(here).map_or(self.id, |r| r.effect)
    }

    /// What most effects are: seen in the free run, possible in every motor, without parameters or words yet.
    pub const fn usual(id: EffectId) -> Self {
        Self {
            id,
            name: "",
            equation: "",
            acts: Acts::Both,
            seen: Seen::FreeRun,
            motors: Motors::All,
            stands_for: None,
            lags_flux: false,
            bends_supply: false,
            of_supply: false,
            remembers: false,
            parameters: &[],
            size_in_words: "",
            second_size_in_words: None,
            excited_by: &[],
            prior: Prior::occasional(""),
            represented_by: &[],
            at_standstill: None,
            two_make_it: None,
            sum_of: None,
            rest_of_law: &[],
            overrated_beside: &[],
            weakens_flux: false,
            half_an_interval: None,
            on_speed_channel: false,
            of_data: false,
            why: "",
            noticed: "",
            remedy: "",
            signature: "",
            turns_into: None,
            confused_with: &[],
            separated_by: &[],
            source: "",
        }
    }
}
