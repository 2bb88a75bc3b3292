//! Data to fit and data to judge.

use crate::recording::Recording;

/// A signal is at rest from where it stays below this share of its largest value.
const AT_REST: f64 = 0.02;

/// Data to fit and data to judge: the last recording, or of a single one the last third of the time until all is at
/// rest, as it is at the end of a coast-down, with what follows.
pub fn split(recordings: &[Recording]) -> (Vec<Recording>, Vec<Recording>) {
    if let [training @ .., held_out] = recordings
        && !training.is_empty()
    {
        return (training.to_vec(), vec![held_out.clone()]);
    }
    let recording = &recordings[0];
    let cut = until_rest(recording) * 2 / 3;
    (vec![recording.part(0..cut)], vec![recording.part(cut..recording.len())])
}

/// Samples until no signal is above [`AT_REST`] of its largest value any more; all of them where nothing ever is.
fn until_rest(recording: &Recording) -> usize {
    let last_above = |signal: &Vec<f64>| {
        let largest = signal.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
        signal.iter().rposition(|x| x.abs() > AT_REST * largest)
    };
    recording.channels().values().filter_map(last_above).max().map_or(recording.len(), |last| last + 1)
}
