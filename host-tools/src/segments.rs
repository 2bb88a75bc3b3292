//! Recordings with gaps, taken apart: what the motor did in a gap is not known, so that the model begins anew behind
//! it, from a state of its own.

use std::borrow::Cow;
use std::ops::Range;

use crate::filtering::{FEWEST_SETTLINGS, Filter};
use crate::recording::Recording;

/// Recordings without gaps, in their order. Of one with gaps each stretch between them is a recording of its own, if it
/// is long enough for the filter to settle in it; the longest one if none is.
pub fn apart<'a>(recordings: &'a [Recording], filter: &Filter) -> Cow<'a, [Recording]> {
    if recordings.iter().all(|r| r.gaps().is_empty()) {
        return Cow::Borrowed(recordings);
    }
    let of = |recording: &Recording| {
        if recording.gaps().is_empty() {
            return vec![recording.clone()];
        }
        let short = too_short(recording, filter);
        let mut segments = recording.segments();
        let mut ranges = recording.between_gaps().into_iter();
        segments.retain(|_| ranges.next().is_some_and(|range| !short.contains(&range)));
        if segments.is_empty() {
            recording.segments().into_iter().max_by_key(Recording::len).into_iter().collect()
        } else {
            segments
        }
    };
    Cow::Owned(recordings.iter().flat_map(of).collect())
}

/// Stretches between gaps that are too short for the filter; none of a recording without gaps.
pub fn too_short(recording: &Recording, filter: &Filter) -> Vec<Range<usize>> {
    let settling = filter.at(recording.sample_time_s()).settling_samples().unwrap_or(0) as usize;
    let ranges = if recording.gaps().is_empty() { Vec::new() } else { recording.between_gaps() };
    ranges.into_iter().filter(|range| range.len() < FEWEST_SETTLINGS * settling).collect()
}
