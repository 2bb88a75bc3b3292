//! Whether time stamps are those of a uniformly sampled run.
//!
//! Loggers print rounded stamps and jitter by a part of an interval; the samples themselves were taken by a timer. So
//! each interval may differ from the mean by half of it (more would mean a lost or doubled sample), and the stamps may
//! wander from a straight line by one interval or 10^-4 of the run, whichever is more (a crystal stays within 50 ppm
//! over temperature; a change of the sampling rate does not).

use super::table::{MAX_VALUES, Table};

/// A uniform time axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeAxis {
    /// First time stamp, s.
    pub start_s: f64,
    /// Sampling interval, s.
    pub interval_s: f64,
    /// Largest deviation of an interval from the mean, as a fraction of it.
    pub jitter: f64,
}

/// A time axis that cannot be used: the row, what is wrong, what to do.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// Row, from zero.
    pub row: usize,
    /// What is wrong.
    pub what: String,
    /// What to do.
    pub remedy: String,
}

/// Largest deviation of one interval from the mean interval, as a fraction of it.
const JITTER_LIMIT: f64 = 0.5;

/// Checks time stamps in seconds.
///
/// # Errors
/// The first row at which the axis stops being uniform.
pub fn check(t: &[f64]) -> Result<TimeAxis, Fault> {
    let fault = |row, what: String, remedy: &str| Err(Fault { row, what, remedy: remedy.into() });
    if let Some(row) = t.iter().position(|x| !x.is_finite()) {
        return fault(
            row,
            "the time is missing".into(),
            "fill in the time, or remove the row and cut the recording there",
        );
    }
    if t.len() < 2 {
        return fault(0, "there is only one sample".into(), "record at least two samples");
    }
    let steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
    let mut sorted = steps.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    if median < 0.0 {
        return fault(1, "the time runs backwards".into(), "sort the rows by time");
    }
    let coarse = "if the stamps are printed too coarsely, remove the time column and give the interval with --map sample_time_s=1e-4";
    if let Some(k) = steps.iter().position(|&s| s <= 0.0) {
        let (what, remedy) = if steps[k] == 0.0 {
            (format!("the time {} s appears twice", t[k + 1]), coarse)
        } else {
            // Whole numbers of that size are no times.
            let told = |x: f64| if x.abs() < 1e15 { x.to_string() } else { format!("{x:e}") };
            let what = format!("the time jumps back from {} s to {} s", told(t[k]), told(t[k + 1]));
            (what, "give one run per file, sorted by time")
        };
        return fault(k + 1, what, remedy);
    }
    let interval = (t[t.len() - 1] - t[0]) / steps.len() as f64;
    let worst = steps.iter().map(|s| (s / interval - 1.0).abs()).fold(0.0, f64::max);
    // Stamps near 1e9 s (seconds since 1970) carry a rounding error of their own.
    let rounding = 2.0 * f64::EPSILON * t[0].abs().max(t[t.len() - 1].abs()) / interval;
    if worst <= JITTER_LIMIT + rounding {
        let allowed = (1e-4 * steps.len() as f64).max(1.0) + rounding;
        let off = |k: usize| ((t[k] - t[0]) / interval - k as f64).abs();
        if (0..t.len()).all(|k| off(k) <= allowed) {
            // Twelve digits are more than any stamp has; the rest is the noise of binary fractions.
            let interval_s = format!("{interval:.11e}").parse().unwrap_or(interval);
            return Ok(TimeAxis { start_s: t[0], interval_s, jitter: worst });
        }
    }
    let unlike = |s: f64, reference: f64| (s / reference - 1.0).abs() > JITTER_LIMIT;
    let odd = steps.iter().filter(|&&s| unlike(s, median)).count();
    // Two sampling rates leave two long stretches, each uniform in itself.
    let first = steps[..steps.len().min(16)].iter().sum::<f64>() / steps.len().min(16) as f64;
    let tail = &steps[steps.len() - steps.len().min(16)..];
    let last = tail.iter().sum::<f64>() / tail.len() as f64;
    let changes = (last / first - 1.0).abs() > 0.02;
    let (uniform_start, uniform_end) =
        (!steps.iter().take(16).any(|&s| unlike(s, first)), !tail.iter().any(|&s| unlike(s, last)));
    if changes && uniform_start && uniform_end && steps.len() >= 8 {
        let middle = 0.5 * (first + last);
        let k = steps.iter().position(|&s| (s > middle) == (last > first)).unwrap_or(0);
        return fault(
            k + 1,
            format!("the sampling interval changes from {} s to {} s", short(first), short(last)),
            "give each sampling rate a file of its own, or resample to one rate",
        );
    }
    if let Some(k) = steps.iter().position(|&s| unlike(s, median)) {
        if odd * 10 <= steps.len() && steps[k] > median {
            let missing = (steps[k] / median).round() - 1.0;
            let what = if missing > MAX_VALUES as f64 {
                format!("a gap of {} s is longer than any recording: a damaged stamp", short(steps[k]))
            } else if missing < 1.0 {
                format!("the interval of {} s does not fit the {} s of the other rows", short(steps[k]), short(median))
            } else {
                format!("a gap of {} s: {missing} samples are missing", short(steps[k]))
            };
            return fault(k + 1, what, "cut the file there into two recordings, or fill the rows with empty cells");
        }
        return fault(
            k + 1,
            format!("the time is not uniform: {} s after intervals of {} s", short(steps[k]), short(median)),
            "record with a fixed sampling rate, or resample before",
        );
    }
    let k = (0..t.len()).find(|&k| ((t[k] - t[0]) / interval - k as f64).abs() > (1e-4 * t.len() as f64).max(1.0));
    fault(
        k.unwrap_or(1),
        format!("the time is not uniform: it wanders from the mean interval of {} s", short(interval)),
        "record with a fixed sampling rate, or resample before",
    )
}

/// Times of day, s, that go on counting after midnight.
pub fn over_midnight(seconds: &mut [f64]) {
    const DAY: f64 = 86_400.0;
    let (mut days, mut last) = (0.0, f64::NEG_INFINITY);
    for t in seconds {
        // Half a day back in one step is the next day.
        if *t < last - 0.5 * DAY {
            days += 1.0;
        }
        last = *t;
        *t += days * DAY;
    }
}

/// Six significant digits, without the noise of binary fractions.
pub fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let digits = 5 - x.abs().log10().floor() as i32;
    let rounded = format!("{:.*e}", 5, x).parse::<f64>().unwrap_or(x);
    // Doubles are whole numbers from there on, and people read no more digits.
    let plain = (0..=12).contains(&digits) || (1e-4..1e15).contains(&x.abs());
    if plain { format!("{rounded}") } else { format!("{rounded:e}") }
}

/// Whether a metadata key states a sampling rate (true) or interval (false), and its factor to Hz or s.
fn interval_key(key: &str) -> Option<(bool, f64)> {
    let name = key.rsplit('/').next().unwrap_or(key).trim().to_lowercase().replace([' ', '-'], "_");
    Some(match name.as_str() {
        "sample_time_s" | "sample_time" | "sampling_interval" | "sample_interval" | "sampling_time" | "ts" | "dt"
        | "ts_s" | "dt_s" | "interval_s" | "delta_x" => (false, 1.0),
        "dt_ms" | "ts_ms" | "sample_time_ms" => (false, 1e-3),
        "dt_us" | "ts_us" | "sample_time_us" => (false, 1e-6),
        "fs" | "fs_hz" | "sample_rate" | "sample_rate_hz" | "sampling_rate" | "samplerate" | "sampling_frequency"
        | "sample_frequency" => (true, 1.0),
        _ => return None,
    })
}

/// Whether a metadata key states the sampling rate or interval.
pub fn is_interval_key(key: &str) -> bool {
    interval_key(key).is_some()
}

/// The sampling interval that a file's metadata state, s.
///
/// # Errors
/// A value that is no positive number.
pub fn from_metadata(table: &Table) -> Result<Option<f64>, (String, String)> {
    for (key, value) in &table.metadata {
        let Some((is_rate, factor)) = interval_key(key) else { continue };
        let (number, unit) = match value.trim().split_once(char::is_whitespace) {
            Some((n, u)) => (n, Some(u.trim())),
            None => (value.trim(), None),
        };
        let factor = match unit.map(|u| u.to_lowercase()) {
            None => factor,
            Some(u) => match (u.trim_matches(['[', ']', '(', ')']), is_rate) {
                ("hz" | "1/s" | "s/s" | "sps" | "samples/s", true) | ("s", false) => 1.0,
                ("khz" | "ks/s" | "ksps", true) => 1e3,
                ("mhz" | "ms/s", true) => 1e6,
                ("ms", false) => 1e-3,
                ("us" | "µs", false) => 1e-6,
                ("ns", false) => 1e-9,
                _ => f64::NAN,
            },
        };
        let value = number.parse::<f64>().unwrap_or(f64::NAN) * factor;
        if !(value.is_finite() && value > 0.0) {
            return Err((
                format!("the metadata '{key}: {}' give no sampling interval", table.metadata[key].trim()),
                "write '# sample_time_s: 1e-4', or add a column t_s".into(),
            ));
        }
        return Ok(Some(if is_rate { 1.0 / value } else { value }));
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stamps(n: usize, dt: f64) -> Vec<f64> {
        (0..n).map(|k| k as f64 * dt).collect()
    }

    #[test]
    fn rounded_and_jittering_stamps_pass() {
        // 3 kHz printed with four decimals: 0.0000 0.0003 0.0007 0.0010.
        let rounded: Vec<f64> = stamps(3001, 1.0 / 3000.0).iter().map(|t| (t * 1e4).round() / 1e4).collect();
        let axis = check(&rounded).expect("uniform");
        // The ends are rounded by at most 5e-5 s each: 1e-4 s over 1 s.
        assert!((axis.interval_s * 3000.0 - 1.0).abs() < 1e-4);
        let jitter: Vec<f64> = (0..1000).map(|k| 1e-3 * (k as f64 + 0.2 * ((k * 7919) % 11) as f64 / 11.0)).collect();
        assert!(check(&jitter).is_ok());
        let absolute: Vec<f64> = stamps(1000, 1e-4).iter().map(|t| t + 1.772_352e9).collect();
        assert!(check(&absolute).is_ok());
    }

    #[test]
    fn faults_name_the_first_row() {
        let mut t = stamps(100, 1e-3);
        t[40] = t[39];
        assert_eq!(check(&t).expect_err("duplicate").row, 40);
        let mut t = stamps(100, 1e-3);
        for x in &mut t[60..] {
            *x += 5e-3;
        }
        let gap = check(&t).expect_err("gap");
        assert_eq!(gap.row, 60);
        assert!(gap.what.contains("5 samples"), "{}", gap.what);
        let mut t = stamps(100, 1e-3);
        for (k, x) in t[50..].iter_mut().enumerate() {
            *x = 0.049 + 2e-3 * (k + 1) as f64;
        }
        let rates = check(&t).expect_err("two rates");
        assert_eq!(rates.row, 50);
        assert!(rates.what.contains("0.001 s to 0.002 s"), "{}", rates.what);
        // A rate change too small for the limit on single intervals shows in the drift.
        let mut t = stamps(2000, 1e-3);
        for (k, x) in t[1000..].iter_mut().enumerate() {
            *x = 0.999 + 1.25e-3 * (k + 1) as f64;
        }
        assert_eq!(check(&t).expect_err("two rates").row, 1000);
        let reversed: Vec<f64> = stamps(100, 1e-3).into_iter().rev().collect();
        assert!(check(&reversed).expect_err("reversed").what.contains("backwards"));
        let square: Vec<f64> = (0..100).map(|k| 1e-5 * (k * k) as f64).collect();
        assert!(check(&square).is_err());
    }
}
