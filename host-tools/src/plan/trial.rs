//! A recording to be made: its waveform, and what it would show.

use greyrig::butterworth::{Cascade, Coefficients};
use greyrig::effects::Passed;
use greyrig::motor::{Constraints, Memories, Motor, OperatingPoint, State, Stepper};
use nalgebra::DVector;

use crate::context::CancelFlag;
use crate::identify::minimise::Residuals;
use crate::identify::space::Space;
use crate::rig::SAMPLE_RATE_HZ;
use crate::rig::source::{DIODE_DROP_V, Drive, Segment, Waveform};

/// Current, speed, terminal voltage.
pub const SIGNALS: usize = 3;

/// A profile as the model has drawn it.
pub struct Drawn {
    /// Voltage at each sample, V.
    pub voltage: Vec<f64>,
    locked: Vec<bool>,
    open: Vec<bool>,
    /// Largest voltage, V.
    pub peak_voltage: f64,
    /// Largest current, A.
    pub peak_current: f64,
    /// Largest speed, rad/s.
    pub peak_speed: f64,
}

/// Runs the base model through segments, with the contact opening at the zeros of its current.
pub fn draw(mut stepper: Stepper<f64>, segments: &[Segment]) -> Drawn {
    let mut drawn = Drawn {
        voltage: Vec::new(),
        locked: Vec::new(),
        open: Vec::new(),
        peak_voltage: 0.0,
        peak_current: 0.0,
        peak_speed: 0.0,
    };
    let (mut last_current, mut conducting) = (0.0, false);
    for segment in segments {
        let begin = drawn.voltage.len();
        let wave = Waveform::new(*segment, begin as f64 / SAMPLE_RATE_HZ, 0.0);
        for n in begin..begin + (segment.seconds * SAMPLE_RATE_HZ).round() as usize {
            let t = n as f64 / SAMPLE_RATE_HZ;
            let current = stepper.state().current;
            let at_zero = current == 0.0 || current * last_current < 0.0;
            let fired = wave.gate(t).is_some_and(|(on, off)| on <= t && t < off);
            conducting = match segment.drive {
                Drive::Closed => true,
                Drive::Off => conducting && !at_zero,
                Drive::Triac { .. } => fired || (conducting && !at_zero),
            };
            let freewheels = segment.drive == Drive::Off && wave.is_dc();
            let voltage = match (conducting, freewheels) {
                (false, _) => 0.0,
                (true, true) => -DIODE_DROP_V * current.signum(),
                (true, false) => wave.at(t),
            };
            let constraints =
                Constraints { speed: segment.locked.then_some(0.0), current: (!conducting).then_some(0.0) };
            let from = drawn.voltage.last().copied().unwrap_or(voltage);
            last_current = current;
            let state = stepper.step(from, voltage, constraints);
            drawn.voltage.push(voltage);
            drawn.locked.push(segment.locked);
            drawn.open.push(!conducting);
            drawn.peak_voltage = drawn.peak_voltage.max(voltage.abs());
            drawn.peak_current = drawn.peak_current.max(state.current.abs());
            drawn.peak_speed = drawn.peak_speed.max(state.speed.abs());
        }
    }
    drawn
}

/// A recording to be made, as a problem of the parameters.
pub struct Trial {
    waveform: Drawn,
    substeps: u8,
    coefficients: Coefficients<f64>,
    stride: usize,
    noise: [f64; 3],
    groups: Vec<u8>,
    cancel: CancelFlag,
}

/// Samples after which it is looked whether the work is to stop: a few milliseconds.
const LOOK_EVERY: usize = 1 << 14;

impl Trial {
    /// Of a waveform, with steps per sample that fit the motor, and the noise of voltage, current and speed. Four rows
    /// for each period of the filter's cut-off. Once `cancel` is set no run is made any more: what it yields is of no
    /// use, and whoever asked looks, too.
    pub fn new(
        waveform: Drawn,
        substeps: u8,
        coefficients: Coefficients<f64>,
        cutoff_hz: f64,
        noise: [f64; 3],
        cancel: CancelFlag,
    ) -> Self {
        let stride = ((SAMPLE_RATE_HZ / (4.0 * cutoff_hz)) as usize).max(1);
        let rows = SIGNALS * waveform.voltage.len().div_ceil(stride);
        Self { waveform, substeps, coefficients, stride, noise, groups: vec![0; rows], cancel }
    }

    /// The rows of the current.
    pub fn currents<'a>(&self, y: &'a DVector<f64>) -> impl Iterator<Item = f64> + 'a {
        y.iter().step_by(SIGNALS).copied()
    }

    /// y, a row of current, speed and terminal voltage at a time; `None` if the motor cannot be run.
    fn run(&self, motor: &Motor<f64>) -> Option<Vec<f64>> {
        let Drawn { voltage, locked, open, .. } = &self.waveform;
        let interval = 1.0 / SAMPLE_RATE_HZ;
        let mut stepper = Stepper::with_substeps(motor.clone(), interval, self.substeps).ok()?;
        stepper.set_state(State::default());
        let mut memories = motor.memories_at_start(State::default());
        let mut filters = [Cascade::<f64>::default(), Cascade::default()];
        let mut rows = Vec::with_capacity(self.groups.len());
        for n in 0..voltage.len() {
            if n % LOOK_EVERY == 0 && self.cancel.is_cancelled() {
                return None;
            }
            let constraints = Constraints { speed: locked[n].then_some(0.0), current: open[n].then_some(0.0) };
            let before = stepper.state();
            let after = stepper.step(voltage[n.saturating_sub(1)], voltage[n], constraints);
            motor.advance(&Passed { interval, before, after }, &mut memories);
            let reading = stepper.reading();
            let shown = [
                filters[0].process(&self.coefficients, reading.current),
                filters[1].process(&self.coefficients, reading.speed),
                if open[n] { terminal_voltage(motor, after, &memories) } else { 0.0 },
            ];
            if n % self.stride == 0 {
                rows.extend(
                    shown.iter().zip([self.noise[1], self.noise[2], self.noise[0]]).map(|(x, sigma)| x / sigma),
                );
            }
        }
        rows.iter().all(|x| x.is_finite()).then_some(rows)
    }
}

/// What the terminals of an open motor show, V: K φ ω + v, less what the voltage channel adds to it.
fn terminal_voltage(motor: &Motor<f64>, state: State<f64>, memories: &Memories<f64>) -> f64 {
    let balance = |voltage: f64| {
        let at = OperatingPoint { current: 0.0, speed: state.speed, voltage };
        motor.balance(&at, memories)
    };
    let open = balance(0.0);
    let true_voltage = motor.linkage(&open) * state.speed + open.voltage;
    true_voltage - (balance(true_voltage).supply - true_voltage)
}

/// Stands for a run that cannot be made.
const HOPELESS: f64 = 1e6;

impl Residuals for Trial {
    fn at(&self, space: &Space, theta: &[f64]) -> DVector<f64> {
        let rows = space.motor_at(theta).ok().and_then(|motor| self.run(&motor));
        rows.map_or_else(|| DVector::from_element(self.groups.len(), HOPELESS), DVector::from_vec)
    }
    fn groups(&self) -> &[u8] {
        &self.groups
    }
    fn sizes(&self) -> [f64; 2] {
        [1.0; 2]
    }
}
