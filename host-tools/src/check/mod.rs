//! What is wrong with recorded data, before anything is asked of them.
//!
//! A recording is questioned by itself: its channels against each other by the two equations of a motor ([`balance`]),
//! its samples against what a measuring chain does, its time axis against what is built. Nothing here knows a model's
//! parameters, an effect or a diagnosis. Each check is a file; each finding says what, where, how much, what is done
//! about it, and what mends it.
//!
//! ```
//! use greyrig_host::check::check;
//! use greyrig_host::recording::Channel;
//! use greyrig_host::recording::finding::Code;
//! use greyrig_host::rig::{Kind, Setup};
//!
//! let run = Setup::new(Kind::PmDc).seconds(2.0).run()?.recording;
//! assert!(check(&[run], Some(Kind::PmDc)).iter().all(|finding| finding.code != Code::SignReversed));
//! # Ok::<(), greyrig_host::error::Error>(())
//! ```

pub mod balance;
pub mod criteria;
pub mod regression;

mod colour;
mod differences;
mod evidence;
mod gaps;
mod hum;
mod interpolated;
mod kind;
mod lost;
mod mismatch;
mod range;
mod raster;
mod rectified;
mod rest;
mod sampling;
mod scale;
mod sensor;
mod sets;
mod sign;
mod signals;
mod smoothed;
mod spectrum;
mod spikes;
mod standstill;
mod steps;
mod supply;
mod timing;

pub use sets::same;

use crate::error::{Error, Place, Result};
use crate::model::Kind;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};
use crate::recording::{Channel, Recording};
use evidence::Evidence;
use signals::Signals;

/// Questions recordings of one motor type. `asked` is the kind of motor that they will be taken for; none: any.
pub fn check(recordings: &[Recording], asked: Option<Kind>) -> Vec<DataFinding> {
    let mut found: Vec<DataFinding> = recordings.iter().flat_map(gaps::look).collect();
    let mut signals: Vec<Signals<'_>> = recordings.iter().map(Signals::new).collect();
    signals.iter_mut().for_each(|s| spikes::look(s, &mut found));
    let evidence: Vec<Evidence> = signals.iter().map(Evidence::new).collect();
    for (s, e) in signals.iter().zip(&evidence) {
        if s.len() > 0 {
            one(s, e, asked, &mut found);
        }
    }
    let kind = asked.or_else(|| evidence.iter().find_map(|e| e.told));
    let pairs: Vec<(&Signals<'_>, &Evidence)> = signals.iter().zip(&evidence).collect();
    let blamed = |f: &DataFinding| matches!(f.code, Code::SignReversed | Code::ChannelsSwapped | Code::UnitSuspect);
    if !found.iter().any(blamed) {
        found.extend(sets::different(&pairs, kind));
    }
    found.extend(sets::duplicates(recordings));
    found.sort_by_key(|f| std::cmp::Reverse(f.severity));
    found
}

/// Questions one recording.
fn one(s: &Signals<'_>, e: &Evidence, asked: Option<Kind>, found: &mut Vec<DataFinding>) {
    let kind = asked.or(e.told).unwrap_or_default();
    let before = found.len();
    range::look(s, found);
    steps::look(s, found);
    sensor::look(s, found);
    interpolated::look(s, found);
    smoothed::look(s, kind, found);
    lost::look(s, found);
    hum::look(s, found);
    colour::look(s, found);
    rest::look(s, found);
    sampling::look(s, e, kind, found);
    standstill::look(s, e, kind, found);
    supply::look(s, e, kind, found);
    let stopped = found[before..].iter().any(|f| f.severity == Severity::Stop);
    // What a dead channel or a supply's voltage says about the others means nothing.
    if stopped {
        return;
    }
    if let Some(asked) = asked {
        kind::look(s, e, asked, found);
    }
    timing::look(s, e, kind, found);
    // A channel that is late goes with the others as another sign would.
    if !found[before..].iter().any(|f| matches!(f.code, Code::ChannelShift | Code::ClockSkew)) {
        sign::look(s, e, kind, found);
    }
    rectified::look(s, e, kind, found);
    mismatch::look(s, e, kind, found);
    scale::look(s, e, kind, found);
}

/// What recordings are questioned for: how much of the measuring chain's doing is undone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// A detector: codes for "no measurement" are masked alone, since a spark is what it looks for.
    Detection,
    /// A fit or a comparison: single samples far from their neighbours are masked, too, since they are nothing that a
    /// motor does. Nor is hum, nor the lateness of a current that is held.
    Fit,
}

/// Masks wild samples, as the findings `overrange` and `outliers` say: they do not count, and the line between their
/// neighbours takes their place. Nor do those count at which a channel has reached the end of its one side.
pub fn mask(recordings: &mut [Recording], purpose: Purpose) {
    for recording in recordings {
        spikes::mask(recording, purpose == Purpose::Fit);
        range::mask(recording);
    }
}

/// The first step of every answer: questions recordings as [`check`] does, then masks what is wild. For a fit the hum
/// of the measuring chain is taken out, of a current that is held the rows with a new value are taken, and a channel
/// with a clock of its own is put on that of the voltage.
pub fn question(recordings: &mut [Recording], kind: Kind, purpose: Purpose) -> Vec<DataFinding> {
    let mut found = check(recordings, Some(kind));
    mask(recordings, purpose);
    let kept = |f: &DataFinding| f.code == Code::Outliers && purpose == Purpose::Detection;
    found.iter_mut().filter(|f| kept(f)).for_each(|f| f.handled = Handled::None);
    if purpose == Purpose::Fit {
        hum::take_out(recordings, &mut found);
        raster::take_renewed(recordings, &mut found);
        timing::correct(recordings, &mut found);
    }
    found
}

/// Questions the input of a prediction. With a measured current or speed it is a recording, as in a comparison; a
/// voltage alone is what somebody wants to know about, and stays as it is. Nothing refuses it: what is wrong with a
/// measured channel does not change what the model makes of the voltage.
pub fn question_an_input(recordings: &mut [Recording], kind: Kind) -> Vec<DataFinding> {
    if recordings.iter().any(is_recorded) {
        return question(recordings, kind, Purpose::Fit);
    }
    let mut found = check(recordings, Some(kind));
    let as_it_is =
        |f: &&mut DataFinding| matches!(f.handled, Handled::Masked | Handled::Corrected) && f.code != Code::TimeGap;
    found.iter_mut().filter(as_it_is).for_each(|f| f.handled = Handled::None);
    found
}

/// Whether a recording holds what a motor did, and not a voltage alone.
pub fn is_recorded(recording: &Recording) -> bool {
    [Channel::Current, Channel::Speed, Channel::Angle].iter().any(|channel| recording.channel(*channel).is_some())
}

/// Refuses recordings from which any answer would mean nothing.
///
/// # Errors
/// The first finding that stops.
pub fn refuse(findings: &[DataFinding]) -> Result<()> {
    let Some(stop) = stop(findings) else { return Ok(()) };
    let remedy = stop.remedy.clone().unwrap_or_else(|| "record again; `greyrig check` tells more".to_owned());
    Err(Error::input(Place::file(&stop.recording), &stop.text, remedy))
}

/// The finding, if any, that makes every answer meaningless.
pub fn stop(findings: &[DataFinding]) -> Option<&DataFinding> {
    findings.iter().find(|f| f.severity == Severity::Stop)
}
