//! A recording as the model meets it: what drives the model, what is observed, what is imposed, which samples count.

use std::borrow::Cow;
use std::path::PathBuf;

use greyrig::butterworth::{self, Cascade, Coefficients};
use greyrig::motor::{Constraints, FluxLaw, Motor, ParameterError, Snapshot, State, Stepper};
use greyrig::scalar::Scalar;

use crate::averaging;
use crate::between::{self, Between, Course};
use crate::counts::Window;
use crate::edges::{self, Edge};
use crate::error::{Error, Place, Result};
use crate::filtering::{FEWEST_SETTLINGS, Filter};
use crate::mains;
use crate::noise;
use crate::recording::{Channel, Recording};
use crate::speed_sensor::{Chain, SpeedSensor};

/// What drives the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drive {
    /// The voltage: the whole motor.
    Voltage,
    /// The measured torque or force: the mechanical side alone. The model takes it as the current of a motor with K =
    /// 1.
    Torque,
}

/// Which signal stands in for its equation, sample by sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Imposed<'a> {
    /// None: free run from the driving signal alone.
    Nothing,
    /// A speed, rad/s: the electrical side alone.
    Speed(&'a [f64]),
    /// A current, A: the mechanical side alone.
    Current(&'a [f64]),
}

/// What can be stepped through a recording.
pub trait Stepped<S> {
    /// Goes on with a run in a state, so long after it began, s.
    fn begin(&mut self, state: State<S>, elapsed: S);
    /// Advances by one interval, during which the voltage goes linearly from `from` to `to` (V).
    fn step(&mut self, from: S, to: S, constraints: Constraints<S>);
    /// Current and speed.
    fn state(&self) -> State<S>;
    /// Current and speed as the measuring chain shows them.
    fn reading(&self) -> State<S>;
    /// Goes on from another state, with what the effects remember.
    fn put(&mut self, state: State<S>);
}

impl<S: Scalar<Base = S>> Stepped<S> for Stepper<S> {
    fn begin(&mut self, state: State<S>, elapsed: S) {
        self.go_on_in(state, elapsed);
    }
    #[inline(always)]
    fn step(&mut self, from: S, to: S, constraints: Constraints<S>) {
        Stepper::step(self, from, to, constraints);
    }
    #[inline(always)]
    fn state(&self) -> State<S> {
        Stepper::state(self)
    }
    #[inline(always)]
    fn reading(&self) -> State<S> {
        Stepper::reading(self)
    }
    fn put(&mut self, state: State<S>) {
        let memories = self.snapshot().memories;
        self.restore(&Snapshot { state, rounding: State::default(), memories });
    }
}

/// Begins a run where the measuring chain shows a state: what it adds to one, such as an offset, is taken off.
fn begin_as_shown<S: Scalar<Base = S>>(stepper: &mut impl Stepped<S>, shown: State<S>, elapsed: S) {
    stepper.begin(shown, elapsed);
    let reading = stepper.reading();
    let off = |shown: S, reading: S| shown + (shown - reading);
    stepper.put(State { current: off(shown.current, reading.current), speed: off(shown.speed, reading.speed) });
}

/// What a measuring chain shows of the speed from sample to sample.
struct Shown<'a, S> {
    window: Option<Window>,
    /// Stretches that lie ahead, from the end of which on their mean is shown.
    stretches: &'a [[usize; 2]],
    is_sampled: bool,
    /// Sum of the means over the intervals since the last value, and their number.
    sum: S,
    intervals: u32,
    speed: S,
    renewed: bool,
}

impl<'a, S: Scalar<Base = S>> Shown<'a, S> {
    fn new(e: &'a Experiment, speed: S) -> Self {
        let (window, stretches) = (e.window, e.stretches.as_slice());
        Self { window, stretches, is_sampled: !e.is_windowed(), sum: S::ZERO, intervals: 0, speed, renewed: true }
    }

    #[inline(always)]
    fn ends_at(&mut self, n: usize) -> bool {
        if let Some(window) = self.window {
            return window.ends_at(n);
        }
        let ends = self.stretches.first().is_some_and(|[_, end]| *end == n);
        if ends {
            self.stretches = &self.stretches[1..];
        }
        ends
    }

    /// What is shown at sample `n`, of what a chain without windows would show, and the mean of the speed since the
    /// sample before.
    #[inline(always)]
    fn at(&mut self, n: usize, reading: State<S>, mean: S) -> State<S> {
        if self.is_sampled {
            return reading;
        }
        if self.stretches.first().is_some_and(|[begin, _]| begin + 1 == n) {
            (self.sum, self.intervals) = (S::ZERO, 0);
        }
        self.sum += mean;
        self.intervals += 1;
        if self.ends_at(n) {
            let mean = self.sum / S::constant(f64::from(self.intervals));
            self.speed = if self.window.is_none_or(|window| window.is_mean) { mean } else { reading.speed };
            (self.sum, self.intervals, self.renewed) = (S::ZERO, 0, true);
        }
        State { speed: self.speed, ..reading }
    }

    /// Whether a value has been shown since this was asked last that had not been before.
    #[inline(always)]
    fn is_renewed(&mut self) -> bool {
        self.is_sampled || std::mem::take(&mut self.renewed)
    }
}

/// A prepared recording.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// The file, as the user named it.
    pub name: String,
    /// Whether it is a part of a recording with gaps, and of which file.
    pub part_of: Option<PathBuf>,
    /// Time from the begin of the run to the first sample, s; of a whole recording none.
    pub elapsed_s: f64,
    /// Sampling interval, s.
    pub interval_s: f64,
    /// What drives the model.
    pub drive: Drive,
    /// The driving signal: V, or N m.
    pub input: Vec<f64>,
    /// Intervals within which the voltage is not straight between its samples, in their order.
    pub edges: Vec<Edge>,
    /// What the voltage does between its samples, where the data were asked ([`between`]); else smooth.
    pub between: Between,
    /// Intervals within which the voltage is switched at an instant of its own, by the sample that they end with, in
    /// their order, and the share of the interval after it.
    pub instants: Vec<(usize, f64)>,
    /// How the speed was measured, where that is told or the values tell it.
    pub sensor: Option<SpeedSensor>,
    /// Windows in which the speed is counted or held.
    pub window: Option<Window>,
    /// Stretches, from sample to sample, whose means a sensor without windows shows from their ends on; empty: no such
    /// sensor.
    pub stretches: Vec<[usize; 2]>,
    /// Equal parts in which the model goes through an interval.
    pieces: usize,
    /// What an ampere by which the prediction over an interval is off is worth in the voltage balance, V, and a radian
    /// per second in the torque balance, N m s: those of one motor while others are fitted. In their own units of
    /// volts and torque a fit would find the motor with the smallest R and J, not the best prediction.
    pub response: [f64; 2],
    /// Share of the distance to the measured state that a short run begins nearer to it than the last one has ended:
    /// the gain of an observer. 1: at the measured state, 0: the model runs free.
    pub gain: f64,
    /// Measured current, A.
    pub current: Option<Vec<f64>>,
    /// Measured speed, rad/s. Not there while only a locked rotor was recorded.
    pub speed: Option<Vec<f64>>,
    /// Measured position, rad or m, where the speed was derived from it.
    pub position: Option<Vec<f64>>,
    /// Where the rotor is held; empty: nowhere.
    pub locked: Vec<bool>,
    /// Where the supply is open; empty: nowhere.
    pub open: Vec<bool>,
    /// Samples that count: usable, and the filter has settled since the last one that was not.
    pub counted: Vec<bool>,
    /// State at the first sample.
    pub start: State<f64>,
    /// Period of an AC supply, s.
    pub mains_period_s: Option<f64>,
    /// The filter of the comparison at this recording's rate.
    pub filter: butterworth::Settings,
}

/// Noise of a slowly sampled speed, in standard deviations, within which the first sample is standstill.
const AT_REST: f64 = 4.0;

/// Averaging time for the speed at the first sample, s: a mains period at 50 Hz.
const START_AVERAGE_S: f64 = 0.02;
/// Fewest samples through which a line is laid for that.
const FEWEST_AVERAGED: usize = 4;

/// Rate of the motor times the step of the model, as in the core's choice of sub-steps, and so many of these at most in
/// an interval that is not cut into pieces.
const LARGEST_RATE_STEP: f64 = 0.75;
const MOST_SUBSTEPS: f64 = 16.0;
/// Rate of the motor times the interval from which the current has settled by the next sample: all but e^−8, 0.03 %, of
/// a change of the voltage. Such samples do not tell L, and only those that follow an edge within a step know of the
/// step's error: of 2 it is 3 % of the change at its end, 1 % after another and nothing after two (the method's own
/// response to a unit step).
const SETTLED: f64 = 8.0;
const STEP_WHERE_SETTLED: f64 = 2.0;
/// Angle of the swing of current against speed, h K/√(L J), that a step covers at most: a method of the third order is
/// off by its cube over 24 a radian, 0.3 per mille.
const LARGEST_SWING: f64 = 0.2;
/// Pieces of an interval at most: with more, of L/R below a four-hundredth of the interval, the steps stay stable and
/// the current after an edge settles within the first of them.
const MOST_PIECES: usize = 512;

/// Most by which the speed may change from one timed pulse to the next, as a factor, so that a line between them tells
/// it: of a rotor that runs down exponentially the line is off by (ln 1.5)²/8, 2 %.
const FACTOR_TOLD: f64 = 1.5;

/// Longest sampling interval that is still fine enough for trying models, s.
const COARSE_INTERVAL_S: f64 = 2.5e-4;

impl Experiment {
    /// Prepares a recording for a comparison.
    ///
    /// # Errors
    /// Neither voltage nor torque, nothing to compare with, or too short for the filter to settle.
    pub fn new(recording: &Recording, filter: &Filter) -> Result<Self> {
        let e = Self::driven(recording, filter)?;
        let bad = |what: &str, remedy: &str| Error::input(Place::file(recording.path()), what, remedy);
        if e.speed.is_none() && e.current.is_none() {
            return Err(bad(
                "there is neither a current (i_a) nor a speed (omega_rad_s) to compare the model with",
                "name the column with --map i_a=COLUMN or --map omega_rad_s=COLUMN",
            ));
        }
        let settling = e.filter.settling_samples().unwrap_or(0) as usize;
        if recording.len() < FEWEST_SETTLINGS * settling {
            return Err(bad(
                &format!(
                    "{} samples ({:.3} s) are too few: the filter alone takes {settling} to settle",
                    recording.len(),
                    recording.duration_s()
                ),
                "record longer, or raise the cut-off with --cutoff",
            ));
        }
        Ok(e)
    }

    /// Prepares a recording of which the voltage alone has to be there, of any length: for what the model makes of it.
    ///
    /// # Errors
    /// Neither voltage nor torque, or a sampling rate that the filter does not fit.
    pub fn driven(recording: &Recording, filter: &Filter) -> Result<Self> {
        let name = recording.name();
        let bad = |what: &str, remedy: &str| Error::input(Place::file(recording.path()), what, remedy);
        let interval_s = recording.sample_time_s();
        let aligned = |channel: Channel, key: &str| {
            let signal = recording.channel(channel)?;
            let skew = recording.metadata().get(key).and_then(|s| s.trim().parse::<f64>().ok()).unwrap_or(0.0);
            Some(earlier(signal, skew / interval_s))
        };
        let torque = recording.channel(Channel::Torque);
        let voltage = recording.channel(Channel::Voltage);
        let (drive, input) = match (voltage, torque) {
            (Some(u), None) => (Drive::Voltage, u.to_vec()),
            (Some(u), Some(_)) if recording.channel(Channel::Current).is_some() => (Drive::Voltage, u.to_vec()),
            (_, Some(t)) => (Drive::Torque, t.to_vec()),
            (None, None) => {
                return Err(bad(
                    "there is neither a voltage (u_v) nor a torque (torque_n_m), so nothing drives the model",
                    "record the voltage at the terminals, or name its column with --map u_v=COLUMN",
                ));
            }
        };
        let locked = recording.rotor_locked().to_vec();
        let always_locked = !locked.is_empty() && locked.iter().all(|l| *l);
        let current = match drive {
            Drive::Voltage => aligned(Channel::Current, "skew_i_a_s"),
            Drive::Torque => None,
        };
        let at_hand = recording.channel(Channel::Speed).filter(|_| drive == Drive::Voltage && current.is_some());
        // Of the values as they were read: what is shifted is held no more.
        let Sensed { sensor, window, stretches } = Sensed::of(SpeedSensor::told(recording)?, at_hand, interval_s);
        let several = window.map_or(!stretches.is_empty(), |window| window.samples > 1);
        let speed = if always_locked {
            None
        } else if several {
            at_hand.map(<[f64]>::to_vec)
        } else {
            aligned(Channel::Speed, "skew_omega_rad_s_s")
                .or_else(|| recording.channel(Channel::Angle).map(|angle| derivative(angle, interval_s)))
        };
        let settings = filter.at(interval_s);
        let settling = settings
            .settling_samples()
            .map_err(|e| bad(&format!("the filter does not fit this sampling rate: {e}"), "choose another --cutoff"))?
            as usize;
        let start = start_state(&speed, &current, &locked, interval_s);
        Ok(Self {
            mains_period_s: (drive == Drive::Voltage).then(|| mains::period_s(&input, interval_s)).flatten(),
            counted: settled(recording.valid(), settling, bridged(settings.cutoff_hz * interval_s)),
            filter: settings,
            name,
            part_of: recording.part_of().map(|_| recording.path().to_owned()),
            elapsed_s: recording.elapsed_s(),
            interval_s,
            drive,
            input,
            edges: Vec::new(),
            between: Between::Smooth,
            instants: Vec::new(),
            sensor,
            window,
            stretches,
            pieces: 1,
            response: [1.0; 2],
            gain: 1.0,
            current,
            position: match recording.channel(Channel::Speed) {
                Some(_) => None,
                None => recording.channel(Channel::Angle).map(<[f64]>::to_vec),
            },
            speed,
            locked,
            open: recording.supply_open().to_vec(),
            start,
        })
    }

    /// The same as a chain has shown it, if neither the recording nor its values tell how the speed was measured.
    #[must_use]
    pub fn through(mut self, chain: &Chain) -> Self {
        if self.sensor.is_none() && chain.speed.is_some() && self.drive == Drive::Voltage && self.current.is_some() {
            let Sensed { sensor, window, stretches } = Sensed::of(chain.speed, self.speed.as_deref(), self.interval_s);
            (self.sensor, self.window, self.stretches) = (sensor, window, stretches);
        }
        self
    }

    /// Whether a value of the speed is more than a sample of it.
    pub fn is_windowed(&self) -> bool {
        self.window.is_some() || !self.stretches.is_empty()
    }

    /// Whether a value of the speed is shown in several samples that are quick enough for the current.
    fn is_renewed_slowly(&self) -> bool {
        let several = self.window.map_or(!self.stretches.is_empty(), |window| window.samples > 1);
        several && !self.is_slow(None)
    }

    /// Samples at which the speed shows a new value.
    pub fn renewed(&self) -> Vec<usize> {
        match self.window {
            Some(window) => (window.first..self.len()).step_by(window.samples).collect(),
            None if self.stretches.is_empty() => (0..self.len()).collect(),
            None => self.stretches.iter().map(|[_, end]| *end).collect(),
        }
    }

    /// The speed as the motor had it, rad/s, to those who want its derivative or impose it: straight lines between the
    /// values of a sensor that renews them every so many samples. A mean stands for the middle of its window. Slow
    /// samples are as they are: their fits know the windows.
    pub fn speed_itself(&self) -> Option<Cow<'_, [f64]>> {
        let speed = self.speed.as_deref()?;
        if !self.is_renewed_slowly() {
            return Some(Cow::Borrowed(speed));
        }
        let mut values = self.values_shown(speed).into_iter().peekable();
        let mut before = values.peek().map_or((0.0, speed[0]), |(t, _)| (t.min(0.0), speed[0]));
        let line = |n: usize| {
            let t = n as f64;
            while let Some(next) = values.next_if(|next| next.0 <= t) {
                before = next;
            }
            let Some(next) = values.peek() else { return before.1 };
            before.1 + (t - before.0) / (next.0 - before.0) * (next.1 - before.1)
        };
        Some(Cow::Owned((0..speed.len()).map(line).collect()))
    }

    /// The values that a sensor has shown which renews them every so many samples, rad/s, and the instants that they
    /// stand for, in samples.
    fn values_shown(&self, speed: &[f64]) -> Vec<(f64, f64)> {
        if let Some(window) = self.window {
            let late = if window.is_mean { 0.5 * window.samples as f64 } else { 0.0 };
            return self.renewed().into_iter().map(|n| (n as f64 - late, speed[n])).collect();
        }
        let between = |sensor: SpeedSensor| sensor.between_pulses(speed, &self.stretches, self.interval_s);
        let between = self.sensor.map_or_else(Vec::new, between);
        between.iter().zip(&self.stretches).map(|([a, b], [_, end])| (0.5 * (a + b), speed[*end])).collect()
    }

    /// Samples at which the speed itself is told: a sensor that times pulses says nothing of a rotor that stands or
    /// turns round, nor of one that is another [`FACTOR_TOLD`] times as fast at the next pulse. `None`: everywhere.
    fn told(&self) -> Option<Vec<bool>> {
        let speed = self.speed.as_deref().filter(|_| !self.stretches.is_empty() && self.is_renewed_slowly())?;
        let mut told = vec![false; speed.len()];
        let values = self.values_shown(speed);
        for (pair, stretches) in values.windows(2).zip(self.stretches.windows(2)) {
            let [(from, one), (to, other)] = [pair[0], pair[1]];
            let (slow, fast) = (one.abs().min(other.abs()), one.abs().max(other.abs()));
            if one * other > 0.0 && fast <= FACTOR_TOLD * slow && stretches[0][1] == stretches[1][0] {
                let range = from.max(0.0).ceil() as usize..=(to.max(0.0) as usize).min(told.len() - 1);
                told[range].fill(true);
            }
        }
        Some(told)
    }

    /// Samples that count where the speed itself stands for what its sensor shows.
    pub fn counted_where_told(&self) -> Vec<bool> {
        let Some(told) = self.told() else { return self.counted.clone() };
        let settling = self.filter.settling_samples().unwrap_or(0) as usize;
        settled(&told, settling, 0).iter().zip(&self.counted).map(|(a, b)| *a && *b).collect()
    }

    /// The same with hard edges of the voltage where the current saw them, between the samples: for comparison and
    /// identification. What runs on line has no such look back.
    #[must_use]
    pub fn with_edges_placed(mut self) -> Self {
        if let (Drive::Voltage, Some(current)) = (self.drive, &self.current) {
            self.edges = edges::find(&self.input, current, |n| self.counted[n] && !self.is_open(n));
        }
        self
    }

    /// The same with another course of the voltage between its samples, in steps as small as a motor needs.
    #[must_use]
    pub fn with_course(mut self, between: Between, motor: &Motor<f64>) -> Self {
        if self.drive != Drive::Voltage {
            return self;
        }
        self.between = between;
        self.instants.clear();
        self.pieces = self.pieces_for(between, motor);
        if !self.is_as_sampled() {
            self.edges.clear();
        }
        self
    }

    /// Takes the voltage at each sample for what its known course between samples makes of it: the smooth signal whose
    /// means over the intervals are those of the course,
    ///
    /// ```text
    /// held      (7 (u(n − 1) + u(n)) − u(n − 2) − u(n + 1))/12
    /// mean      (7 (u(n) + u(n + 1)) − u(n − 1) − u(n + 2))/12
    /// ```
    /// which is right to the fourth order of the interval (means of cells to values at their borders). For a rate at
    /// which a motor's current goes on from sample to sample.
    pub fn take_voltage_as(&mut self, course: Course) {
        let u = &self.input;
        let last = u.len() as isize - 1;
        let at = |n: isize| u[n.clamp(0, last) as usize];
        let before = match course {
            Course::Held => 1,
            Course::Mean => 0,
            Course::Smooth | Course::Linear | Course::Edges => return,
        };
        if self.drive == Drive::Voltage {
            let border = |n: isize| {
                (7.0 * (at(n - before) + at(n - before + 1)) - at(n - before - 1) - at(n - before + 2)) / 12.0
            };
            self.input = (0..u.len() as isize).map(border).collect();
        }
    }

    /// The same without what the measured current tells of single edges of the voltage: as a voltage alone would drive
    /// the model.
    #[must_use]
    pub fn by_voltage_alone(mut self) -> Self {
        self.edges.clear();
        self.instants.clear();
        self
    }

    /// The same with predictions that are weighed by the response of a motor: an ampere by `R/(1 − e^(−h R/L))`, a
    /// radian per second by J.
    #[must_use]
    pub fn with_response_of(mut self, motor: &Motor<f64>) -> Self {
        let p = motor.parameters();
        let rate = self.interval_s * p.resistance / p.inductance;
        self.response = [p.resistance / -(-rate).exp_m1(), p.inertia];
        self
    }

    /// The same along a course of the voltage, if its samples are slow.
    #[must_use]
    pub fn along_if_slow(self, between: Between, motor: &Motor<f64>) -> Self {
        if self.is_slow(None) { self.with_course(between, motor) } else { self }
    }

    /// Whether current and speed were sampled so slowly that it matters what the voltage does between samples: in
    /// seconds, or in the time constants of a motor that is known.
    pub fn is_slow(&self, motor: Option<&Motor<f64>>) -> bool {
        let beside = |motor: &Motor<f64>| {
            let p = motor.parameters();
            self.interval_s * p.resistance > between::ASKED_FROM_RATE * p.inductance
        };
        let slow = self.interval_s >= between::ASKED_FROM_S || motor.is_some_and(beside);
        self.drive == Drive::Voltage && self.current.is_some() && slow
    }

    /// Whether the model goes from sample to sample in one step, along a smooth voltage.
    pub fn is_as_sampled(&self) -> bool {
        self.between == Between::Smooth && self.pieces == 1
    }

    /// Whether a motor's current has settled from one sample to the next.
    fn settles<S: Scalar<Base = S>>(&self, motor: &Motor<S>) -> bool {
        let p = motor.parameters();
        S::constant(self.interval_s) * p.resistance > S::constant(SETTLED) * p.inductance
    }

    fn pieces_for(&self, between: Between, motor: &Motor<f64>) -> usize {
        let p = motor.parameters();
        let rate = self.interval_s * p.resistance / p.inductance;
        let peak = |signal: &[f64]| signal.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        // What was not measured is at most the current at a standstill.
        let largest = || self.current.as_deref().map_or_else(|| peak(&self.input) / p.resistance, peak);
        let linkage = p.flux_coefficient * if p.flux_law == FluxLaw::Series { largest() } else { 1.0 };
        let swing = self.interval_s * linkage / (p.inductance * p.inertia).sqrt();
        let can_be_built = |pieces: usize| Stepper::build(motor.clone(), self.interval_s / pieces as f64).is_ok();
        let has_substeps = rate <= LARGEST_RATE_STEP * MOST_SUBSTEPS && swing <= LARGEST_SWING;
        if between == Between::Smooth && has_substeps && can_be_built(1) {
            return 1;
        }
        let rate_step = if self.settles(motor) { STEP_WHERE_SETTLED } else { LARGEST_RATE_STEP };
        let mut pieces = (rate / rate_step).max(swing / LARGEST_SWING).ceil().clamp(1.0, MOST_PIECES as f64) as usize;
        while pieces < MOST_PIECES && !can_be_built(pieces) {
            pieces *= 2;
        }
        pieces
    }

    /// What the model steps by, s.
    pub fn step_s(&self) -> f64 {
        self.interval_s / self.pieces as f64
    }

    /// Samples that count, and for which the filter has settled since the supply was last opened or closed: a current
    /// that is broken off has no rate.
    pub fn counted_in_balances(&self) -> Vec<bool> {
        let last = self.len() - 1;
        let same = |n: usize| (n.saturating_sub(1)..=(n + 1).min(last)).all(|k| self.is_open(k) == self.is_open(n));
        let unbroken: Vec<bool> = (0..self.len()).map(same).collect();
        let counted = self.counted_where_told();
        if unbroken.iter().all(|same| *same) {
            return counted;
        }
        let settling = self.filter.settling_samples().unwrap_or(0) as usize;
        settled(&unbroken, settling, 0).iter().zip(&counted).map(|(a, b)| *a && *b).collect()
    }

    /// Where the voltage is not straight between its samples: sample, and mean of voltage (V) and current (A) over the
    /// two intervals around it.
    pub fn means_around_edges<'a>(&'a self, current: &'a [f64]) -> impl Iterator<Item = (usize, [f64; 2])> + 'a {
        let over = |n: usize| match edges::at(&self.edges, n) {
            Some(edge) => edge.means(&self.input, current),
            None => edges::means(&self.input, current, n),
        };
        let inside = |n: &usize| *n > 0 && n + 1 < self.len();
        let mut samples: Vec<usize> = self.edges.iter().flat_map(|e| [e.n - 1, e.n]).filter(inside).collect();
        samples.dedup();
        samples.into_iter().map(move |n| {
            let [before, after] = [over(n), over(n + 1)];
            (n, [0, 1].map(|k| 0.5 * (before[k] + after[k])))
        })
    }

    /// The same at the rate that suffices for trying many models: 5 kHz or a little less.
    #[must_use]
    pub fn coarse(&self) -> Self {
        self.coarser((COARSE_INTERVAL_S / self.interval_s) as usize)
    }

    /// The same at a fraction of the sampling rate, each signal averaged alike ([`averaging`]): for fits that are tried
    /// by the dozen.
    #[must_use]
    pub fn coarser(&self, factor: usize) -> Self {
        if factor < 2 {
            return self.clone();
        }
        let average = |signal: &[f64]| averaging::average(signal, factor);
        let flags = |flags: &[bool]| flags.iter().copied().step_by(factor).collect::<Vec<bool>>();
        Self {
            name: self.name.clone(),
            part_of: self.part_of.clone(),
            elapsed_s: self.elapsed_s,
            interval_s: self.interval_s * factor as f64,
            drive: self.drive,
            input: average(&self.input),
            edges: self.current.as_ref().map_or_else(Vec::new, |i| edges::coarser(&self.edges, &self.input, i, factor)),
            between: self.between,
            sensor: self.sensor,
            // A window of several samples need not be one of several of these.
            window: self.window.filter(|_| !self.is_renewed_slowly()),
            stretches: Vec::new(),
            instants: if factor == 1 { self.instants.clone() } else { Vec::new() },
            pieces: if self.is_as_sampled() { 1 } else { self.pieces * factor },
            response: self.response,
            gain: self.gain,
            current: self.current.as_deref().map(average),
            speed: self.speed_itself().as_deref().map(average),
            position: self.position.as_deref().map(average),
            locked: flags(&self.locked),
            open: flags(&self.open),
            counted: flags(&self.counted_where_told()),
            start: self.start,
            mains_period_s: self.mains_period_s,
            filter: butterworth::Settings { sample_rate_hz: self.filter.sample_rate_hz / factor as f64, ..self.filter },
        }
    }

    /// Where it comes from, for an error.
    pub fn place(&self) -> Place {
        Place::file(&self.name)
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.input.len()
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.input.is_empty()
    }

    /// Whether the rotor is held at a sample.
    pub fn is_locked(&self, n: usize) -> bool {
        self.locked.get(n).copied().unwrap_or(false)
    }

    /// Whether the supply is open at a sample.
    pub fn is_open(&self, n: usize) -> bool {
        self.open.get(n).copied().unwrap_or(false)
    }

    /// The filter's coefficients.
    pub fn coefficients<S: Scalar>(&self) -> Coefficients<S> {
        // The settings have built a filter once, in `new`.
        self.filter.build().unwrap_or_else(|_| unreachable!("settings were checked"))
    }

    /// A signal through the filter, started in its steady state.
    pub fn filtered<S: Scalar>(&self, signal: &[S]) -> Vec<S> {
        let coefficients = self.coefficients::<S>();
        let mut cascade = Cascade::default();
        cascade.reset_to(signal.first().copied().unwrap_or(S::ZERO));
        signal.iter().map(|x| cascade.process(&coefficients, *x)).collect()
    }

    /// Steps the model over the recording and hands what the measuring chain shows at each sample, unfiltered, to
    /// `take`.
    ///
    /// # Errors
    /// Parameters that the stepper refuses.
    pub fn run<S: Scalar<Base = S>>(
        &self,
        motor: &Motor<S>,
        substeps: u8,
        imposed: Imposed<'_>,
        take: impl FnMut(usize, State<S>),
    ) -> std::result::Result<(), ParameterError> {
        let stepper = Stepper::with_substeps(motor.clone(), S::constant(self.step_s()), substeps)?;
        self.step_through(stepper, imposed, take);
        Ok(())
    }

    /// [`Experiment::run`] of what is stepped by the interval of this recording.
    pub fn step_through<S: Scalar<Base = S>>(
        &self,
        mut stepper: impl Stepped<S>,
        imposed: Imposed<'_>,
        mut take: impl FnMut(usize, State<S>),
    ) {
        let start = State { current: S::constant(self.start.current), speed: S::constant(self.start.speed) };
        stepper.begin(start, S::constant(self.elapsed_s));
        let mut shown = Shown::new(self, stepper.reading().speed);
        take(0, stepper.reading());
        let mut edges = self.edges.as_slice();
        for n in 1..self.len() {
            let mean = self.advance(&mut stepper, n, imposed, &mut edges);
            take(n, shown.at(n, stepper.reading(), mean));
        }
    }

    /// Steps the model in runs of so many samples and hands what the measuring chain shows at each sample but the
    /// first. The first run begins at the measured state, `[current, speed]`, each other one where the last has ended,
    /// corrected by the [`gain`](Self::gain) times what it is off by.
    pub fn short_runs<S: Scalar<Base = S>>(
        &self,
        mut stepper: impl Stepped<S>,
        length: usize,
        [current, speed]: [&[f64]; 2],
        mut take: impl FnMut(usize, State<S>),
    ) {
        let measured = |n: usize| State { current: S::constant(current[n]), speed: S::constant(speed[n]) };
        begin_as_shown(&mut stepper, measured(0), S::constant(self.elapsed_s));
        let gain = S::constant(self.gain);
        let mut last = measured(0);
        let mut shown = Shown::new(self, last.speed);
        let mut edges = self.edges.as_slice();
        for n in 1..self.len() {
            if (n - 1) % length == 0 && n > 1 {
                let (state, measured) = (stepper.state(), measured(n - 1));
                // What is held is a correction once.
                let speed = if shown.is_renewed() { measured.speed - last.speed } else { S::ZERO };
                let off = State { current: measured.current - last.current, speed };
                stepper
                    .put(State { current: state.current + gain * off.current, speed: state.speed + gain * off.speed });
            }
            let mean = self.advance(&mut stepper, n, Imposed::Nothing, &mut edges);
            last = shown.at(n, stepper.reading(), mean);
            take(n, last);
        }
    }

    /// What the measuring chain shows at sample `n` of a motor that was in the measured state, `[current, speed]`, at
    /// the sample before.
    pub fn after_an_interval<S: Scalar<Base = S>>(
        &self,
        stepper: &mut impl Stepped<S>,
        n: usize,
        [current, speed]: [&[f64]; 2],
    ) -> State<S> {
        let before = State { current: S::constant(current[n - 1]), speed: S::constant(speed[n - 1]) };
        begin_as_shown(stepper, before, S::constant(self.elapsed_s + (n - 1) as f64 * self.interval_s));
        let mean = self.advance(stepper, n, Imposed::Nothing, &mut self.edges.as_slice());
        let reading = stepper.reading();
        if self.window == Some(Window::ONE) { State { speed: mean, ..reading } } else { reading }
    }

    /// All samples but the first `from`.
    #[must_use]
    pub fn tail(&self, from: usize) -> Self {
        let cut = |signal: &Option<Vec<f64>>| signal.as_ref().map(|signal| signal[from..].to_vec());
        let flags = |flags: &[bool]| flags.iter().copied().skip(from).collect::<Vec<bool>>();
        Self {
            name: self.name.clone(),
            part_of: self.part_of.clone(),
            input: self.input[from..].to_vec(),
            edges: self.edges.iter().filter(|e| e.n > from).map(|e| Edge { n: e.n - from, ..*e }).collect(),
            instants: self.instants.iter().filter(|(n, _)| *n > from).map(|(n, share)| (n - from, *share)).collect(),
            current: cut(&self.current),
            speed: cut(&self.speed),
            position: cut(&self.position),
            locked: flags(&self.locked),
            open: flags(&self.open),
            counted: flags(&self.counted),
            window: self.window.map(|window| window.without_first(from)),
            stretches: self
                .stretches
                .iter()
                .filter(|[_, end]| *end > from)
                .map(|ends| ends.map(|n| n.saturating_sub(from)))
                .collect(),
            ..*self
        }
    }

    /// The first samples.
    #[must_use]
    pub fn head(&self, samples: usize) -> Self {
        let samples = samples.min(self.len());
        let cut = |signal: &Option<Vec<f64>>| signal.as_ref().map(|signal| signal[..samples].to_vec());
        let flags = |flags: &[bool]| flags.iter().copied().take(samples).collect::<Vec<bool>>();
        Self {
            name: self.name.clone(),
            part_of: self.part_of.clone(),
            input: self.input[..samples].to_vec(),
            edges: self.edges.iter().copied().filter(|e| e.n < samples).collect(),
            instants: self.instants.iter().copied().filter(|(n, _)| *n < samples).collect(),
            current: cut(&self.current),
            speed: cut(&self.speed),
            position: cut(&self.position),
            locked: flags(&self.locked),
            open: flags(&self.open),
            counted: flags(&self.counted),
            stretches: self.stretches.iter().copied().filter(|[_, end]| *end < samples).collect(),
            ..*self
        }
    }

    /// Advances by the interval that ends at sample `n`, and tells the mean of the speed over it where a chain shows
    /// that; `edges` are those from about there on.
    #[inline(always)]
    fn advance<S: Scalar<Base = S>>(
        &self,
        stepper: &mut impl Stepped<S>,
        n: usize,
        imposed: Imposed<'_>,
        edges: &mut &[Edge],
    ) -> S {
        let is_counted = self.is_windowed();
        let mut before = if is_counted { stepper.reading().speed } else { S::ZERO };
        let mut sum = S::ZERO;
        if self.drive == Drive::Voltage && !self.is_as_sampled() {
            let own = self.instants.binary_search_by_key(&n, |(n, _)| *n);
            let between = own.map_or(self.between, |k| Between::Switched(self.instants[k].1));
            for piece in 0..self.pieces {
                let middle = (piece as f64 + 0.5) / self.pieces as f64;
                let [from, to] = between.over(&self.input, n, piece, self.pieces);
                let constraints =
                    self.imposed(n, imposed, |signal| signal[n - 1] + middle * (signal[n] - signal[n - 1]));
                stepper.step(S::constant(from), S::constant(to), constraints);
                if is_counted {
                    let after = stepper.reading().speed;
                    sum += before + after;
                    before = after;
                }
            }
            return sum * S::constant(0.5 / self.pieces as f64);
        }
        let (from, to) = match self.drive {
            Drive::Voltage => {
                while edges.first().is_some_and(|e| e.n + 1 < n) {
                    *edges = &edges[1..];
                }
                let [begins, ends] = self.between_samples(n, edges);
                (S::constant(self.input[n - 1] + begins), S::constant(self.input[n] + ends))
            }
            Drive::Torque => (S::ZERO, S::ZERO),
        };
        stepper.step(from, to, self.imposed(n, imposed, |signal| 0.5 * (signal[n - 1] + signal[n])));
        if is_counted { S::constant(0.5) * (before + stepper.reading().speed) } else { S::ZERO }
    }

    /// What is imposed within the interval that ends at sample `n`; `at` takes a signal's value there.
    #[inline(always)]
    fn imposed<S: Scalar<Base = S>>(
        &self,
        n: usize,
        imposed: Imposed<'_>,
        at: impl Fn(&[f64]) -> f64,
    ) -> Constraints<S> {
        let (speed, current) = match imposed {
            Imposed::Nothing => (None, None),
            Imposed::Speed(speed) => (Some(speed), None),
            Imposed::Current(current) => (None, Some(current)),
        };
        let current = if self.drive == Drive::Torque { Some(self.input.as_slice()) } else { current };
        Constraints {
            speed: match speed {
                _ if self.is_locked(n) => Some(S::ZERO),
                Some(speed) => Some(S::constant(at(speed))),
                None => None,
            },
            current: match current {
                _ if self.is_open(n) => Some(S::ZERO),
                Some(current) => Some(S::constant(at(current))),
                None => None,
            },
        }
    }

    /// Begin and end of the line that stands for the voltage over the interval that ends at sample `n`, above its two
    /// samples, V: what an edge makes of it, or else, away from `edges`, the mean of a cubic through its neighbours.
    fn between_samples(&self, n: usize, edges: &[Edge]) -> [f64; 2] {
        let u = &self.input;
        let near = || edges.iter().take_while(|e| e.n <= n + 1);
        match near().find(|e| e.n == n) {
            Some(edge) => [edge.begins, edge.ends],
            None if n < 2 || n + 1 >= u.len() || near().next().is_some() => [0.0; 2],
            None => [(u[n - 1] - u[n - 2] + u[n] - u[n + 1]) / 24.0; 2],
        }
    }

    /// Steps per sample that a motor needs here.
    ///
    /// # Errors
    /// Parameters that the stepper refuses.
    pub fn substeps<S: Scalar<Base = S>>(&self, motor: &Motor<S>) -> std::result::Result<u8, ParameterError> {
        match self.drive {
            Drive::Voltage if self.pieces > 1 && self.settles(motor) => Ok(1),
            Drive::Voltage => Ok(Stepper::build(motor.clone(), S::constant(self.step_s()))?.substeps()),
            Drive::Torque => Ok(1),
        }
    }
}

/// How a speed was measured, as it is told or as its values tell.
struct Sensed {
    sensor: Option<SpeedSensor>,
    window: Option<Window>,
    stretches: Vec<[usize; 2]>,
}

impl Sensed {
    const AS_SAMPLED: Self = Self { sensor: None, window: None, stretches: Vec::new() };

    /// Of a speed that is sampled every so many seconds. Quick samples are looked at for values that are shown in
    /// several of them alone; a speed that is held there, and not counted, was sampled more slowly.
    fn of(told: Option<SpeedSensor>, speed: Option<&[f64]>, interval_s: f64) -> Self {
        let Some(speed) = speed else { return Self::AS_SAMPLED };
        let sensor = told.or_else(|| SpeedSensor::by_values(speed, interval_s));
        let stretches = sensor.map_or_else(Vec::new, |sensor| sensor.stretches(speed, interval_s));
        let window = match sensor {
            Some(sensor) => sensor.window(speed, interval_s),
            None => Window::of(speed),
        };
        if interval_s >= between::ASKED_FROM_S || !stretches.is_empty() {
            return Self { sensor, window, stretches };
        }
        let Some(window) = window.filter(|w| w.samples > 1 && w.holds(speed)) else { return Self::AS_SAMPLED };
        let sensor = sensor.unwrap_or(SpeedSensor::Held { window_s: window.samples as f64 * interval_s });
        Self { sensor: Some(sensor), window: Some(Window { is_mean: sensor.is_mean(), ..window }), stretches }
    }
}

/// A signal that was sampled `share` of an interval too late, moved to the common instant by linear interpolation.
/// (A converter takes its channels one after the other; metadata `skew_i_a_s` and `skew_omega_rad_s_s` say how late.)
fn earlier(signal: &[f64], share: f64) -> Vec<f64> {
    if share == 0.0 || !(-1.0..=1.0).contains(&share) {
        return signal.to_vec();
    }
    let mut before = signal[0];
    signal
        .iter()
        .map(|x| {
            let moved = x - share * (x - before);
            before = *x;
            moved
        })
        .collect()
}

/// Central differences; one-sided at the ends.
pub fn derivative(signal: &[f64], interval_s: f64) -> Vec<f64> {
    let n = signal.len();
    (0..n)
        .map(|k| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
            if a == b { 0.0 } else { (signal[b] - signal[a]) / ((b - a) as f64 * interval_s) }
        })
        .collect()
}

/// Samples that a line bridges so closely that the filter need not settle anew, by its cut-off in cycles a sample: a
/// sinusoid at the cut-off f leaves the chord over n + 1 intervals by (2π f (n + 1))²/8, here a twentieth, and what a
/// motor does is far below the cut-off.
fn bridged(cutoff: f64) -> usize {
    const LEAVES: f64 = 0.05;
    let intervals = (8.0 * LEAVES).sqrt() / (std::f64::consts::TAU * cutoff);
    (intervals as usize).saturating_sub(1)
}

/// Usable samples for which the last unusable stretch of more than `bridged` samples, or the start, is at least
/// `settling` samples ago.
fn settled(valid: &[bool], settling: usize, bridged: usize) -> Vec<bool> {
    let (mut since, mut missing) = (0, 0);
    valid
        .iter()
        .map(|valid| {
            missing = if *valid { 0 } else { missing + 1 };
            since = if missing > bridged { 0 } else { since + 1 };
            *valid && since > settling
        })
        .collect()
}

fn start_state(speed: &Option<Vec<f64>>, current: &Option<Vec<f64>>, locked: &[bool], interval_s: f64) -> State<f64> {
    let first_current = current.as_ref().map_or(0.0, |i| i[0]);
    let held = locked.first().copied().unwrap_or(false);
    let first_speed = match speed {
        Some(speed) if !held && interval_s >= between::ASKED_FROM_S => {
            // The motor may be far away after a few samples.
            if speed[0].abs() <= AT_REST * noise::of_differences(speed) { 0.0 } else { speed[0] }
        }
        Some(speed) if !held && speed.len() < FEWEST_AVERAGED => speed[0],
        Some(speed) if !held => {
            let n = ((START_AVERAGE_S / interval_s) as usize).clamp(FEWEST_AVERAGED, speed.len());
            // The straight line through the first samples, at the first of them.
            let (mut sum, mut moment) = (0.0, 0.0);
            let centre = (n - 1) as f64 / 2.0;
            for (k, w) in speed[..n].iter().enumerate() {
                sum += w;
                moment += (k as f64 - centre) * w;
            }
            let (nf, mean) = (n as f64, sum / n as f64);
            let slope = moment * 12.0 / (nf * (nf * nf - 1.0));
            let scatter = (speed[..n].iter().map(|w| (w - mean).powi(2)).sum::<f64>() / nf).sqrt();
            let at_start = mean - slope * centre;
            // Within the noise of standstill it is standstill, from which dry friction can hold the rotor.
            if at_start.abs() <= 3.0 * scatter.max(slope.abs()) { 0.0 } else { at_start }
        }
        _ => 0.0,
    };
    State { current: first_current, speed: first_speed }
}
