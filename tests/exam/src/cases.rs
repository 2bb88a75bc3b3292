//! Blind cases: motors of a production lot with effects of random size and form on a virtual rig.
//!
//! The plant's laws are not the catalogue's: Froelich and Langevin magnetisation against the blended root, play
//! operators against Duhem's hysteresis, a Gaussian inductance against a rational one, an algebraic brush transition
//! against an exponential, a true first-order flux lag against its expansion, arc tangent against a root for the
//! current sensor, and so on (`greyrig simulate --list`).

use greyrig::effects::EffectId;
use greyrig_host::context::Context;
use greyrig_host::diagnose::base;
use greyrig_host::diagnose::classes::{class_of, same};
use greyrig_host::identify::Settings;
use greyrig_host::model::Filter;
use greyrig_host::model::Kind;
use greyrig_host::recording::Recording;
use greyrig_host::rig::plant::Plant;
use greyrig_host::rig::{Motor, Profile, Setup};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// An effect counts where its error is at least this many times that of a healthy motor.
pub const STANDS_OUT: f64 = 3.0;

/// Relative scatter of the base parameters in the lot.
const SPREAD: f64 = 0.025;

/// An effect with its forms and the range of its sizes in a motor of the 1.4 kW class.
pub struct Sort {
    /// The effect.
    pub id: EffectId,
    /// Forms of the plant; empty: one only.
    pub forms: &'static [&'static str],
    /// Smallest and largest size.
    pub sizes: (f64, f64),
}

impl Sort {
    /// A usual size, as an argument of `simulate --effect`: the geometric mean of the smallest and the largest, in the
    /// first form.
    fn usual(&self) -> String {
        let size = (self.sizes.0 * self.sizes.1).sqrt();
        let form = self.forms.first().map_or_else(String::new, |form| format!(":{form}"));
        format!("{}{form}={size:.6e}", self.id)
    }
}

const fn sort(id: EffectId, low: f64, high: f64) -> Sort {
    Sort { id, forms: &[], sizes: (low, high) }
}

/// Effects that leave something to see in voltage, current and speed of a universal motor.
const VISIBLE: &[Sort] = &[
    Sort { id: EffectId::Saturation, forms: &["froelich", "langevin"], sizes: (0.1, 0.5) },
    sort(EffectId::InductanceSaturation, 0.2, 0.7),
    sort(EffectId::Hysteresis, 0.04, 0.5),
    sort(EffectId::EddyCurrent, 30e-6, 200e-6),
    sort(EffectId::TransformerEmf, 80e-6, 300e-6),
    sort(EffectId::Remanence, 0.05, 0.3),
    sort(EffectId::ArmatureReaction, 0.03, 0.15),
    sort(EffectId::BrushDrop, 1.0, 5.0),
    sort(EffectId::WindingTemperature, 20.0, 120.0),
    sort(EffectId::CommutationDemagnetisation, 0.02, 0.1),
    sort(EffectId::SkinEffect, 0.03, 0.25),
    sort(EffectId::SupplyDeadZone, 1.0, 6.0),
    sort(EffectId::Stribeck, 0.01, 0.06),
    sort(EffectId::WindageExponent, 2.15, 3.0),
    sort(EffectId::FanDynamics, 0.05, 0.3),
    sort(EffectId::IronLossDrag, 20.0, 100.0),
    sort(EffectId::StrayLoadTorque, 20.0, 100.0),
    sort(EffectId::BearingWarmup, 0.5, 2.0),
    sort(EffectId::CurrentOffset, 0.05, 0.25),
    sort(EffectId::VoltageOffset, 0.5, 5.0),
    sort(EffectId::CurrentCompression, 0.02, 0.1),
    sort(EffectId::ChannelDelay, 30e-6, 200e-6),
    sort(EffectId::SpeedLag, 3e-3, 30e-3),
    sort(EffectId::AdcClipping, 5.0, 8.0),
];

/// Effects that leave something to see in voltage, current and speed of a small magnet motor.
const VISIBLE_WITH_MAGNETS: &[Sort] = &[
    sort(EffectId::BrushDrop, 0.2, 2.0),
    sort(EffectId::WindingTemperature, 20.0, 120.0),
    sort(EffectId::CommutationDemagnetisation, 0.02, 0.1),
    sort(EffectId::CommutationResistance, 0.1, 1.0),
    sort(EffectId::SkinEffect, 0.05, 0.5),
    sort(EffectId::SupplyDeadZone, 0.2, 3.0),
    sort(EffectId::AsymmetricFriction, 1e-3, 0.01),
    sort(EffectId::Stribeck, 1e-3, 0.01),
    sort(EffectId::TorqueOffset, 1e-3, 0.01),
    sort(EffectId::QuadraticLoad, 1e-3, 0.01),
    sort(EffectId::StrayLoadTorque, 0.05, 0.5),
    sort(EffectId::BearingWarmup, 0.5, 2.0),
    sort(EffectId::CurrentOffset, 0.02, 0.2),
    sort(EffectId::VoltageOffset, 0.05, 1.0),
    sort(EffectId::CurrentCompression, 0.02, 0.2),
    sort(EffectId::ChannelDelay, 50e-6, 1e-3),
    sort(EffectId::SpeedLag, 1e-3, 20e-3),
    sort(EffectId::AdcClipping, 1.0, 4.0),
];

/// Effects that leave something to see in voltage, current and speed of a kind of motor.
pub const fn visible(kind: Kind) -> &'static [Sort] {
    match kind {
        Kind::Universal => VISIBLE,
        Kind::PmDc => VISIBLE_WITH_MAGNETS,
    }
}

/// Effects that leave something to see, and that only [`Question::Rarer`] draws.
const RARER: &[Sort] = &[
    sort(EffectId::ConverterDeadTime, 2.0, 15.0),
    Sort { id: EffectId::TwoMass, forms: &["10Hz", "25Hz", "60Hz"], sizes: (0.15, 0.75) },
    sort(EffectId::SensorHysteresis, 0.03, 0.5),
    Sort { id: EffectId::GainDrift, forms: &["current", "speed"], sizes: (0.02, 0.2) },
];

/// The same of a small magnet motor.
const RARER_WITH_MAGNETS: &[Sort] = &[
    sort(EffectId::ConverterDeadTime, 0.2, 2.0),
    Sort { id: EffectId::TwoMass, forms: &["10Hz", "25Hz", "60Hz"], sizes: (0.15, 0.75) },
    sort(EffectId::SensorHysteresis, 0.01, 0.2),
    Sort { id: EffectId::GainDrift, forms: &["current", "speed"], sizes: (0.02, 0.2) },
    sort(EffectId::MagnetTemperature, 20.0, 120.0),
    sort(EffectId::PositionLoad, 2e-3, 0.02),
];

/// One of the effects that leave something to see, of any size, as an argument of `simulate --effect`.
pub fn any_visible(kind: Kind, random: &mut ChaCha8Rng) -> String {
    let sorts: Vec<&'static Sort> = visible(kind).iter().collect();
    draw(random, &sorts, &[]).1
}

/// Effects of a magnet motor that nothing in voltage, current and speed below the filter can show.
const INVISIBLE_WITH_MAGNETS: &[Sort] = &[
    sort(EffectId::SupplyImpedance, 0.05, 0.5),
    sort(EffectId::CurrentGain, -0.05, 0.05),
    sort(EffectId::VoltageGain, -0.05, 0.05),
    sort(EffectId::SpeedGain, -0.05, 0.05),
    sort(EffectId::CoulombFriction, 1e-3, 0.01),
];

/// Effects that nothing in voltage, current and speed below the filter can show.
const INVISIBLE: &[Sort] = &[
    sort(EffectId::CommutationResistance, 0.5, 3.0),
    sort(EffectId::SupplyImpedance, 0.1, 0.6),
    sort(EffectId::CurrentGain, -0.05, 0.05),
    sort(EffectId::VoltageGain, -0.05, 0.05),
    sort(EffectId::SpeedGain, -0.05, 0.05),
    sort(EffectId::CoulombFriction, 0.005, 0.03),
    sort(EffectId::TorqueOffset, 0.005, 0.02),
];

/// The combination of five that is asked for.
const FIVE: [EffectId; 5] =
    [EffectId::Saturation, EffectId::Hysteresis, EffectId::EddyCurrent, EffectId::BrushDrop, EffectId::IronLossDrag];

/// How a motor is excited: profiles and seconds, and the recording on which what was learnt is judged.
#[derive(Debug, Clone, Copy)]
pub enum Excitation {
    /// AC alone.
    Ac,
    /// The same twice.
    Twice,
    /// AC, and a direct start: an inrush of ten times the usual current.
    Start,
    /// AC, DC steps, a locked rotor and a coast-down.
    Set,
    /// DC steps and a ramp in both directions, and coast-downs: of a magnet motor.
    Magnet,
    /// A profile of the rig by itself, in its usual length.
    Alone(Kind, &'static Profile),
}

/// Effects that are one on AC alone.
const ALIKE_ON_AC: [EffectId; 2] = [EffectId::EddyCurrent, EffectId::TransformerEmf];

/// An effect and those that cannot be told from it: the class, and on AC alone its like.
fn withheld_with(id: EffectId, excitation: Excitation) -> Vec<EffectId> {
    if matches!(excitation, Excitation::Ac | Excitation::Twice | Excitation::Start) && ALIKE_ON_AC.contains(&id) {
        return ALIKE_ON_AC.to_vec();
    }
    class_of(excitation.kind(), id).unwrap_or_else(|| vec![id])
}

impl Excitation {
    /// Those that the questions are asked of.
    pub const ALL: [Self; 5] = [Self::Ac, Self::Twice, Self::Start, Self::Set, Self::Magnet];

    /// How figures name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ac => "ac",
            Self::Twice => "twice",
            Self::Start => "start",
            Self::Set => "set",
            Self::Magnet => "magnet",
            Self::Alone(_, profile) => profile.id,
        }
    }

    /// Profiles and their lengths, s.
    pub fn profiles(self) -> Vec<(&'static str, f64)> {
        match self {
            Self::Ac => vec![("staircase", 12.0)],
            Self::Twice => vec![("staircase", 12.0); 2],
            Self::Start => vec![("start", 3.0), ("staircase", 9.0)],
            Self::Set => vec![("staircase", 8.0), ("dc-steps", 6.0), ("locked", 2.0), ("coast-down", 8.0)],
            Self::Magnet => vec![("dc-steps", 8.0), ("dc-ramp", 6.0), ("coast-down", 9.0)],
            Self::Alone(_, profile) => vec![(profile.id, profile.seconds)],
        }
    }

    /// The motor.
    pub const fn kind(self) -> Kind {
        match self {
            Self::Ac | Self::Twice | Self::Start | Self::Set => Kind::Universal,
            Self::Magnet => Kind::PmDc,
            Self::Alone(kind, _) => kind,
        }
    }

    /// Whether a question can be asked of such a motor: a magnet has no hysteresis.
    pub fn has(self, question: Question) -> bool {
        question != Question::Five || self.kind() == Kind::Universal
    }

    /// Effects that leave something to see in voltage, current and speed.
    pub const fn visible(self) -> &'static [Sort] {
        visible(self.kind())
    }

    /// Those of them that only [`Question::Rarer`] draws.
    const fn rarer(self) -> &'static [Sort] {
        match self.kind() {
            Kind::Universal => RARER,
            Kind::PmDc => RARER_WITH_MAGNETS,
        }
    }

    /// Effects that leave nothing to see there.
    const fn invisible(self) -> &'static [Sort] {
        match self.kind() {
            Kind::Universal => INVISIBLE,
            Kind::PmDc => INVISIBLE_WITH_MAGNETS,
        }
    }
}

/// What a figure is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Question {
    /// One effect.
    One,
    /// One of the effects that the other questions do not draw.
    Rarer,
    /// No effect, or one that is invisible.
    None,
    /// One effect that is withheld from the catalogue, its class with it.
    Withheld,
    /// Two effects.
    Two,
    /// Three effects.
    Three,
    /// Five given ones.
    Five,
    /// As many as there are: each effect on as many motors as its prior says, and on one motor in three one of them is
    /// none of the catalogue's.
    Prior,
}

/// Share of the motors of [`Question::Prior`] on which the catalogue lacks one of the effects.
const UNLISTED: f64 = 1.0 / 3.0;
/// Sizes that are drawn until an effect stands out.
const DRAWS: usize = 20;

/// A case.
#[derive(Debug, Clone)]
pub struct Case {
    /// Its number.
    pub seed: u64,
    /// The truth, in the order in which it was drawn.
    pub truth: Vec<EffectId>,
    /// The same as arguments of `simulate --effect`.
    pub effects: Vec<String>,
    /// Effects withheld from the catalogue.
    pub exclude: Vec<EffectId>,
    /// How it is excited.
    pub excitation: Excitation,
    /// Factor on the noise.
    pub noise: f64,
}

fn draw(random: &mut ChaCha8Rng, sorts: &[&'static Sort], taken: &[EffectId]) -> (EffectId, String) {
    loop {
        let sort = sorts[random.random_range(0..sorts.len())];
        // What is a finding about the data is no effect of a verdict; it keeps its place, so that the numbers of all
        // other cases keep their meaning.
        if taken.contains(&sort.id) || sort.id == EffectId::AdcClipping {
            continue;
        }
        return (sort.id, size(random, sort));
    }
}

fn size(random: &mut ChaCha8Rng, sort: &Sort) -> String {
    let (low, high) = sort.sizes;
    // Log-uniform where the range allows: small sizes are as frequent as large ones.
    let size = if low > 0.0 {
        (low.ln() + random.random::<f64>() * (high / low).ln()).exp()
    } else {
        low + random.random::<f64>() * (high - low)
    };
    match sort.forms {
        [] => format!("{}={size:.6e}", sort.id),
        forms => format!("{}:{}={size:.6e}", sort.id, forms[random.random_range(0..forms.len())]),
    }
}

impl Case {
    /// The case with a number.
    pub fn new(question: Question, excitation: Excitation, noise: f64, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let blank = Self { seed, truth: Vec::new(), effects: Vec::new(), exclude: Vec::new(), excitation, noise };
        let visible: Vec<&'static Sort> = excitation.visible().iter().collect();
        let mut truth = Vec::new();
        let mut effects = Vec::new();
        let several = matches!(question, Question::Two | Question::Three);
        let mut add = |random: &mut ChaCha8Rng, sorts: &[&'static Sort], truth: &mut Vec<EffectId>| {
            let (id, text) = loop {
                let drawn = draw(random, sorts, truth);
                // With one effect the examiner sorts out afterwards; with several each has to be there to be found.
                if !several || blank.stands_out_alone(&drawn.1) {
                    break drawn;
                }
            };
            truth.push(id);
            effects.push(text);
        };
        match question {
            Question::One | Question::Withheld => add(&mut random, &visible, &mut truth),
            Question::Rarer => {
                let rarer: Vec<&'static Sort> = excitation.rarer().iter().collect();
                add(&mut random, &rarer, &mut truth);
            }
            Question::None => {
                if random.random::<f64>() < 0.5 {
                    let invisible: Vec<&'static Sort> = excitation.invisible().iter().collect();
                    add(&mut random, &invisible, &mut Vec::new());
                }
            }
            Question::Two | Question::Three => {
                // Two members of a class are one effect in the data.
                let count = if question == Question::Two { 2 } else { 3 };
                while truth.len() < count {
                    let apart: Vec<&'static Sort> = excitation
                        .visible()
                        .iter()
                        .filter(|s| truth.iter().all(|t| !same(excitation.kind(), s.id, *t)))
                        .collect();
                    add(&mut random, &apart, &mut truth);
                }
            }
            Question::Prior => {
                for sort in excitation.visible().iter().chain(excitation.rarer()) {
                    let is_there = random.random::<f64>() < sort.id.description().prior.share;
                    let is_known = truth.iter().any(|t| same(excitation.kind(), sort.id, *t));
                    if !is_there || is_known || sort.id == EffectId::AdcClipping {
                        continue;
                    }
                    let drawn = (0..DRAWS).map(|_| size(&mut random, sort)).find(|text| blank.stands_out_alone(text));
                    if let Some(text) = drawn {
                        truth.push(sort.id);
                        effects.push(text);
                    }
                }
            }
            Question::Five => {
                for id in FIVE {
                    let sort: Vec<&'static Sort> = excitation.visible().iter().filter(|s| s.id == id).collect();
                    add(&mut random, &sort, &mut truth);
                }
            }
        }
        let exclude = match question {
            Question::Withheld => withheld_with(truth[0], excitation),
            Question::Prior if !truth.is_empty() && random.random::<f64>() < UNLISTED => {
                withheld_with(truth[random.random_range(0..truth.len())], excitation)
            }
            _ => Vec::new(),
        };
        Self { seed, truth, effects, exclude, excitation, noise }
    }

    /// The case of one effect of a usual size; without, of none.
    pub fn usual(effect: Option<&Sort>, excitation: Excitation, seed: u64) -> Self {
        Self {
            seed,
            truth: effect.iter().map(|sort| sort.id).collect(),
            effects: effect.iter().map(|sort| sort.usual()).collect(),
            exclude: Vec::new(),
            excitation,
            noise: 1.0,
        }
    }

    /// Whether an effect by itself makes the base model's free-run error at least [`STANDS_OUT`] times that of a
    /// healthy motor, after the base model has been refitted.
    fn stands_out_alone(&self, effect: &str) -> bool {
        let error = |effects: Vec<String>| -> Option<[f64; 2]> {
            let alone = Self { effects, ..self.clone() };
            let recordings = alone.recordings().ok()?;
            let settings = Settings { filter: Filter::default(), ..Settings::new(self.excitation.kind()) };
            let base = base::error(&recordings, &settings, &Context::quiet()).ok()?;
            Some(base)
        };
        match (error(vec![effect.to_owned()]), error(Vec::new())) {
            (Some(with), Some(without)) => (0..2).any(|k| with[k] >= STANDS_OUT * without[k]),
            _ => false,
        }
    }

    /// The motor by itself.
    pub fn motor(&self) -> Motor {
        Motor::sample_from_population(&Motor::nominal(self.excitation.kind()), SPREAD, self.seed)
    }

    fn setup(&self) -> greyrig_host::error::Result<Setup> {
        let setup = Setup::new(self.excitation.kind()).motor(self.motor()).noise(self.noise);
        self.effects.iter().try_fold(setup, |setup, effect| setup.effect(effect))
    }

    fn record(&self, profile: &str, seconds: f64, seed: u64) -> greyrig_host::error::Result<Recording> {
        Ok(self.setup()?.profile(profile)?.seconds(seconds).seed(seed).run()?.recording)
    }

    /// The motor with its effects.
    ///
    /// # Errors
    /// An effect that the rig does not have.
    pub fn plant(&self) -> greyrig_host::error::Result<Plant> {
        Ok(self.setup()?.plant())
    }

    /// The recordings that are diagnosed.
    ///
    /// # Errors
    /// An interrupt.
    pub fn recordings(&self) -> greyrig_host::error::Result<Vec<Recording>> {
        let profiles = self.excitation.profiles().into_iter().enumerate();
        profiles.map(|(k, (profile, seconds))| self.record(profile, seconds, 1000 * self.seed + k as u64)).collect()
    }

    /// The recording on another excitation that judges what was learnt: a ramp.
    ///
    /// # Errors
    /// An interrupt.
    pub fn held_out(&self) -> greyrig_host::error::Result<Recording> {
        self.record("ramp", 10.0, 1000 * self.seed + 999)
    }
}
