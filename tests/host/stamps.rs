//! Time axes of anybody's recordings: gaps, scattered, coarse and doubled stamps, a rate that wanders.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use greyrig_host::check::check;
use greyrig_host::context::Context;
use greyrig_host::recording::finding::{Code, DataFinding, Handled, Severity};
use greyrig_host::recording::{Channel, Mapping, Recording, load, write};
use greyrig_host::rig::{Kind, Motor, PROFILES, Setup};
use serde_json::Value;

use crate::random::Random;

const CHANNELS: [Channel; 3] = [Channel::Voltage, Channel::Current, Channel::Speed];

/// A magnet motor on DC steps at 10 kHz.
fn steps(seconds: f64, noise: f64) -> Recording {
    let setup = Setup::new(Kind::PmDc).profile("dc-steps").unwrap().seconds(seconds).noise(noise);
    setup.run().unwrap().recording
}

/// Stamp, voltage, current and speed of each row.
type Rows = Vec<[f64; 4]>;

fn rows(run: &Recording) -> Rows {
    let of = |channel, n: usize| run.channel(channel).unwrap()[n];
    let row = |n: usize| {
        let [u, i, w] = CHANNELS.map(|channel| of(channel, n));
        [n as f64 * run.sample_time_s(), u, i, w]
    };
    (0..run.len()).map(row).collect()
}

fn csv(folder: &Path, rows: &[[f64; 4]], digits: usize) -> PathBuf {
    let mut text = "t_s,u_v,i_a,omega_rad_s\n".to_owned();
    for [t, u, i, w] in rows {
        writeln!(text, "{t:.digits$},{u:.6},{i:.6},{w:.6}").unwrap();
    }
    let path = folder.join("run.csv");
    std::fs::write(&path, text).unwrap();
    path
}

fn read(path: &Path) -> Recording {
    load(path, &Mapping::default(), &Context::quiet()).expect("it is read")
}

fn through_csv(rows: &[[f64; 4]], digits: usize) -> Recording {
    let folder = tempfile::tempdir().unwrap();
    read(&csv(folder.path(), rows, digits))
}

fn found(run: &Recording, code: Code) -> Vec<DataFinding> {
    check(std::slice::from_ref(run), None).into_iter().filter(|f| f.code == code).collect()
}

/// A signal at an instant between its samples, in samples.
fn at(x: &[f64], instant: f64) -> f64 {
    let n = (instant.max(0.0) as usize).min(x.len() - 2);
    x[n] + (instant - n as f64) * (x[n + 1] - x[n])
}

/// RMS of the differences, without the ends.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let squares: f64 = (4..n - 4).map(|k| (a[k] - b[k]).powi(2)).sum();
    (squares / (n - 8) as f64).sqrt()
}

/// Samples at 1 kHz of a run at 10 kHz without noise, taken at instants in samples; with noise of so much of each
/// channel's RMS. The same at the even milliseconds without noise is the truth.
fn slowly(run: &Recording, instants: &[f64], noise: f64, random: &mut Random) -> Rows {
    let channels = CHANNELS.map(|channel| run.channel(channel).unwrap());
    let rms = channels.map(|x| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt());
    let row = |instant: &f64| {
        let [u, i, w] = [0, 1, 2].map(|k| at(channels[k], 10.0 * instant) + noise * rms[k] * random.gaussian());
        [1e-3 * instant, u, i, w]
    };
    instants.iter().map(row).collect()
}

fn greyrig(arguments: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_greyrig"))
        .env("COLUMNS", crate::program::WIDE)
        .args(arguments)
        .output()
        .expect("greyrig runs");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {told}");
    serde_json::from_slice(&output.stdout).expect("one JSON object")
}

/// Gaps of the test below, s.
const GAPS: [(f64, f64); 3] = [(1.2, 1.25), (3.0, 3.4), (4.7, 4.701)];

fn with_gaps(seconds: f64) -> Rows {
    let mut rows = rows(&steps(seconds, 1.0));
    rows.retain(|row| !GAPS.iter().any(|(from, to)| (*from..*to).contains(&row[0])));
    rows
}

#[test]
fn parameters_are_found_beside_gaps() {
    let folder = tempfile::tempdir().unwrap();
    let path = csv(folder.path(), &with_gaps(6.0), 4);
    let model = folder.path().join("model.toml");
    let [path, model] = [&path, &model].map(|p| p.to_str().unwrap());
    let told = greyrig(&["identify", path, "--kind", "pm-dc", "--out", model, "--json"]);
    let motor = Motor::nominal(Kind::PmDc);
    for (name, truth) in [("R", motor.r), ("K", motor.k), ("J", motor.j)] {
        let all = told["parameters"].as_array().unwrap();
        let interval = &all.iter().find(|p| p["name"] == name).expect("it is told")["ci95"];
        let [low, high] = [0, 1].map(|k| interval[k].as_f64().expect("it is identifiable"));
        assert!((low..=high).contains(&truth), "{name}: {low} … {high}, not {truth}");
        assert!(high / low < 1.1, "{name}: {low} … {high}");
    }
    let gaps: Vec<&Value> =
        told["data_findings"].as_array().unwrap().iter().filter(|f| f["code"] == "time_gap").collect();
    assert_eq!(gaps.len(), GAPS.len());
    for (gap, (from, to)) in gaps.iter().zip(GAPS) {
        assert_eq!(gap["handled"], "split");
        for (key, truth) in [("from_s", from - 1e-4), ("to_s", to), ("value", to - from)] {
            assert!((gap[key].as_f64().unwrap() - truth).abs() < 1e-6, "{key} of {gap}");
        }
    }
    let told = greyrig(&["compare", path, "--model", model, "--json"]);
    let parts = told["per_recording"].as_array().unwrap();
    let names: Vec<&str> = parts.iter().map(|p| p["recording"].as_str().unwrap()).collect();
    assert_eq!(names.len(), 4, "{names:?}");
    assert!(names[1].ends_with("run.csv (2 of 4)"), "{names:?}");
    for signal in ["current", "speed"] {
        let [esr, floor] = ["esr", "noise_floor"].map(|key| told[key][signal].as_f64().expect("it is known"));
        assert!(esr < 2.0 * floor, "{signal}: {esr}, floor {floor}");
    }
}

/// Every profile of both kinds, at 10 kHz and at 1 kHz.
fn sound() -> impl Iterator<Item = (Kind, String, Recording)> {
    let kinds = [Kind::PmDc, Kind::Universal].into_iter();
    let profiles =
        |kind| PROFILES.iter().filter(move |p| p.pm_dc || kind == Kind::Universal).map(move |p| (kind, p.id));
    kinds.flat_map(profiles).flat_map(|(kind, id)| {
        let run = Setup::new(kind).profile(id).unwrap().seconds(3.0).run().unwrap().recording;
        [1, 10].map(|every| {
            let builder = Recording::builder(1e-4 * every as f64)
                .metadata(run.metadata().clone())
                .rotor_locked(run.rotor_locked().iter().copied().step_by(every).collect())
                .supply_open(run.supply_open().iter().copied().step_by(every).collect());
            let of = |channel| run.channel(channel).unwrap().iter().copied().step_by(every).collect();
            let slower = CHANNELS.into_iter().fold(builder, |b, c| b.channel(c, of(c))).build().unwrap();
            (kind, format!("{} {id}, every {every}", kind.name()), slower)
        })
    })
}

/// The same through a file, without some rows or with other stamps.
fn rewritten(run: &Recording, change: impl Fn(&mut Rows)) -> Recording {
    let mut rows = rows(run);
    change(&mut rows);
    through_csv(&rows, 7)
}

#[test]
fn gaps_and_scatter_are_told_on_every_profile_and_nothing_else_is() {
    let mut told = 0;
    for (k, (kind, title, run)) in sound().enumerate() {
        let serious = |run: &Recording| -> Vec<Code> {
            let found = check(std::slice::from_ref(run), Some(kind)).into_iter();
            found.filter(|f| f.severity != Severity::Info).map(|f| f.code).collect()
        };
        let plain = rewritten(&run, |_| ());
        assert!(plain.findings().is_empty() && plain.gaps().is_empty(), "{title}: {:?}", plain.findings());
        let before = serious(&plain);
        let mut random = Random(k as u64);
        let [from, lasts] = [0.3 + 2.0 * random.next(), 0.005 + 0.3 * random.next()];
        let cut = rewritten(&run, |rows| rows.retain(|row| !(from..from + lasts).contains(&row[0])));
        let mut after = serious(&cut);
        assert!(after.contains(&Code::TimeGap), "{title}: {after:?}");
        after.retain(|code| *code != Code::TimeGap && !before.contains(code));
        assert!(after.is_empty(), "{title}, without {from} … {} s: {after:?}", from + lasts);
        let reach = run.sample_time_s() * (0.1 + 0.3 * random.next());
        let random = std::cell::RefCell::new(random);
        let late = rewritten(&run, |rows| {
            rows.iter_mut().for_each(|row| row[0] += 1.0 + random.borrow_mut().between(-reach, reach));
        });
        assert!(found(&late, Code::TimeJitter).len() == 1, "{title}, ±{reach} s: {:?}", late.findings());
        assert!(late.gaps().is_empty() && late.len() == run.len(), "{title}");
        told += 1;
    }
    println!("{told} recordings");
}

#[test]
fn a_gap_stays_one_in_what_is_written() {
    let rows = with_gaps(6.0);
    let run = through_csv(&rows, 4);
    assert_eq!((run.len(), run.gaps().len(), run.segments().len()), (60_000, 3, 4));
    let lasts: f64 = run.segments().iter().map(Recording::duration_s).sum();
    assert!((lasts - rows.len() as f64 * 1e-4).abs() < 1e-6, "{lasts} s");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("again.csv");
    write(&run, &path, false, &Context::quiet()).unwrap();
    let again = read(&path);
    assert_eq!(again.gaps(), run.gaps());
    assert_eq!(again.channels(), run.channels());
    assert_eq!(again.sample_time_s(), 1e-4);
}

#[test]
fn parts_too_short_are_left_out_and_told() {
    let mut rows = rows(&steps(3.0, 1.0));
    rows.retain(|row| !((1.0..1.1).contains(&row[0]) || (1.102..1.2).contains(&row[0])));
    let run = through_csv(&rows, 4);
    assert_eq!(run.segments().len(), 3);
    let short = found(&run, Code::TooShort);
    assert_eq!(short.len(), 1, "{short:?}");
    assert_eq!((short[0].handled, short[0].from_s.map(|t| (t * 1e4).round())), (Handled::Masked, Some(11_000.0)));
}

#[test]
fn samples_taken_beside_their_rows_are_brought_there() {
    let run = steps(6.0, 0.0);
    let mut random = Random(1);
    let even: Vec<f64> = (1..5990).map(f64::from).collect();
    let truth = slowly(&run, &even, 0.0, &mut random);
    for reach in [0.1, 0.25, 0.4] {
        let taken: Vec<f64> = even.iter().map(|n| n + random.between(-reach, reach)).collect();
        // A twelve-bit converter's noise.
        let noise = 3e-4;
        let measured = slowly(&run, &taken, noise, &mut random);
        let run = through_csv(&measured, 7);
        let jitter = found(&run, Code::TimeJitter);
        assert!(matches!(&jitter[..], [f] if f.handled == Handled::Corrected), "±{reach}: {jitter:?}");
        let rms_s = jitter[0].value.unwrap();
        assert!((rms_s / (1e-3 * reach / 3f64.sqrt()) - 1.0).abs() < 0.05, "±{reach}: {rms_s} s");
        let speed: Vec<f64> = truth.iter().map(|row| row[3]).collect();
        let raw: Vec<f64> = measured.iter().map(|row| row[3]).collect();
        let sigma = noise * (speed.iter().map(|w| w * w).sum::<f64>() / speed.len() as f64).sqrt();
        let (before, after) = (apart(&raw, &speed), apart(run.channel(Channel::Speed).unwrap(), &speed));
        println!("±{reach}: speed off by {before:.4} before and {after:.4} after, noise {sigma:.4} rad/s");
        assert!(before > 1.5 * sigma, "±{reach}: it would show");
        // What is curved within three samples is interpolated less well than the noise.
        assert!(after < 1.25 * sigma, "±{reach}: {after} rad/s, noise {sigma} rad/s");
    }
}

#[test]
fn stamps_that_are_merely_printed_late_change_no_sample() {
    let run = steps(6.0, 0.0);
    let mut random = Random(2);
    let even: Vec<f64> = (1..5990).map(f64::from).collect();
    let mut rows = slowly(&run, &even, 3e-4, &mut random);
    let values: Vec<f64> = rows.iter().map(|row| row[3]).collect();
    rows.iter_mut().for_each(|row| row[0] += 1e-3 * random.between(-0.4, 0.4));
    let run = through_csv(&rows, 7);
    let jitter = found(&run, Code::TimeJitter);
    assert!(matches!(&jitter[..], [f] if f.handled == Handled::None), "{jitter:?}");
    assert_eq!(run.len(), values.len());
    assert!((run.sample_time_s() / 1e-3 - 1.0).abs() < 1e-6);
    let read = run.channel(Channel::Speed).unwrap();
    assert!(values.iter().zip(read).all(|(a, b)| (a - b).abs() < 1e-6));
}

#[test]
fn a_rate_that_wanders_is_followed() {
    let run = steps(6.0, 0.0);
    let mut random = Random(3);
    let wandering = |n: u32| f64::from(n) + 8.0 * (std::f64::consts::TAU * f64::from(n) / 6000.0).sin();
    let taken: Vec<f64> = (1..5980).map(wandering).collect();
    let noise = 3e-4;
    let read = through_csv(&slowly(&run, &taken, noise, &mut random), 7);
    let jitter = found(&read, Code::TimeJitter);
    assert!(matches!(&jitter[..], [f] if f.handled == Handled::Corrected), "{jitter:?}");
    let [start, interval] = [read.start_s(), read.sample_time_s()];
    let even: Vec<f64> = (0..read.len()).map(|n| 1e3 * (start + n as f64 * interval)).collect();
    let speed: Vec<f64> = slowly(&run, &even, 0.0, &mut random).iter().map(|row| row[3]).collect();
    let sigma = noise * (speed.iter().map(|w| w * w).sum::<f64>() / speed.len() as f64).sqrt();
    let off = apart(read.channel(Channel::Speed).unwrap(), &speed);
    assert!(off < 1.15 * sigma, "{off} rad/s, noise {sigma} rad/s");
}

#[test]
fn stamps_that_several_samples_share_are_spread_out() {
    let run = steps(3.0, 1.0);
    let read = through_csv(&rows(&run), 3);
    assert_eq!((read.len(), read.sample_time_s()), (run.len(), 1e-4));
    let coarse = found(&read, Code::TimeJitter);
    assert!(matches!(&coarse[..], [f] if f.handled == Handled::Corrected && f.text.contains("0.001 s")), "{coarse:?}");
    // A stamp that does not fit its row is no coarse one.
    let mut rows = rows(&run);
    rows[15_000][0] += 3e-3;
    let folder = tempfile::tempdir().unwrap();
    let refused = load(&csv(folder.path(), &rows, 3), &Mapping::default(), &Context::quiet());
    assert!(refused.expect_err("it is refused").to_string().contains("appears twice"));
}

#[test]
fn rows_that_stand_twice_are_left_out() {
    let run = steps(3.0, 1.0);
    let once = rows(&run);
    let doubled = [0, 700, 701, 20_000, 29_999];
    let twice: Rows =
        (0..once.len()).flat_map(|n| std::iter::repeat_n(once[n], 1 + usize::from(doubled.contains(&n)))).collect();
    let read = through_csv(&twice, 4);
    assert_eq!((read.len(), read.sample_time_s()), (run.len(), 1e-4));
    let told = found(&read, Code::TimeJitter);
    assert!(matches!(&told[..], [f] if f.value == Some(5.0) && f.handled == Handled::Corrected), "{told:?}");
    let speed = read.channel(Channel::Speed).unwrap();
    assert!(once.iter().zip(speed).all(|(row, w)| (row[3] - w).abs() < 1e-6));
    // The same stamp on other values is no doubled row.
    let mut other = twice;
    other[701][3] += 1.0;
    let folder = tempfile::tempdir().unwrap();
    let refused = load(&csv(folder.path(), &other, 4), &Mapping::default(), &Context::quiet());
    assert!(refused.expect_err("it is refused").to_string().contains("appears twice"));
}
