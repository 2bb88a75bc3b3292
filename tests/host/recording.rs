//! Readers against files that other tools wrote, dialects of text, and the way back through the writers.

use std::path::{Path, PathBuf};

use greyrig_host::context::Context;
use greyrig_host::recording::{self, Channel, Extra, Mapping, Motion, Recording};
use proptest::prelude::*;

/// The folder with the files of other tools, if it is there.
pub fn data() -> Option<PathBuf> {
    let beside = || Some(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"));
    let folder = std::env::var_os("GREYRIG_DATA").map(PathBuf::from).or_else(beside)?.join("formats");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("skipped: no data");
    None
}

fn load(path: &Path, map: &[&str]) -> Recording {
    let mapping = Mapping::parse(map).expect("a mapping");
    recording::load(path, &mapping, &Context::quiet()).unwrap_or_else(|e| panic!("{e}"))
}

fn text(name: &str, content: impl AsRef<[u8]>, map: &[&str]) -> Recording {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join(name);
    std::fs::write(&path, content).expect("a writable file");
    load(&path, map)
}

/// The columns t, u, i, w of the plain CSV, parsed here without any of the code under test.
fn reference(folder: &Path) -> Vec<[f64; 4]> {
    let text = std::fs::read_to_string(folder.join("csv_plain.csv")).expect("the plain file");
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|c| c.parse().expect("a number")).collect();
        [cells[0], cells[1], cells[2], cells[3]]
    };
    text.lines().skip(1).map(row).collect()
}

#[test]
fn files_of_other_tools_hold_the_same_values() {
    let Some(folder) = data() else { return };
    let truth = reference(&folder);
    assert_eq!(truth.len(), 5000);
    let wav = &["u_v=ch1*20", "i_a=ch2*20", "omega_rad_s=ch3*400"][..];
    // Largest error of u, i, w. Text: half a unit of the last digit printed. int16: half a step of the scaling. Single
    // precision: 2^-25 of the largest value of its power of two (16 for u and i, 512 for w).
    let exact = [1e-15, 1e-15, 1e-13];
    let single = [4.8e-7, 4.8e-7, 1.53e-5];
    let int16 = [0.5001e-3, 0.5001e-3, 1.0001e-2];
    let cases: &[(&str, &[&str], [f64; 3])] = &[
        ("csv_plain.csv", &[], exact),
        ("csv_plain.csv.gz", &[], exact),
        ("csv_polars.csv", &[], exact),
        ("csv_iso_time.csv", &[], exact),
        ("csv_german_excel.csv", &[], [5.1e-7; 3]),
        // "%.7g": w in rpm has up to four digits before the point, 5e-4 rpm or 5.3e-5 rad/s.
        ("csv_tab_unit_row_rpm.tsv", &[], [5.1e-6, 5.1e-6, 5.4e-5]),
        // "%.9e": ten digits of up to 255.
        ("csv_numpy_comment.txt", &[], [5.1e-9, 5.1e-9, 5.1e-8]),
        #[cfg(feature = "arrow")]
        ("arrow_ipc.feather", &[], exact),
        ("h5_plain.h5", &[], exact),
        ("mat_v4.mat", &[], exact),
        ("mat_v5.mat", &[], exact),
        ("mat_v5_zlib.mat", &[], exact),
        ("mat_v5_int16_single.mat", &["u_v=u*1e-3"], [int16[0], single[1], single[2]]),
        ("mat_v73.mat", &[], exact),
        ("mdf214.mdf", &[], exact),
        ("mdf410_plain.mf4", &[], exact),
        ("mdf410_int16_linear.mf4", &[], int16),
        ("mdf410_two_blocks.mf4", &[], exact),
        ("mdf411_deflate.mf4", &[], exact),
        ("mdf411_transposed_deflate.mf4", &[], exact),
        #[cfg(feature = "parquet")]
        ("pq_none.parquet", &[], exact),
        #[cfg(feature = "parquet")]
        ("pq_snappy.parquet", &[], exact),
        #[cfg(feature = "parquet")]
        ("pq_gzip.parquet", &[], exact),
        #[cfg(feature = "parquet")]
        ("pq_lz4.parquet", &[], exact),
        #[cfg(feature = "parquet")]
        ("pq_brotli.parquet", &[], exact),
        #[cfg(feature = "parquet")]
        ("pq_polars.parquet", &[], exact),
        #[cfg(feature = "parquet")]
        ("pq_f32_bss.parquet", &["sample_time_s=1e-4"], single),
        ("reference.npz", &[], exact),
        ("tdms_v1_float64.tdms", &[], exact),
        ("tdms_v2_float64.tdms", &[], exact),
        ("tdms_int16_scaled.tdms", &[], int16),
        ("tdms_time_channel_sgl.tdms", &[], single),
        // Half a code of 20/32767 and 400/32767.
        ("wav_int16_3ch.wav", wav, [3.06e-4, 3.06e-4, 6.11e-3]),
        ("wav_float32_3ch.wav", &["u_v=ch1", "i_a=ch2", "omega_rad_s=ch3"], single),
        // libsndfile rounds down: a whole code of 20/2^23 and 400/2^23.
        ("wav_pcm24_3ch.wav", wav, [2.39e-6, 2.39e-6, 4.77e-5]),
    ];
    for (name, map, tolerance) in cases {
        let recording = load(&folder.join(name), map);
        assert_eq!(recording.len(), 5000, "{name}");
        // ISO stamps and the rest give 100 us to the rounding of their printed digits.
        assert!((recording.sample_time_s() / 1e-4 - 1.0).abs() < 1e-9, "{name}: {}", recording.sample_time_s());
        assert_eq!(recording.start_s(), 0.0, "{name}");
        assert_eq!(recording.motion(), Motion::Rotary);
        assert!(recording.valid().iter().all(|&ok| ok), "{name}: {:?}", recording.warnings());
        for (k, channel) in [Channel::Voltage, Channel::Current, Channel::Speed].into_iter().enumerate() {
            let values = recording.channel(channel).unwrap_or_else(|| panic!("{name} has no {channel:?}"));
            let worst = values.iter().zip(&truth).map(|(x, row)| (x - row[k + 1]).abs()).fold(0.0, f64::max);
            assert!(worst <= tolerance[k], "{name} {channel:?}: {worst:e}");
        }
    }
    // The slow temperature beside them (25 degC + 4 K/s, every 0.1 s) holds its value.
    let recording = load(&folder.join("mdf410_plain.mf4"), &[]);
    let temperature = &recording.extras()[0];
    assert_eq!(temperature.values.len(), 5000);
    for (row, expected) in [(0, 25.0), (999, 25.0), (1000, 25.4), (4999, 26.6)] {
        assert!((temperature.values[row] - expected).abs() < 1e-12, "row {row}: {}", temperature.values[row]);
    }
    assert!(recording.warnings().iter().any(|w| w.contains("T_wdg")));
    // Gaps are masked, counted, and bridged by a straight line.
    let recording = load(&folder.join("csv_gaps.csv"), &[]);
    let invalid: Vec<usize> = (0..5000).filter(|&k| !recording.valid()[k]).collect();
    assert_eq!(invalid, [100, 101, 102, 103, 104]);
    let i = recording.channel(Channel::Current).expect("a current");
    assert!((i[102] - 0.5 * (truth[99][2] + truth[105][2])).abs() < 1e-12);
    // The checksum is the one of the list that came with the files.
    let list = std::fs::read_to_string(folder.join("MANIFEST.json")).expect("the list");
    assert!(list.contains(recording.sha256()));
}

/// Four rows as every dialect should give them: t = 0, 0.5 ms …; u, i, w in SI.
fn is_expected(recording: &Recording, label: &str) {
    assert!((recording.sample_time_s() - 5e-4).abs() < 1e-12, "{label}");
    let expected = [(Channel::Voltage, [1.5, -2.0, 0.25, 3.0]), (Channel::Current, [0.1, 0.2, -0.3, 0.4])];
    for (channel, values) in expected {
        let got = recording.channel(channel).unwrap_or_else(|| panic!("{label}: no {channel:?}"));
        for (a, b) in got.iter().zip(values) {
            assert!((a - b).abs() < 1e-12, "{label}: {got:?}");
        }
    }
    // 30, 60, -15, 7.5 rpm.
    let w = recording.channel(Channel::Speed).unwrap_or_else(|| panic!("{label}: no speed"));
    for (a, b) in w.iter().zip([1.0, 2.0, -0.5, 0.25]) {
        assert!((a - b * std::f64::consts::PI).abs() < 1e-9, "{label}: {w:?}");
    }
}

#[test]
fn dialects_of_text() {
    let rows = [
        ["0", "1.5", "100", "30"],
        ["0.5", "-2", "200", "60"],
        ["1.0", "0.25", "-300", "-15"],
        ["1.5", "3", "400", "7.5"],
    ];
    let table = |header: &str, separator: &str, end: &str, comma: bool| {
        let mut out = format!("{header}{end}");
        for row in rows {
            let line = row.join(separator);
            out += &if comma { line.replace('.', ",") } else { line };
            out += end;
        }
        out
    };
    let cases = [
        ("brackets.csv", table("Time [ms],u [V],i [mA],speed [rpm]", ",", "\n", false)),
        ("parentheses.csv", table("Time (ms),U (V),I (mA),n (1/min)", ",", "\r\n", false)),
        ("german.csv", table("Zeit in ms;Spannung in V;Strom in mA;Drehzahl in U/min", ";", "\r\n", true)),
        ("bom.csv", format!("\u{feff}{}", table("t_ms;u_V;i_mA;speed_rpm", ";", "\n", true))),
        ("tab.tsv", table("t / ms\tU / V\tI / mA\tn / rpm", "\t", "\n", false)),
        ("units.txt", table("Time\tu\ti\tw\nms\tV\tmA\trpm", "\t", "\n", false)),
        ("units_in_brackets.csv", table("Time,u,i,w\n[ms],[V],[mA],[rpm]", ",", "\n", false)),
        ("blanks.dat", table("# t_ms u_V i_mA speed_rpm", "  ", "\n", false)),
        (
            "quoted.csv",
            table("\"t [ms]\",\"voltage, motor [V]\",\"i [mA]\",\"speed [rpm]\"", ",", "\n", false)
                .replace("voltage, motor", "voltage"),
        ),
        ("trailing.csv", table("t_ms,u_V,i_mA,speed_rpm,", ",", ",\n", false)),
        (
            "scope.csv",
            format!(
                "Model,MSO5104\nSerial No.,C0123\n\nSample rate,2000,Hz\n\n{}",
                table("t_ms,u_V,i_mA,speed_rpm", ",", "\n", false)
            ),
        ),
        (
            "comment.csv",
            format!("# motor: M-001\n# rig: bench 1\n{}", table("t_ms,u_V,i_mA,speed_rpm", ",", "\n", false)),
        ),
        ("pipe.csv", table("t_ms|u_V|i_mA|speed_rpm", "|", "\n", false)),
    ];
    for (name, content) in &cases {
        is_expected(&text(name, content, &[]), name);
    }
    // UTF-16 as Windows programs save it.
    let mut bytes = vec![0xff, 0xfe];
    bytes.extend(cases[0].1.encode_utf16().flat_map(u16::to_le_bytes));
    is_expected(&text("utf16.csv", &bytes, &[]), "utf16");
    // One byte per character, with a degree sign.
    let latin: Vec<u8> = "t_ms;u_V;i_mA;speed [°/s]\n0;1,5;100;180\n0,5;-2;200;360\n1;0,25;-300;-90\n1,5;3;400;45\n"
        .chars()
        .map(|c| c as u8)
        .collect();
    is_expected(&text("latin1.csv", &latin, &[]), "latin1");
    // An unnamed index column and NaN, as pandas writes them.
    let index = text(
        "index.csv",
        ",t_ms,u_V,i_mA,speed_rpm,T\n0,0,1.5,100,30,\n1,0.5,-2,200,60,25\n2,1,0.25,-300,-15,NaN\n3,1.5,3,400,7.5,26\n",
        &[],
    );
    is_expected(&index, "index");
    assert_eq!(index.extras().len(), 1);
    assert_eq!(index.extras()[0].values, [25.0, 25.0, 25.0, 26.0]);
    // Absolute time.
    for (name, stamps) in [
        (
            "iso",
            [
                "2026-03-01T08:00:00.0000Z",
                "2026-03-01T08:00:00.0005Z",
                "2026-03-01T08:00:00.0010Z",
                "2026-03-01T08:00:00.0015Z",
            ],
        ),
        ("day", ["23:59:59.9990", "23:59:59.9995", "24:00:00.0000", "24:00:00.0005"]),
        (
            "german",
            [
                "01.03.2026 08:00:00,0000",
                "01.03.2026 08:00:00,0005",
                "01.03.2026 08:00:00,0010",
                "01.03.2026 08:00:00,0015",
            ],
        ),
    ] {
        let rows: Vec<String> =
            rows.iter().zip(stamps).map(|(r, t)| format!("{t};{};{};{}", r[1], r[2], r[3])).collect();
        is_expected(&text("stamps.csv", format!("time;u_V;i_mA;speed_rpm\n{}\n", rows.join("\n")), &[]), name);
    }
}

#[test]
fn mappings_units_and_marks() {
    let table = "time,Ch1,Ch2,Speed,hold\n0,100,2,60,1\n0.01,200,3,60,0\n0.02,300,4,120,0\n";
    let r = text("map.csv", table, &["u_v=Ch1*0.01", "i_a=Ch2*10-5", "omega_rad_s=Speed[rpm]", "rotor_locked=hold"]);
    assert_eq!(r.channel(Channel::Voltage), Some(&[1.0, 2.0, 3.0][..]));
    assert_eq!(r.channel(Channel::Current), Some(&[15.0, 25.0, 35.0][..]));
    // 60 rpm are 2 pi rad/s.
    assert!((r.channel(Channel::Speed).expect("a speed")[0] - std::f64::consts::TAU).abs() < 1e-12);
    assert_eq!(r.rotor_locked(), [true, false, false]);
    // A linear drive.
    let linear = text(
        "linear.csv",
        "t_s,q_ref_m,q_m,drive_V,force_N\n0,0,0.1,2,70\n0.001,0,0.2,3,80\n0.002,0,0.3,3,90\n",
        &["u_v=drive_V"],
    );
    assert_eq!(linear.motion(), Motion::Linear);
    assert_eq!(linear.channel(Channel::Angle), Some(&[0.1, 0.2, 0.3][..]));
    assert_eq!(linear.channel(Channel::Torque), Some(&[70.0, 80.0, 90.0][..]));
    let millimetres = text("mm.csv", "t,x,force [kN]\n0,10,1\n0.1,20,1\n0.2,30,2\n", &["angle_rad=x[mm]"]);
    assert_eq!(millimetres.motion(), Motion::Linear);
    assert!((millimetres.channel(Channel::Angle).expect("a position")[2] - 0.03).abs() < 1e-15);
    // Measured values beside set points.
    let servo = text(
        "servo.csv",
        "t_s,pos_ref_rad,pos_rad,vel_rad_s,torque_in_Nm,torque_meas_Nm,current_A\n0,9,1,2,8,3,4\n0.1,9,1,2,8,3,4\n",
        &[],
    );
    for (channel, value) in
        [(Channel::Angle, 1.0), (Channel::Speed, 2.0), (Channel::Torque, 3.0), (Channel::Current, 4.0)]
    {
        assert_eq!(servo.channel(channel), Some(&[value, value][..]));
    }
    // A whole recording with the rotor held, and one without a time column.
    let locked = text("locked.csv", "# rotor: locked\n# sample_time_s: 1e-4\nu_v,i_a\n1,2\n2,3\n3,4\n", &[]);
    assert_eq!(locked.rotor_locked(), [true; 3]);
    assert_eq!(locked.sample_time_s(), 1e-4);
    let rate = text("rate.csv", "u_v,i_a\n1,2\n2,3\n", &["sample_time_s=100[us]"]);
    assert!((rate.sample_time_s() - 1e-4).abs() < 1e-18);
    // The interface's names win over others of the same meaning.
    let both = text("both.csv", "t_s,u_v,voltage\n0,1,9\n0.1,2,9\n", &[]);
    assert_eq!(both.channel(Channel::Voltage), Some(&[1.0, 2.0][..]));
    assert_eq!(both.extras()[0].name, "voltage");
}

#[test]
fn clipping_is_masked_and_said() {
    let rows: Vec<String> = (0..4000)
        .map(|k| {
            let phase = f64::from(k) / 100.0;
            // A 10-bit converter over +-10 A, a current of 13 A: the rest of the range is lost.
            let i = ((13.0 * phase.sin()).clamp(-10.0, 10.0) * 51.2).round() / 51.2;
            format!("{},{},{}", f64::from(k) * 1e-3, 12, i)
        })
        .collect();
    let recording = text("clipped.csv", format!("t_s,u_v,i_a\n{}\n", rows.join("\n")), &[]);
    let masked = recording.valid().iter().filter(|ok| !**ok).count();
    // |13 sin| exceeds 10 for 2 acos(10/13) of each half turn, 44 % of the time; over 6.4 turns the last part counts.
    assert!((masked as f64 / 4000.0 - 0.44).abs() < 0.03, "{masked}");
    assert!(recording.warnings().iter().any(|w| w.contains("i_a is clipped at 10 A")), "{:?}", recording.warnings());
    assert!(!recording.warnings().iter().any(|w| w.contains("u_v")));
}

fn arbitrary() -> impl Strategy<Value = Recording> {
    let value = prop_oneof![-1e3..1e3_f64, -1e-12..1e-12_f64, Just(0.0), -1e300..1e300_f64];
    (2..60_usize).prop_flat_map(move |n| {
        let column = || prop::collection::vec(value.clone(), n);
        let marks = || prop::collection::vec(any::<bool>(), n);
        let channels = prop::sample::subsequence(Channel::ALL.to_vec(), 1..=5);
        let extra = ("[a-z][a-z ,;\"]{0,8}x", column());
        let keys = prop::collection::btree_map("[a-z]{2}x", "[A-Za-z0-9 :=#,]{0,12}[a-z]", 0..3);
        let time = (1e-6..1.0_f64, -10.0..10.0_f64);
        ((channels, prop::collection::vec(column(), 5)), (marks(), marks()), extra, keys, time, any::<bool>()).prop_map(
            move |((channels, columns), (mut valid, locked), (name, values), metadata, (dt, start), linear)| {
                // A recording has at least one sample that counts.
                valid[n / 2] = true;
                let one_line = |text: String| text.split_whitespace().collect::<Vec<_>>().join(" ");
                let builder = Recording::builder(dt)
                    .start_s((start / dt).round() * dt)
                    .motion(if linear { Motion::Linear } else { Motion::Rotary })
                    .valid(valid)
                    .rotor_locked(locked)
                    .metadata(metadata.into_iter().map(|(k, v)| (k, one_line(v))).collect())
                    .extra(Extra { name: one_line(name), values });
                let builder = channels.into_iter().zip(columns).fold(builder, |b, (c, values)| b.channel(c, values));
                builder.build().expect("columns of one length")
            },
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// What is written reads back as the same numbers, bit for bit.
    #[test]
    fn written_recordings_read_back(original in arbitrary()) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let formats: &[&str] = if cfg!(feature = "parquet") { &["run.csv", "run.parquet"] } else { &["run.csv"] };
        for name in formats {
            let path = folder.path().join(name);
            recording::write(&original, &path, false, &Context::quiet()).expect("written");
            let back = load(&path, &[]);
            prop_assert_eq!(back.channels(), original.channels());
            prop_assert_eq!(back.metadata(), original.metadata());
            prop_assert_eq!(back.extras(), original.extras());
            prop_assert_eq!(back.rotor_locked(), original.rotor_locked());
            prop_assert_eq!(back.motion(), original.motion());
            prop_assert_eq!(back.sample_time_s(), original.sample_time_s());
            prop_assert_eq!(back.start_s(), original.start_s());
            // Random numbers do not clip, so that the masks are those of the file.
            prop_assert_eq!(back.valid(), original.valid());
        }
    }
}
