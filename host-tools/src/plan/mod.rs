//! The recording that would best tell rival effects apart, found by simulating them.
//!
//! y(θ) are the filtered current and speed of the model's free run and, where the supply is open, the voltage that the
//! terminals show, each over its noise σ; d_A = y(θ, a) − y(θ) is what effect A does to them at a size that causes an
//! error of 1 % in the current of the usual staircase. J holds the sensitivities ∂y/∂θ to the base parameters, d_B, and
//! how d_B changes with the shape of B. What neither can imitate is
//! ```text
//! s(A|B) = ‖(I − J J⁺) d_A‖/√N
//! ```
//! over N instants, in multiples of the noise. The separation of two rivals is the smaller one of s(A|B) and s(B|A):
//! whichever of them is real, it is seen not to be the other one. Several recordings stand below each other in y.
//!
//! | noise | σ |
//! |---|---|
//! | before the filter | that of the virtual rig's chain ([`ChainSetup`](crate::rig::ChainSetup)) |
//! | after it | a fifth: √(250 Hz/5 kHz) is 0.22 |
//!
//! Profiles are waveforms of the voltage, scaled down until voltage and current stay within the limits.

mod bench;
mod rivals;
mod trial;

use greyrig::effects::EffectId;
use rayon::prelude::*;
use serde::Serialize;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::model::{Kind, Model};
use crate::rig::{PROFILES, Profile};
use bench::{Bench, Piece};

/// The recording that sizes are relative to, and that goes with each other profile.
const USUAL: &str = "staircase";
/// Shortest and longest plan, s.
pub const SECONDS: (f64, f64) = (2.0, 120.0);

/// The most that a recording may ask of motor and rig.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Limits {
    /// Peak voltage, V.
    pub voltage_v: f64,
    /// Peak current, A.
    pub current_a: f64,
}

impl Limits {
    /// The scale of the motors that the rig was made for.
    pub const fn usual(kind: Kind) -> Self {
        match kind {
            Kind::Universal => Self { voltage_v: 325.0, current_a: 10.0 },
            Kind::PmDc => Self { voltage_v: 24.0, current_a: 15.0 },
        }
    }
}

/// A recording of a proposal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Take {
    /// Profile of the rig.
    pub profile: &'static str,
    /// Length, s.
    pub seconds: f64,
    /// Peak voltage, V.
    pub peak_voltage_v: f64,
    /// Peak current of the model, A.
    pub peak_current_a: f64,
}

/// Recordings, and how well they tell two rivals apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Proposal {
    /// One or two recordings.
    pub recordings: Vec<Take>,
    /// What remains of the effect that is harder to tell, in multiples of the noise.
    pub separation: f64,
    /// What remains of each rival after the other one.
    pub each: [f64; 2],
}

/// Two rivals and the proposals, best first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contest {
    /// The effects.
    pub rivals: [EffectId; 2],
    /// Their sizes: 1 % of the current of the usual staircase.
    pub sizes: [f64; 2],
    /// What the catalogue says.
    pub separated_by: String,
    /// Recordings, best first.
    pub proposals: Vec<Proposal>,
}

/// The result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// What was kept to.
    pub limits: Limits,
    /// Pair by pair.
    pub contests: Vec<Contest>,
    /// The recordings that tell most over all pairs: largest Σ ln(1 + s²).
    pub best: Vec<Take>,
}

/// Plans the recording that tells rivals apart; without rivals, the classic pairs.
///
/// # Errors
/// A model that cannot be run, rivals that nothing tells apart, an impossible length, an interrupt.
pub fn plan(model: &Model, rivals: &[EffectId], seconds: f64, limits: Limits, ctx: &Context) -> Result<Plan> {
    ctx.install(|| planned(model, rivals, seconds, limits, ctx))
}

fn planned(model: &Model, rivals: &[EffectId], seconds: f64, limits: Limits, ctx: &Context) -> Result<Plan> {
    if !(SECONDS.0..=SECONDS.1).contains(&seconds) {
        return Err(Error::usage(
            format!("a recording of {seconds} s is not possible"),
            format!("give --seconds from {} to {}", SECONDS.0, SECONDS.1),
        ));
    }
    let pairs = if rivals.is_empty() { rivals::classic(model.kind) } else { rivals::pairs(model.kind, rivals)? };
    let bench = Bench::new(model, &pairs, seconds, limits, ctx)?;
    let mut lengths: Vec<(&'static Profile, f64)> = Vec::new();
    for profile in PROFILES.iter().filter(|p| p.pm_dc || model.kind == Kind::Universal) {
        lengths.extend([(profile, seconds), (profile, 0.5 * seconds)]);
    }
    let steps = ctx.steps("simulations", lengths.len() as u64);
    let pieces: Vec<Option<Piece>> = lengths
        .par_iter()
        .map(|(profile, seconds)| {
            ctx.check()?;
            let piece = bench.piece(profile, *seconds, ctx)?;
            steps.next();
            Ok(piece)
        })
        .collect::<Result<_>>()?;
    let sets = sets(&pieces, seconds);
    let contests: Vec<Contest> = pairs.iter().map(|pair| bench.contest(*pair, &sets, ctx)).collect::<Result<_>>()?;
    let best = overall(&contests, &sets);
    Ok(Plan { limits, contests, best })
}

/// The voltage of a recording that a plan proposes, V, at each sample of the rig's rate: what it was when it was
/// weighed. `in_question` are the rivals of that plan.
///
/// # Errors
/// A profile that there is not, or that does not keep the limits; a model that cannot be run; an interrupt.
pub fn voltage(
    model: &Model,
    in_question: &[EffectId],
    (profile, seconds): (&str, f64),
    limits: Limits,
    ctx: &Context,
) -> Result<Vec<f64>> {
    let bench = Bench::without(model, in_question, seconds, limits)?;
    let drawn = bench.waveform(Profile::find(profile)?, seconds, ctx)?;
    drawn.map(|drawn| drawn.voltage).ok_or_else(|| {
        Error::usage(format!("{profile} does not stay within the limits"), "take another recording of the plan")
    })
}

/// One or two pieces, and what they stand for.
struct Set<'a> {
    pieces: Vec<&'a Piece>,
    takes: Vec<Take>,
}

/// Each profile by itself, and with the usual staircase at half the length each. `pieces`: full and half length in
/// turn.
fn sets(pieces: &[Option<Piece>], seconds: f64) -> Vec<Set<'_>> {
    let usual = pieces.iter().flatten().find(|p| p.take.profile == USUAL && p.take.seconds < seconds);
    let mut sets = Vec::new();
    for piece in pieces.iter().flatten() {
        let half = piece.take.seconds < seconds;
        let together = match (half, usual) {
            (false, _) => vec![piece],
            (true, Some(usual)) if piece.take.profile != USUAL => vec![usual, piece],
            _ => continue,
        };
        sets.push(Set { takes: together.iter().map(|p| p.take.clone()).collect(), pieces: together });
    }
    sets
}

fn overall(contests: &[Contest], sets: &[Set<'_>]) -> Vec<Take> {
    let told = |set: &Set<'_>| -> f64 {
        contests
            .iter()
            .filter_map(|c| c.proposals.iter().find(|p| p.recordings == set.takes))
            .map(|p| p.separation.powi(2).ln_1p())
            .sum()
    };
    sets.iter().max_by(|a, b| told(a).total_cmp(&told(b))).map_or_else(Vec::new, |set| set.takes.clone())
}
