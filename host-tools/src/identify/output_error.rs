//! Output-error refinement: the free-run simulation against the measurement, all recordings jointly.
//!
//! The residuals are modelled − measured current and speed, both through the Butterworth filter, each divided by a
//! weight per signal ([`mod@super::minimise`] tells which).

use std::array;

use greyrig::butterworth::{AT_REST, Bank, Coefficients};
use greyrig::motor::Stepper;
use greyrig::scalar::Scalar;
use nalgebra::DVector;
use rayon::prelude::*;

use super::minimise::{Fit, Residuals, rms_of};
use super::regression::stride;
use super::space::Space;
use crate::error::{Error, Insufficient, Place, Result};
use crate::experiment::{Experiment, Imposed, Stepped};
use crate::lockstep::{self, LANES, Lanes, Lockstep};

/// Stands for a residual that cannot be computed, so that the optimiser turns back.
const HOPELESS: f64 = 1e6;

/// One signal of one experiment: its measured values at the rows that count.
#[derive(Debug, Clone)]
struct Observation {
    samples: Vec<usize>,
    measured: Vec<f64>,
    is_speed: bool,
}

/// The rows of one experiment: current first, then speed.
#[derive(Debug, Clone)]
pub struct Rows<'a> {
    experiment: &'a Experiment,
    observations: Vec<Observation>,
    substeps: u8,
}

impl<'a> Rows<'a> {
    /// Chooses the rows of an experiment.
    pub fn new(experiment: &'a Experiment, substeps: u8) -> Self {
        let every = stride(experiment);
        let mut observations = Vec::new();
        for (signal, is_speed) in [(&experiment.current, false), (&experiment.speed, true)] {
            let Some(signal) = signal else { continue };
            let filtered = experiment.filtered(signal);
            let samples: Vec<usize> = (0..experiment.len())
                .step_by(every)
                .filter(|n| experiment.counted[*n])
                .filter(|n| if is_speed { !experiment.is_locked(*n) } else { !experiment.is_open(*n) })
                .collect();
            let measured = samples.iter().map(|n| filtered[*n]).collect();
            observations.push(Observation { samples, measured, is_speed });
        }
        Self { experiment, observations, substeps }
    }

    fn len(&self) -> usize {
        self.observations.iter().map(|o| o.samples.len()).sum()
    }

    /// Block of each row: stretches with as much time that rows cover, in which what is masked does not count.
    pub fn blocks(&self, length_s: f64) -> Vec<usize> {
        let moments = self.moments();
        let rows = (length_s / self.row_interval_s()).max(1.0);
        let block = |n: &usize| (moments.partition_point(|m| m < n) as f64 / rows) as usize;
        self.observations.iter().flat_map(|o| &o.samples).map(block).collect()
    }

    /// The samples at which there is a row.
    fn moments(&self) -> Vec<usize> {
        let mut moments: Vec<usize> = self.observations.iter().flat_map(|o| &o.samples).copied().collect();
        moments.sort_unstable();
        moments.dedup();
        moments
    }

    /// Whether each row is of the speed.
    pub fn speed_rows(&self) -> impl Iterator<Item = bool> {
        self.observations.iter().flat_map(|o| std::iter::repeat_n(o.is_speed, o.samples.len()))
    }

    /// Time that rows cover, s.
    pub fn covered_s(&self) -> f64 {
        self.moments().len() as f64 * self.row_interval_s()
    }

    /// Interval between the rows of a signal, s.
    pub fn row_interval_s(&self) -> f64 {
        stride(self.experiment) as f64 * self.experiment.interval_s
    }

    fn measured(&self) -> impl Iterator<Item = (f64, bool)> {
        self.observations.iter().flat_map(|o| o.measured.iter().map(|m| (*m, o.is_speed)))
    }

    /// Modelled signals at the rows.
    fn modelled(&self, space: &Space, theta: &[f64], imposed: Imposed<'_>) -> Vec<f64> {
        let attempt = || {
            let motor = space.motor_at(theta).ok()?;
            let stepper = Stepper::with_substeps(motor, self.experiment.step_s(), self.substeps).ok()?;
            let [modelled] = self.run(stepper, imposed, |x| [x]);
            Some(modelled)
        };
        attempt().unwrap_or_else(|| self.hopeless())
    }

    /// Modelled signals with the speed imposed that the measuring chain would show of the free run.
    fn modelled_at_its_own_speed(&self, space: &Space, theta: &[f64]) -> Vec<f64> {
        let shown = || {
            let motor = space.motor_at(theta).ok()?;
            let mut shown = Vec::with_capacity(self.experiment.len());
            self.experiment
                .run(&motor, self.substeps, Imposed::Nothing, |_, reading| shown.push(reading.speed))
                .ok()?;
            Some(shown)
        };
        let Some(shown) = shown() else { return self.hopeless() };
        self.modelled(space, theta, Imposed::Speed(&shown))
    }

    /// The same at several points that lie close together.
    fn modelled_at_each(&self, space: &Space, thetas: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let together = || {
            let motors = thetas.iter().map(|theta| space.motor_at(theta).ok()).collect::<Option<Vec<_>>>()?;
            let motors = lockstep::as_many_as_lanes(&motors)?;
            let lockstep = Lockstep::build(&motors, self.experiment.step_s(), self.substeps)?;
            let modelled = self.run(lockstep, Imposed::Nothing, |lanes: Lanes| lanes.0);
            Some(modelled.into_iter().take(thetas.len()).collect())
        };
        let alone = || thetas.iter().map(|theta| self.modelled(space, theta, Imposed::Nothing)).collect();
        together().unwrap_or_else(alone)
    }

    /// The rows of what `each` makes motors of.
    fn run<S: Scalar<Base = S>, const MOTORS: usize>(
        &self,
        stepper: impl Stepped<S>,
        imposed: Imposed<'_>,
        each: impl Fn(S) -> [f64; MOTORS],
    ) -> [Vec<f64>; MOTORS] {
        let coefficients = self.experiment.coefficients::<f64>();
        let mut filters = [Bank::<f64, MOTORS>::default(), Bank::default()];
        let mut outputs: Vec<Vec<[f64; MOTORS]>> =
            self.observations.iter().map(|o| Vec::with_capacity(o.samples.len())).collect();
        self.experiment.step_through(stepper, imposed, |n, state| {
            let signals = [each(state.current), each(state.speed)];
            if n == 0 {
                filters[0].reset_to(signals[0]);
                filters[1].reset_to(signals[1]);
            }
            let mut filtered = |k: usize| filter(&mut filters[k], &coefficients, signals[k]);
            let filtered = [filtered(0), filtered(1)];
            for (o, output) in self.observations.iter().zip(&mut outputs) {
                if o.samples.get(output.len()) == Some(&n) {
                    output.push(filtered[usize::from(o.is_speed)]);
                }
            }
        });
        array::from_fn(|k| {
            let rows: Vec<f64> = outputs.iter().flatten().map(|row| row[k]).collect();
            if rows.iter().all(|x| x.is_finite()) { rows } else { self.hopeless() }
        })
    }

    fn hopeless(&self) -> Vec<f64> {
        vec![HOPELESS; self.len()]
    }

    fn off(&self, modelled: &[f64]) -> Vec<f64> {
        modelled.iter().zip(self.measured()).map(|(model, (measured, _))| model - measured).collect()
    }
}

/// The next output of a filter, which comes to rest some time after its input, as the current does where the supply is
/// opened.
#[inline(always)]
fn filter<const MOTORS: usize>(
    bank: &mut Bank<f64, MOTORS>,
    coefficients: &Coefficients<f64>,
    signal: [f64; MOTORS],
) -> [f64; MOTORS] {
    let (_, filtered) = bank.process(coefficients, signal);
    if signal == [0.0; MOTORS] && filtered != signal && filtered.iter().all(|x| x.abs() < AT_REST) {
        bank.reset_to(signal);
    }
    filtered
}

/// The free-run simulation against the measurement, all recordings jointly.
#[derive(Debug, Clone)]
pub struct OutputError<'a> {
    rows: Vec<Rows<'a>>,
    groups: Vec<u8>,
    sizes: [f64; 2],
}

impl<'a> OutputError<'a> {
    /// Chooses the rows of all recordings.
    ///
    /// # Errors
    /// Data without a single usable row.
    pub fn new(rows: Vec<Rows<'a>>) -> Result<Self> {
        let groups: Vec<u8> = rows.iter().flat_map(Rows::speed_rows).map(u8::from).collect();
        if groups.is_empty() {
            let place = rows.first().map_or_else(Place::default, |rows| rows.experiment.place());
            return Err(Error::insufficient(place, Insufficient::NoUsableSample));
        }
        let measured = DVector::from_iterator(groups.len(), rows.iter().flat_map(Rows::measured).map(|(m, _)| m));
        let sizes = rms_of(&measured, &groups).map(|rms| if rms > 0.0 { rms } else { 1.0 });
        Ok(Self { rows, groups, sizes })
    }

    /// Recording and time, s, of each row.
    pub fn times(&self) -> Vec<(usize, f64)> {
        let of = |(recording, rows): (usize, &Rows<'a>)| {
            let interval_s = rows.experiment.interval_s;
            let samples = rows.observations.iter().flat_map(|o| o.samples.iter().copied());
            samples.map(move |n| (recording, n as f64 * interval_s)).collect::<Vec<_>>()
        };
        self.rows.iter().enumerate().flat_map(of).collect()
    }

    /// What the error of the speed makes of the rows at a fit, A and rad/s: the model at the speed that its measuring
    /// chain shows of the free run less the model at the measured one.
    pub fn through_the_speed(&self, fit: &Fit) -> DVector<f64> {
        let theta = fit.space.coordinates();
        let made = |rows: &Rows<'_>| -> Vec<f64> {
            let measured = rows.experiment.speed_itself();
            let measured = measured.as_deref().map_or(Imposed::Nothing, Imposed::Speed);
            let (own, measured) = rayon::join(
                || rows.modelled_at_its_own_speed(&fit.space, &theta),
                || rows.modelled(&fit.space, &theta, measured),
            );
            own.into_iter().zip(measured).map(|(own, measured)| own - measured).collect()
        };
        DVector::from_vec(self.rows.par_iter().map(made).collect::<Vec<_>>().concat())
    }

    /// The rows of each recording.
    pub fn rows(&self) -> &[Rows<'a>] {
        &self.rows
    }
}

impl Residuals for OutputError<'_> {
    fn at(&self, space: &Space, theta: &[f64]) -> DVector<f64> {
        let off = |rows: &Rows<'_>| rows.off(&rows.modelled(space, theta, Imposed::Nothing));
        DVector::from_vec(self.rows.par_iter().map(off).collect::<Vec<_>>().concat())
    }
    fn at_each(&self, space: &Space, thetas: &[Vec<f64>]) -> Vec<DVector<f64>> {
        let together = |thetas: &[Vec<f64>]| {
            let parts: Vec<Vec<Vec<f64>>> =
                self.rows.par_iter().map(|rows| rows.modelled_at_each(space, thetas)).collect();
            let off = |k: usize| self.rows.iter().zip(&parts).flat_map(move |(rows, part)| rows.off(&part[k]));
            (0..thetas.len()).map(|k| DVector::from_vec(off(k).collect())).collect::<Vec<_>>()
        };
        thetas.par_chunks(LANES).flat_map_iter(together).collect()
    }
    fn groups(&self) -> &[u8] {
        &self.groups
    }
    fn sizes(&self) -> [f64; 2] {
        self.sizes
    }
}

#[cfg(test)]
mod tests {
    use greyrig::butterworth::Settings;
    use greyrig::effects::EffectId;
    use greyrig::motor::BaseParameter;

    use super::*;
    use crate::identify::minimise::as_it_is;
    use crate::identify::space::Key;
    use crate::model::{Base, Filter, Kind};
    use crate::rig::Setup;

    #[test]
    fn a_lag_that_the_model_knows_is_no_error_of_the_speed() {
        let setup = Setup::new(Kind::PmDc).ideal().profile("dc-steps").unwrap().seconds(4.0);
        let setup = setup.effect("speed_lag=15e-3").unwrap();
        let experiment = Experiment::new(&setup.run().unwrap().recording, &Filter::default()).unwrap();
        let problem = OutputError::new(vec![Rows::new(&experiment, 1)]).unwrap();
        let through_the_speed = |lag: f64| {
            let mut space = Space::new(Kind::PmDc, Base::Full, &[EffectId::SpeedLag]);
            let m = setup.motor;
            for (parameter, value) in BaseParameter::ALL.into_iter().zip([m.r, m.l, m.k, m.j, m.mu0, m.mu1]) {
                space.start(parameter, value);
            }
            space.start(Key::size_of(EffectId::SpeedLag), lag);
            let made = problem.through_the_speed(&as_it_is(&space, &problem));
            rms_of(&made, problem.groups())[0] / problem.sizes()[0]
        };
        // K Δω/R with a speed that is 15 ms late is most of a run-up's current; the rig's integrator is not the
        // model's.
        let [known, unknown] = [15e-3, 0.0].map(through_the_speed);
        assert!(known < 0.01 && unknown > 0.3, "{known} {unknown}");
    }

    #[test]
    fn a_filter_comes_to_rest_with_the_bits_that_it_has_without() {
        let coefficients = Settings::default().build().unwrap();
        let (mut bank, mut plain) = (Bank::<f64, 2>::default(), Bank::<f64, 2>::default());
        let current = |n: usize| if n < 100 { [3.0, -0.2] } else { [0.0; 2] };
        let mut rests = false;
        for n in 0..20_000 {
            let (filtered, (_, expected)) =
                (filter(&mut bank, &coefficients, current(n)), plain.process(&coefficients, current(n)));
            rests |= expected.iter().all(|x| x.abs() < AT_REST);
            if rests {
                assert!(n > 100 && !filtered.iter().any(|x| x.is_subnormal()), "{n}: {filtered:?}");
            } else {
                assert_eq!(filtered, expected, "{n}");
            }
        }
        assert_eq!(bank, Bank::default());
    }
}
