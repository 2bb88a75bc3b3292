//! The virtual rig: a motor with effects that the model may not know, its load, its supply and its measuring chain.
//!
//! The plant is independent of the core's model on purpose: other equations of the same physics, other functional
//! forms of the effects, another integrator, `f64`. A model that fits it has earned it.
//!
//! ```
//! # fn main() -> greyrig_host::error::Result<()> {
//! use greyrig_host::rig::{Kind, Setup};
//!
//! let run = Setup::new(Kind::Universal).effect("saturation=0.35")?.profile("ramp")?.seconds(0.5).seed(1).run()?;
//! assert_eq!(run.recording.len(), 5000);
//! # Ok(())
//! # }
//! ```

pub mod chain;
pub mod effects;
pub mod faults;
pub mod logger;
pub mod motor;
pub mod parts;
pub mod plant;
pub mod profiles;
pub mod running;
pub mod source;
pub mod streams;

use std::collections::BTreeMap;

use rand::RngExt;
use serde::Serialize;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::recording::{Channel, Recording};

pub use chain::ChainSetup;
pub use effects::{ChosenEffect, EFFECTS, Effect};
pub use faults::{ChosenFault, FAULTS, Fault};
pub use logger::Logger;
pub use motor::{Kind, Motor};
pub use profiles::{PROFILES, Profile};

use parts::Assembly;
use plant::Plant;
use running::{Running, Sample};
use source::Segment;
use streams::{Purpose, Streams};

/// Sampling rate of the rig, Hz (the paper's).
pub const SAMPLE_RATE_HZ: f64 = 10_000.0;
/// What the universal motor's voltage channel can measure.
const LARGEST_VOLTAGE_V: f64 = 400.0;

/// Sizes of an effect or a fault for one kind of motor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sizes {
    /// The usual size.
    pub default: f64,
    /// The least that is accepted.
    pub least: f64,
    /// The most that is accepted.
    pub most: f64,
}

impl Sizes {
    /// Usual size, least, most.
    pub const fn new(default: f64, least: f64, most: f64) -> Option<Self> {
        Some(Self { default, least, most })
    }

    /// Checks a size that the user gave, or takes the usual one.
    fn choose(sizes: Option<Self>, id: &str, unit: &str, kind: Kind, given: Option<f64>) -> Result<f64> {
        let Some(sizes) = sizes else {
            return Err(Error::usage(
                format!("a {} motor cannot have {id}", kind.name()),
                "give the other --kind, or see --list for those that fit",
            ));
        };
        let size = given.unwrap_or(sizes.default);
        if !(sizes.least..=sizes.most).contains(&size) {
            return Err(Error::usage(
                format!("{id}={size} is not possible"),
                format!(
                    "give a size from {} to {}{}{unit}",
                    sizes.least,
                    sizes.most,
                    if unit.is_empty() { "" } else { " " }
                ),
            ));
        }
        Ok(size)
    }
}

/// A number in an argument such as `saturation=0.35`.
fn number(text: &str, whole: &str) -> Result<f64> {
    text.trim()
        .parse()
        .ok()
        .filter(|x: &f64| x.is_finite())
        .ok_or_else(|| Error::usage(format!("`{text}` in `{whole}` is not a number"), "write it like 0.35 or 1e-4"))
}

/// A run of the rig in preparation. Everything that follows from it follows from its fields alone, the seed included.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The motor, nominal by default.
    pub motor: Motor,
    /// What the motor, its supply and its measuring chain have beyond the base model.
    pub effects: Vec<ChosenEffect>,
    /// What is broken.
    pub faults: Vec<ChosenFault>,
    /// The excitation.
    pub profile: &'static Profile,
    /// Length, s; none: the profile's own.
    pub seconds: Option<f64>,
    /// Largest voltage of the profile, V, if not its own: all of it is scaled.
    pub peak_voltage_v: Option<f64>,
    /// Where all randomness comes from.
    pub seed: u64,
    /// Mains frequency, Hz.
    pub mains_hz: f64,
    /// Fluctuation of the load, relative RMS, correlated over 20 ms (Ornstein–Uhlenbeck). 0.003 by default: the
    /// residual of a real turbine is never white.
    pub turbulence: f64,
    /// Fluctuation of the supply voltage, relative RMS, correlated over 1 s. 0.001 by default: that of a test supply;
    /// it is measured, so it is no error of a model.
    pub fluctuation: f64,
    /// Fifth harmonic of AC supplies, as a fraction, in the phase that flattens the top. None by default: a test rig
    /// has an electronic source; 0.03 is usual on public mains.
    pub fifth_harmonic: f64,
    /// The measuring chain; none: [`ChainSetup::for_motor`].
    pub chain: Option<ChainSetup>,
    /// Factor on the noise of all channels.
    pub noise: f64,
    /// Integration steps in a sample; 10 (10 µs) by default, 50 at most, for the skew has to fit into half a step.
    pub steps: usize,
    /// Whether the recording's metadata tell the truth; otherwise a hidden effect stays hidden.
    pub reveal: bool,
}

/// What was simulated: never part of the recording unless asked for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Truth {
    /// The motor, with what effects did to its base parameters: K and L are those of the unsaturated motor.
    pub motor: Motor,
    /// Its effects.
    pub effects: Vec<ChosenEffect>,
    /// Its faults.
    pub faults: Vec<ChosenFault>,
}

/// A finished run.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// What the rig recorded.
    pub recording: Recording,
    /// The converter's codes for voltage, current and speed: the same samples before scaling. All zero with an ideal
    /// chain.
    pub counts: [Vec<u16>; 3],
    /// What the recording does not tell.
    pub truth: Truth,
}

impl Setup {
    /// The nominal motor of a kind, without effects: a universal motor on the staircase, a magnet motor on DC steps.
    pub fn new(kind: Kind) -> Self {
        let usual = match kind {
            Kind::Universal => "staircase",
            Kind::PmDc => "dc-steps",
        };
        Self {
            motor: Motor::nominal(kind),
            effects: Vec::new(),
            faults: Vec::new(),
            profile: PROFILES.iter().find(|p| p.id == usual).unwrap_or(&PROFILES[0]),
            seconds: None,
            peak_voltage_v: None,
            seed: 0,
            mains_hz: 50.0,
            turbulence: 0.003,
            fluctuation: 0.001,
            fifth_harmonic: 0.0,
            chain: None,
            noise: 1.0,
            steps: 10,
            reveal: false,
        }
    }

    /// Adds an effect, written `ID[:FORM][=SIZE]`.
    ///
    /// # Errors
    /// Unknown names, sizes out of range, an effect given twice.
    pub fn effect(mut self, text: &str) -> Result<Self> {
        let chosen = ChosenEffect::parse(text, self.motor.kind)?;
        if self.effects.iter().any(|e| e.effect.id == chosen.effect.id) {
            return Err(Error::usage(format!("effect {} is given twice", chosen.effect.id), "give it once"));
        }
        self.effects.push(chosen);
        Ok(self)
    }

    /// Adds an effect that the seed of the puzzle chooses among those of this kind of motor, at its usual size.
    #[must_use]
    pub fn hidden_effect(mut self, seed: u64) -> Self {
        let fitting: Vec<ChosenEffect> =
            EFFECTS.iter().filter_map(|e| ChosenEffect::usual(e, self.motor.kind).ok()).collect();
        let free: Vec<&ChosenEffect> =
            fitting.iter().filter(|c| self.effects.iter().all(|e| e.effect.id != c.effect.id)).collect();
        if !free.is_empty() {
            let n = Streams::new(seed).stream(Purpose::Hidden).random_range(0..free.len());
            self.effects.push(free[n].clone());
        }
        self
    }

    /// Adds a fault, written `ID[=SIZE][@T]` with the time of onset T in seconds.
    ///
    /// # Errors
    /// Unknown names, sizes out of range.
    pub fn fault(mut self, text: &str) -> Result<Self> {
        self.faults.push(ChosenFault::parse(text, self.motor.kind)?);
        Ok(self)
    }

    /// Chooses the excitation.
    ///
    /// # Errors
    /// An unknown name.
    pub fn profile(mut self, id: &str) -> Result<Self> {
        self.profile = Profile::find(id)?;
        Ok(self)
    }

    /// Another motor (of the same kind; effects chosen before keep their sizes).
    #[must_use]
    pub fn motor(mut self, motor: Motor) -> Self {
        self.motor = motor;
        self
    }

    /// The length, s.
    #[must_use]
    pub fn seconds(mut self, seconds: f64) -> Self {
        self.seconds = Some(seconds);
        self
    }

    /// The seed of all randomness.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// Factor on the noise of the channels.
    #[must_use]
    pub fn noise(mut self, factor: f64) -> Self {
        self.noise = factor;
        self
    }

    /// No randomness and no measuring chain: the true state at the sampling instants.
    #[must_use]
    pub fn ideal(mut self) -> Self {
        self.chain = Some(ChainSetup::ideal(&self.motor));
        self.turbulence = 0.0;
        self.fluctuation = 0.0;
        self
    }

    /// The parts of this rig, effects and faults put in.
    fn assemble(&self) -> Assembly {
        let mut assembly = Assembly::new(self.motor, Streams::new(self.seed));
        for chosen in &self.effects {
            (chosen.effect.install)(chosen.size, chosen.form, &mut assembly);
        }
        for chosen in &self.faults {
            (chosen.fault.install)(chosen.size, chosen.onset_s, &mut assembly);
        }
        assembly.keep_nameplate();
        assembly
    }

    /// The motor of this rig, at rest, for whoever wants to drive it step by step.
    pub fn plant(&self) -> Plant {
        Plant::new(self.assemble()).0
    }

    /// Runs the profile.
    ///
    /// # Errors
    /// A profile that this motor cannot run, an impossible length or figure.
    pub fn run(&self) -> Result<Run> {
        self.run_in(&Context::quiet())
    }

    /// The same as a job that can be stopped.
    ///
    /// # Errors
    /// As [`Setup::run`]; an interrupt.
    pub fn run_in(&self, ctx: &Context) -> Result<Run> {
        let mut running = self.start()?;
        let mut log = Log::with_capacity((running.seconds * SAMPLE_RATE_HZ) as usize + 1);
        while let Some(sample) = running.next_sample() {
            if log.locked.len().is_multiple_of(4096) {
                ctx.check()?;
            }
            log.push(&sample);
        }
        self.finish(log, running.truth, &running.chain_setup)
    }

    /// Begins to run the profile, sample by sample.
    ///
    /// # Errors
    /// A profile that this motor cannot run, an impossible length or figure.
    pub fn start(&self) -> Result<Running> {
        self.check()?;
        let seconds = self.seconds.unwrap_or(self.profile.seconds);
        let mut segments = self.profile.segments(&self.motor, self.mains_hz, seconds)?;
        if let Some(peak) = self.peak_voltage_v {
            let own = segments.iter().map(Segment::peak_v).fold(0.0, f64::max);
            segments.iter_mut().for_each(|segment| segment.scale(peak / own));
        }
        Ok(Running::new(self, seconds, segments))
    }

    fn check(&self) -> Result<()> {
        let figures = [
            ("noise factor", self.noise, 0.0, 1000.0),
            ("mains frequency", self.mains_hz, 10.0, 400.0),
            ("turbulence", self.turbulence, 0.0, 0.3),
            ("voltage fluctuation", self.fluctuation, 0.0, 0.3),
            ("fifth harmonic", self.fifth_harmonic, 0.0, 0.2),
            ("peak voltage in volts", self.peak_voltage_v.unwrap_or(1.0), 0.1, LARGEST_VOLTAGE_V),
            ("number of integration steps", self.steps as f64, 10.0, 50.0),
        ];
        for (what, value, least, most) in figures {
            if !(least..=most).contains(&value) {
                return Err(Error::usage(
                    format!("a {what} of {value} is not possible"),
                    format!("give one from {least} to {most}"),
                ));
            }
        }
        Ok(())
    }

    fn finish(&self, log: Log, truth: Truth, chain: &ChainSetup) -> Result<Run> {
        let mut metadata = BTreeMap::from(
            [
                ("motor", self.motor.kind.name().to_owned()),
                ("rig", "virtual".to_owned()),
                ("profile", self.profile.id.to_owned()),
                ("seed", self.seed.to_string()),
            ]
            .map(|(key, value)| (key.to_owned(), value)),
        );
        if chain.bits.is_some() {
            for (name, places) in [("skew_i_a_s", 1.0), ("skew_omega_rad_s_s", 2.0)] {
                metadata.insert(name.to_owned(), (places * chain.skew_s).to_string());
            }
            for (name, channel) in ["range_u_v", "range_i_a", "range_omega_rad_s"].into_iter().zip(chain.channels) {
                metadata.insert(name.to_owned(), format!("{} {}", channel.lowest, channel.highest));
            }
        }
        let all = |flags: &[bool]| flags.iter().all(|&x| x);
        let never = |flags: &[bool]| !flags.iter().any(|&x| x);
        if all(&log.locked) {
            metadata.insert("rotor".to_owned(), "locked".to_owned());
        }
        if self.reveal {
            for (name, value) in truth.motor.parameters() {
                metadata.insert(format!("truth_{name}"), value.to_string());
            }
            let join = |texts: Vec<String>| if texts.is_empty() { "none".to_owned() } else { texts.join(" ") };
            let effects = truth.effects.iter().map(ToString::to_string).collect();
            let faults = truth.faults.iter().map(ToString::to_string).collect();
            metadata.insert("truth_effects".to_owned(), join(effects));
            metadata.insert("truth_faults".to_owned(), join(faults));
        }
        let [u, i, omega] = log.values;
        let recording = Recording::builder(1.0 / SAMPLE_RATE_HZ)
            .channel(Channel::Voltage, u)
            .channel(Channel::Current, i)
            .channel(Channel::Speed, omega)
            .rotor_locked(if never(&log.locked) { Vec::new() } else { log.locked })
            .supply_open(if never(&log.open) { Vec::new() } else { log.open })
            .metadata(metadata)
            .build()
            .map_err(|e| Error::usage(format!("the run gives no recording: {e}"), "choose another length"))?;
        Ok(Run { recording, counts: log.counts, truth })
    }
}

/// What is collected in a run.
struct Log {
    values: [Vec<f64>; 3],
    counts: [Vec<u16>; 3],
    locked: Vec<bool>,
    open: Vec<bool>,
}

impl Log {
    fn with_capacity(samples: usize) -> Self {
        Self {
            values: std::array::from_fn(|_| Vec::with_capacity(samples)),
            counts: std::array::from_fn(|_| Vec::with_capacity(samples)),
            locked: Vec::with_capacity(samples),
            open: Vec::with_capacity(samples),
        }
    }

    fn push(&mut self, sample: &Sample) {
        for n in 0..3 {
            self.counts[n].push(sample.counts[n]);
            self.values[n].push(sample.values[n]);
        }
        self.locked.push(sample.locked);
        self.open.push(sample.open);
    }
}
