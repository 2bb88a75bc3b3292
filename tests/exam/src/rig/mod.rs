//! Recordings as others make them: sound ones of the virtual rig, and what measuring chains, loggers and people do to
//! them.
//!
//! A sound recording is of a motor of any size (volts, amperes and radians in units of their own are another motor), at
//! one of five rates, on one of the profiles, healthy or with one effect. A [`Kind`] of damage is done to it, and
//! `check` has to name that kind, and `diagnose` to tell the truth of the motor behind it.

mod damage;
mod kinds;
mod motor;
mod random;

use std::path::Path;

use greyrig_host::check::check;
use greyrig_host::context::Context;
use greyrig_host::error::{Error, Result};
use greyrig_host::model::Kind as MotorKind;
use greyrig_host::recording::finding::{DataFinding, Severity};
use greyrig_host::recording::{Channel, Recording, write};
use greyrig_host::rig::{Motor, PROFILES, Setup, logger};

use crate::cases;
use kinds::Damaged;
pub use kinds::{KINDS, Kind};
pub use motor::{Said, Verdict, diagnosed};
pub use random::Random;

/// Factors by which the rig's 10 kHz are divided.
const SLOWER: [usize; 5] = [1, 2, 5, 10, 20];
/// Relative scatter of a motor's parameters about the nominal ones, beside its size.
const SPREAD: f64 = 0.1;
/// Factors on voltage, current and speed that make a motor of another size.
const SIZES: (f64, f64) = (0.3, 2.0);
/// Recordings drawn until one shows the damage.
const MOST_DRAWS: usize = 300;
/// Length of a recording, s.
const SECONDS: (f64, f64) = (3.0, 6.0);

/// A recording without damage.
pub struct Sound {
    /// Its number.
    pub seed: u64,
    /// The kind of motor.
    pub motor: MotorKind,
    /// The profile.
    pub profile: &'static str,
    /// Its effect, as an argument of `simulate --effect`; none: a healthy motor.
    pub effect: Option<String>,
    /// The samples.
    pub recording: Recording,
}

impl Sound {
    /// The one with a number, on a profile that shows a kind of damage.
    ///
    /// # Errors
    /// None but a fault of the rig.
    pub fn new(seed: u64, shows: impl Fn(MotorKind, &str) -> bool, random: &mut Random) -> Result<Self> {
        loop {
            let motor = random.one_of(&[MotorKind::PmDc, MotorKind::Universal]);
            let profile = &PROFILES[random.below(PROFILES.len())];
            if shows(motor, profile.id) && (motor == MotorKind::Universal || profile.pm_dc) {
                return Self::draw(seed, motor, profile.id, random);
            }
        }
    }

    fn draw(seed: u64, motor: MotorKind, profile: &'static str, random: &mut Random) -> Result<Self> {
        let effect = random.chance(0.5).then(|| cases::any_visible(motor, &mut random.0));
        let lot = Motor::sample_from_population(&Motor::nominal(motor), SPREAD, seed);
        let seconds = random.between(SECONDS.0, SECONDS.1);
        let setup = Setup::new(motor).motor(lot).profile(profile)?.seconds(seconds).seed(seed);
        let setup = effect.iter().try_fold(setup, |setup, effect| setup.effect(effect))?;
        let run = setup.run()?.recording;
        let scaled = [Channel::Voltage, Channel::Current, Channel::Speed].into_iter().fold(run, |run, channel| {
            let factor = random.log_between(SIZES.0, SIZES.1);
            damage::times(&run, channel, factor)
        });
        let recording =
            logger::one_of(&scaled, random.one_of(&SLOWER)).expect("samples are left").named(format!("{seed}.csv"));
        Ok(Self { seed, motor, profile, effect, recording })
    }

    /// What it is.
    pub fn title(&self) -> String {
        let effect = self.effect.as_deref().unwrap_or("healthy");
        let hz = 1.0 / self.recording.sample_time_s();
        format!("{} {} {} {hz:.0} Hz {effect}", self.seed, self.motor.name(), self.profile)
    }
}

/// What `check` said about one recording.
pub struct Answer {
    /// What it is.
    pub title: String,
    /// The damage, with its size.
    pub damage: String,
    /// Whether the damage was named.
    pub named: bool,
    /// All findings.
    pub findings: Vec<DataFinding>,
}

impl Answer {
    /// Findings beside the right one that are no mere information.
    pub fn false_alarms(&self, kind: &Kind) -> usize {
        let serious = self.findings.iter().filter(|f| f.severity != Severity::Info);
        serious.filter(|f| !kind.codes.contains(&f.code) && !kind.besides.contains(&f.code)).count()
    }
}

/// Asks `check` about a case of a kind of damage.
///
/// # Errors
/// None but a fault of the rig, or a file that is refused.
pub fn ask(kind: &Kind, seed: u64) -> Result<Answer> {
    let (sound, damaged) = draw(kind, seed)?;
    let findings = check(&damaged.recordings, Some((kind.taken_for)(sound.motor)));
    let right = |f: &DataFinding| {
        kind.codes.contains(&f.code)
            && damaged.channels.as_ref().is_none_or(|c| f.channel.is_none_or(|f| c.contains(&f)))
    };
    // Of a sound recording nothing may be said.
    let serious = |f: &DataFinding| f.severity != Severity::Info;
    let named = if kind.codes.is_empty() { !findings.iter().any(serious) } else { findings.iter().any(right) };
    Ok(Answer { title: sound.title(), damage: damaged.what, named, findings })
}

/// Writes the recordings of a case of a kind of damage to `<folder>/<seed>.csv`, and the one before the damage to
/// `<folder>/<seed>-sound.csv`.
///
/// # Errors
/// A directory or a file that cannot be written, a fault of the rig.
pub fn export(kind: &Kind, seed: u64, folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::io(folder, e))?;
    let (sound, damaged) = draw(kind, seed)?;
    for recording in &damaged.recordings {
        write(recording, &folder.join(format!("{seed}.csv")), true, &Context::quiet())?;
    }
    write(&sound.recording, &folder.join(format!("{seed}-sound.csv")), true, &Context::quiet())
}

/// A sound recording on which a kind of damage can be seen, and what the damage makes of it.
fn draw(kind: &Kind, seed: u64) -> Result<(Sound, Damaged)> {
    let mut random = Random::new(seed);
    for _ in 0..MOST_DRAWS {
        let sound = Sound::new(seed, kind.shows, &mut random)?;
        if let Some(damaged) = (kind.damage)(&sound, &mut random) {
            return Ok((sound, damaged));
        }
    }
    Err(Error::usage(format!("{seed}: no recording shows {}", kind.name), "ask another number"))
}
