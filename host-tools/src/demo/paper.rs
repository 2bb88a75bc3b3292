//! Figures 4, 6 and 7 of the paper, redrawn with the demonstration's own motor.
//!
//! Source: A. Rakar, Đ. Juričić: Modelling for fault detection of electric motors, Strojniški vestnik, 2004.

use greyrig::detector::Features;

use crate::compare::Comparison;
use crate::monitor::test::Test;
use crate::report::{Curves, Report};

/// Shown on each side of the largest current, s: three periods of 50 Hz in all.
const AROUND_S: f64 = 0.03;
/// A second at 50 Hz.
const LAST_PERIODS: usize = 50;

/// Adds the figures: the physical model alone, the hybrid model, and the residuals of the type's motor, healthy and
/// sparking.
pub fn figures<'a>(report: Report<'a>, physical: &Comparison, hybrid: &Comparison, motors: &[Test; 2]) -> Report<'a> {
    report
        .curves("As figure 4 of the paper: the physical model alone", currents(physical, "physical model"))
        .curves("As figure 6 of the paper: the hybrid model", currents(hybrid, "hybrid model"))
        .curves("As figure 7 of the paper: the residual of sparking brushes", residuals(motors))
        .text("By how much sparking raises what is watched", growth(motors))
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
    let of =
        |get: &dyn Fn(usize) -> f64| window.clone().map(|k| (t.start_s + k as f64 * t.sample_time_s, get(k))).collect();
    curves.curves = vec![
        ("measured".to_owned(), of(&|k| measured[k])),
        (name.to_owned(), of(&|k| modelled[k])),
        ("error".to_owned(), of(&|k| modelled[k] - measured[k])),
    ];
    curves
}

fn residuals([healthy, sparking]: &[Test; 2]) -> Curves {
    let of = |t: &Test| t.replay.judged().map(|r| (r.t_s, 100.0 * f64::from(r.features.current))).collect();
    Curves {
        caption: "Residual of the current over each period of the mains, RMS over that of the current, with effects and correction; \
                  an arc at every fifth commutator bar from 5 s on"
            .to_owned(),
        x: "time, s".to_owned(),
        y: "residual of the current, %".to_owned(),
        logarithmic: true,
        curves: vec![("healthy".to_owned(), of(healthy)), ("sparking brushes".to_owned(), of(sparking))],
    }
}

/// What sparking does to the residual and to the current above 1 kHz: mean squares of the last second.
fn growth([healthy, sparking]: &[Test; 2]) -> String {
    let mean = |t: &Test, get: fn(&Features) -> f64| {
        let last = t.replay.rows.iter().rev().filter(|r| r.judged).take(LAST_PERIODS);
        let values: Vec<f64> = last.map(|r| get(&r.features)).collect();
        values.iter().sum::<f64>() / values.len().max(1) as f64
    };
    let times = |get: fn(&Features) -> f64| mean(sparking, get) / mean(healthy, get);
    format!(
        "In the last second the residual of the current is {:.1} times that of the healthy motor, the current above 1 kHz {:.1} times, \
         and its power that goes with the current, without the noise of the sensor, {:.0} times.",
        times(|f| f64::from(f.current).powi(2)).sqrt(),
        times(|f| f64::from(f.sparking).powi(2)).sqrt(),
        times(|f| f64::from(f.arcing))
    )
}
