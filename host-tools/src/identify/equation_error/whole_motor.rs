//! Voltage, current and speed: both balances.

use std::borrow::Cow;

use greyrig::effects::{Acts, Effect, Passed};
use greyrig::motor::{Gradient, Motor, OperatingPoint, Slopes, State};
use greyrig::scalar::Scalar;

use super::Balance;
use super::balance_rows::{Impulse, VoltageRows, simpson};
use super::signals::{Signals, View};
use crate::edges::Edge;
use crate::experiment::Experiment;
use crate::filtering::directions;
use crate::identify::regression::stride;
use crate::lockstep::{self, Lanes};
use crate::noise::white_noise;

/// Windows of the weak form are at least this long on mains, s.
const WINDOW_S: f64 = 0.1;
/// And this long without.
const WINDOW_WITHOUT_MAINS_S: f64 = 0.02;

/// Reversals of the current by less than this many standard deviations of its noise are noise.
const NOISE_REVERSAL: f64 = 8.0;
/// Share of the largest current up to which such reversals are narrow beside loops of hysteresis, which are usually
/// three per cent of it wide.
const NARROW: f64 = 0.012;
/// A direct current is averaged over this on either side at most to make them so, s: less than its usual time constant
/// L/R.
const LONGEST_AVERAGE_S: f64 = 2e-3;

/// Samples at which the balances are formed at once: of a motor, and of several as one, whose numbers are vectors
/// already.
const BLOCK: usize = 32;
const BLOCK_OF_LANES: usize = 8;

/// What a model leaves for inductance and inertia at each sample of a recording.
#[derive(Debug, Clone, Default)]
pub struct Left {
    /// `u − R i − K φ ω − v`, V: what should be L di/dt.
    pub voltage: Vec<f64>,
    /// Incremental inductance, H.
    pub inductance: Vec<f64>,
    /// `K φ i − friction`, N m: what should be J dω/dt.
    pub torque: Vec<f64>,
    /// J, kg m².
    pub inertia: f64,
}

/// Voltage, current and speed.
#[derive(Debug)]
pub struct WholeMotor<'a> {
    experiment: &'a Experiment,
    view: View,
    measured: Signals,
    directions: Vec<f64>,
    /// Samples at which the filtered voltage balance is looked at.
    samples: Vec<usize>,
}

impl<'a> WholeMotor<'a> {
    /// Prepares a recording; `None` where it lacks a channel.
    pub fn new(e: &'a Experiment) -> Option<Self> {
        let current = e.current.as_deref()?;
        // Without a supply there is no current, whatever the sensor shows.
        let current: Vec<f64> = current.iter().enumerate().map(|(n, i)| if e.is_open(n) { 0.0 } else { *i }).collect();
        let speed = e.speed_itself().map_or_else(|| vec![0.0; current.len()], |speed| speed.into_owned());
        if e.speed.is_none() && !e.is_locked(0) {
            return None;
        }
        let directions = directions(&speed);
        let shortest = e.mains_period_s.map_or(WINDOW_WITHOUT_MAINS_S, |period| (WINDOW_S / period).ceil() * period);
        let window = ((shortest / e.interval_s).round() as usize).max(2);
        let period = e.mains_period_s.map_or(window / 2, |period| (period / e.interval_s).round() as usize).max(2);
        let is_told = e.counted_where_told();
        let mut windows = Vec::new();
        let mut from = period;
        while e.speed.is_some() && from + window + period < current.len() {
            let to = from + window;
            let counted = || (from..=to + period / 2).all(|n| is_told[n]);
            // Through standstill, which can lie between two samples, dry friction jumps.
            let turns_one_way = || {
                let direction = |n: usize| if e.is_locked(n) { 0.0 } else { directions[n] };
                let mut around = from - period / 2..=to + period / 2;
                direction(from) != 0.0 && around.all(|n| direction(n) == direction(from))
            };
            if counted() && turns_one_way() {
                windows.push((from, to));
            }
            from = to;
        }
        let noise = NOISE_REVERSAL * white_noise(&current).unwrap_or(0.0);
        let averaged_beside = averaged_beside(e, &current, noise);
        let least_reversal = noise / (2.0 * averaged_beside as f64).max(1.0).sqrt();
        let view = View { interval_s: e.interval_s, averaged_beside, least_reversal, windows, period };
        let counted = e.counted_in_balances();
        Some(Self {
            experiment: e,
            measured: view.of(current, speed),
            view,
            directions,
            samples: (0..e.len()).step_by(stride(e)).filter(|n| counted[*n]).collect(),
        })
    }

    /// Group and samples of the rows.
    pub fn rows(&self) -> [(u8, Vec<usize>); 2] {
        [(0, self.samples.clone()), (1, self.view.windows.iter().map(|(from, _)| *from).collect())]
    }

    /// What the rows are compared with: the voltage, and the change of speed (of unknown inertia, so of a typical one).
    pub fn signals(&self) -> Vec<f64> {
        let voltage = self.experiment.filtered(&self.experiment.input);
        let mut all: Vec<f64> = self.samples.iter().map(|n| voltage[*n]).collect();
        all.extend(self.view.windows.iter().map(|_| 1.0));
        all
    }

    /// What both balances leave over.
    pub fn residuals(&self, motor: &Motor<f64>) -> Vec<f64> {
        self.left_over::<_, BLOCK>(motor, &self.before(&chain_of(motor)))
    }

    /// What a motor leaves for its inductance and its inertia, sample by sample.
    pub fn left(&self, motor: &Motor<f64>) -> Left {
        let signals = self.before(&chain_of(motor));
        let inertia = motor.parameters().inertia;
        let mut left = Left { inertia, ..Left::default() };
        self.each_slopes::<_, BLOCK>(motor, [&signals.current, &signals.speed, &signals.turning], |slopes| {
            left.voltage.extend(slopes.iter().map(|s| s.inductance * s.current));
            left.inductance.extend(slopes.iter().map(|s| s.inductance));
            left.torque.extend(slopes.iter().map(|s| inertia * s.speed));
        });
        left
    }

    /// Current, A, and speed, rad/s, before the measuring chain of a motor.
    pub fn at_the_motor(&self, motor: &Motor<f64>) -> [Vec<f64>; 2] {
        let signals = self.before(&chain_of(motor)).into_owned();
        [signals.current, signals.speed]
    }

    /// The same of several motors that hardly differ and share their measuring chain.
    pub fn residuals_of_each(&self, motors: &[&Motor<f64>]) -> Vec<Vec<f64>> {
        let chain = motors.first().map_or_else(Vec::new, |motor| chain_of(motor));
        let signals = self.before(&chain);
        let together = || {
            let lanes = lockstep::as_many_as_lanes(motors)?;
            let rows =
                lockstep::in_agreement(&lanes, |motor| self.left_over::<Lanes, BLOCK_OF_LANES>(motor, &signals))?;
            Some((0..motors.len()).map(|k| rows.iter().map(|lanes| lanes.0[k]).collect()).collect())
        };
        let one_by_one = || motors.iter().map(|motor| self.left_over::<_, BLOCK>(motor, &signals)).collect();
        together().unwrap_or_else(one_by_one)
    }

    /// The signals as they were before a measuring chain.
    fn before(&self, chain: &[Effect<f64>]) -> Cow<'_, Signals> {
        if chain.is_empty() { Cow::Borrowed(&self.measured) } else { Cow::Owned(self.undone(chain)) }
    }

    /// What both balances leave over at signals before the measuring chain.
    fn left_over<S: Scalar<Base = S>, const BLOCK: usize>(&self, motor: &Motor<S>, signals: &Signals) -> Vec<S> {
        let Signals { current, speed, current_rate, turning, speed_changes } = signals;
        let e = self.experiment;
        let inertia = motor.parameters().inertia;
        let mut voltage = {
            let too_much = self.around_edges(motor, current, speed);
            VoltageRows::new(current_rate, too_much, e.coefficients(), &self.samples)
        };
        let mut impulse = (!self.view.windows.is_empty()).then(|| {
            let lacking = self.lacking_at_edges(motor, current, speed);
            Impulse::new(e.len(), S::constant(e.interval_s), lacking)
        });
        self.each_slopes::<S, BLOCK>(motor, [current, speed, turning], |slopes| {
            for slopes in slopes {
                voltage.take(slopes.inductance, slopes.current);
            }
            if let Some(impulse) = &mut impulse {
                for slopes in slopes {
                    impulse.take(inertia * slopes.speed);
                }
            }
        });
        let mut rows = voltage.finish();
        if let Some(impulse) = impulse {
            let impulses = self.view.changes_of(&impulse.mean_over(self.view.period));
            rows.extend(impulses.iter().zip(speed_changes).map(|(impulse, x)| *impulse - inertia * S::constant(*x)));
        }
        rows
    }

    /// What the voltage balance leaves too much, V, at the samples around an edge of the voltage: Simpson's rule takes
    /// what is smooth, and there neither the voltage nor what goes with the current is.
    fn around_edges<S: Scalar<Base = S>>(&self, motor: &Motor<S>, current: &[f64], speed: &[f64]) -> Vec<(usize, S)> {
        let e = self.experiment;
        let too_much = |(n, [voltage, mean]): (usize, [f64; 2])| {
            let smooth = |signal: &[f64]| simpson(signal[n - 1], signal[n], signal[n + 1]);
            let [drop, _] = self.by_current(motor, current, speed, n - 1);
            (n, S::constant(voltage - smooth(&e.input)) - drop * S::constant(mean - smooth(current)))
        };
        e.means_around_edges(current).map(too_much).collect()
    }

    /// What the trapezium rule lacks of the torque's integral, N m s, from each edge of the voltage on.
    fn lacking_at_edges<S: Scalar<Base = S>>(
        &self,
        motor: &Motor<S>,
        current: &[f64],
        speed: &[f64],
    ) -> Vec<(usize, S)> {
        let e = self.experiment;
        let mut lacking = S::ZERO;
        let up_to = |edge: &Edge| {
            let [_, torque] = self.by_current(motor, current, speed, edge.n - 1);
            lacking += torque * S::constant(edge.charge) * S::constant(e.interval_s);
            (edge.n, lacking)
        };
        e.edges.iter().filter(|edge| edge.charge != 0.0).map(up_to).collect()
    }

    /// What a further ampere changes at a sample: voltage that the inductance lacks, V/A, and torque, N m/A.
    fn by_current<S: Scalar<Base = S>>(&self, motor: &Motor<S>, current: &[f64], speed: &[f64], n: usize) -> [S; 2] {
        let state = State { current: S::constant(current[n]), speed: S::constant(speed[n]) };
        let at = OperatingPoint {
            current: Gradient::current(state.current),
            speed: Gradient::speed(state.speed),
            voltage: Gradient::lift(S::constant(self.experiment.input[n])),
        };
        let slopes = motor.slopes(&at, Some(S::constant(self.directions[n])), &motor.memories_at_start(state));
        [-slopes.inductance.value * slopes.current.by_current, motor.parameters().inertia * slopes.speed.by_current]
    }

    /// Tells the slopes at the samples, in their order and a block at a time, from current, speed and current without
    /// small reversals as they were before the measuring chain.
    fn each_slopes<S: Scalar<Base = S>, const BLOCK: usize>(
        &self,
        motor: &Motor<S>,
        [current, speed, turning]: [&[f64]; 3],
        mut take: impl FnMut(&[Slopes<S>]),
    ) {
        let e = self.experiment;
        let at_terminals = if e.open.contains(&true) { at_open_terminals(motor) } else { None };
        let state = |signal: &[f64], n: usize| State { current: S::constant(signal[n]), speed: S::constant(speed[n]) };
        let at = |n: usize| {
            let State { current, speed } = state(current, n);
            OperatingPoint { current, speed, voltage: S::constant(e.input[n]) }
        };
        let mut memories = motor.memories_after(state(current, 0), S::constant(e.elapsed_s));
        let mut remembered = memories.map(|memory| [memory; BLOCK]);
        let mut points = [(at(0), S::ZERO); BLOCK];
        let mut balances = [motor.balance(&at(0), &memories); BLOCK];
        let mut slopes = [motor.slopes(&at(0), Some(S::ZERO), &memories); BLOCK];
        for begin in (0..e.len()).step_by(BLOCK) {
            let block = begin..(begin + BLOCK).min(e.len());
            for (n, point) in block.clone().zip(&mut points) {
                *point = (at(n), S::constant(self.directions[n]));
            }
            let step = |k: usize| {
                let n = begin + k;
                (n > 0 && block.contains(&n)).then(|| Passed {
                    interval: S::constant(e.interval_s),
                    before: state(turning, n - 1),
                    after: state(turning, n),
                })
            };
            motor.advance_over_each(step, &mut memories, &mut remembered);
            match &at_terminals {
                Some(at_terminals) if block.clone().any(|n| e.is_open(n)) => {
                    for (k, n) in block.clone().enumerate() {
                        let present = if e.is_open(n) { at_terminals } else { motor };
                        let (at, direction) = &points[k];
                        slopes[k] = present.slopes(at, Some(*direction), &remembered.each_ref().map(|m| m[k]));
                    }
                }
                _ => motor.slopes_at_each(&points, &remembered, &mut balances, &mut slopes),
            }
            take(&slopes[..block.len()]);
        }
    }

    /// The rows of a term of current (A), speed (rad/s) and di/dt (A/s).
    pub fn column(&self, balance: Balance, term: &impl Fn(f64, f64, f64) -> f64) -> Vec<f64> {
        let e = self.experiment;
        let Signals { current, speed, current_rate, .. } = &self.measured;
        let values: Vec<f64> = (0..e.len()).map(|n| term(current[n], speed[n], current_rate[n])).collect();
        match balance {
            Balance::Voltage => {
                let filtered = e.filtered(&means(&values));
                let rows = self.samples.iter().map(|n| filtered[*n]);
                rows.chain(self.view.windows.iter().map(|_| 0.0)).collect()
            }
            Balance::Torque => {
                let mut sums = vec![0.0];
                for pair in values.windows(2) {
                    sums.push(sums[sums.len() - 1] - 0.5 * (pair[0] + pair[1]) * e.interval_s);
                }
                self.samples.iter().map(|_| 0.0).chain(self.view.changes(&sums)).collect()
            }
        }
    }

    /// The signals as they were before a measuring chain.
    fn undone(&self, chain: &[Effect<f64>]) -> Signals {
        let [current, speed] = undone(self.experiment, &self.measured.current, &self.measured.speed, chain);
        self.view.of(current, speed)
    }
}

/// Current, A, and speed, rad/s, as they were before a measuring chain.
pub fn undone(e: &Experiment, current: &[f64], speed: &[f64], chain: &[Effect<f64>]) -> [Vec<f64>; 2] {
    let measured = |n: usize| State { current: current[n], speed: speed[n] };
    let mut memories: Vec<_> = chain.iter().map(|effect| effect.at_start(measured(0), e.elapsed_s)).collect();
    let (mut currents, mut speeds) = (Vec::with_capacity(e.len()), Vec::with_capacity(e.len()));
    for n in 0..e.len() {
        let mut shown = measured(n);
        for (effect, memory) in chain.iter().zip(&mut memories) {
            if n > 0 {
                let passed = Passed { interval: e.interval_s, before: measured(n - 1), after: measured(n) };
                effect.advance(&passed, memory);
            }
            effect.measure(memory, &mut shown);
        }
        // Without a supply there is no current, whatever the chain would make of it.
        currents.push(if e.is_open(n) { 0.0 } else { 2.0 * measured(n).current - shown.current });
        speeds.push(if e.is_locked(n) { 0.0 } else { 2.0 * measured(n).speed - shown.speed });
    }
    [currents, speeds]
}

/// Samples on either side over which a current is averaged before its reversals are looked for, so that those of noise,
/// A, are narrow. A direct one alone: the average would round the peaks of an alternating one, and noise hardly moves
/// these. A mean over 2 n samples has white noise smaller by √(2 n).
fn averaged_beside(e: &Experiment, current: &[f64], noise: f64) -> usize {
    let narrow = NARROW * current.iter().fold(0.0f64, |most, i| most.max(i.abs()));
    if e.mains_period_s.is_some() || noise <= narrow {
        return 0;
    }
    let samples = (noise / narrow).powi(2);
    (samples / 2.0).ceil().min(LONGEST_AVERAGE_S / e.interval_s) as usize
}

/// The effects of a motor's measuring chain.
pub fn chain_of(motor: &Motor<f64>) -> Vec<Effect<f64>> {
    motor.effects().iter().filter(|effect| effect.description().acts == Acts::Measuring).copied().collect()
}

/// A motor as its terminals show it while the supply is open, if that is another one: without the effects of the
/// supply.
fn at_open_terminals<S: Scalar<Base = S>>(motor: &Motor<S>) -> Option<Motor<S>> {
    let of_supply = |effect: &Effect<S>| effect.description().of_supply;
    if !motor.effects().iter().any(of_supply) {
        return None;
    }
    let effects: Vec<Effect<S>> = motor
        .effects()
        .iter()
        .map(|effect| if of_supply(effect) { Effect::new(effect.id(), &[]) } else { *effect })
        .collect();
    Motor::build(*motor.parameters(), &effects).ok()?.with_terms(motor.terms()).ok()
}

/// Mean of a signal over the two intervals around each sample; beyond its ends it stays as it is.
fn means<S: Scalar>(signal: &[S]) -> Vec<S> {
    let ([first, .., last], n) = (signal, signal.len()) else { return signal.to_vec() };
    let mut means = Vec::with_capacity(n);
    means.push(simpson(*first, *first, signal[1]));
    means.extend(signal.windows(3).map(|around| simpson(around[0], around[1], around[2])));
    means.push(simpson(signal[n - 2], *last, *last));
    means
}

#[cfg(test)]
mod tests {
    use greyrig::motor::{FluxLaw, Parameters};

    use super::*;
    use crate::model::Filter;
    use crate::recording::{Channel, Recording};

    const STEP_S: f64 = 2e-4;

    /// A magnet motor without friction.
    fn parameters(resistance: f64, inductance: f64) -> Parameters<f64> {
        Parameters::from_values(FluxLaw::PermanentMagnet, [resistance, inductance, 0.05, 1e-5, 0.0, 0.0, 0.0])
    }

    fn recorded(samples: usize, at: impl Fn(f64) -> [f64; 3], locked: bool) -> Experiment {
        recorded_within(f64::INFINITY, samples, at, locked)
    }

    /// By a current channel that clips.
    fn recorded_within(level: f64, samples: usize, at: impl Fn(f64) -> [f64; 3], locked: bool) -> Experiment {
        let channel = |k: usize| (0..samples).map(|n| at(n as f64 * STEP_S)[k]).collect::<Vec<f64>>();
        let mut recording = Recording::builder(STEP_S)
            .path("closed form")
            .channel(Channel::Voltage, channel(0))
            .channel(Channel::Current, channel(1).iter().map(|i| i.clamp(-level, level)).collect())
            .channel(Channel::Speed, channel(2))
            .rotor_locked(vec![locked; samples])
            .build()
            .unwrap();
        recording.exclude(channel(1).iter().enumerate().filter(|(_, i)| i.abs() >= level).map(|(n, _)| n));
        Experiment::new(&recording, &Filter::default()).unwrap()
    }

    /// What the torque balance leaves over each window, N m s, without its sign.
    fn torques(e: &Experiment, motor: &Motor<f64>) -> Vec<f64> {
        let part = WholeMotor::new(e).unwrap();
        part.residuals(motor)[part.samples.len()..].iter().map(|x| x.abs()).collect()
    }

    #[test]
    fn a_current_that_changes_within_a_few_samples_leaves_nothing() {
        // i = 7 A sin(ωt) with ωh = 1/4, and u = R i + L di/dt.
        let (r, l, omega) = (3.4, 2.72e-3, 0.25 / STEP_S);
        let at = |t: f64| {
            let (i, rate) = (7.0 * (omega * t).sin(), 7.0 * omega * (omega * t).cos());
            [r * i + l * rate, i, 0.0]
        };
        let e = recorded(2000, at, true);
        let motor = Motor::build(parameters(r, l), &[]).unwrap();
        let left = WholeMotor::new(&e).unwrap().residuals(&motor);
        // The first half holds what the one-sided difference at the start leaves in the filter.
        let worst = left[left.len() / 2..].iter().fold(0.0f64, |m, x| m.max(x.abs()));
        // (ωh)⁴/180 of the 23.8 V of the inductance are 0.52 mV; the rate at the sample alone would leave (ωh)²/6, 250
        // mV.
        assert!(worst < 0.6e-3, "{worst} V");
    }

    #[test]
    fn a_supply_that_is_switched_between_samples_leaves_little() {
        // 24 V on a locked rotor, h R/L = 0.2: i = u/R (1 − e^(−t R/L)) from the edge on.
        let (r, l, step, n) = (0.6, 6e-4, 24.0, 1000);
        let motor = Motor::build(parameters(r, l), &[]).unwrap();
        for share in [0.0, 0.3, 0.5, 1.0] {
            let edge_s = (n as f64 - share) * STEP_S;
            let at = |t: f64| {
                // The sample of an edge on it is of the voltage after it; the current is continuous.
                let on = if t > edge_s - 1e-9 && (share < 1.0 || t > edge_s + 1e-9) { step } else { 0.0 };
                [on, step / r * -(-(t - edge_s).max(0.0) * r / l).exp_m1(), 0.0]
            };
            let mut e = recorded(2000, at, true);
            let worst = |e: &Experiment| {
                let left = WholeMotor::new(e).unwrap().residuals(&motor);
                left.iter().fold(0.0f64, |m, x| m.max(x.abs()))
            };
            let without = worst(&e);
            e.edges = vec![Edge::switched(n, share, step, step / l * STEP_S)];
            // What is left of R i is (h R/L)²/24 of the step, 40 mV, before the filter; half an interval of the step is
            // volts.
            assert!(worst(&e) < 0.04, "{share}: {} V, {without} V", worst(&e));
            assert!(share == 0.5 || without > 0.5, "{share}: {without} V");
        }
    }

    #[test]
    fn a_torque_that_jumps_beside_the_end_of_a_window_leaves_nothing() {
        // J dω/dt = K i with a current that jumps by 2 A at the end of a window, in the middle of the mean over its
        // end.
        let motor = Motor::build(parameters(3.4, 1e-4), &[]).unwrap();
        let jump = 0.11;
        let at = |t: f64| {
            let i = if t < jump { 0.1 } else { 2.1 };
            [3.4 * i, i, 0.05 / 1e-5 * (0.1 * t + 2.0 * (t - jump).max(0.0)) + 10.0]
        };
        let e = recorded(2000, at, false);
        let worst = torques(&e, &motor).into_iter().fold(0.0f64, f64::max);
        // The trapezium over the sample of the jump is off by h/2 of it, 0.05 · 2 A · 0.1 ms; the unequal means were by
        // 25 times that.
        assert!(worst < 1.1e-5, "{worst} N m s");
    }

    #[test]
    fn a_window_whose_end_is_averaged_over_what_clips_does_not_count() {
        let motor = Motor::build(parameters(3.4, 1e-4), &[]).unwrap();
        let (begin, end) = (0.111, 0.121);
        let at = |t: f64| {
            let i = if (begin..end).contains(&t) { 2.1 } else { 0.1 };
            [3.4 * i, i, 0.05 / 1e-5 * (0.1 * t + 2.0 * (t.clamp(begin, end) - begin)) + 10.0]
        };
        let e = recorded_within(1.0, 2000, at, false);
        let torques = torques(&e, &motor);
        assert!(torques.len() > 10);
        // Exact but for rounding; a window that ends just before would lack K times 1.1 A for up to 2.5 ms, 1e-4 N m s.
        let worst = torques.iter().fold(0.0f64, |m, x| m.max(*x));
        assert!(worst < 1e-9, "{worst} N m s");
    }
}
