//! What a comparison of a model with measurements yields.

use serde::Serialize;

use crate::between::Course;
use crate::speed_sensor::SpeedSensor;

/// A figure for each signal that a recording may hold; `None` where it does not apply.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct PerSignal {
    /// Of the current.
    pub current: Option<f64>,
    /// Of the speed.
    pub speed: Option<f64>,
    /// Of the torque (or force), in recordings that have it in place of the voltage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque: Option<f64>,
}

/// How much smaller an error has to be to count as having fallen.
const GAIN: f64 = 0.99;

impl PerSignal {
    /// Whether errors have fallen on the whole, and one of them has by itself.
    pub fn falls_to(&self, after: &Self) -> bool {
        let pairs = [(self.current, after.current), (self.speed, after.speed), (self.torque, after.torque)];
        let ratios: Vec<f64> = pairs.iter().filter_map(|(before, after)| Some((*after)? / (*before)?)).collect();
        ratios.iter().product::<f64>() < GAIN && ratios.iter().any(|r| *r < GAIN)
    }

    /// The figure of one signal.
    pub fn of(&self, signal: Signal) -> Option<f64> {
        match signal {
            Signal::Current => self.current,
            Signal::Speed => self.speed,
            Signal::Torque => self.torque,
        }
    }
}

/// A signal that is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Signal {
    /// i, A.
    Current,
    /// ω, rad/s (m/s of a linear drive).
    Speed,
    /// T, N m (N of a linear drive).
    Torque,
}

/// Measured and modelled signals of one recording, filtered alike, at the recording's sampling rate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Traces {
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Sampling interval, s.
    pub sample_time_s: f64,
    /// Mains period, s; `None` on DC.
    pub mains_period_s: Option<f64>,
    /// Voltage, V (raw, as it drives the model); empty where not recorded. So are the others.
    pub voltage: Vec<f64>,
    /// Measured current, A.
    pub measured_current: Vec<f64>,
    /// Modelled current, A, in free run.
    pub modelled_current: Vec<f64>,
    /// Measured speed, rad/s.
    pub measured_speed: Vec<f64>,
    /// Modelled speed, rad/s, in free run.
    pub modelled_speed: Vec<f64>,
    /// Measured torque, N m.
    pub measured_torque: Vec<f64>,
    /// Torque that the model needs for the measured motion, N m.
    pub modelled_torque: Vec<f64>,
    /// Samples that count in the figures (settled, not masked).
    pub counted: Vec<bool>,
    /// Whether the free run leaves all bounds.
    pub diverges: bool,
}

impl Traces {
    /// Measured and modelled values of a signal; empty where not recorded.
    pub fn signal(&self, signal: Signal) -> [&[f64]; 2] {
        match signal {
            Signal::Current => [&self.measured_current, &self.modelled_current],
            Signal::Speed => [&self.measured_speed, &self.modelled_speed],
            Signal::Torque => [&self.measured_torque, &self.modelled_torque],
        }
    }
}

/// Mean and RMS of a residual (modelled − measured) over bins of another quantity.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Profile {
    /// The residual's signal.
    pub quantity: Signal,
    /// What it is sorted by: `i_a`, `abs_i_a`, `omega_rad_s`, `u_v`, `di_dt_sign`, `mains_phase_deg`, `t_s`.
    pub axis: &'static str,
    /// Bin edges, one more than bins, in the axis' unit.
    pub edges: Vec<f64>,
    /// Samples in each bin.
    pub counts: Vec<usize>,
    /// Mean residual in each bin, in the signal's unit; 0 in empty bins.
    pub mean: Vec<f64>,
    /// RMS residual in each bin; 0 in empty bins.
    pub rms: Vec<f64>,
}

/// Mean residual over the plane of current and speed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Map {
    /// The residual's signal.
    pub quantity: Signal,
    /// Edges of the current, A.
    pub current_edges: Vec<f64>,
    /// Edges of the speed, rad/s.
    pub speed_edges: Vec<f64>,
    /// Samples in each cell; row by row, a row per speed bin.
    pub counts: Vec<usize>,
    /// Mean residual in each cell, in the signal's unit; 0 in empty cells.
    pub mean: Vec<f64>,
}

/// A region of operation in which the model fails more than elsewhere.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Region {
    /// The quantity that delimits it.
    pub axis: &'static str,
    /// From.
    pub from: f64,
    /// To.
    pub to: f64,
    /// The signal whose residual is large there.
    pub quantity: Signal,
    /// RMS residual there, in the signal's unit.
    pub error_rms: f64,
    /// Mean residual there, modelled − measured.
    pub error_mean: f64,
    /// RMS residual there over the RMS residual of the whole.
    pub times_average: f64,
    /// Share of the squared residual that lies there.
    pub share: f64,
    /// All of it in words.
    pub text: String,
}

/// One recording against the model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordingComparison {
    /// The file, as the user named it.
    pub recording: String,
    /// Free-run error-to-signal ratio: RMS(model − measured) / RMS(measured).
    pub esr: PerSignal,
    /// What a perfect model would show on these data.
    pub noise_floor: PerSignal,
    /// Current error with measured u and ω imposed; speed error with measured i imposed.
    pub structured: PerSignal,
    /// RMS of the measured signals, in their units.
    pub rms: PerSignal,
    /// What the voltage was taken to do between its samples; `None` where there is none.
    pub input: Option<Course>,
    /// Share of the interval by which the supply is switched before a sample, where it is switched.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input_share: Option<f64>,
    /// How the speed was measured, if it was not sampled; the model's is shown alike.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_sensor: Option<SpeedSensor>,
    /// Cut-off of the filter that measured and modelled signals went through, Hz.
    pub cutoff_hz: f64,
    /// Whether the free run leaves all bounds: then there is no error.
    pub diverges: bool,
    /// What the user should know about these data.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// The signals themselves, for plots.
    #[serde(skip)]
    pub traces: Traces,
}

/// A model against one or several recordings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// What the voltage was taken to do between its samples, if that is one for all recordings.
    pub input: Option<Course>,
    /// Whether the free run of a recording leaves all bounds.
    pub diverges: bool,
    /// Free-run error-to-signal ratio over all recordings together.
    pub esr: PerSignal,
    /// What a perfect model would show on these data.
    pub noise_floor: PerSignal,
    /// How the noise floor was found; `None` where it is unknown.
    pub noise_floor_source: Option<String>,
    /// Current error with measured u and ω imposed; speed error with measured i imposed.
    pub structured: PerSignal,
    /// RMS of the one-step (equation) residuals relative to RMS of voltage and torque: `current` is that of the voltage
    /// balance, `speed` that of the torque balance. Of slow samples, whose rates say nothing, RMS of what is predicted
    /// from one sample to the next relative to RMS of current and speed.
    pub one_step: PerSignal,
    /// Recording by recording.
    pub per_recording: Vec<RecordingComparison>,
    /// Where the model fails, worst first.
    #[serde(rename = "where")]
    pub regions: Vec<Region>,
    /// Residual profiles over all recordings.
    #[serde(skip)]
    pub profiles: Vec<Profile>,
    /// Residual maps over all recordings.
    #[serde(skip)]
    pub maps: Vec<Map>,
}
