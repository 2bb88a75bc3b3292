//! Damaged files: an error or a recording, never a panic, whatever the bytes.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use greyrig_host::context::Context;
use greyrig_host::recording::{self, Extra, Mapping, Recording};

/// A fixed sequence (Park and Miller's minimal standard generator, 1988), so that a failure can be repeated.
struct Sequence(u64);

impl Sequence {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0 * 16_807 % 2_147_483_647;
        (self.0 as usize) % n.max(1)
    }
}

/// Loads a file; panics in the readers are fenced by them, so any panic here is one of our own code.
fn survives(path: &Path, what: &str) {
    let mapping = Mapping::default();
    let result = catch_unwind(AssertUnwindSafe(|| recording::load(path, &mapping, &Context::quiet())));
    match result {
        Ok(Ok(recording)) => {
            assert!(recording.channels().values().all(|c| c.len() == recording.len()), "{what}");
            assert!(recording.channels().values().flatten().all(|x| x.is_finite()), "{what}");
            assert!(recording.sample_time_s() > 0.0, "{what}");
        }
        Ok(Err(error)) => assert_eq!(error.to_string().lines().count(), 1, "{what}: {error}"),
        Err(_) => panic!("{what}: a panic"),
    }
}

fn mutate(name: &str, bytes: &[u8], rounds: usize) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    let mut random = Sequence(20_260_301);
    for round in 0..rounds {
        let mut damaged = bytes.to_vec();
        let what = match round % 4 {
            0 => {
                let length = random.below(bytes.len());
                damaged.truncate(length);
                format!("{name} cut to {length}")
            }
            // Headers are where readers take lengths and counts from.
            1 => {
                let at = random.below(bytes.len().min(1024));
                damaged[at] ^= 1 << random.below(8);
                format!("{name} bit flipped at {at}")
            }
            2 => {
                let at = random.below(bytes.len());
                damaged[at] = [0, 0xff, 0x7f, 0x80][random.below(4)];
                format!("{name} byte set at {at}")
            }
            _ => {
                let at = bytes.len().saturating_sub(1 + random.below(1024));
                let end = (at + 4).min(bytes.len());
                damaged[at..end].fill([0xff, 0x7f][random.below(2)]);
                format!("{name} word set at {at}")
            }
        };
        std::fs::write(&path, &damaged).expect("a writable file");
        survives(&path, &what);
    }
}

#[test]
fn files_of_other_tools_damaged() {
    let Some(folder) = super::recording::data() else { return };
    let mut entries: Vec<_> = std::fs::read_dir(&folder).expect("a folder").filter_map(Result::ok).collect();
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let name = entry.file_name().to_string_lossy().into_owned();
        if ["json", "py", "mcap"].iter().any(|e| name.ends_with(e)) {
            continue;
        }
        mutate(&name, &std::fs::read(entry.path()).expect("readable"), 200);
    }
}

#[test]
fn own_files_damaged() {
    let n = 300;
    let wave = |a: f64| (0..n).map(|k| a * (f64::from(k) * 0.1).sin()).collect::<Vec<_>>();
    let builder = Recording::builder(1e-3)
        .rotor_locked(vec![false; n as usize])
        .extra(Extra { name: "temp_c".into(), values: vec![25.0; n as usize] });
    let sizes = recording::Channel::ALL.into_iter().zip([12.0, 3.0, 200.0, 9.0, 0.1]);
    let original = sizes.fold(builder, |b, (c, a)| b.channel(c, wave(a))).build().expect("a recording");
    let folder = tempfile::tempdir().expect("a temporary folder");
    for name in ["run.csv", "run.parquet"] {
        if name == "run.parquet" && !cfg!(feature = "parquet") {
            continue;
        }
        let path = folder.path().join(name);
        recording::write(&original, &path, false, &Context::quiet()).expect("written");
        mutate(name, &std::fs::read(path).expect("readable"), 2000);
    }
}

#[test]
fn noise_under_any_name_is_refused() {
    let mut random = Sequence(7);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let heads: [&[u8]; 9] = [
        b"",
        b"PAR1",
        b"MDF     4.10    ",
        b"MDF     3.30    ",
        b"TDSm\x0e\0\0\0",
        b"RIFF\0\x10\0\0WAVEfmt ",
        b"\x89HDF\r\n\x1a\n",
        b"MATLAB 5.0 MAT-file",
        b"PK\x03\x04",
    ];
    for extension in
        ["csv", "csv.gz", "tsv", "dat", "parquet", "feather", "mat", "h5", "mf4", "mdf", "tdms", "wav", "npz"]
    {
        for head in heads {
            for length in [1, 30, 200, 3000] {
                let mut bytes = head.to_vec();
                bytes.extend((0..length).map(|_| random.below(256) as u8));
                if extension == "mat" && bytes.len() > 128 {
                    bytes[124..128].copy_from_slice(b"\0\x01IM");
                }
                let path = folder.path().join(format!("noise.{extension}"));
                std::fs::write(&path, bytes).expect("a writable file");
                survives(&path, &format!("{extension}, {length} bytes behind {head:?}"));
            }
        }
    }
}
