//! A run of the rig, sample by sample: for whoever cannot wait for its end, such as a virtual board.

use rand_distr::{Distribution, StandardNormal};

use super::chain::{Chain, ChainSetup};
use super::parts::Instant;
use super::plant::{Contact, Plant};
use super::source::{DIODE_DROP_V, Drive, Segment, Shape, Waveform};
use super::streams::{Purpose, Streams};
use super::{SAMPLE_RATE_HZ, Setup, Truth};

/// Correlation time of the load's turbulence, s.
const TURBULENCE_S: f64 = 20e-3;
/// Correlation time of the mains fluctuation, s.
const FLUCTUATION_S: f64 = 1.0;

/// A sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The converter's codes for voltage, current and speed; zero with an ideal chain.
    pub counts: [u16; 3],
    /// What they stand for, V, A and rad/s.
    pub values: [f64; 3],
    /// Whether the rotor is held.
    pub locked: bool,
    /// Whether the supply is open.
    pub open: bool,
}

/// A rig at work.
pub struct Running {
    /// What is simulated.
    pub truth: Truth,
    /// Length of the profile, s.
    pub seconds: f64,
    /// Figures of the measuring chain.
    pub chain_setup: ChainSetup,
    segments: Vec<Segment>,
    /// The next segment.
    next: usize,
    wave: Option<Waveform>,
    locked: bool,
    off: bool,
    /// Samples taken, and their number at the end of the segment.
    n: usize,
    end: usize,
    plant: Plant,
    chain: Chain,
    gust: Drift,
    level: Drift,
    fifth_harmonic: f64,
    steps: usize,
    voltages: Vec<f64>,
}

impl Running {
    pub(super) fn new(setup: &Setup, seconds: f64, segments: Vec<Segment>) -> Self {
        let streams = Streams::new(setup.seed);
        let assembly = setup.assemble();
        let truth = Truth { motor: assembly.motor, effects: setup.effects.clone(), faults: setup.faults.clone() };
        let (plant, channel_parts) = Plant::new(assembly);
        let mut chain_setup =
            setup.chain.unwrap_or_else(|| ChainSetup::for_motor(&setup.motor, setup.profile.high_current));
        chain_setup.scale_noise(setup.noise);
        let chain = Chain::new(&chain_setup, channel_parts, &streams, step(setup.steps));
        Self {
            truth,
            seconds,
            chain_setup,
            segments,
            next: 0,
            wave: None,
            locked: false,
            off: false,
            n: 0,
            end: 0,
            plant,
            chain,
            gust: Drift::new(setup.turbulence, TURBULENCE_S, streams.stream(Purpose::Turbulence)),
            level: Drift::new(setup.fluctuation, FLUCTUATION_S, streams.stream(Purpose::Mains)),
            fifth_harmonic: setup.fifth_harmonic,
            steps: setup.steps,
            voltages: vec![0.0; 2 * setup.steps + 1],
        }
    }

    /// Begins the profile again, with the motor as it is and time going on.
    pub fn again(&mut self) {
        (self.next, self.wave) = (0, None);
    }

    /// From the next sample on the supply gives a voltage, whatever the profile says, until it is commanded anew.
    pub fn command(&mut self, shape: Shape, closed: bool) {
        let drive = if closed { Drive::Closed } else { Drive::Off };
        let segment = Segment { seconds: 1.0, shape, drive, locked: false };
        self.wave = Some(self.switched(segment));
        self.end = usize::MAX;
    }

    fn begin_segment(&mut self) -> Option<Waveform> {
        let segment = *self.segments.get(self.next)?;
        self.next += 1;
        self.end = self.n + (segment.seconds * SAMPLE_RATE_HZ).round() as usize;
        Some(self.switched(segment))
    }

    /// The waveform of a segment that begins now, with the contact as it has to be.
    fn switched(&mut self, segment: Segment) -> Waveform {
        let plant = &mut self.plant;
        plant.lock(segment.locked);
        plant.contact = match (segment.drive, plant.contact) {
            (Drive::Closed, _) => Contact::Closed,
            (_, Contact::Closed) if plant.state.i == 0.0 => Contact::Open,
            (_, Contact::Closed) => Contact::UntilZero,
            (_, other) => other,
        };
        (self.locked, self.off) = (segment.locked, segment.drive == Drive::Off);
        Waveform::new(segment, self.n as f64 / SAMPLE_RATE_HZ, self.fifth_harmonic)
    }

    /// The next sample; none at the end of the profile.
    pub fn next_sample(&mut self) -> Option<Sample> {
        while self.wave.is_none() || self.n >= self.end {
            self.wave = Some(self.begin_segment()?);
        }
        let wave = self.wave.as_mut()?;
        let h = step(self.steps);
        let t = self.n as f64 / SAMPLE_RATE_HZ;
        self.plant.gust = self.gust.next(1.0 / SAMPLE_RATE_HZ);
        wave.level = 1.0 + self.level.next(1.0 / SAMPLE_RATE_HZ);
        let u = &mut self.voltages;
        wave.fill(t, 0.5 * h, u);
        let open = self.off && self.plant.contact == Contact::Open;
        let mut sample = Sample { counts: [0; 3], values: [0.0; 3], locked: self.locked, open };
        for step in 0..self.steps {
            let u = [u[2 * step], u[2 * step + 1], u[2 * step + 2]];
            let now = advance(&mut self.plant, wave, t + step as f64 * h, h, u);
            self.plant.tick(h, &now);
            self.chain.push(&now);
            if step == 0 {
                (sample.counts, sample.values) = self.chain.sample();
            }
        }
        self.n += 1;
        Some(sample)
    }
}

/// An integration step, s.
fn step(steps: usize) -> f64 {
    1.0 / (SAMPLE_RATE_HZ * steps as f64)
}

/// One integration step under a segment's voltage, with its switching; the state at its end.
fn advance(plant: &mut Plant, wave: &Waveform, t: f64, h: f64, u: [f64; 3]) -> Instant {
    let mut shown = u[2];
    match (wave.gate(t), plant.contact) {
        (Some((on, off)), Contact::Open) if on < t + h && t < off => {
            let before = (on - t).max(0.0);
            if before > 0.0 {
                plant.advance(before, [0.0; 3], |_| 0.0);
            }
            plant.contact = Contact::UntilZero;
            let [t0, rest] = [t + before, h - before];
            plant.advance(rest, [0.0, 0.5, 1.0].map(|part| wave.at(t0 + part * rest)), |s| wave.at(t0 + s));
        }
        (_, Contact::UntilZero) if wave.is_dc() => {
            shown = -DIODE_DROP_V * plant.state.i.signum();
            plant.advance(h, [shown; 3], |_| shown);
        }
        _ => plant.advance(h, u, |s| wave.at(t + s)),
    }
    if plant.contact == Contact::Open {
        shown = plant.open_voltage();
    }
    let state = plant.state;
    Instant { t: t + h, u: shown, i: state.i, omega: state.omega, theta: state.theta }
}

/// A stationary Ornstein–Uhlenbeck process of zero mean.
struct Drift {
    rms: f64,
    time_constant: f64,
    value: f64,
    rng: rand_chacha::ChaCha8Rng,
}

impl Drift {
    fn new(rms: f64, time_constant: f64, rng: rand_chacha::ChaCha8Rng) -> Self {
        Self { rms, time_constant, value: 0.0, rng }
    }

    /// The value after another `dt` seconds (exact discretisation).
    fn next(&mut self, dt: f64) -> f64 {
        if self.rms > 0.0 {
            let keep = (-dt / self.time_constant).exp();
            let z: f64 = StandardNormal.sample(&mut self.rng);
            self.value = keep * self.value + self.rms * (1.0 - keep * keep).sqrt() * z;
        }
        self.value
    }
}
