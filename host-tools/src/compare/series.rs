//! A comparison sample by sample, as columns of a file.

use super::regions;
use super::result::{Comparison, Signal, Traces};
use crate::recording::series::Series;
use crate::recording::{Channel, Motion};

/// Signals and the columns that they are compared in.
const SIGNALS: [(Signal, Channel); 3] =
    [(Signal::Current, Channel::Current), (Signal::Speed, Channel::Speed), (Signal::Torque, Channel::Torque)];

impl Comparison {
    /// The columns of a file, all recordings one below the other: `recording` (its name, where there are several or one
    /// in parts), `t_s`, `u_v`, then `measured_…`, `modelled_…` and `residual_…` (modelled − measured) of each signal,
    /// as the figures are made of them, filtered alike; `counted`, whether a sample counts in them; and for each region
    /// of `where`, in its order, whether the sample lies in it. What a recording does not hold is empty.
    pub fn series(&self, motion: Motion) -> Series {
        let traces: Vec<&Traces> = self.per_recording.iter().map(|r| &r.traces).collect();
        let mut series = Series::default();
        if traces.len() > 1 {
            let rows = traces.iter().enumerate().flat_map(|(k, t)| std::iter::repeat_n(k, t.counted.len()));
            series.words("recording", rows.collect(), self.per_recording.iter().map(|r| r.recording.clone()).collect());
        }
        let times = |t: &&Traces| {
            let (start_s, interval_s) = (t.start_s, t.sample_time_s);
            (0..t.counted.len()).map(move |n| start_s + n as f64 * interval_s)
        };
        series.numbers("t_s", traces.iter().flat_map(times).collect(), Some("s"));
        let column = |of: &dyn Fn(&Traces) -> Vec<f64>| -> Option<Vec<f64>> {
            let parts: Vec<Vec<f64>> = traces.iter().map(|t| of(t)).collect();
            let is_there = parts.iter().any(|part| !part.is_empty());
            let filled = |(part, t): (Vec<f64>, &&Traces)| match part.is_empty() {
                true => vec![f64::NAN; t.counted.len()],
                false => part,
            };
            is_there.then(|| parts.into_iter().zip(&traces).flat_map(filled).collect())
        };
        if let Some(voltage) = column(&|t| t.voltage.clone()) {
            series.numbers(Channel::Voltage.column(), voltage, Some(Channel::Voltage.unit(motion)));
        }
        for (signal, channel) in SIGNALS {
            let [measured, modelled] = [0, 1].map(|side| column(&|t| t.signal(signal)[side].to_vec()));
            let (Some(measured), Some(modelled)) = (measured, modelled) else { continue };
            let residual = modelled.iter().zip(&measured).map(|(modelled, measured)| modelled - measured).collect();
            for (what, values) in [("measured", measured), ("modelled", modelled), ("residual", residual)] {
                series.numbers(format!("{what}_{}", channel.column()), values, Some(channel.unit(motion)));
            }
        }
        let counted: Vec<bool> = traces.iter().flat_map(|t| &t.counted).copied().collect();
        series.flags("counted", &counted);
        for (k, region) in self.regions.iter().enumerate() {
            let inside: Vec<bool> = traces.iter().flat_map(|t| regions::inside(region, &self.profiles, t)).collect();
            let name = format!("where_{}", k + 1);
            series.flags(&name, &inside);
            series.say(&name, &region.text);
        }
        let mut cutoffs: Vec<f64> = self.per_recording.iter().map(|r| r.cutoff_hz).collect();
        cutoffs.dedup();
        if let [cutoff] = cutoffs[..] {
            series.say("filter", format!("low-pass of {cutoff} Hz, of measured and modelled alike"));
        }
        series
    }
}
