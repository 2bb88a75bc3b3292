//! Channels of different rates, brought to one raster.
//!
//! A current that its logger renews every so many rows only is late by up to as much, and looks neither like the
//! motor's nor like noise. At the rows with a new value all channels are samples of one instant: those rows alone are a
//! sound recording, of a lower rate. It is sound as long as it carries the voltage: the line between the rows that are
//! kept has the mean of the samples between them.

use crate::counts::Window;
use crate::recording::finding::{Code, DataFinding, Handled};
use crate::recording::{Channel, Recording};

/// Error of the means of the voltage, in its RMS, in the median over the intervals: a sine of seven samples a period
/// leaves (2π/7)²/12 √2 · 0.7 = 0.066 of it, one of eight 0.05.
const CARRIED: f64 = 0.05;
/// Fewest rows that are left.
const FEWEST: usize = 100;

/// Takes the rows of each recording at which its current is new, where `found` says that it is held.
pub fn take_renewed(recordings: &mut [Recording], found: &mut [DataFinding]) {
    for recording in recordings {
        let is_held = |f: &&mut DataFinding| {
            f.code == Code::HeldValues && f.channel == Some(Channel::Current) && f.recording == recording.path()
        };
        let Some(finding) = found.iter_mut().find(is_held) else { continue };
        let window = recording.channel(Channel::Current).and_then(Window::of);
        let Some(Window { samples, first, .. }) = window.filter(|w| carries_voltage(recording, w)) else { continue };
        let Some(renewed) = recording.one_row_in(samples, first).filter(|r| r.len() >= FEWEST) else { continue };
        *recording = renewed;
        finding.handled = Handled::Corrected;
        finding.text += "; the rows with a new value are taken, and no others";
    }
}

/// Whether the rows at a window's ends tell what the voltage does in between.
fn carries_voltage(recording: &Recording, window: &Window) -> bool {
    let Some(u) = recording.channel(Channel::Voltage) else { return true };
    let power = u.iter().map(|u| u * u).sum::<f64>() / u.len() as f64;
    let ends: Vec<usize> = (window.first..u.len()).step_by(window.samples).collect();
    let error = |pair: &[usize]| {
        let (a, b) = (pair[0], pair[1]);
        let sum = u[a + 1..b].iter().sum::<f64>() + 0.5 * (u[a] + u[b]);
        (sum / (b - a) as f64 - 0.5 * (u[a] + u[b])).powi(2)
    };
    let mut errors: Vec<f64> = ends.windows(2).map(error).collect();
    if errors.is_empty() {
        return false;
    }
    let middle = errors.len() / 2;
    *errors.select_nth_unstable_by(middle, f64::total_cmp).1 <= CARRIED * CARRIED * power
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::{Purpose, question};
    use crate::model::Kind;
    use crate::rig::Setup;

    fn held(recording: &Recording, rows: usize) -> Recording {
        let mut held = recording.clone();
        let i = recording.channel(Channel::Current).unwrap();
        held.set_channel(Channel::Current, (0..i.len()).map(|n| i[n / rows * rows]).collect()).unwrap();
        held
    }

    #[test]
    fn the_rows_at_which_a_held_current_is_new_are_what_a_slower_logger_writes() {
        let sound = Setup::new(Kind::PmDc).profile("dc-steps").unwrap().seconds(3.0).run().unwrap().recording;
        let mut recordings = [held(&sound, 7)];
        let found = question(&mut recordings, Kind::PmDc, Purpose::Fit);
        let told = found.iter().find(|f| f.code == Code::HeldValues && f.channel == Some(Channel::Current)).unwrap();
        assert_eq!(told.handled, Handled::Corrected, "{}", told.text);
        assert!((recordings[0].sample_time_s() - 7.0 * sound.sample_time_s()).abs() < 1e-12);
        for channel in [Channel::Voltage, Channel::Current, Channel::Speed] {
            let kept: Vec<f64> = sound.channel(channel).unwrap().iter().copied().step_by(7).collect();
            assert_eq!(recordings[0].channel(channel).unwrap(), kept, "{channel:?}");
        }
    }

    #[test]
    fn a_raster_that_is_too_slow_for_the_mains_is_not_taken() {
        // 50 Hz at 10 kHz: 5 of 10,000 samples a second are enough, 80 rows leave 2.5 a period.
        let sound = Setup::new(Kind::Universal).profile("ramp").unwrap().seconds(4.0).run().unwrap().recording;
        for (rows, is_taken) in [(5, true), (80, false)] {
            let mut recordings = [held(&sound, rows)];
            let mut found = crate::check::check(&recordings, Some(Kind::Universal));
            take_renewed(&mut recordings, &mut found);
            assert_eq!(recordings[0].len() < sound.len(), is_taken, "{rows} rows");
        }
    }
}
