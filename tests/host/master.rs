//! The golden motor: published gauge studies, false alarms of the drift rules, a history that survives a crash.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use greyrig_host::context::Context;
use greyrig_host::monitor::drift::{Baseline, FEWEST, Point};
use greyrig_host::monitor::gauge::crossed;
use greyrig_host::monitor::golden::History;
use greyrig_host::monitor::tolerance::{spread, upper};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::bad_input::refused;
use crate::program::greyrig;

/// AIAG, Measurement Systems Analysis, 4th edition, table III-B: ten parts, three appraisers, three trials each.
#[rustfmt::skip]
const AIAG: [[[f64; 10]; 3]; 3] = [
    [
        [0.29, -0.56, 1.34, 0.47, -0.80, 0.02, 0.59, -0.31, 2.26, -1.36],
        [0.41, -0.68, 1.17, 0.50, -0.92, -0.11, 0.75, -0.20, 1.99, -1.25],
        [0.64, -0.58, 1.27, 0.64, -0.84, -0.21, 0.66, -0.17, 2.01, -1.31],
    ],
    [
        [0.08, -0.47, 1.19, 0.01, -0.56, -0.20, 0.47, -0.63, 1.80, -1.68],
        [0.25, -1.22, 0.94, 1.03, -1.20, 0.22, 0.55, 0.08, 2.12, -1.62],
        [0.07, -0.68, 1.34, 0.20, -1.28, 0.06, 0.83, -0.34, 2.19, -1.50],
    ],
    [
        [0.04, -1.38, 0.88, 0.14, -1.46, -0.29, 0.02, -0.46, 1.77, -1.49],
        [-0.11, -1.13, 1.09, 0.20, -1.07, -0.67, 0.01, -0.56, 1.45, -1.77],
        [-0.15, -0.96, 0.67, 0.11, -1.45, -0.49, 0.21, -0.49, 1.87, -2.16],
    ],
];

#[test]
fn gauge_study_is_the_published_one() {
    let values: Vec<Vec<Vec<f64>>> = (0..10)
        .map(|part| AIAG.iter().map(|appraiser| appraiser.iter().map(|trial| trial[part]).collect()).collect())
        .collect();
    let g = crossed(&values).unwrap();
    let close = |found: f64, published: f64, digit: f64| {
        // Half a digit of what is printed.
        assert!((found - published).abs() <= 0.5 * digit, "{found} against {published}");
    };
    for (source, freedom, squares) in
        [(g.appraisers, 2, 3.1673), (g.parts, 9, 88.3619), (g.interaction, 18, 0.3590), (g.error, 60, 2.7589)]
    {
        assert_eq!(source.freedom, freedom);
        close(source.squares, squares, 1e-4);
    }
    close(g.interaction.mean() / g.error.mean(), 0.434, 1e-3);
    // The interaction is pooled, as in the manual.
    close(g.repeatability, 0.199933, 1e-6);
    close(g.reproducibility, 0.226838, 1e-6);
    // The manual prints 0.302373, though its own two figures above give 0.302372.
    close(g.gauge, 0.302373, 4e-6);
    close(g.part, 1.042327, 1e-6);
    close(g.total, 1.085, 1e-3);
    close(100.0 * g.of_total(), 27.9, 0.1);
    assert_eq!(g.categories(), 4);
}

#[test]
fn a_study_that_is_not_balanced_is_none() {
    assert_eq!(crossed(&[vec![vec![1.0, 2.0]], vec![vec![1.0]]]), None);
    assert_eq!(crossed(&[vec![vec![1.0, 2.0]]]), None);
    assert_eq!(crossed(&[vec![vec![1.0]], vec![vec![2.0]]]), None);
    assert_eq!(crossed(&[]), None);
    // One appraiser, no scatter of the gauge: everything is between parts, of variance ((1 − 3)/2)² · 2.
    let g = crossed(&[vec![vec![1.0, 1.0]], vec![vec![3.0, 3.0]]]).unwrap();
    assert_eq!((g.gauge, g.part, g.categories()), (0.0, 2f64.sqrt(), 0));
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    random.sample(StandardNormal)
}

/// Of rigs that have not drifted each rule calls as often as it says, whatever the baseline's length.
#[test]
fn drift_is_alarmed_falsely_as_often_as_stated() {
    const ALPHA: f64 = 0.02;
    const RIGS: usize = 40_000;
    for baseline in [FEWEST, 20] {
        let mut random = ChaCha8Rng::seed_from_u64(baseline as u64);
        for later in [1, 7] {
            let (mut individual, mut average) = (0, 0);
            for _ in 0..RIGS {
                let mut draw = |n: usize| (0..n).map(|_| 0.3 + 0.01 * normal(&mut random)).collect::<Vec<f64>>();
                let first = Baseline::new(&draw(baseline), ALPHA).unwrap();
                let last = *first.judge(&draw(later)).last().unwrap();
                individual += usize::from(last.individual.abs() > 1.0);
                average += usize::from(last.average.abs() > 1.0);
            }
            // Four standard deviations of a binomial count: one false failure in 16,000.
            let expected = ALPHA * RIGS as f64;
            let slack = 4.0 * (expected * (1.0 - ALPHA)).sqrt();
            for (rule, count) in [("individuals", individual), ("average", average)] {
                assert!((count as f64 - expected).abs() < slack, "{rule}, {baseline} checks, {later} later: {count}");
            }
        }
    }
}

/// A drift of 1.5 standard deviations is lost in the individuals and found by the average; one of six is found at once.
#[test]
fn a_drift_is_found() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut checks = |n: usize, shift: f64| (0..n).map(|_| shift + normal(&mut random)).collect::<Vec<f64>>();
    let alpha = 0.0027 / 8.0;
    let (mut at_once, mut slowly) = (0, 0);
    for _ in 0..200 {
        let first = Baseline::new(&checks(20, 0.0), alpha).unwrap();
        at_once += usize::from(first.judge(&checks(1, 6.0))[0].calls());
        slowly += usize::from(first.judge(&checks(20, 2.0)).iter().any(Point::calls));
    }
    assert!(at_once > 160, "{at_once} of 200");
    assert!(slowly > 180, "{slowly} of 200");
    assert_eq!(Baseline::new(&[1.0; 20], alpha), None, "a figure that never changes has no scatter to compare with");
    assert_eq!(Baseline::new(&checks(FEWEST - 1, 0.0), alpha), None);
}

/// With three runs each of ten motors the limits hold what they say; taken as thirty motors they do not.
#[test]
fn repeated_runs_of_a_motor_are_not_more_motors() {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let (between, within) = (1.0, 0.3f64);
    // 99 % of runs of any motor lie below 2.3263 standard deviations of both scatters together.
    let truth = 2.3263 * (between * between + within * within).sqrt();
    let (mut by_motor, mut by_run) = (0, 0);
    const LOTS: usize = 4_000;
    for _ in 0..LOTS {
        let motors: Vec<Vec<f64>> = (0..10)
            .map(|_| {
                let motor = between * normal(&mut random);
                (0..3).map(|_| motor + within * normal(&mut random)).collect()
            })
            .collect();
        by_motor += usize::from(upper(&motors, false, 0.99, 0.95).unwrap() >= truth);
        let runs: Vec<Vec<f64>> = motors.iter().flatten().map(|x| vec![*x]).collect();
        by_run += usize::from(upper(&runs, false, 0.99, 0.95).unwrap() >= truth);
    }
    let [by_motor, by_run] = [by_motor, by_run].map(|n| f64::from(n as u32) / LOTS as f64);
    // 95 %; the formula is an approximation, good to a percent or two, and the count is good to 0.7 %.
    assert!((0.93..0.98).contains(&by_motor), "{by_motor}");
    assert!(by_run < 0.90, "{by_run}");
}

#[test]
fn scatter_between_and_within_motors() {
    // By hand: means 2, 6, variance of the means 8; within 2, 2; MS_b/n = 8, s² = 8 + 2/2.
    let s = spread(&[vec![1.0, 3.0], vec![5.0, 7.0]]);
    assert_eq!((s.mean, s.within, s.motors), (4.0, Some(2f64.sqrt()), 2));
    // A few roundings.
    assert!((s.deviation - 3.0).abs() < 1e-14, "{}", s.deviation);
    // (8 + 1)²/(8²/1 + 1²/2).
    assert!((s.freedom - 81.0 / 64.5).abs() < 1e-12, "{}", s.freedom);
    let single = spread(&[vec![1.0], vec![3.0], vec![5.0]]);
    assert_eq!((single.deviation, single.freedom, single.within), (2.0, 2.0, None));
}

/// Runs of the golden motor: seven seconds at a station that is the model.
mod shift {
    use greyrig_host::model::{DetectorEntry, Kind, Model};
    use greyrig_host::recording::write;
    use greyrig_host::rig::Setup;

    use super::*;

    /// The model of the rig's usual motor, with limits as wide as a lot's.
    pub fn station(folder: &Path) -> Model {
        let recording = Setup::new(Kind::Universal).profile("staircase").unwrap().seconds(6.0).run().unwrap().recording;
        let settings = greyrig_host::identify::Settings::new(Kind::Universal);
        let model = greyrig_host::identify::identify(&[recording], &settings, &Context::quiet()).unwrap().model;
        let detector = DetectorEntry {
            nominal_voltage: 230.0,
            least_voltage: 0.3,
            most_voltage: 1.1,
            least_speed: 300.0,
            blanking_s: 1.0,
            fewest_periods: 20,
            current: 0.3,
            speed: 0.2,
            sparking: 1.0,
            current_jump: 0.2,
            speed_jump: 0.2,
            current_deviation: [0.0, 0.2],
            speed_deviation: [0.0, 0.1],
            runs: 10,
            motors: 10,
            holds: [0.999, 0.95],
            ..DetectorEntry::default()
        };
        let station = Model { detector: Some(detector), ..model };
        station.save(&folder.join("station.toml"), true).unwrap();
        station
    }

    pub fn golden(folder: &Path, name: &str, seed: u64, fault: Option<&str>) {
        let setup = Setup::new(Kind::Universal).profile("steady").unwrap().seconds(3.0).seed(seed);
        let setup = fault.into_iter().fold(setup, |s, f| s.fault(f).unwrap());
        let mut recording = setup.run().unwrap().recording;
        recording.set_metadata("serial", "GOLD");
        write(&recording, &folder.join(name), true, &Context::quiet()).unwrap();
    }
}

#[test]
fn the_golden_motor_shows_a_rig_that_has_drifted() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    shift::station(here);
    let master = |files: &[&str], more: &[&str]| {
        let options = ["--model", "station.toml", "--history", "golden.csv", "--baseline", "5"];
        greyrig(here, &[&["master"], files, &options, more].concat())
    };
    for check in 0..5 {
        shift::golden(here, "a.csv", 10 + check, None);
        shift::golden(here, "b.csv", 30 + check, None);
        let output = master(&["a.csv", "b.csv"], &[]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(String::from_utf8_lossy(&output.stdout).contains("that teach what is usual"));
    }
    // A run that was cut off by a crash, in the digits of its last number, and one that an older greyrig has left.
    let mut text = std::fs::read_to_string(here.join("golden.csv")).unwrap();
    let last = text.lines().last().unwrap().to_owned();
    text += &format!("6,,a.csv,GO\n{}", &last[..last.len() - 4]);
    assert!(text.len() > last.len() && !last.ends_with(','));
    std::fs::write(here.join("golden.csv"), text).unwrap();
    let healthy = master(&["a.csv", "b.csv"], &[]);
    assert_eq!(healthy.status.code(), Some(0));
    let talk = String::from_utf8_lossy(&healthy.stderr);
    assert!(talk.contains("golden.csv:12: not a whole line"), "{talk}");
    assert!(talk.contains("golden.csv: the last line was cut off") && talk.contains("golden.csv.cut"), "{talk}");
    let cut = std::fs::read_to_string(here.join("golden.csv.cut")).unwrap();
    assert_eq!(cut, format!("{}\n", &last[..last.len() - 4]));
    assert!(String::from_utf8_lossy(&healthy.stdout).contains("no drift"));

    // A current sensor off by 2 %: a hundredth of what a lot's scatter would show, and the motor passes.
    shift::golden(here, "a.csv", 50, Some("current_sensor=0.02@0"));
    shift::golden(here, "b.csv", 51, Some("current_sensor=0.02@0"));
    let drifted = master(&["a.csv", "b.csv"], &["--json", "--report", "shift.html"]);
    assert_eq!(drifted.status.code(), Some(1), "{}", String::from_utf8_lossy(&drifted.stderr));
    let told: serde_json::Value = serde_json::from_slice(&drifted.stdout).unwrap();
    assert_eq!((&told["verdict"], &told["drifted"], &told["checks"]), (&"pass".into(), &true.into(), &7.into()));
    assert_eq!(told["charts"][0]["chart"]["figure"], "deviation of the current");
    assert_eq!(told["charts"][0]["drifted"], true);
    assert!(told["charts"][0]["chart"]["gauge"]["repeatability"].as_f64().unwrap() > 0.0);
    assert!(std::fs::read_to_string(here.join("shift.html")).unwrap().contains("the rig has drifted"));

    let history = History::open(&here.join("golden.csv"), &Context::quiet()).unwrap();
    assert_eq!((history.runs.len(), &history.torn), (14, &vec![12]));
    assert_eq!(history.runs.last().map(|r| (r.check, r.serial.as_str())), Some((7, "GOLD")));
}

/// Programs that add to one history at once, of which some are killed: every check has a number of its own, every line
/// is whole, and what was there is there.
#[cfg(unix)]
#[test]
fn a_history_is_shared_and_survives_kills_and_full_disks() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    shift::station(here);
    shift::golden(here, "a.csv", 1, None);
    std::fs::create_dir(here.join("rig")).unwrap();
    std::os::unix::fs::symlink("rig/golden.csv", here.join("golden.csv")).unwrap();
    let arguments = ["master", "a.csv", "--model", "station.toml", "--history", "golden.csv", "--json"];
    let command = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_greyrig"));
        command.env("COLUMNS", crate::program::WIDE);
        command.current_dir(here).args(arguments).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    };
    // The first one tells how long a check takes.
    let begin = Instant::now();
    assert!(command().status().unwrap().success());
    let takes = begin.elapsed();
    let running: Vec<_> = (0..4).map(|_| command().spawn().unwrap()).collect();
    for mut child in running {
        assert!(child.wait().unwrap().success());
    }
    let numbers = || {
        let history = History::open(&here.join("golden.csv"), &Context::quiet()).unwrap();
        assert!(history.torn.is_empty(), "{:?}", history.torn);
        history.runs.iter().map(|run| run.check).collect::<Vec<_>>()
    };
    assert_eq!(numbers(), [1, 2, 3, 4, 5]);

    for n in 0..12 {
        let mut child = command().spawn().unwrap();
        // Around the end of the work, where the line is written.
        std::thread::sleep(takes.mul_f64(0.7 + 0.05 * f64::from(n)));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let count = numbers().len();
    assert_eq!(numbers(), (1..=count).collect::<Vec<_>>());

    // No file may grow beyond what this one has: as a full disk, for whoever ignores the signal.
    let mut grown = std::fs::read(here.join("rig/golden.csv")).unwrap();
    let line = grown.split_inclusive(|&byte| byte == b'\n').next_back().unwrap().to_vec();
    // The limit counts in 512 bytes; the next line is longer than what is left of them.
    while grown.len() % 512 + line.len() < 530 {
        grown.extend(&line);
    }
    std::fs::write(here.join("rig/golden.csv"), &grown).unwrap();
    let (program, blocks) = (env!("CARGO_BIN_EXE_greyrig"), grown.len() / 512 + 1);
    let limited = format!("trap '' XFSZ; ulimit -f {blocks}; exec '{program}' {}", arguments.join(" "));
    let full = Command::new("sh").current_dir(here).args(["-c", &limited]).output().unwrap();
    let talk = String::from_utf8_lossy(&full.stderr);
    assert_eq!(full.status.code(), Some(2), "{talk}");
    assert!(talk.contains("golden.csv: ") && talk.contains("arge"), "{talk}");
    assert_eq!(std::fs::read(here.join("rig/golden.csv")).unwrap(), grown, "as long as before");
    assert!(here.join("golden.csv").is_symlink());
}

#[test]
fn what_is_no_check_of_a_golden_motor_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    shift::station(here);
    shift::golden(here, "a.csv", 1, None);
    let text = std::fs::read_to_string(here.join("a.csv")).unwrap();
    std::fs::write(here.join("b.csv"), text.replace("GOLD", "SILVER")).unwrap();
    std::fs::write(here.join("day.csv"), "recording,serial\n").unwrap();
    let refuse = |arguments: &[&str], words: &[&str]| {
        refused(&greyrig(here, &[&["master"], arguments, &["--model", "station.toml"]].concat()), words);
    };
    refuse(&["a.csv", "b.csv"], &["several motors", "--study"]);
    refuse(&["a.csv", "b.csv", "--study"], &["2 motors", "runs 1 1", "twice or more"]);
    refuse(&["a.csv", "--history", "day.csv"], &["day.csv:1:1", "something else", "check,date"]);
    assert_eq!(std::fs::read_to_string(here.join("day.csv")).unwrap(), "recording,serial\n");
    refuse(&["a.csv", "--history", "/dev/null"], &["/dev/null", "device"]);
    refuse(&["a.csv", "--history", "no/such.csv"], &["no/such.csv", "folder"]);
    refuse(&["a.csv", "--history", "h.csv", "--baseline", "2"], &["--baseline"]);
    assert!(!here.join("h.csv").exists());

    std::fs::copy(here.join("a.csv"), here.join("a2.csv")).unwrap();
    shift::golden(here, "a2.csv", 2, None);
    shift::golden(here, "b2.csv", 3, Some("resistance_up=0.1@0"));
    let text = std::fs::read_to_string(here.join("b2.csv")).unwrap();
    std::fs::write(here.join("b2.csv"), text.replace("GOLD", "SILVER")).unwrap();
    shift::golden(here, "b.csv", 4, Some("resistance_up=0.1@0"));
    let text = std::fs::read_to_string(here.join("b.csv")).unwrap();
    std::fs::write(here.join("b.csv"), text.replace("GOLD", "SILVER")).unwrap();
    let study = ["master", "a.csv", "a2.csv", "b.csv", "b2.csv", "--study", "--model", "station.toml", "--json"];
    let output = greyrig(here, &study);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let gauge = &told["study"][0]["gauge"];
    // A tenth more resistance is what differs between the motors; noise is what differs between runs.
    assert!(gauge["part"].as_f64().unwrap() > 5.0 * gauge["repeatability"].as_f64().unwrap(), "{gauge}");
}
