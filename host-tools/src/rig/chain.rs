//! The measuring chain: sensor → anti-alias filter → sample → noise → gain and offset → amplifier limits → converter.
//!
//! | element | figure | why |
//! | --- | --- | --- |
//! | anti-alias filter | second-order Butterworth, 4 kHz, the same on all three channels | takes 16 dB off what would fold from 10 kHz into the pass band of the identification (250 Hz); equal filters delay all channels alike, by 56 µs, which no model sees |
//! | skew | 0.87 µs from channel to channel: u, i, ω | one converter in sequence: (24.5 + 12.5) cycles at 42.5 MHz on an STM32G4 |
//! | resolution | 12 bits | the microcontroller's own converter |
//! | voltage range | ±400 V, 24 V motor ±40 V | peak of 230 V + 10 % is 358 V |
//! | current range | ±40 A, magnet motor ±15 A; ±200 A for a direct start | four times the nominal peak leaves room for steps, and a reversal of the magnet motor draws twice its stall current; a direct start is limited by û/R = 148 A alone |
//! | speed range | −125 … 5000 rad/s, magnet motor ±640 rad/s | nominal 3456 rad/s, unloaded more; the pedestal keeps noise about standstill from being rectified |
//! | noise | 0.5, 0.5, 1 LSB RMS on u, i, ω | an assumption: half an LSB dithers the converter, a tacho is somewhat worse |

use std::f64::consts::{SQRT_2, TAU};

use greyrig::butterworth::AT_REST;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::motor::{Kind, Motor};
use super::parts::{ChannelParts, Instant};
use super::streams::{Purpose, Streams};

/// One channel's figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelSetup {
    /// Value at code 0, V, A or rad/s.
    pub lowest: f64,
    /// Value one LSB above the highest code.
    pub highest: f64,
    /// Noise before the converter, RMS, in units of the channel.
    pub noise: f64,
    /// Relative gain error; zero by default.
    pub gain_error: f64,
    /// Offset error in units of the channel; zero by default.
    pub offset: f64,
}

/// The measuring chain's figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChainSetup {
    /// Voltage, current, speed, in the order of sampling.
    pub channels: [ChannelSetup; 3],
    /// Cut-off of the anti-alias filters, Hz; none: no filter.
    pub cutoff_hz: Option<f64>,
    /// Time from one channel's sample to the next one's, s; at most half an integration step.
    pub skew_s: f64,
    /// Bits of the converter; none: no quantisation and no range.
    pub bits: Option<u32>,
}

impl ChainSetup {
    /// The usual chain for a motor (see the table above); `high_current` selects the range for a direct start.
    pub fn for_motor(motor: &Motor, high_current: bool) -> Self {
        let bits = 12;
        let channel = |lowest: f64, highest: f64, noise_lsb: f64| ChannelSetup {
            lowest,
            highest,
            noise: noise_lsb * (highest - lowest) / f64::from(1 << bits),
            gain_error: 0.0,
            offset: 0.0,
        };
        let channels = match motor.kind {
            Kind::Universal => {
                let amperes = if high_current { 200.0 } else { 40.0 };
                [channel(-400.0, 400.0, 0.5), channel(-amperes, amperes, 0.5), channel(-125.0, 5000.0, 1.0)]
            }
            Kind::PmDc => [channel(-40.0, 40.0, 0.5), channel(-15.0, 15.0, 0.5), channel(-640.0, 640.0, 1.0)],
        };
        Self { channels, cutoff_hz: Some(4000.0), skew_s: 0.87e-6, bits: Some(bits) }
    }

    /// A chain that shows the true state at the sampling instants: for tests of the physics.
    pub fn ideal(motor: &Motor) -> Self {
        let mut setup = Self { cutoff_hz: None, skew_s: 0.0, bits: None, ..Self::for_motor(motor, true) };
        setup.scale_noise(0.0);
        setup
    }

    /// Multiplies the noise of all channels.
    pub fn scale_noise(&mut self, factor: f64) {
        for channel in &mut self.channels {
            channel.noise *= factor;
        }
    }
}

/// Second-order Butterworth low-pass, bilinear with the cut-off prewarped, transposed direct form II.
#[derive(Debug, Clone, Copy)]
struct AntiAlias {
    b: f64,
    a1: f64,
    a2: f64,
    z: [f64; 2],
}

impl AntiAlias {
    fn new(cutoff_hz: f64, dt: f64) -> Self {
        let w = (0.5 * TAU * cutoff_hz * dt).tan();
        let norm = 1.0 / (1.0 + SQRT_2 * w + w * w);
        Self { b: w * w * norm, a1: 2.0 * (w * w - 1.0) * norm, a2: (1.0 - SQRT_2 * w + w * w) * norm, z: [0.0; 2] }
    }

    fn pass(&mut self, x: f64) -> f64 {
        let y = self.b * x + self.z[0];
        self.z = [2.0 * self.b * x - self.a1 * y + self.z[1], self.b * x - self.a2 * y];
        if x == 0.0 && y.abs() < AT_REST {
            self.z = [0.0; 2];
        }
        y
    }
}

struct ChannelState {
    setup: ChannelSetup,
    parts: ChannelParts,
    filter: Option<AntiAlias>,
    rng: ChaCha8Rng,
    /// Filter output at the last two integration steps.
    before: f64,
    latest: f64,
}

impl ChannelState {
    fn push(&mut self, mut value: f64, now: &Instant, dt: f64) {
        for sensor in &mut self.parts.sensors {
            value = sensor.sense(value, now, dt);
        }
        self.before = self.latest;
        self.latest = self.filter.as_mut().map_or(value, |f| f.pass(value));
    }

    /// Converts the value at a fraction of the last integration step: the code and what it stands for.
    fn convert(&mut self, fraction: f64, bits: Option<u32>) -> (u16, f64) {
        let mut x = self.before + fraction * (self.latest - self.before);
        if self.setup.noise > 0.0 {
            let z: f64 = StandardNormal.sample(&mut self.rng);
            x += self.setup.noise * z;
        }
        x += self.setup.gain_error * x + self.setup.offset;
        if let Some((low, high)) = self.parts.limits {
            x = x.clamp(low, high);
        }
        let Some(bits) = bits else { return (0, x) };
        let codes = f64::from(1_u32 << bits);
        let lsb = (self.setup.highest - self.setup.lowest) / codes;
        let coarse = f64::from(1_u32 << bits.saturating_sub(self.parts.bits.unwrap_or(bits)));
        let code = ((x - self.setup.lowest) / (lsb * coarse)).round() * coarse;
        let code = code.clamp(0.0, codes - 1.0);
        (code as u16, self.setup.lowest + lsb * code)
    }
}

/// The chain in operation: takes the true state at each integration step, gives samples.
pub struct Chain {
    channels: [ChannelState; 3],
    skew: f64,
    dt: f64,
    bits: Option<u32>,
}

impl Chain {
    /// A chain at rest, for an integration step of `dt` seconds.
    pub fn new(setup: &ChainSetup, parts: [ChannelParts; 3], streams: &Streams, dt: f64) -> Self {
        let purposes = [Purpose::VoltageNoise, Purpose::CurrentNoise, Purpose::SpeedNoise];
        let state = |n: usize, parts: ChannelParts| ChannelState {
            setup: setup.channels[n],
            parts,
            filter: setup.cutoff_hz.map(|f| AntiAlias::new(f, dt)),
            rng: streams.stream(purposes[n]),
            before: 0.0,
            latest: 0.0,
        };
        let [voltage, current, speed] = parts;
        let channels = [state(0, voltage), state(1, current), state(2, speed)];
        Self { channels, skew: setup.skew_s, dt, bits: setup.bits }
    }

    /// The true state at the end of an integration step.
    pub fn push(&mut self, now: &Instant) {
        for (channel, value) in self.channels.iter_mut().zip([now.u, now.i, now.omega]) {
            channel.push(value, now, self.dt);
        }
    }

    /// Samples at the *begin* of the step pushed last, plus the skew: codes and values of u, i, ω.
    pub fn sample(&mut self) -> ([u16; 3], [f64; 3]) {
        let mut codes = [0; 3];
        let mut values = [0.0; 3];
        for (n, channel) in self.channels.iter_mut().enumerate() {
            (codes[n], values[n]) = channel.convert(n as f64 * self.skew / self.dt, self.bits);
        }
        (codes, values)
    }
}
