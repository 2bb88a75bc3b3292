//! Recordings as other programs write them: read right, or refused by name.
//!
//! The small files in tests/data/foreign were made by tests/data/make_foreign.py; those of `shared/cases` are read
//! where that folder is.

use std::path::{Path, PathBuf};

use greyrig_host::context::Context;
use greyrig_host::recording::{self, Channel, Mapping, Recording};

const INTERVAL_S: f64 = 1e-3;
const SAMPLES: usize = 40;

fn volts(t: f64) -> f64 {
    12.0 * (5.0 * t).sin() + 1.0
}

fn amperes(t: f64) -> f64 {
    (3.0 * t).cos()
}

fn speed(t: f64) -> f64 {
    100.0 * (4.0 * t).sin()
}

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/foreign").join(name)
}

fn open(path: &Path, map: &[&str]) -> Result<Recording, String> {
    recording::load(path, &Mapping::parse(map).expect("a mapping"), &Context::quiet()).map_err(|e| e.to_string())
}

fn read(name: &str, map: &[&str]) -> Recording {
    open(&file(name), map).unwrap_or_else(|e| panic!("{e}"))
}

/// Largest error of a channel against a signal, over the samples that count.
fn error(recording: &Recording, channel: Channel, signal: impl Fn(f64) -> f64) -> f64 {
    let values = recording.channel(channel).unwrap_or_else(|| panic!("{channel:?} is missing"));
    let at = |n: usize| (values[n] - signal(n as f64 * INTERVAL_S)).abs();
    (0..values.len()).filter(|n| recording.valid()[*n]).map(at).fold(0.0, f64::max)
}

#[test]
fn values_and_times_are_those_of_the_writer() {
    // Half a step of what the file holds. Floats of 16 bits have 11 digits in base two: 2^-12 of 8 V up to 13 V.
    let [exact, millivolt, packed, half] = [1e-12, 0.5001e-3, 0.5001e-4, 4e-3];
    for (name, map, [of_u, of_i]) in [
        ("mdf_group_per_channel.mf4", &[][..], [exact; 2]),
        ("mdf_half.mf4", &[], [half, exact]),
        #[cfg(feature = "parquet")]
        ("decimals.parquet", &[], [millivolt, packed]),
        #[cfg(feature = "parquet")]
        ("decimals_as_bytes.parquet", &[], [millivolt, exact]),
        #[cfg(feature = "parquet")]
        ("time64.parquet", &[], [exact; 2]),
        #[cfg(feature = "parquet")]
        ("midnight.parquet", &[], [exact; 2]),
        #[cfg(feature = "parquet")]
        ("duration.parquet", &[], [exact; 2]),
        #[cfg(feature = "parquet")]
        ("int96.parquet", &[], [exact; 2]),
        #[cfg(feature = "parquet")]
        ("half.parquet", &[], [half, exact]),
        #[cfg(feature = "parquet")]
        ("checksum.parquet", &[], [exact; 2]),
        #[cfg(feature = "parquet")]
        ("fork.parquet", &[], [exact; 2]),
        ("scale_factor.h5", &[], [millivolt, packed]),
        ("fill_value.h5", &[], [exact; 2]),
        ("compound.h5", &[], [exact; 2]),
        ("not_all_is_known.h5", &[], [exact; 2]),
        ("fletcher.h5", &[], [exact; 2]),
        ("lzf.h5", &[], [exact; 2]),
        ("virtual_1.h5", &[], [exact; 2]),
        ("virtual_2.h5", &[], [exact; 2]),
        ("committed_1.h5", &[], [exact; 2]),
        ("committed_2.h5", &[], [exact; 2]),
        ("pandas_table.h5", &[], [exact; 2]),
        ("pandas_fixed.h5", &[], [exact; 2]),
        ("pandas_stamps.h5", &[], [exact; 2]),
        ("pandas_stamps_fixed.h5", &[], [exact; 2]),
        ("pandas_index_table.h5", &[], [exact; 2]),
        ("pandas_index_fixed.h5", &[], [exact; 2]),
        ("packed.nc", &[], [millivolt, exact]),
        ("classic.nc", &[], [exact; 2]),
        ("classic_1.nc", &[], [millivolt, exact]),
        ("classic_5.nc", &[], [millivolt, exact]),
        ("simulink.mat", &[], [exact; 2]),
        ("simulink_blocks.mat", &[], [exact; 2]),
        ("simulink_73.mat", &[], [exact; 2]),
        ("empty_struct.mat", &[], [exact; 2]),
        ("object.mat", &[], [exact; 2]),
        ("half.npz", &[], [half, exact]),
        ("structured.npz", &[], [exact; 2]),
        ("structured.npy", &[], [exact; 2]),
        ("scale_on_group.tdms", &[], [millivolt, 0.5001e-3]),
        ("scale_uncounted.tdms", &[], [millivolt, 0.5001e-3]),
        ("later_start.tdms", &[], [exact; 2]),
        ("float64.wav", &["u_v=ch1", "i_a=ch2"], [exact; 2]),
        ("rf64.wav", &["u_v=ch1*20", "i_a=ch2*20"], [3.06e-4; 2]),
        ("rifx.wav", &["u_v=ch1*20", "i_a=ch2*20"], [3.06e-4; 2]),
        ("switched_off.wav", &["u_v=ch1*20", "i_a=ch2*20"], [3.06e-4; 2]),
        ("int64.wav", &["u_v=ch1*20", "i_a=ch2*20"], [exact; 2]),
    ] {
        let recording = read(name, map);
        assert_eq!(recording.len(), SAMPLES, "{name}");
        // Stamps in floats of 64 bits, or in whole microseconds.
        assert!((recording.sample_time_s() / INTERVAL_S - 1.0).abs() < 1e-9, "{name}: {}", recording.sample_time_s());
        let errors = [error(&recording, Channel::Voltage, volts), error(&recording, Channel::Current, amperes)];
        assert!(errors[0] <= of_u && errors[1] <= of_i, "{name}: {errors:?}");
        if recording.channel(Channel::Speed).is_some() {
            // The coarsest hold whole numbers and steps of 0.01 rad/s; single precision has 2^-24 of 16.
            let whole = ["pandas_stamps.h5", "pandas_index_fixed.h5"].contains(&name);
            let of_w = if whole { 0.5 } else { 0.00501 };
            assert!(error(&recording, Channel::Speed, speed) <= of_w, "{name}");
        }
    }
}

#[test]
fn what_is_missing_is_masked() {
    let filled = read("fill_value.h5", &[]);
    let masked: Vec<usize> = (0..SAMPLES).filter(|n| !filled.valid()[*n]).collect();
    assert_eq!(masked, [5, 9]);
    assert_eq!(filled.masked(Channel::Voltage), [5]);
    assert!(filled.channels().values().flatten().all(|x| x.abs() < 100.0));
    for name in ["classic_1.nc", "classic_5.nc"] {
        let run = read(name, &[]);
        assert_eq!((run.masked(Channel::Voltage), run.masked(Channel::Current)), (vec![5], vec![9]), "{name}");
        assert_eq!(run.metadata().get("rig").map(String::as_str), Some("bench 3"), "{name}");
    }
    let one = read("simulink_73_one.mat", &[]);
    assert!(error(&one, Channel::Voltage, volts) < 1e-12);
    // A current that begins ten samples later has none before.
    let later = read("later_start.tdms", &[]);
    assert_eq!(later.masked(Channel::Current), (0..10).collect::<Vec<_>>());
    assert!(later.warnings().iter().any(|w| w.contains("'i'") && w.contains("0.01 s later")), "{:?}", later.warnings());
}

#[test]
fn what_cannot_be_read_is_named() {
    for (name, map, words) in [
        ("mdf_wrong_record_length.mf4", &[][..], &["cycles", "bytes of data"][..]),
        ("bad_checksum.npz", &[], &["checksum of 'u'"]),
        ("bad_fletcher.h5", &[], &["checksum"]),
        ("mu_law.wav", &["u_v=ch1"], &["compressed (mu-law)"]),
        ("wide_frames.wav", &["u_v=ch1"], &["fewer bytes than they take"]),
        ("complex.mat", &["i_a=i"], &["'i'", "complex"]),
        ("not_all_is_known.h5", &["u_v=notes"], &["complex"]),
        ("not_all_is_known.h5", &["u_v=elsewhere"], &["other files"]),
        ("committed_1.h5", &["u_v=run/packed"], &["scale_factor"]),
        #[cfg(feature = "parquet")]
        ("bad_checksum.parquet", &[], &["checksum"]),
        #[cfg(feature = "parquet")]
        ("bad_packed_checksum.parquet", &[], &["checksum"]),
        ("object.mat", &["u_v=remark"], &["MATLAB object (string)"]),
    ] {
        let told = open(&file(name), map).expect_err(name);
        assert_eq!(told.lines().count(), 1, "{told}");
        for word in words {
            assert!(told.to_lowercase().contains(&word.to_lowercase()), "{name}: {told}");
        }
    }
    for (name, map, words) in [
        ("complex.mat", &[][..], &["'i'", "complex"][..]),
        ("not_all_is_known.h5", &[], &["'notes'", "complex"]),
        ("not_all_is_known.h5", &[], &["'elsewhere'", "other files"]),
        ("committed_2.h5", &[], &["'gain' of 'run/u'"]),
        ("object.mat", &[], &["'remark'", "MATLAB object"]),
        ("cut_off.wav", &["u_v=ch1"], &["cut off"]),
        ("switched_off.wav", &["u_v=ch1"], &["cut off"]),
    ] {
        let warnings = read(name, map).warnings().to_vec();
        let told = |w: &String| words.iter().all(|word| w.contains(word));
        assert!(warnings.iter().any(told), "{name}: {warnings:?}");
    }
    // c0 + c1 x + c2 x² with 1, 0 and 2.
    let bent = read("polynomial.tdms", &[]);
    let u = bent.channel(Channel::Voltage).expect("a voltage");
    assert_eq!((u[0], u[3]), (1.0, 19.0));
}

fn text(name: &str, content: &str, map: &[&str]) -> Result<Recording, String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, content).expect("a writable file");
    open(&path, map)
}

#[test]
fn texts_of_loggers() {
    let lvm = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\n***End_of_Header***\t\n\t\nChannels\t2\n\
               Samples\t3\t3\nY_Unit_Label\tmV\tA\nX0\t0\t0\nDelta_X\t0.001\t0.001\n***End_of_Header***\t\t\n\
               X_Value\tu\ti\tComment\n0.000\t1500\t2\tbegin\n0.001\t2500\t3\n0.002\t3500\t4\n0.003\t4500\t5\n";
    let run = text("run.lvm", lvm, &[]).expect("a recording");
    assert_eq!(run.channel(Channel::Voltage), Some(&[1.5, 2.5, 3.5, 4.5][..]));
    assert_eq!(run.sample_time_s(), 1e-3);

    // A time beside each channel, or none at all.
    for (head, timed) in [("X_Value\tu\tX_Value\ti\tComment", true), ("X_Value\tu\ti\tComment", false)] {
        let above = &lvm[..lvm.find("X_Value").expect("a heading")];
        let row = |k: i32| match timed {
            true => format!("0.{k:03}\t{}\t0.{k:03}\t{k}\n", 1500 + k),
            false => format!("\t{}\t{k}\n", 1500 + k),
        };
        let rows: String = (0..20).map(row).collect();
        let run = text("run.lvm", &format!("{above}{head}\n{rows}"), &[]).expect("a recording");
        assert_eq!(run.channel(Channel::Voltage).map(|u| u[2]), Some(1.502), "{head}");
        assert_eq!(run.channel(Channel::Current).map(|i| i[3]), Some(3.0), "{head}");
        assert!((run.sample_time_s() - 1e-3).abs() < 1e-12, "{head}");
    }
    let rows: String = (0..20).map(|k| format!("\t1,5\t{k},25\n")).collect();
    let commas = format!("Delta_X\t0,001000\t0,001000\nX_Value\tu [V]\ti [A]\n{rows}");
    assert!((text("run.lvm", &commas, &[]).expect("a recording").sample_time_s() - 1e-3).abs() < 1e-12);
    let rows: String = (0..20).map(|k| format!("0.{k:03}\t1\t1.{k:03}\t{k}\n")).collect();
    let told = text("run.lvm", &format!("X_Value\tu [V]\tX_Value\ti [A]\n{rows}"), &[]).expect_err("times apart");
    assert!(told.contains("times of their own"), "{told}");

    // Months in words, days without separators, milliseconds behind a colon.
    for stamps in [
        ["28-Feb-2026 23:59:59.95", "01-Mar-2026 00:00:00.00", "01-Mar-2026 00:00:00.05"],
        ["20260228 23:59:59.95", "20260301 00:00:00.00", "20260301 00:00:00.05"],
        ["2026-02-28 23:59:59:950", "2026-03-01 00:00:00:000", "2026-03-01 00:00:00:050"],
    ] {
        let rows: String = stamps.iter().zip(1..).map(|(stamp, u)| format!("{stamp},{u},1\n")).collect();
        let run = text("run.csv", &format!("Timestamp,u [V],i [A]\n{rows}"), &[]).expect("a recording");
        assert!((run.sample_time_s() - 0.05).abs() < 1e-9, "{stamps:?}");
    }

    // A date of its own, hours of twelve, and midnight between the second row and the third.
    let dated = "Date,Time,u [V],i [A]\n3/1/2026,11:59:59.90 PM,1,2\n3/1/2026,11:59:59.95 PM,2,3\n\
                 3/2/2026,12:00:00.00 AM,3,4\n3/2/2026,12:00:00.05 AM,4,5\n";
    let run = text("run.csv", dated, &[]).expect("a recording");
    assert!((run.sample_time_s() - 0.05).abs() < 1e-9);

    let whole = "t_s,u_v,i_a\n0,1,2\n0.1,2,3\n0.2,3,123.456\n";
    assert!(text("run.csv", whole, &[]).expect("a recording").warnings().is_empty());
    let cut = text("run.csv", &whole[..whole.len() - 6], &[]).expect("a recording");
    assert!(cut.warnings().iter().any(|w| w.contains("line 4") && w.contains("no line end")), "{:?}", cut.warnings());
    let cut = text("run.csv", &whole[..whole.len() - 9], &[]).expect("a recording");
    assert_eq!(cut.len(), 2);
    assert!(cut.warnings().iter().any(|w| w.contains("line 4") && w.contains("cut off")), "{:?}", cut.warnings());
}

#[test]
fn rows_that_do_not_count_hold_nothing() {
    let rows = |fill: Option<&str>| {
        let row = |k: usize| match fill {
            Some(fill) if (10..15).contains(&k) => format!("{fill},{fill},{fill},{fill},{fill},0\n"),
            _ => format!("{},{},{},{},25,1\n", k as f64 * 1e-3, k, 2 * k, 3 * k),
        };
        let body: String = (0..40).map(row).collect();
        text("run.csv", &format!("t_s,u_v,i_a,omega_rad_s,temp_c,valid\n{body}"), &[]).expect("a recording")
    };
    let clean = rows(None);
    for fill in ["-999", "1e6", "", "NaN"] {
        let run = rows(Some(fill));
        assert_eq!(run.valid().iter().filter(|ok| !**ok).count(), 5, "{fill}");
        for (channel, values) in clean.channels() {
            // What lies on a line comes back as it was, but for the rounding of one product.
            let worst = values.iter().zip(&run.channels()[channel]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-12, "{fill} {channel:?}: {worst}");
        }
        assert_eq!(run.extras(), clean.extras(), "{fill}");
        assert!((run.sample_time_s() - 1e-3).abs() < 1e-12, "{fill}");
    }
}

#[test]
fn maps_compute() {
    let table = "ms,input_voltage,duty,angle [deg],current\n0,24,0.5,0,1\n20,24,0.25,90,1\n40,20,0.5,180,2\n60,20,0.5,270,2\n\
                 80,20,0.5,0,2\n";
    let asked = text("log.csv", table, &["t_s=ms[ms]"]).expect_err("a question");
    assert!(asked.contains("duty*input_voltage") && asked.contains("supply"), "{asked}");
    let map = ["t_s=ms[ms]", "u_v=duty*input_voltage", "omega_rad_s=ddt(angle)"];
    let run = text("log.csv", table, &map).expect("a recording");
    assert_eq!(run.channel(Channel::Voltage), Some(&[12.0, 6.0, 10.0, 10.0, 10.0][..]));
    // A quarter of a turn in 20 ms, past the end of the turn.
    for w in run.channel(Channel::Speed).expect("a speed") {
        assert!((w - std::f64::consts::FRAC_PI_2 / 0.02).abs() < 1e-9, "{w}");
    }
    let offset = text("log.csv", table, &["t_s=ms[ms]", "u_v=2*duty*(input_voltage-4)/2+1"]).expect("a recording");
    assert_eq!(offset.channel(Channel::Voltage).map(|u| u[0]), Some(11.0));
    let told = text("log.csv", table, &["t_s=ms[ms]", "u_v=dutty*input_voltage"]).expect_err("no such column");
    assert!(told.contains("no column 'dutty'"), "{told}");
    // Only what may be the quantity is proposed.
    let told = text("x.csv", "t,n1,motor_volts,fault\n0,1,2,0\n1,2,3,0\n2,5,4,0\n", &[]).expect_err("unknown names");
    assert!(told.contains("u_v=motor_volts") && !told.contains("=fault") && !told.contains("=n1"), "{told}");
}

/// The folder with cases of others, where it is there.
fn cases() -> Option<PathBuf> {
    let beside = || Some(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"));
    let folder = std::env::var_os("GREYRIG_DATA").map(PathBuf::from).or_else(beside)?.join("../cases");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no cases");
    None
}

#[test]
fn cases_of_others_are_read_or_named() {
    let Some(folder) = cases() else { return };
    // As the list that comes with them says: u = 12 sin 5t + 1, i = cos 3t, w = 100 sin 4t at 1 kHz.
    for (name, map, tolerance) in [
        ("mdf_channel_per_group_same_time.mf4", &[][..], 1e-9),
        ("mdf_float16_channel.mf4", &[], 8e-3),
        #[cfg(feature = "parquet")]
        ("parquet_decimal_int.parquet", &[], 0.51e-3),
        #[cfg(feature = "parquet")]
        ("parquet_time64_us.parquet", &[], 1e-9),
        #[cfg(feature = "parquet")]
        ("parquet_timedelta.parquet", &[], 1e-9),
        #[cfg(feature = "parquet")]
        ("parquet_int96_time.parquet", &[], 1e-9),
        ("h5_scale_factor.h5", &[], 0.51e-3),
        ("h5_xarray_packed.h5", &[], 0.51e-3),
        ("h5_fill_value_999.h5", &[], 1e-9),
        ("h5_compound_table.h5", &[], 1e-9),
        ("h5_pandas_table.h5", &[], 1e-9),
        ("h5_lzf_dataset_beside.h5", &[], 1e-9),
        ("h5_virtual_dataset.h5", &[], 1e-9),
        ("h5_committed_type_attribute.h5", &[], 1e-9),
        ("mat5_empty_struct_array.mat", &[], 1e-9),
        ("mat5_with_string_object.mat", &[], 1e-9),
        ("mat5_with_table_datetime.mat", &[], 1e-9),
        ("mat5_simulink_structure_with_time.mat", &[], 1e-9),
        ("labview_lvm.txt", &[], 0.51e-6),
    ] {
        let run = open(&folder.join(name), map).unwrap_or_else(|e| panic!("{e}"));
        assert!((run.sample_time_s() / INTERVAL_S - 1.0).abs() < 1e-6, "{name}: {}", run.sample_time_s());
        let worst = [error(&run, Channel::Voltage, volts), error(&run, Channel::Current, amperes)];
        assert!(worst[0] <= tolerance && worst[1] <= tolerance, "{name}: {worst:?} {:?}", run.warnings());
    }
    #[cfg(feature = "parquet")]
    {
        let keys = open(&folder.join("parquet_dict_page_offset_zero.parquet"), &["u_v=l_partkey", "sample_time_s=1"]);
        assert_eq!(keys.unwrap_or_else(|e| panic!("{e}")).len(), 39);
    }
    // Half of what 16 bits resolve at 12 V is 4 mV.
    let run = open(&folder.join("npz_float16.npz"), &[]).unwrap_or_else(|e| panic!("{e}"));
    let voltage = run.channel(Channel::Voltage).unwrap();
    let off = |(n, u): (usize, &f64)| (u - 12.0 * (30.0 * INTERVAL_S * n as f64).sin()).abs();
    assert!(voltage.iter().enumerate().map(off).all(|off| off <= 4e-3), "{voltage:?}");
    for (name, words) in [
        ("mdf_cycle_count_contradicts_length.mf4", &["cycles"][..]),
        ("npz_bad_crc.npz", &["checksum"]),
        #[cfg(feature = "parquet")]
        ("parquet_bad_page_crc.parquet", &["checksum"]),
        ("mat73_timeseries_objects.mat", &["MATLAB object"]),
        ("vesc_log.csv", &["duty_cycle*input_voltage"]),
    ] {
        let map: &[&str] = if name.starts_with("vesc") { &["t_s=ms_today[ms]"] } else { &[] };
        let told = open(&folder.join(name), map).expect_err(name);
        assert!(words.iter().all(|w| told.to_lowercase().contains(&w.to_lowercase())), "{name}: {told}");
    }
    for (name, map, words) in [
        ("mat5_complex_current.mat", &[][..], &["complex"][..]),
        ("csv_cut_in_last_number.csv", &[], &["no line end"]),
        ("wav_cut_off.wav", &["u_v=ch1"], &["cut off"]),
        ("tdms_start_offset_differs.tdms", &[], &["0.1 s later"]),
        ("h5_lzf_dataset_beside.h5", &[], &["'notes'"]),
    ] {
        let run = open(&folder.join(name), map).unwrap_or_else(|e| panic!("{e}"));
        let told = |w: &String| words.iter().all(|word| w.contains(word));
        assert!(run.warnings().iter().any(told), "{name}: {:?}", run.warnings());
    }
    for (name, map) in [("wav_rf64.wav", &["u_v=ch1"][..]), ("wav_float64.wav", &["u_v=ch1"])] {
        open(&folder.join(name), map).unwrap_or_else(|e| panic!("{e}"));
    }
    for name in ["tdms_scale_on_group.tdms", "tdms_scale_without_count.tdms"] {
        let run = open(&folder.join(name), &[]).unwrap_or_else(|e| panic!("{e}"));
        let u = run.channel(Channel::Voltage).expect("a voltage");
        assert!((u[0] + 9.0).abs() < 1e-9 && (u[1] + 8.9).abs() < 1e-9, "{name}: {:?}", &u[..2]);
    }
    // Its own signals: the second row holds 0.001, 0.359946, 0.999800, 0.899988.
    let structured = open(&folder.join("npz_structured.npz"), &[]).unwrap_or_else(|e| panic!("{e}"));
    let second = |c| structured.channel(c).map(|x| x[1]).unwrap_or(f64::NAN);
    assert!((second(Channel::Voltage) - 0.359946).abs() < 1e-6 && (second(Channel::Current) - 0.9998).abs() < 1e-6);
    let dates = open(&folder.join("date_and_time_columns.csv"), &[]).unwrap_or_else(|e| panic!("{e}"));
    assert!((dates.sample_time_s() - 0.05).abs() < 1e-6);
    // Rows that do not count change nothing but themselves.
    let clean = open(&folder.join("valid0_clean.csv.gz"), &[]).unwrap_or_else(|e| panic!("{e}"));
    for name in ["valid0_fill_999.csv.gz", "valid0_fill_1e6.csv.gz"] {
        let run = open(&folder.join(name), &[]).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(run.valid().iter().filter(|ok| !**ok).count(), 50, "{name}");
        for (channel, values) in clean.channels() {
            let other = &run.channels()[channel];
            let same = |n: &usize| !run.valid()[*n] || values[*n] == other[*n];
            assert!((0..values.len()).all(|n| same(&n)), "{name} {channel:?}");
            let most = values.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            assert!(other.iter().all(|x| x.abs() <= most), "{name} {channel:?}");
        }
    }
}
