//! From a file to the station's sequence: the profile by its name or segment by segment, and the limits.
//!
//! ```toml
//! profile = "steady"       # of `greyrig simulate --list`; or wave and [[segment]]s
//! seconds = 7.0            # its length, if not its own
//! peak_voltage_v = 325.0   # its largest voltage, if not its own
//! mains_hz = 50.0
//! trip_a = 30.0
//! overspeed_rad_s = 4500.0
//! rest_rad_s = 50.0
//! time_out_s = 40.0
//! [stuck]
//! from_v = 150.0
//! below_rad_s = 20.0
//! within_s = 1.0
//! ```

use std::path::Path;

use greyrig::parameters::{self, Rig};
use greyrig::sequence::{MAX_SEGMENTS, Segment, Settings, Stuck, Supplied, Supply, Wave};
use serde::Deserialize;

use super::RIG;
use crate::error::{Error, Place, Result};
use crate::model::Kind;
use crate::rig::source::{self, Drive, Shape};
use crate::rig::{Motor, Profile, motor};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    profile: Option<String>,
    seconds: Option<f64>,
    peak_voltage_v: Option<f64>,
    mains_hz: Option<f64>,
    wave: Option<FileWave>,
    #[serde(default)]
    segment: Vec<FileSegment>,
    trip_a: f32,
    overspeed_rad_s: f32,
    rest_rad_s: f32,
    time_out_s: f32,
    stuck: FileStuck,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum FileWave {
    Direct,
    Alternating,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSegment {
    seconds: f32,
    from_v: f32,
    to_v: f32,
    /// The contactor is open.
    #[serde(default)]
    off: bool,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileStuck {
    from_v: f32,
    below_rad_s: f32,
    within_s: f32,
}

/// Frequency where the file says none, Hz.
const MAINS_HZ: f64 = 50.0;

/// Reads a sequence for a kind of motor.
///
/// # Errors
/// A file that cannot be read, a profile that one supply of one sign cannot give, a value that cannot be.
pub fn read(path: &Path, kind: Kind) -> Result<Settings> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
    let wrong = |line, what: String, remedy: &str| Error::input(Place::at(path, line, 0), what, remedy);
    let file: File = toml::from_str(&text).map_err(|e| {
        let line = e.span().map_or(0, |span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        let what = e.message().lines().next().unwrap_or("no sequence").to_owned();
        wrong(
            line,
            what,
            "give a profile, trip_a, overspeed_rad_s, rest_rad_s, time_out_s and [stuck], see docs/sequence.md",
        )
    })?;
    let (wave, segments) = match (&file.profile, file.wave) {
        (Some(profile), None) if file.segment.is_empty() => of_profile(&file, profile, kind, path)?,
        (None, Some(wave)) if file.seconds.is_none() && file.peak_voltage_v.is_none() => {
            (of_wave(&file, wave), own(&file))
        }
        _ => {
            let what = "it has to name a profile, or a wave and segments, not both";
            return Err(wrong(
                0,
                what.into(),
                "give profile (with seconds and peak_voltage_v), or wave and [[segment]]s",
            ));
        }
    };
    let count = segments.len();
    if count > MAX_SEGMENTS {
        return Err(wrong(0, format!("it has {count} segments"), &format!("give {MAX_SEGMENTS} at most")));
    }
    let settings = Settings {
        wave,
        segments: segments.into_iter().collect(),
        trip_a: file.trip_a,
        overspeed_rad_s: file.overspeed_rad_s,
        stuck: Stuck { from_v: file.stuck.from_v, below_rad_s: file.stuck.below_rad_s, within_s: file.stuck.within_s },
        rest_rad_s: file.rest_rad_s,
        time_out_s: file.time_out_s,
    };
    settings.validate().map_err(|e| wrong(0, e.to_string(), "correct it"))?;
    Ok(settings)
}

fn of_wave(file: &File, wave: FileWave) -> Wave {
    match wave {
        FileWave::Direct => Wave::Direct,
        FileWave::Alternating => Wave::Alternating { frequency_hz: file.mains_hz.unwrap_or(MAINS_HZ) as f32 },
    }
}

fn own(file: &File) -> Vec<Segment> {
    let supplied = |off| if off { Supplied::Off } else { Supplied::On };
    let of =
        |s: &FileSegment| Segment { seconds: s.seconds, from_v: s.from_v, to_v: s.to_v, supplied: supplied(s.off) };
    file.segment.iter().map(of).collect()
}

/// The profile of a name, as `greyrig simulate` runs it on the nominal motor.
fn of_profile(file: &File, profile: &str, kind: Kind, path: &Path) -> Result<(Wave, Vec<Segment>)> {
    let kind = match kind {
        Kind::Universal => motor::Kind::Universal,
        Kind::PmDc => motor::Kind::PmDc,
    };
    let profile = Profile::find(profile)?;
    let mut segments = profile.segments(
        &Motor::nominal(kind),
        file.mains_hz.unwrap_or(MAINS_HZ),
        file.seconds.unwrap_or(profile.seconds),
    )?;
    if let Some(peak) = file.peak_voltage_v {
        let highest = segments.iter().map(source::Segment::peak_v).fold(0.0, f64::max);
        segments.iter_mut().for_each(|segment| segment.scale(peak / highest));
    }
    let refuse = |what: &str| {
        let what = format!("profile {}: {what}", profile.id);
        Error::input(
            Place::file(path),
            what,
            "take another profile: steady, staircase, ramp, start, coast-down, dc-steps, dc-ramp",
        )
    };
    let mut wave = None;
    let mut converted = Vec::new();
    for segment in &segments {
        let (of_segment, from_v, to_v) = match segment.shape {
            Shape::Ac { frequency_hz, from_v, to_v } => {
                (Wave::Alternating { frequency_hz: frequency_hz as f32 }, from_v, to_v)
            }
            Shape::Dc { from_v, to_v } => (Wave::Direct, from_v, to_v),
        };
        let supplied = match segment.drive {
            Drive::Closed => Supplied::On,
            Drive::Off => Supplied::Off,
            Drive::Triac { .. } => return Err(refuse("the board commands a voltage, no firing angle")),
        };
        if segment.locked {
            return Err(refuse("nobody holds the rotor"));
        }
        if from_v < 0.0 || to_v < 0.0 {
            return Err(refuse("the board commands voltages of one sign"));
        }
        if *wave.get_or_insert(of_segment) != of_segment {
            return Err(refuse("it is of two kinds of voltage"));
        }
        let seconds = segment.seconds as f32;
        converted.push(Segment { seconds, from_v: from_v as f32, to_v: to_v as f32, supplied });
    }
    Ok((wave.unwrap_or(Wave::Direct), converted))
}

/// Whether a rig can do a motor's sequence, where it has one.
///
/// # Errors
/// A rig without a supply, or with another one than it needs.
pub fn suits(settings: &parameters::Settings, rig: &Rig) -> Result<()> {
    if settings.sequence.is_none() {
        return Ok(());
    }
    if rig.supply.is_none() {
        return Err(Error::usage(
            "the rig has no supply that the sequence could command",
            "say what it gives: greyrig rig --port PORT --supply ac:325:50",
        ));
    }
    let together = parameters::Settings { rig: Some(rig.clone()), ..settings.clone() };
    together
        .sequence(&RIG)
        .map(|_| ())
        .map_err(|e| Error::usage(format!("the rig cannot do it: {e}"), "change the sequence, or the rig's --supply"))
}

/// A supply in an argument: `ac:PEAK_V:HZ` or `dc:V`.
///
/// # Errors
/// Anything else.
pub fn supply(text: &str) -> Result<Supply> {
    let refuse = || Error::usage(format!("`{text}` is no supply"), "write ac:PEAK_V:HZ, such as ac:325:50, or dc:V");
    let mut parts = text.split(':');
    let kind = parts.next().unwrap_or_default();
    let numbers: Vec<f32> = parts.map(|part| part.parse().map_err(|_| refuse())).collect::<Result<_>>()?;
    let supply = match (kind, numbers.as_slice()) {
        ("ac", &[full_scale_v, frequency_hz]) => Supply { wave: Wave::Alternating { frequency_hz }, full_scale_v },
        ("dc", &[full_scale_v]) => Supply { wave: Wave::Direct, full_scale_v },
        _ => return Err(refuse()),
    };
    supply.validate().map_err(|e| Error::usage(e.to_string(), "write ac:PEAK_V:HZ, such as ac:325:50, or dc:V"))?;
    Ok(supply)
}

/// A supply in words.
pub fn in_words(supply: &Supply) -> String {
    match supply.wave {
        Wave::Direct => format!("direct, 0 to {} V", supply.full_scale_v),
        Wave::Alternating { frequency_hz } => {
            format!("{frequency_hz} Hz, 0 to {} V peak", supply.full_scale_v)
        }
    }
}
