//! What was found while the file was read, and parts between gaps that are too short for anything.

use crate::filtering::Filter;
use crate::recording::Recording;
use crate::recording::finding::{Code, DataFinding, Handled, Severity};
use crate::segments;

/// What to look for.
pub fn look(recording: &Recording) -> Vec<DataFinding> {
    let mut found = recording.findings().to_vec();
    let time_s = |n: usize| recording.start_s() + n as f64 * recording.sample_time_s();
    for part in segments::too_short(recording, &Filter::default()) {
        let text = format!("the {} samples between gaps are too few for the filter: they are left out", part.len());
        found.push(
            DataFinding::new(Code::TooShort, Severity::Info, recording.path(), text)
                .between(time_s(part.start), time_s(part.end - 1))
                .value(part.len() as f64 * recording.sample_time_s(), "s")
                .handled(Handled::Masked),
        );
    }
    found
}
