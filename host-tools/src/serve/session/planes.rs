//! A run in the planes in which a motor's laws are drawn.

use super::Session;
use crate::compare::Signal;
use crate::planes::{Run, filtered};
use crate::recording::Motion;
use crate::serve::api;
use crate::serve::curves::Of;
use crate::serve::error::{Error, Result};
use crate::serve::simulated::Kind;

/// Points of a path that are drawn at most: more would only hide one another.
const MOST: usize = 3000;

impl Session {
    /// Voltage over current, flux over current and torque over speed between two times: measured, and as a version has
    /// them.
    ///
    /// # Errors
    /// No such recording or version; one without voltage, current or speed.
    pub fn planes(&self, recording: u32, version: u32, range_s: [f64; 2]) -> Result<Vec<api::LawPlane>> {
        let model = self.state().version(version)?.model.clone();
        let run = self.simulated(Of::Version(version), recording)?;
        let [current, speed] = [Signal::Current, Signal::Speed].map(|signal| run.signal(signal).ok_or(Error::NoSignal));
        let (current, speed) = (current?, speed?);
        let voltage = filtered(&run.voltage, run.step_s, &model).ok_or(Error::NoSignal)?;
        if voltage.is_empty() {
            return Err(Error::NoSignal);
        }
        let place = |t: f64| (((t - run.start_s) / run.step_s).round().max(0.0) as usize).min(voltage.len());
        let (from, to) = (place(range_s[0]), place(range_s[1]));
        let each = (to.saturating_sub(from) / MOST).max(1);
        let mut planes =
            ["voltage over current", "flux over current", "torque over speed"].map(|name| (name, Vec::new()));
        for (name, kind) in [("measured", Kind::Measured), ("model", Kind::Modelled)] {
            let (i, w) = (current.curve(kind).pyramid.samples(), speed.curve(kind).pyramid.samples());
            let flux = Run { voltage: &voltage, current: i, speed: w, interval_s: run.step_s }.flux(&model);
            let locus = |point: &dyn Fn(usize) -> [f64; 2]| {
                let counts = |n: &usize| run.counted[*n];
                let points = (from..to.min(flux.len())).step_by(each).filter(counts).map(point);
                let (x, y) = points.filter(|p| p.iter().all(|x| x.is_finite())).map(|[x, y]| (x, y)).unzip();
                api::Locus { name: name.to_owned(), x, y }
            };
            let (i, w) = (|n: usize| f64::from(i[n]), |n: usize| f64::from(w[n]));
            planes[0].1.push(locus(&|n| [i(n), f64::from(voltage[n])]));
            planes[1].1.push(locus(&|n| [i(n), flux[n]]));
            planes[2].1.push(locus(&|n| [w(n), flux[n] * i(n)]));
        }
        let units = match model.motion {
            Motion::Rotary => [["A", "V"], ["A", "V s"], ["rad/s", "N m"]],
            Motion::Linear => [["A", "V"], ["A", "V s/m"], ["m/s", "N"]],
        };
        let told = |((name, loci), [x, y]): ((&str, Vec<api::Locus>), [&str; 2])| api::LawPlane {
            name: name.to_owned(),
            x_unit: x.to_owned(),
            y_unit: y.to_owned(),
            loci,
        };
        Ok(planes.into_iter().zip(units).map(told).collect())
    }
}
