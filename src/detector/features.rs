//! What a period of the mains tells about the motor.
//!
//! With i, ω measured and î, ω̂ modelled (both filtered alike), e = î − i, ε = ω̂ − ω, and h the current above 1 kHz
//! before that filter, means over one period:
//!
//! | feature | formula | unit |
//! | --- | --- | --- |
//! | error of the current | √(⟨e²⟩/⟨i²⟩) | 1 |
//! | error of the speed | √(⟨ε²⟩/⟨ω²⟩) | 1 |
//! | deviation of the current | −⟨e î⟩/⟨î²⟩ = by how much the motor draws more than the model | 1 |
//! | deviation of the speed | −⟨ε ω̂⟩/⟨ω̂²⟩ = by how much it runs faster | 1 |
//! | sparking | √⟨h²⟩ | A |
//! | arcing | ⟨\|i\|⟩ (⟨h² \|i\|⟩ − ⟨h²⟩⟨\|i\|⟩)/(⟨i²⟩ − ⟨\|i\|⟩²) | A² |
//!
//! Noise of the sensor is there with and without a current; sparks need one. The last line, the mean of h² that goes
//! with |i| by linear regression over the period, holds them alone. On direct current, where |i| does not change,
//! nothing can tell, and it is zero.

use crate::motor::State;
use crate::scalar::root;

/// How many features a period has.
pub const FEATURES: usize = 10;

/// Least variance of |i| over its mean square from which the period tells what goes with it: a sine has 0.19.
const LEAST_VARIATION: f32 = 0.02;

/// The features of a period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Features {
    /// Error of the current.
    pub current: f32,
    /// Error of the speed.
    pub speed: f32,
    /// Deviation of the current: positive where the motor draws more than the model.
    pub current_deviation: f32,
    /// Deviation of the speed: positive where the motor runs faster than the model.
    pub speed_deviation: f32,
    /// RMS of the current above 1 kHz, A.
    pub sparking: f32,
    /// Its power, A², as far as it goes with the current over the period.
    pub arcing: f32,
    /// RMS of the voltage, V.
    pub voltage_rms: f32,
    /// RMS of the measured current, A.
    pub current_rms: f32,
    /// Mean of the measured speed, rad/s.
    pub speed_mean: f32,
    /// Share of the samples at which the correction was within what it has been trained on.
    pub validity: f32,
}

impl Features {
    /// The mean of each over periods; zero without any.
    pub fn mean<'a>(periods: impl Iterator<Item = &'a Self>) -> Self {
        let (mut sum, mut count) = (Self::default(), 0.0f32);
        for period in periods {
            count += 1.0;
            // A running mean: no sum to grow out of single precision.
            for (mean, value) in sum.each_mut().into_iter().zip(period.each()) {
                *mean += (value - *mean) / count;
            }
        }
        sum
    }

    /// From all of them, in order of declaration.
    #[cfg(feature = "link")]
    pub(crate) fn of(values: [f32; FEATURES]) -> Self {
        let mut features = Self::default();
        for (place, value) in features.each_mut().into_iter().zip(values) {
            *place = value;
        }
        features
    }

    /// All of them, in order of declaration.
    pub(crate) fn each(&self) -> [f32; FEATURES] {
        let mut copy = *self;
        copy.each_mut().map(|x| *x)
    }

    fn each_mut(&mut self) -> [&mut f32; FEATURES] {
        [
            &mut self.current,
            &mut self.speed,
            &mut self.current_deviation,
            &mut self.speed_deviation,
            &mut self.sparking,
            &mut self.arcing,
            &mut self.voltage_rms,
            &mut self.current_rms,
            &mut self.speed_mean,
            &mut self.validity,
        ]
    }
}

/// Sums over a period.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sums {
    count: u32,
    voltage: f32,
    current: f32,
    speed: f32,
    speed_sum: f32,
    magnitude: f32,
    current_error: f32,
    speed_error: f32,
    current_product: f32,
    speed_product: f32,
    model_current: f32,
    model_speed: f32,
    high: f32,
    high_with_current: f32,
    validity: f32,
}

/// What a sample contributes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Raw voltage, V.
    pub voltage: f32,
    /// Measured and filtered.
    pub measured: State<f32>,
    /// Modelled and filtered.
    pub modelled: State<f32>,
    /// Current above 1 kHz, A.
    pub high: f32,
    /// Validity of the correction, 0 to 1.
    pub validity: f32,
}

impl Sums {
    /// Adds a sample.
    #[inline]
    pub fn add(&mut self, p: &Point) {
        let error = p.modelled.current - p.measured.current;
        let slip = p.modelled.speed - p.measured.speed;
        let magnitude = p.measured.current.abs();
        let high = p.high * p.high;
        self.count += 1;
        self.voltage += p.voltage * p.voltage;
        self.current += p.measured.current * p.measured.current;
        self.speed += p.measured.speed * p.measured.speed;
        self.speed_sum += p.measured.speed;
        self.magnitude += magnitude;
        self.current_error += error * error;
        self.speed_error += slip * slip;
        self.current_product += error * p.modelled.current;
        self.speed_product += slip * p.modelled.speed;
        self.model_current += p.modelled.current * p.modelled.current;
        self.model_speed += p.modelled.speed * p.modelled.speed;
        self.high += high;
        self.high_with_current += high * magnitude;
        self.validity += p.validity;
    }

    /// The sums of a period that begins with this sample.
    #[inline]
    pub fn of(first: &Point) -> Self {
        let mut sums = Self::default();
        sums.add(first);
        sums
    }

    /// How many samples have been added.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// The features.
    pub fn features(&self) -> Features {
        let mut features = Features::default();
        for place in 0..FEATURES {
            self.feature(place, &mut features);
        }
        features
    }

    /// A feature by its place in the order of declaration.
    #[inline]
    pub(super) fn feature(&self, place: usize, f: &mut Features) {
        let n = self.samples();
        match place {
            0 => f.current = root(ratio(self.current_error, self.current)),
            1 => f.speed = root(ratio(self.speed_error, self.speed)),
            2 => f.current_deviation = -ratio(self.current_product, self.model_current),
            3 => f.speed_deviation = -ratio(self.speed_product, self.model_speed),
            4 => f.sparking = root(self.high / n),
            5 => f.arcing = self.arcing(n),
            6 => f.voltage_rms = root(self.voltage / n),
            7 => f.current_rms = root(self.current / n),
            8 => f.speed_mean = self.speed_sum / n,
            _ => f.validity = self.validity / n,
        }
    }

    fn arcing(&self, n: f32) -> f32 {
        let (square, magnitude) = (self.current / n, self.magnitude / n);
        let varies = square - magnitude * magnitude;
        if varies > LEAST_VARIATION * square {
            magnitude * (self.high_with_current / n - self.high / n * magnitude) / varies
        } else {
            0.0
        }
    }

    /// How many samples have been added, at least 1.
    fn samples(&self) -> f32 {
        self.count.max(1) as f32
    }
}

fn ratio(a: f32, b: f32) -> f32 {
    if b > 0.0 { a / b } else { 0.0 }
}
