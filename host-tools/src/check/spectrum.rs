//! Spectra of short windows, the median over the windows: what jumps somewhere does not count.

use std::f64::consts::TAU;

use realfft::RealFftPlanner;

use super::signals::Signals;
use crate::recording::Channel;
use crate::recording::finding::{Code, DataFinding};

/// Current and speed, where nothing is told of them that has a spectrum of its own, such as steps.
pub fn plain_channels<'a>(s: &Signals<'a>, found: &[DataFinding]) -> Vec<(Channel, &'a [f64])> {
    let has_none = |f: &&DataFinding| matches!(f.code, Code::OneSided | Code::Outliers | Code::Clipped);
    let own = |channel: Channel| {
        found.iter().filter(|f| f.recording == s.path() && f.channel == Some(channel)).any(|f| !has_none(&f))
    };
    s.channels()
        .filter(|(channel, _)| !matches!(channel, Channel::Angle | Channel::Voltage) && !own(*channel))
        .collect()
}

/// Power at each frequency k/length, the median over windows.
pub fn spectrum(values: &[f64], length: usize, hop: usize) -> Option<Vec<f64>> {
    const FEWEST_WINDOWS: usize = 8;
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(length);
    let window: Vec<f64> = (0..length).map(|k| 0.5 - 0.5 * (TAU * k as f64 / length as f64).cos()).collect();
    let mut all: Vec<Vec<f64>> = Vec::new();
    let mut output = fft.make_output_vec();
    for from in (0..values.len().saturating_sub(length)).step_by(hop) {
        let piece = &values[from..from + length];
        // A straight line through the ends, so that a run-up is no edge.
        let (a, b) = (piece[0], (piece[length - 1] - piece[0]) / (length - 1) as f64);
        let mut input: Vec<f64> = (0..length).map(|k| (piece[k] - a - b * k as f64) * window[k]).collect();
        fft.process(&mut input, &mut output).ok()?;
        all.push(output.iter().map(|x| x.norm_sqr()).collect());
    }
    if all.len() < FEWEST_WINDOWS {
        return None;
    }
    let middle = all.len() / 2;
    let at = |k: usize| {
        let mut powers: Vec<f64> = all.iter().map(|w| w[k]).collect();
        *powers.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    Some((0..length / 2 + 1).map(at).collect())
}
