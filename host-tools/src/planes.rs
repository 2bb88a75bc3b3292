//! A motor's run as a path in the planes in which its laws are drawn: voltage over current, flux over current, torque
//! over speed.
//!
//! ```text
//! Ψ = (u − R i − L di/dt) / ω            flux linkage that makes the back-EMF, V s
//! T = Ψ i                                torque that goes with it, N m
//! ```
//! All signals have passed the same filter, so that they belong together. R and L are the model's base parameters: what
//! an effect makes of them is a part of Ψ.

use greyrig::butterworth::{Cascade, Settings};
use greyrig::motor::BaseParameter;

use crate::model::Model;

/// Share of the largest speed below which nothing is divided by the speed.
const STANDS: f64 = 0.1;

/// Signals of one run, filtered alike, at equal intervals; NaN where there is no sample.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// V.
    pub voltage: &'a [f32],
    /// A.
    pub current: &'a [f32],
    /// rad/s.
    pub speed: &'a [f32],
    /// s.
    pub interval_s: f64,
}

/// A voltage through the filter of the comparison, begun anew behind each gap. None: the filter cannot be had at this
/// rate.
pub fn filtered(voltage: &[f32], interval_s: f64, model: &Model) -> Option<Vec<f32>> {
    let crate::model::Filter { order, cutoff_hz, .. } = model.filter;
    let coefficients = Settings { order, cutoff_hz, sample_rate_hz: 1.0 / interval_s }.build::<f32>().ok()?;
    let (mut cascade, mut goes_on) = (Cascade::<f32>::default(), false);
    let out = voltage.iter().map(|u| {
        if !u.is_finite() {
            goes_on = false;
            return f32::NAN;
        }
        if !goes_on {
            cascade.reset_to(*u);
            goes_on = true;
        }
        cascade.process(&coefficients, *u)
    });
    Some(out.collect())
}

impl Run<'_> {
    /// Ψ at each sample, V s; NaN where the rotor hardly turns.
    pub fn flux(&self, model: &Model) -> Vec<f64> {
        let (r, l) = (model.value(BaseParameter::R), model.value(BaseParameter::L));
        let fastest = self.speed.iter().filter(|w| w.is_finite()).fold(0.0f32, |most, w| most.max(w.abs()));
        let slowest = STANDS * f64::from(fastest);
        let count = self.voltage.len().min(self.current.len()).min(self.speed.len());
        let at = |signal: &[f32], n: usize| f64::from(signal[n]);
        (0..count)
            .map(|n| {
                let speed = at(self.speed, n);
                if n == 0 || n + 1 == count || speed.abs() <= slowest {
                    return f64::NAN;
                }
                let slope = (at(self.current, n + 1) - at(self.current, n - 1)) / (2.0 * self.interval_s);
                (at(self.voltage, n) - r * at(self.current, n) - l * slope) / speed
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::context::Context;
    use crate::identify::{Settings as Identification, identify};
    use crate::model::Kind;
    use crate::rig::Setup;

    fn a_model() -> Model {
        let recording = Setup::new(Kind::PmDc).seconds(4.0).seed(1).run().unwrap().recording;
        identify(&[recording], &Identification::new(Kind::PmDc), &Context::quiet()).unwrap().model
    }

    #[test]
    fn the_flux_of_a_magnet_is_its_constant() {
        let mut model = a_model();
        for (parameter, value) in [(BaseParameter::R, 2.0), (BaseParameter::L, 0.01)] {
            if let Some(p) = model.base_parameter_mut(parameter) {
                p.value = value;
            }
        }
        // u = R i + L di/dt + K ω with a current of 3 A at 5 Hz, and K = 0.05 V s.
        let (interval_s, count, k) = (1e-3, 2000, 0.05);
        let t = |n: usize| n as f64 * interval_s;
        let current = |n: usize| 3.0 * (TAU * 5.0 * t(n)).sin();
        let slope = |n: usize| 3.0 * TAU * 5.0 * (TAU * 5.0 * t(n)).cos();
        let speed = |n: usize| if n < 100 { 1.0 } else { 100.0 + 50.0 * t(n) };
        let all = |of: &dyn Fn(usize) -> f64| (0..count).map(|n| of(n) as f32).collect::<Vec<f32>>();
        let [u, i, w] =
            [&|n| 2.0 * current(n) + 0.01 * slope(n) + k * speed(n), &current as &dyn Fn(usize) -> f64, &speed]
                .map(all);
        let flux = Run { voltage: &u, current: &i, speed: &w, interval_s }.flux(&model);
        assert!(flux[..100].iter().all(|x| x.is_nan()), "nothing is divided by next to nothing");
        // The difference quotient misses (2π 5 Hz 1 ms)²/6 of the slope, a six-thousandth of at most 0.94 V.
        assert!(flux[101..count - 1].iter().all(|x| (x - k).abs() < 1e-5));
    }

    #[test]
    fn a_direct_voltage_passes_and_a_gap_stays_one() {
        let model = a_model();
        let mut u = vec![5.0f32; 1000];
        u[400] = f32::NAN;
        let out = filtered(&u, 1e-4, &model).unwrap();
        assert!(out[400].is_nan() && out.iter().filter(|x| x.is_nan()).count() == 1);
        // Single precision.
        assert!(out.iter().filter(|x| x.is_finite()).all(|x| (x - 5.0).abs() < 1e-4));
    }
}
