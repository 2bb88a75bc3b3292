//! Tables that grow: whatever a crash has left, a line that is added is a line by itself, and no whole line is lost.

use greyrig_host::context::Context;
use greyrig_host::journal::{self, Journal};
use greyrig_host::monitor::golden::History;

use crate::recordings::one_line;
use crate::{Seen, with_file};

const HEADER: &str = "check,date,recording,serial,model,verdict,current_deviation,speed_deviation,sparking_a,voltage_v";

/// A file; where it does not begin with a header, one is put before it.
pub fn open(data: &[u8]) -> Seen {
    let content = if data.starts_with(b"!") { data[1..].to_vec() } else { [HEADER.as_bytes(), b"\n", data].concat() };
    with_file("history.csv", &content, |path| {
        let checked = journal::check(path, HEADER).is_ok();
        match Journal::open(path, HEADER, &Context::quiet()) {
            Err(error) => {
                assert_eq!(std::fs::read(path).expect("it is there"), content, "what is refused is left as it is");
                return one_line(&error);
            }
            Ok(mut journal) => {
                assert!(checked, "what can be opened was not refused before");
                journal.append(&["a line".to_owned()]).expect("it is added");
            }
        }
        let after = std::fs::read(path).expect("it is there");
        let whole = content.iter().rposition(|&byte| byte == b'\n').map_or(0, |n| n + 1);
        assert!(after.starts_with(&content[..whole]) && after.ends_with(b"\na line\n"));
        let mut history = History::open(path, &Context::quiet()).expect("it is a history");
        history.append(&[]).expect("nothing to add");
        let seen = Seen::of((history.runs.len().min(9), history.torn.len().min(9), whole == content.len()));
        let beside = path.with_extension("csv.cut");
        let _ = std::fs::remove_file(beside);
        seen
    })
}
