//! Files with recordings: an error of one line, or a recording that keeps its promises.

use greyrig_host::anfis::csv;
use greyrig_host::context::Context;
use greyrig_host::error::Error;
use greyrig_host::recording::{self, Channel, Mapping, Recording};

use crate::{Seen, with_file};

/// Longest file that is looked at, bytes: larger ones find nothing that smaller ones do not.
const LONGEST: usize = 1 << 16;

/// Loads the bytes as a file of a name.
pub fn load(name: &str, data: &[u8]) -> Seen {
    let data = &data[..data.len().min(LONGEST)];
    with_file(name, data, |path| judge(recording::load(path, &Mapping::default(), &Context::quiet())))
}

/// The first line of the input is a mapping of several pieces between blanks, the rest a table.
pub fn mapped(data: &[u8]) -> Seen {
    let (line, rest) = data.split_at(data.iter().position(|&byte| byte == b'\n').unwrap_or(data.len()));
    let line = String::from_utf8_lossy(line);
    let pieces: Vec<&str> = line.split(' ').filter(|piece| !piece.is_empty()).collect();
    match Mapping::parse(&pieces) {
        Err(error) => one_line(&error),
        Ok(mapping) => with_file("run.csv", rest.get(1..).unwrap_or_default(), |path| {
            judge(recording::load(path, &mapping, &Context::quiet()))
        }),
    }
}

/// A table for ANFIS.
pub fn table(data: &[u8]) -> Seen {
    with_file("table.csv", data, |path| match csv::read(path, &Context::quiet()) {
        Err(error) => one_line(&error),
        Ok(_) => Seen::of("table"),
    })
}

fn judge(loaded: Result<Recording, Error>) -> Seen {
    let recording = match loaded {
        Err(error) => return one_line(&error),
        Ok(recording) => recording,
    };
    let rows = recording.len();
    let interval = recording.sample_time_s();
    assert!(interval > 0.0 && interval.is_finite(), "{interval}");
    assert!(rows > 0 && recording.valid().len() == rows);
    for (channel, values) in recording.channels() {
        assert_eq!(values.len(), rows, "{channel:?}");
        assert!(values.iter().all(|value| value.is_finite()), "{channel:?} is not finite");
    }
    // What was read can be written, and is then the same.
    if rows < 1000 {
        with_file("again.csv", b"", |path| {
            recording::write(&recording, path, true, &Context::quiet()).expect("written");
            let again =
                recording::load(path, &Mapping::default(), &Context::quiet()).expect("what greyrig writes it can read");
            assert_eq!(again.len(), rows);
        });
    }
    let channels: Vec<bool> = Channel::ALL.into_iter().map(|channel| recording.channel(channel).is_some()).collect();
    Seen::of((
        channels,
        recording.valid().contains(&false),
        recording.extras().len(),
        recording.warnings().len(),
        rows.ilog2(),
    ))
}

/// Errors are told in a line.
pub fn one_line(error: &Error) -> Seen {
    let text = error.to_string();
    assert_eq!(text.lines().count(), 1, "{text}");
    Seen::error(&text)
}
