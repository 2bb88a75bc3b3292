//! What chains, loggers and people do to a recording's samples.

use std::io::Write as _;
use std::path::Path;

use greyrig_host::error::Result;
use greyrig_host::recording::{Channel, Mapping, Recording, load};

use super::Random;

/// A recording with other channels on a raster of its own.
pub fn rebuilt(run: &Recording, interval_s: f64, channels: impl Fn(&[f64]) -> Vec<f64>) -> Recording {
    let flags = |x: &[bool]| {
        let values: Vec<f64> = x.iter().map(|on| f64::from(u8::from(*on))).collect();
        channels(&values).into_iter().map(|x| x > 0.5).collect::<Vec<bool>>()
    };
    let builder = Recording::builder(interval_s)
        .path(run.path())
        .rotor_locked(flags(run.rotor_locked()))
        .supply_open(flags(run.supply_open()))
        .metadata(run.metadata().clone());
    let builder = run.channels().iter().fold(builder, |b, (c, x)| b.channel(*c, channels(x)));
    builder.build().expect("channels of one length")
}

/// Only some samples.
pub fn kept(run: &Recording, keep: &[bool]) -> Recording {
    rebuilt(run, run.sample_time_s(), |x| x.iter().zip(keep).filter(|(_, keep)| **keep).map(|(x, _)| *x).collect())
}

/// One channel changed.
pub fn change(run: &Recording, channel: Channel, f: impl FnOnce(&mut Vec<f64>)) -> Recording {
    let mut changed = run.clone();
    let mut values = of(run, channel).to_vec();
    f(&mut values);
    changed.set_channel(channel, values).expect("as many samples");
    changed
}

/// Each sample of one channel changed.
pub fn each(run: &Recording, channel: Channel, mut f: impl FnMut(usize, f64) -> f64) -> Recording {
    change(run, channel, |x| x.iter_mut().enumerate().for_each(|(n, x)| *x = f(n, *x)))
}

/// One channel times a factor.
pub fn times(run: &Recording, channel: Channel, factor: f64) -> Recording {
    each(run, channel, |_, x| factor * x)
}

/// A channel that is there.
pub fn of(run: &Recording, channel: Channel) -> &[f64] {
    run.channel(channel).expect("the rig records all three")
}

/// Largest magnitude.
pub fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// Root mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

/// Standard deviation of the noise per sample, by fourth differences.
pub fn noise(values: &[f64]) -> f64 {
    let fourth = |w: &[f64]| (w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).abs();
    let mut all: Vec<f64> = values.windows(5).map(fourth).collect();
    all.sort_by(f64::total_cmp);
    all[all.len() / 2] / (0.674_49 * 70f64.sqrt())
}

/// Linear interpolation at a position in samples.
pub fn at(values: &[f64], position: f64) -> f64 {
    let position = position.clamp(0.0, (values.len() - 1) as f64);
    let n = (position as usize).min(values.len().saturating_sub(2));
    values[n] + (position - n as f64) * (values[n + 1] - values[n])
}

/// Mean over the last samples.
pub fn mean_of_last(values: &[f64], window: usize) -> Vec<f64> {
    let mut sum = 0.0;
    (0..values.len())
        .map(|n| {
            sum += values[n];
            if n >= window {
                sum -= values[n - window];
            }
            sum / window.min(n + 1) as f64
        })
        .collect()
}

/// Root of the mean square of the last samples.
pub fn rms_of_last(values: &[f64], window: usize) -> Vec<f64> {
    let squares: Vec<f64> = values.iter().map(|x| x * x).collect();
    mean_of_last(&squares, window).into_iter().map(|x| x.max(0.0).sqrt()).collect()
}

/// Noise whose power falls with the frequency, RMS 1: a sum of first-order processes an octave apart.
pub fn pink(length: usize, random: &mut Random) -> Vec<f64> {
    let poles: Vec<f64> = (1..14).map(|k| 1.0 - 0.5_f64.powi(k)).collect();
    let mut states = vec![0.0; poles.len()];
    let mut next = || {
        for (state, pole) in states.iter_mut().zip(&poles) {
            *state = pole * *state + (1.0 - pole * pole).sqrt() * random.gaussian();
        }
        states.iter().sum::<f64>()
    };
    (0..20_000).for_each(|_| {
        next();
    });
    let values: Vec<f64> = (0..length).map(|_| next()).collect();
    let scale = (poles.len() as f64).sqrt();
    values.into_iter().map(|x| x / scale).collect()
}

/// Writes a text file with a time column and reads it as a user's.
///
/// # Errors
/// A file that is refused.
pub fn through_text(run: &Recording, stamps_s: &[f64], name: &str) -> Result<Recording> {
    let folder = std::env::temp_dir().join(format!("greyrig-exam-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    let path = folder.join(name);
    write(run, stamps_s, &path).expect("a temporary file");
    let read = load(&path, &Mapping::default(), &greyrig_host::context::Context::default());
    std::fs::remove_file(&path).expect("it was written");
    read
}

fn write(run: &Recording, stamps_s: &[f64], path: &Path) -> std::io::Result<()> {
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    writeln!(file, "t_s,u_v,i_a,omega_rad_s,rotor_locked,supply_open")?;
    let flag = |x: &[bool], n: usize| u8::from(x.get(n).copied().unwrap_or(false));
    for (n, t) in stamps_s.iter().enumerate() {
        let [u, i, w] = [Channel::Voltage, Channel::Current, Channel::Speed].map(|c| of(run, c)[n]);
        let (locked, open) = (flag(run.rotor_locked(), n), flag(run.supply_open(), n));
        writeln!(file, "{t:.7},{u:.6},{i:.6},{w:.5},{locked},{open}")?;
    }
    file.flush()
}
