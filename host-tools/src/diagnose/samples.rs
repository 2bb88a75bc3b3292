//! What the samples themselves show, before any fit: sparks, and lines that follow the rotor.

use greyrig::effects::{EffectId, Seen};

use super::orders;
use crate::experiment::Experiment;
use crate::noise;
use crate::recording::{Channel, Recording, clipping};

/// A speed that never falls below this share of its largest value to the negative side has no sign.
const NO_SIGN: f64 = 0.02;
/// Colour of the current's noise from which sparks are seen.
const SPARKS: f64 = 1.4;
/// Bands whose noise is compared, Hz: above what a load does, and below the anti-alias filter.
const LOWER_BAND_HZ: (f64, f64) = (400.0, 1000.0);
const UPPER_BAND_HZ: (f64, f64) = (2500.0, 3500.0);
/// Slowest sampling that holds both, s.
const SLOWEST_SAMPLING_S: f64 = 1.25e-4;

/// A finding with its reason.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The effect.
    pub id: EffectId,
    /// Why, in words.
    pub text: String,
}

impl Finding {
    /// Whether it is a line that follows the rotor.
    pub fn is_line(&self) -> bool {
        self.id.description().seen == Seen::Orders
    }
}

/// The part of the measuring chain that stands for a sensor which shows the magnitude.
pub const SIGN_LOST: EffectId = EffectId::SpeedSignLost;

/// Recordings whose clipped samples do not count (reading a file has seen to that already).
pub fn without_clipped(recordings: &[Recording]) -> Vec<Recording> {
    let mut clean = recordings.to_vec();
    for recording in &mut clean {
        for channel in [Channel::Current, Channel::Speed] {
            let Some(values) = recording.channel(channel) else { continue };
            let clipped: Vec<usize> = clipping::find(channel, values).into_iter().flat_map(|c| c.samples).collect();
            recording.exclude(clipped);
        }
    }
    clean
}

/// Looks at the samples of all recordings.
pub fn look(experiments: &[Experiment]) -> Vec<Finding> {
    let mut found = Vec::new();
    if let Some(ratio) = sparking(experiments) {
        found.push(Finding {
            id: EffectId::BrushArcing,
            text: format!(
                "the current's noise is {ratio:.1} times as strong at 400 to 1000 Hz as at 2500 to 3500 Hz, and the voltage's is \
                 not: pulses of voltage behind an inductance, sparks at the commutator (the mean hides in the resistance)"
            ),
        });
    }
    found.extend(rotor_lines(experiments));
    found
}

/// The strongest line that follows the rotor, as the effect that makes such a line.
fn rotor_lines(experiments: &[Experiment]) -> Option<Finding> {
    let lines = orders::lines(experiments);
    let line = lines.first()?;
    // The first two waves of a load that repeats with every turn.
    let both = lines.iter().filter(|line| line.order <= 2 && !line.grows).count() == 2;
    let (id, what) = match (line.grows, line.order) {
        (false, 1 | 2) if both => (
            EffectId::PositionLoad,
            "it fades as the speed rises, as what a torque does to the speed, and so does the other of the first two waves of a \
             turn: a load that goes with the angle",
        ),
        (true, _) => (EffectId::SpeedRipple, "it grows with the speed: the sensor shows it, the shaft does not do it"),
        (false, 1) => (EffectId::Imbalance, "it fades as the speed rises, as what a torque does to the speed"),
        (false, _) => (EffectId::TorqueRipple, "it fades as the speed rises, as what a torque does to the speed"),
    };
    let [(slow, at_slow), (fast, at_fast)] = line.amplitudes;
    Some(Finding {
        id,
        text: format!(
            "a line in the speed at {} times the frequency of rotation, {slow:.2} rad/s at {at_slow:.0} rad/s and {fast:.2} rad/s \
             at {at_fast:.0} rad/s: {what}",
            line.order
        ),
    })
}

/// Whether the speed is that of a magnet motor that must have turned backwards, without a sign. What is fitted then has
/// such a sensor.
pub fn sign_lost(e: &Experiment) -> bool {
    let Some(speed) = &e.speed else { return false };
    let (low, high) = speed.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let largest = e.input.iter().fold(0.0f64, |m, u| m.max(u.abs()));
    let backwards = e.input.iter().filter(|u| **u < -0.2 * largest).count();
    let forwards = e.input.iter().filter(|u| **u > 0.2 * largest).count();
    let both = backwards.min(forwards) * 10 > e.len();
    both && (low >= -NO_SIGN * high || high <= -NO_SIGN * low)
}

/// Colour of the current's noise while it flows through turning brushes, where that tells of sparks.
///
/// An arc takes some volts for part of a bar's passage, and the inductance turns such pulses into noise whose density
/// falls with the square of the frequency; noise of the converter is white. What repeats with the mains is taken off
/// first. A supply that is noisy itself does the same, so the voltage's colour is looked at too.
fn sparking(experiments: &[Experiment]) -> Option<f64> {
    let colours: Vec<[f64; 2]> = experiments.iter().filter_map(colour).collect();
    let largest = colours.iter().max_by(|a, b| a[0].total_cmp(&b[0]))?;
    (largest[0] > SPARKS && largest[0] > largest[1] * SPARKS).then_some(largest[0])
}

/// Density of the noise in the lower band over that in the upper one (ratio of amplitudes), of current and voltage.
fn colour(e: &Experiment) -> Option<[f64; 2]> {
    let (Some(current), Some(speed)) = (&e.current, &e.speed) else { return None };
    if e.interval_s > SLOWEST_SAMPLING_S {
        return None;
    }
    let turns = |n: usize| e.counted[n] && !e.is_open(n) && !e.is_locked(n);
    let fastest = speed.iter().fold(0.0f64, |m, w| m.max(w.abs()));
    let running = |n: usize| turns(n) && speed[n].abs() > 0.1 * fastest;
    let colour = |signal: &[f64]| {
        let lower = noise::density(signal, e.interval_s, e.mains_period_s, LOWER_BAND_HZ, &running)?;
        let upper = noise::density(signal, e.interval_s, e.mains_period_s, UPPER_BAND_HZ, &running)?;
        Some(lower / upper)
    };
    Some([colour(current)?, colour(&e.input)?])
}
