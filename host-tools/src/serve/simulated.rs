//! A recording and a model's free run over it, as curves.

use super::pyramid::{Curve, Pyramid};
use crate::compare::regions::mains_phase;
use crate::compare::{Signal, compare};
use crate::context::Context;
use crate::error::Result;
use crate::model::Model;
use crate::recording::{Channel, Recording};

/// Of a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// As recorded.
    Raw,
    /// As compared: filtered.
    Measured,
    /// The model's free run.
    Modelled,
    /// Modelled − measured.
    Residual,
}

/// Measured, modelled and residual of one signal.
pub struct Compared {
    measured: Curve,
    modelled: Curve,
    residual: Curve,
}

impl Compared {
    /// One of them.
    pub fn curve(&self, kind: Kind) -> &Curve {
        match kind {
            Kind::Raw | Kind::Measured => &self.measured,
            Kind::Modelled => &self.modelled,
            Kind::Residual => &self.residual,
        }
    }
}

/// A model's free run over a recording.
pub struct Simulated {
    /// Current, speed and torque, where there are.
    signals: [Option<Compared>; 3],
    /// Voltage, V.
    pub voltage: Vec<f32>,
    /// Phase of the mains, degrees; NaN where there is none.
    pub phase: Vec<f32>,
    /// Samples that count.
    pub counted: Vec<bool>,
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Sampling interval, s.
    pub step_s: f64,
}

impl Simulated {
    /// Of a recording; what its gaps hold is NaN.
    ///
    /// # Errors
    /// A recording that the model cannot be run on; an interrupt.
    pub fn new(model: &Model, recording: &Recording, ctx: &Context) -> Result<Self> {
        let comparison = compare(model, std::slice::from_ref(recording), ctx)?;
        let (start_s, step_s) = (recording.start_s(), recording.sample_time_s());
        let placed = |t: &crate::compare::Traces| ((t.start_s - start_s) / step_s).round().max(0.0) as usize;
        let parts: Vec<_> = comparison.per_recording.iter().map(|part| (placed(&part.traces), &part.traces)).collect();
        let length = parts.iter().map(|(at, t)| at + t.counted.len()).max().unwrap_or(0);
        let joined = |of: &dyn Fn(usize, usize) -> Option<f64>| {
            let mut all = vec![f32::NAN; length];
            for (k, (at, t)) in parts.iter().enumerate() {
                for n in 0..t.counted.len() {
                    all[at + n] = of(k, n).map_or(f32::NAN, |x| x as f32);
                }
            }
            all
        };
        let curve = |samples| Curve { start_s, step_s, pyramid: Pyramid::new(samples) };
        let signal = |signal: Signal| {
            parts.iter().any(|(_, t)| !t.signal(signal)[0].is_empty()).then(|| {
                let of =
                    |which: usize| move |t: &crate::compare::Traces, n: usize| t.signal(signal)[which].get(n).copied();
                let (measured, modelled) = (of(0), of(1));
                Compared {
                    measured: curve(joined(&|k, n| measured(parts[k].1, n))),
                    modelled: curve(joined(&|k, n| modelled(parts[k].1, n))),
                    residual: curve(joined(&|k, n| Some(modelled(parts[k].1, n)? - measured(parts[k].1, n)?))),
                }
            })
        };
        let phases: Vec<Vec<f64>> = parts.iter().map(|(_, t)| mains_phase(t)).collect();
        let mut counted = vec![false; length];
        for (at, t) in &parts {
            counted[*at..at + t.counted.len()].copy_from_slice(&t.counted);
        }
        Ok(Self {
            signals: [signal(Signal::Current), signal(Signal::Speed), signal(Signal::Torque)],
            voltage: joined(&|k, n| parts[k].1.voltage.get(n).copied()),
            phase: joined(&|k, n| phases[k].get(n).copied()),
            counted,
            start_s,
            step_s,
        })
    }

    /// A signal.
    pub fn signal(&self, signal: Signal) -> Option<&Compared> {
        self.signals[match signal {
            Signal::Current => 0,
            Signal::Speed => 1,
            Signal::Torque => 2,
        }]
        .as_ref()
    }
}

/// A channel as it was recorded.
pub fn raw(recording: &Recording, channel: Channel) -> Option<Curve> {
    let samples = recording.channel(channel)?.iter().map(|x| *x as f32).collect();
    Some(Curve { start_s: recording.start_s(), step_s: recording.sample_time_s(), pyramid: Pyramid::new(samples) })
}
