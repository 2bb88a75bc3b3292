//! Figures 4, 6 and 7 of the paper, redrawn with the demonstration's own motor.
//!
//! Source: A. Rakar, Đ. Juričić: Modelling for fault detection of electric motors, Strojniški vestnik, 2004.

use crate::compare::Comparison;
use crate::monitor::test::Test;
use crate::report::{Curves, Report};

/// Shown on each side of the largest current, s: three periods of 50 Hz in all.
const AROUND_S: f64 = 0.03;

/// Adds the figures: the physical model alone, the hybrid model, and the residual of a healthy and of a sparking motor.
pub fn figures<'a>(report: Report<'a>, physical: &Comparison, hybrid: &Comparison, tests: &[(&str, Test)]) -> Report<'a> {
    let mut report = report
        .curves("As figure 4 of the paper: the physical model alone", currents(physical, "physical model"))
        .curves("As figure 6 of the paper: the hybrid model", currents(hybrid, "hybrid model"));
    if let Some(residuals) = residuals(tests) {
        report = report
            .curves("As figure 7 of the paper: the residual of sparking brushes", residuals)
            .text("By how much sparking raises what is watched", growth(tests));
    }
    report
}

/// Measured and modelled current and their difference, where the current is largest.
fn currents(comparison: &Comparison, name: &str) -> Curves {
    let mut curves = Curves {
        caption: format!("Current on the held-out ramp at its top: measured, {name}, and the {name}'s error"),
        x: "time, s".to_owned(),
        y: "current, A".to_owned(),
        logarithmic: false,
        curves: Vec::new(),
    };
    let Some(one) = comparison.per_recording.first() else { return curves };
    let t = &one.traces;
    let (measured, modelled) = (&t.measured_current, &t.modelled_current);
    let magnitude = |k: &usize| measured[*k].abs();
    let Some(top) = (0..measured.len().min(modelled.len())).max_by(|a, b| magnitude(a).total_cmp(&magnitude(b))) else {
        return curves;
    };
    let around = (AROUND_S / t.sample_time_s) as usize;
    let window = top.saturating_sub(around)..(top + around).min(modelled.len());
    let of = |get: &dyn Fn(usize) -> f64| window.clone().map(|k| (t.start_s + k as f64 * t.sample_time_s, get(k))).collect();
    curves.curves = vec![
        ("measured".to_owned(), of(&|k| measured[k])),
        (name.to_owned(), of(&|k| modelled[k])),
        ("error".to_owned(), of(&|k| modelled[k] - measured[k])),
    ];
    curves
}

/// Healthy and sparking, by the labels of the demonstration.
fn pair<'a>(tests: &'a [(&str, Test)]) -> Option<[&'a Test; 2]> {
    let of = |word: &str| tests.iter().find(|(label, _)| label.contains(word)).map(|(_, t)| t);
    Some([of("healthy")?, of("sparking")?])
}

fn residuals(tests: &[(&str, Test)]) -> Option<Curves> {
    let [healthy, sparking] = pair(tests)?;
    let of = |t: &Test| t.replay.judged().map(|r| (r.t_s, 100.0 * f64::from(r.features.current))).collect();
    Some(Curves {
        caption: "Residual of the current over each period of the mains, RMS over that of the current; sparking begins at 5 s".to_owned(),
        x: "time, s".to_owned(),
        y: "residual of the current, %".to_owned(),
        logarithmic: true,
        curves: vec![("healthy motor".to_owned(), of(healthy)), ("sparking brushes".to_owned(), of(sparking))],
    })
}

/// Medians of the last second over those of the healthy motor.
fn growth(tests: &[(&str, Test)]) -> String {
    let Some([healthy, sparking]) = pair(tests) else { return String::new() };
    let median = |t: &Test, get: &dyn Fn(&crate::monitor::replay::Row) -> f32| {
        let mut last: Vec<f32> = t.replay.judged().map(get).collect();
        let from = last.len().saturating_sub(50);
        let last = &mut last[from..];
        last.sort_by(f32::total_cmp);
        last.get(last.len() / 2).copied().unwrap_or(f32::NAN)
    };
    let times = |get: &dyn Fn(&crate::monitor::replay::Row) -> f32| median(sparking, get) / median(healthy, get);
    format!(
        "In the last second the residual of the current is {:.0} times that of the healthy motor, the current above 1 kHz {:.0} times.",
        times(&|r| r.features.current),
        times(&|r| r.features.sparking)
    )
}
