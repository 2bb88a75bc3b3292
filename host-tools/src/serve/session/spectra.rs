//! Signals by frequency, by order of the rotor, and residuals by lag.

use std::sync::Arc;

use super::Session;
use crate::compare::Signal;
use crate::recording::Channel;
use crate::serve::api;
use crate::serve::curves::Of;
use crate::serve::error::{Error, Result};
use crate::serve::pyramid::Curve;
use crate::serve::simulated::{self, Kind, Simulated};
use crate::spectra::{at_angles, correlation, density};

/// Lags of a residual that are shown, at twice the cut-off of the comparison's filter: a tenth of a second at 250 Hz.
const LAGS: i32 = 50;

/// Over what a spectrum is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// Frequency.
    Frequency,
    /// Orders of the rotor.
    Order,
}

impl Curve {
    /// Its samples between two times.
    fn between(&self, [from_s, to_s]: [f64; 2]) -> &[f32] {
        let all = self.pyramid.samples();
        let place = |t: f64| (((t - self.start_s) / self.step_s).round().max(0.0) as usize).min(all.len());
        &all[place(from_s)..place(to_s).max(place(from_s))]
    }
}

impl Session {
    /// A channel as recorded.
    ///
    /// # Errors
    /// No such recording or channel.
    pub(super) fn raw(&self, recording: u32, channel: Channel) -> Result<Arc<Curve>> {
        let read = self.state().recordings.entry(recording).and_then(|e| e.read.clone().ok());
        let read = read.ok_or(Error::NoRecordingAt(recording))?;
        self.curves.raw(recording, channel, || simulated::raw(&read, channel)).ok_or(Error::NoSignal)
    }

    /// A signal between two times by frequency or by order: as recorded, or of a model.
    ///
    /// # Errors
    /// No such recording, version or signal; a stretch that is too short, or in which the rotor does not turn.
    pub fn spectrum(
        &self,
        recording: u32,
        channel: Channel,
        curve: Kind,
        of: Option<Of>,
        over: Over,
        range_s: [f64; 2],
    ) -> Result<api::Spectrum> {
        let (values, modelled) = match of.filter(|_| curve != Kind::Raw) {
            None => (self.raw(recording, channel)?.between(range_s).to_vec(), None),
            Some(of) => {
                let run = self.simulated(of, recording)?;
                let signal = signal(channel).and_then(|signal| run.signal(signal)).ok_or(Error::NoSignal)?;
                (signal.curve(curve).between(range_s).to_vec(), Some(run))
            }
        };
        let interval_s = self.raw(recording, Channel::Current).or_else(|_| self.raw(recording, channel))?.step_s;
        let (values, rate) = match over {
            Over::Frequency => (values, 1.0 / interval_s),
            Over::Order => {
                let speed = self.speed(recording, modelled.as_deref())?;
                at_angles(&values, speed.between(range_s), interval_s).ok_or(Error::NeverTurns)?
            }
        };
        let d = density(&values, rate).ok_or(Error::TooShort)?;
        let amplitude = d.power.iter().map(|p| p.sqrt()).collect();
        Ok(api::Spectrum { step: d.step, parts: u32::try_from(d.parts).unwrap_or(u32::MAX), amplitude })
    }

    /// The measured speed: as recorded, or what the comparison makes of the angle.
    fn speed(&self, recording: u32, run: Option<&Simulated>) -> Result<Arc<Curve>> {
        let compared = || Some(Arc::new(run?.signal(Signal::Speed)?.curve(Kind::Measured).clone()));
        self.raw(recording, Channel::Speed).or_else(|_| compared().ok_or(Error::NoSignal))
    }

    /// What a version's residual between two times has to do with its past and with the voltage.
    ///
    /// # Errors
    /// No such recording, version or signal; a residual that is nothing, or a stretch that is too short.
    pub fn correlations(
        &self,
        recording: u32,
        channel: Channel,
        version: u32,
        range_s: [f64; 2],
    ) -> Result<api::Correlations> {
        let cutoff_hz = self.state().version(version)?.model.filter.cutoff_hz;
        let run = self.simulated(Of::Version(version), recording)?;
        let residual = signal(channel).and_then(|signal| run.signal(signal)).ok_or(Error::NoSignal)?;
        let residual = residual.curve(Kind::Residual);
        let (e, step_s) = correlation::at_the_cutoff(residual.between(range_s), residual.step_s, cutoff_hz);
        let told = |c: correlation::Correlation| api::Correlation {
            first_s: f64::from(c.first) * step_s,
            step_s,
            values: c.values,
            bound: c.bound,
        };
        let own = correlation::of_residual(&e, LAGS).map(told).ok_or(Error::TooShort)?;
        let input = self.raw(recording, Channel::Voltage).ok().and_then(|voltage| {
            let (u, _) = correlation::at_the_cutoff(voltage.between(range_s), voltage.step_s, cutoff_hz);
            correlation::with_input(&e, &u, LAGS).map(told)
        });
        Ok(api::Correlations { own, input })
    }
}

/// What is compared of a channel.
pub(super) const fn signal(channel: Channel) -> Option<Signal> {
    match channel {
        Channel::Current => Some(Signal::Current),
        Channel::Speed => Some(Signal::Speed),
        Channel::Torque => Some(Signal::Torque),
        Channel::Voltage | Channel::Angle => None,
    }
}
