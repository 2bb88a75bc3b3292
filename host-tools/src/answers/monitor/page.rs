//! The report on tested motors.

use crate::model::{DetectorEntry, Origin};
use crate::monitor::bands::{Course, courses};
use crate::monitor::lot::{Beside, Finding};
use crate::monitor::test::Test;
use crate::report::{Curves, Report, Table};

/// Faults that are shown of a motor.
const FAULTS_SHOWN: usize = 5;

/// The report.
pub fn report<'a>(tests: &[Test], detector: &DetectorEntry, files: &[Origin]) -> Report<'a> {
    let rows = tests
        .iter()
        .map(|t| {
            let alarm = t.alarms.iter().max_by(|a, b| a.ratio.total_cmp(&b.ratio));
            vec![
                t.recording.clone(),
                t.serial.clone().unwrap_or_default(),
                t.verdict.words().to_owned(),
                alarm.map_or_else(|| t.reasons.join("; "), |a| format!("{}, {:.1} times the limit", a.cause, a.ratio)),
                alarm.map_or_else(String::new, |a| a.suspect.clone()),
            ]
        })
        .collect();
    let title = match tests {
        [Test { serial: Some(serial), verdict, .. }] => format!("Motor {serial}: {}", verdict.words()),
        _ => "Test of motors".to_owned(),
    };
    let mut report = Report::new(title).table(
        "Verdicts",
        Table {
            caption: format!("Limits from {} healthy runs", detector.runs),
            columns: ["recording", "serial", "verdict", "why", "suspect"].map(str::to_owned).to_vec(),
            rows,
        },
    );
    for test in tests.iter().take(12) {
        if !test.findings.is_empty() {
            report = report.table(format!("{}: what is wrong", test.recording), findings(test));
        }
        if !test.beside.is_empty() {
            report = report.curves(format!("{}: its balances beside the lot's", test.recording), balances(test));
        }
        report = report
            .curves(format!("{}: {}", test.recording, test.verdict.words()), ratios(test, detector))
            .curves(format!("{}: arcing", test.recording), arcing(test));
    }
    report.recordings(files)
}

/// The faults that explain what is seen, the likeliest first.
fn findings(test: &Test) -> Table {
    let row = |f: &Finding| {
        let as_likely = if f.as_likely { "as likely as any" } else { "less likely" };
        vec![f.text.clone(), f.kind.to_owned(), format!("{:.1}", f.ratio), as_likely.to_owned(), f.look_at.to_owned()]
    };
    Table {
        caption: "Faults by the balances of power and torque, against what healthy motors of the lot show at the same \
                  time of the test"
            .to_owned(),
        columns: ["fault", "where", "times the limit", "how likely", "on the bench"].map(str::to_owned).to_vec(),
        rows: test.findings.iter().take(FAULTS_SHOWN).map(row).collect(),
    }
}

/// What the balances leave over, in time.
fn balances(test: &Test) -> Curves {
    let of = |get: fn(&Beside) -> Option<f64>| test.beside.iter().filter_map(|b| Some((b.t_s, get(b)?))).collect();
    Curves {
        caption:
            "What the balances of power and torque leave over, less what is usual at that time of the test and what \
                  the motor's own parameters make; the unit is what is left of the healthy motors that have taught it, \
                  and another healthy one may leave some times as much"
                .to_owned(),
        x: "time, s".to_owned(),
        y: "standard deviations of the lot".to_owned(),
        logarithmic: false,
        curves: vec![("power".to_owned(), of(|b| b.power)), ("torque".to_owned(), of(|b| b.torque))],
    }
}

/// What only arcs do to the current above 1 kHz.
fn arcing(test: &Test) -> Curves {
    let points = test.replay.judged().map(|r| (r.t_s, f64::from(r.features.arcing)));
    Curves {
        caption:
            "Power of the current above 1 kHz that goes with the current: arcs do, the noise of the sensor does not"
                .to_owned(),
        x: "time, s".to_owned(),
        y: "arcing, A²".to_owned(),
        logarithmic: false,
        curves: vec![("arcing".to_owned(), points.collect())],
    }
}

/// What is watched, over its limit, in time.
fn ratios(test: &Test, detector: &DetectorEntry) -> Curves {
    let curve = |course: Course| {
        let ratio = |[t_s, value]: [f64; 2]| (t_s, course.band.ratio(value));
        (course.name.to_owned(), course.points.iter().copied().map(ratio).collect())
    };
    Curves {
        caption: "What is watched, as a share of its limit; above 1 it calls".to_owned(),
        x: "time, s".to_owned(),
        y: "ratio to the limit".to_owned(),
        logarithmic: true,
        curves: courses(test, detector).into_iter().map(curve).collect(),
    }
}
