//! What is in a block: sections with a tag, a version and a length each.
//!
//! ```text
//! byte 0      tag
//! byte 1      version of the section
//! byte 2, 3   length of the body, little-endian
//! byte 4 …    body in postcard's encoding (wire format 1.0) of the type named at the tag
//! ```
//! Sections may come in any order. Postcard is compact, stable, specified, and encodes `f32` in full, so that every
//! value comes back bit by bit; versions and lengths around it make the block extendable, which postcard by itself is
//! not. The order of fields and of variants of the encoded types is part of the format: changing one means a new
//! version of the section, and [`FINGERPRINT`](super::FINGERPRINT) and a test of the bytes notice if it is forgotten.

use serde::{Deserialize, Serialize};

use super::block::MAX_PAYLOAD;
use super::encoding::{Sections, Writer, text, whole};
use super::tag::Tag;
use super::{Error, Origin, Rig, Settings, Text};
use crate::anfis::{Firing, Premise, Settings3x3, Shape};
use crate::effects::{Effect, MAX_EFFECT_PARAMETERS, MAX_EFFECTS};
use crate::motor::MAX_TERMS;
use crate::term::{MAX_OPS, MAX_UNKNOWNS, Op, Target, Term};

/// Since a rig has a block of its own, its name is empty here.
#[derive(Serialize, Deserialize)]
struct Identity<'a> {
    motor_type: &'a str,
    rig: &'a str,
}

#[derive(Serialize, Deserialize)]
struct OriginEntry<'a> {
    greyrig: &'a str,
    build: [u8; 8],
}

/// Effects by identifier, so that a longer catalogue reads the blocks of a shorter one.
#[derive(Serialize, Deserialize)]
struct EffectEntry<'a> {
    id: &'a str,
    values: [f32; MAX_EFFECT_PARAMETERS],
}

#[derive(Serialize, Deserialize)]
struct TermEntry {
    target: Target,
    ops: heapless::Vec<Op<f32>, MAX_OPS>,
    unknowns: [f32; MAX_UNKNOWNS],
}

/// A network in single precision, which is what it is computed with.
#[derive(Serialize, Deserialize)]
struct CorrectionEntry {
    shape: Shape,
    firing: Firing,
    /// a, b, c of each membership function, by input.
    premise: [[[f32; 3]; 3]; 3],
    slopes: [[f32; 3]; 27],
    constants: [f32; 27],
    inputs: [(f32, f32); 3],
    output: (f32, f32),
    margin: f32,
}

impl From<&Settings3x3> for CorrectionEntry {
    fn from(s: &Settings3x3) -> Self {
        let pair = |(low, high): (f64, f64)| (low as f32, high as f32);
        Self {
            shape: s.shape,
            firing: s.firing,
            premise: s.premise.map(|input| input.map(|p| [p.a, p.b, p.c].map(|x| x as f32))),
            slopes: s.slopes.map(|rule| rule.map(|x| x as f32)),
            constants: s.constants.map(|x| x as f32),
            inputs: s.inputs.map(pair),
            output: pair(s.output),
            margin: s.margin as f32,
        }
    }
}

impl From<CorrectionEntry> for Settings3x3 {
    fn from(e: CorrectionEntry) -> Self {
        let pair = |(low, high): (f32, f32)| (f64::from(low), f64::from(high));
        Self {
            shape: e.shape,
            firing: e.firing,
            premise: e
                .premise
                .map(|input| input.map(|[a, b, c]| Premise { a: f64::from(a), b: f64::from(b), c: f64::from(c) })),
            slopes: e.slopes.map(|rule| rule.map(f64::from)),
            constants: e.constants.map(f64::from),
            inputs: e.inputs.map(pair),
            output: pair(e.output),
            margin: f64::from(e.margin),
        }
    }
}

/// Writes all sections into `payload` and gives the used part.
///
/// # Errors
/// [`Error::TooLong`]; the values are not checked, see [`Settings::build`].
pub fn encode<'b>(settings: &Settings, payload: &'b mut [u8; MAX_PAYLOAD]) -> Result<&'b [u8], Error> {
    let mut out = Writer::new(payload);
    let rig = settings.rig.as_ref();
    let name = rig.map_or("", |rig| rig.name.as_str());
    out.section(Tag::Identity, &Identity { motor_type: &settings.motor_type, rig: name })?;
    if let Some(rig) = rig {
        out.section(Tag::Calibration, &rig.calibration)?;
    }
    out.section(Tag::Filter, &settings.filter)?;
    out.section(Tag::Motor, &settings.motor)?;
    let effects: heapless::Vec<_, MAX_EFFECTS> =
        settings.effects.iter().map(|effect| EffectEntry { id: effect.id().id(), values: effect.values() }).collect();
    out.section(Tag::Effects, &effects)?;
    let terms: heapless::Vec<_, MAX_TERMS> = settings
        .terms
        .iter()
        .map(|term| TermEntry { target: term.target(), ops: term.ops().collect(), unknowns: term.unknowns() })
        .collect();
    out.section(Tag::Terms, &terms)?;
    if let Some(correction) = &settings.correction {
        out.section(Tag::Correction, &CorrectionEntry::from(correction))?;
    }
    if let Some(detector) = &settings.detector {
        out.section(Tag::Detector, detector)?;
    }
    if let Some(sequence) = &settings.sequence {
        out.section(Tag::Sequence, sequence)?;
    }
    if let Some(Origin { greyrig, build }) = &settings.origin {
        out.section(Tag::Origin, &OriginEntry { greyrig, build: *build })?;
    }
    out.used()
}

/// Reads a payload and checks every value.
///
/// # Errors
/// The first section or value that cannot be used. Never panics, whatever the bytes.
pub fn decode(payload: &[u8]) -> Result<Settings, Error> {
    let mut settings = Settings::default();
    let (mut rig, mut calibration) = (Text::new(), None);
    let mut sections = Sections::new(payload);
    while let Some((tag, body)) = sections.next()? {
        match tag {
            Tag::Identity => {
                let identity: Identity = whole(tag, body)?;
                settings.motor_type = text(tag, identity.motor_type)?;
                rig = text(tag, identity.rig)?;
            }
            Tag::Calibration => calibration = Some(whole(tag, body)?),
            Tag::Filter => settings.filter = whole(tag, body)?,
            Tag::Motor => settings.motor = whole(tag, body)?,
            Tag::Effects => {
                let entries: heapless::Vec<EffectEntry, MAX_EFFECTS> = whole(tag, body)?;
                for (index, EffectEntry { id, values }) in entries.iter().enumerate() {
                    let id = id.parse().map_err(|_| Error::UnknownEffect(index))?;
                    let effect = Effect::new(id, values);
                    settings.effects.push(effect).map_err(|_| Error::Malformed(tag))?;
                }
            }
            Tag::Terms => {
                let entries: heapless::Vec<TermEntry, MAX_TERMS> = whole(tag, body)?;
                for (index, entry) in entries.iter().enumerate() {
                    let ops: heapless::Vec<Op<f64>, MAX_OPS> = entry.ops.iter().map(|op| op.map(f64::from)).collect();
                    let term = Term::build(entry.target, &ops, entry.unknowns.map(f64::from));
                    settings
                        .terms
                        .push(term.map_err(|error| Error::Term(index, error))?)
                        .map_err(|_| Error::Malformed(tag))?;
                }
            }
            Tag::Correction => settings.correction = Some(whole::<CorrectionEntry>(tag, body)?.into()),
            Tag::Detector => settings.detector = Some(whole(tag, body)?),
            Tag::Sequence => settings.sequence = Some(whole(tag, body)?),
            Tag::Rig | Tag::Supply => return Err(Error::Elsewhere(tag)),
            Tag::Origin => {
                let OriginEntry { greyrig, build } = whole(tag, body)?;
                settings.origin = Some(Origin { greyrig: text(tag, greyrig)?, build });
            }
        }
    }
    settings.rig = calibration.map(|calibration| Rig { name: rig, calibration, supply: None });
    for ((tag, version), seen) in Tag::ALL.into_iter().zip(sections.seen) {
        if version.is_some() && !tag.is_optional() && !seen {
            return Err(Error::Missing(tag));
        }
    }
    settings.build()?;
    Ok(settings)
}
