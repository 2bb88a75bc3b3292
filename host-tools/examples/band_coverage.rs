//! What share of the samples of recordings that no fit has seen lies within the band of `predict`, on the virtual rig:
//! `cargo run --release -p greyrig-host --example band_coverage [MOTORS] [PERCENT]`.
//!
//! Each motor of a population is fitted to one recording of each of two profiles; other recordings of the same motor
//! are predicted from their voltage alone: of the same profiles, and of others. Of each case there is the model with
//! the effect that the motor has, and, where it has one, the model without.

use greyrig_host::context::Context;
use greyrig_host::error::Result;
use greyrig_host::forecast::{self, predict};
use greyrig_host::identify::{Settings, identify};
use greyrig_host::model::{Kind, Model, catalogue};
use greyrig_host::recording::{Channel, Recording};
use greyrig_host::rig::{Motor, Setup};
use rayon::prelude::*;

/// Scatter of the motors' parameters in a population.
const SPREAD: f64 = 0.05;

/// Recordings of one kind of motor.
struct Bench {
    kind: Kind,
    /// Profiles that are fitted, and their lengths, s.
    fitted: &'static [(&'static str, f64)],
    /// Further profiles that are predicted.
    others: &'static [(&'static str, f64)],
    /// Effects of the motor; none: the base model.
    effects: &'static [&'static [&'static str]],
}

const BENCHES: [Bench; 3] = [
    Bench {
        kind: Kind::Universal,
        fitted: &[("staircase", 12.0), ("ramp", 8.0)],
        others: &[("phase-angle", 6.0), ("steady", 6.0)],
        effects: &[&[], &["saturation"], &["hysteresis"], &["saturation", "brush_drop"], &["winding_temperature"]],
    },
    Bench {
        kind: Kind::Universal,
        fitted: &[("staircase", 12.0), ("phase-angle", 8.0)],
        others: &[],
        effects: &[&[], &["saturation"]],
    },
    Bench {
        kind: Kind::PmDc,
        fitted: &[("dc-steps", 8.0), ("dc-ramp", 6.0)],
        others: &[("steady", 6.0), ("start", 3.0)],
        effects: &[&[], &["brush_drop"], &["stribeck"], &["current_offset"]],
    },
];

/// Share of the samples of current and speed within the band, and of samples that are said to be extrapolated.
#[derive(Debug, Clone, Copy)]
struct Held {
    current: f64,
    speed: f64,
    extrapolated: f64,
    width: [f64; 2],
}

fn held(model: &Model, recording: &Recording, share: f64) -> Result<Held> {
    let mut voltage = recording.clone();
    [Channel::Current, Channel::Speed].iter().for_each(|channel| voltage.remove_channel(*channel));
    let begin = recording.channel(Channel::Speed).map(|speed| speed[..50].iter().sum::<f64>() / 50.0);
    let settings = forecast::Settings { band: Some(share), speed: begin, ..Default::default() };
    let made = predict(model, &voltage, &settings, &Context::quiet())?;
    let band = made.band.unwrap_or_else(|| unreachable!("it was asked for"));
    let within = |channel: Channel, band: &Option<[Vec<f64>; 2]>| {
        let (Some(measured), Some([low, high])) = (recording.channel(channel), band) else { return [f64::NAN; 2] };
        let inside = measured.iter().zip(low).zip(high).filter(|((x, low), high)| *low <= *x && *x <= *high).count();
        let width = low.iter().zip(high).map(|(low, high)| high - low).sum::<f64>() / low.len() as f64;
        let rms = (measured.iter().map(|x| x * x).sum::<f64>() / measured.len() as f64).sqrt();
        [inside as f64 / measured.len() as f64, 0.5 * width / rms]
    };
    let [current, speed] = [within(Channel::Current, &band.current), within(Channel::Speed, &band.speed)];
    let beyond = made.extrapolation.map_or(0, |e| e.samples.iter().filter(|beyond| **beyond).count());
    Ok(Held {
        current: current[0],
        speed: speed[0],
        extrapolated: beyond as f64 / recording.len() as f64,
        width: [current[1], speed[1]],
    })
}

/// One motor: profile by profile, what its band holds.
fn motor(bench: &Bench, effects: &[&str], with: bool, seed: u64, share: f64) -> Result<Vec<(String, Held)>> {
    let nominal = Motor::nominal(bench.kind);
    let setup = Setup::new(bench.kind).motor(Motor::sample_from_population(&nominal, SPREAD, seed));
    let setup = effects.iter().try_fold(setup, |setup, effect| setup.effect(effect))?;
    let recorded = |(profile, seconds): (&str, f64), n: u64| -> Result<Recording> {
        Ok(setup.clone().profile(profile)?.seconds(seconds).seed(1000 * seed + n).run()?.recording)
    };
    let training = bench.fitted.iter().zip(1..).map(|(p, n)| recorded(*p, n)).collect::<Result<Vec<_>>>()?;
    let mut settings = Settings::new(bench.kind);
    if with {
        let names: Vec<String> = effects.iter().map(|effect| (*effect).to_owned()).collect();
        settings.effects = catalogue::effects(&names)?;
    }
    let model = identify(&training, &settings, &Context::quiet())?.model;
    let predicted = bench.fitted.iter().chain(bench.others).zip(101..);
    predicted.map(|(p, n)| Ok((p.0.to_owned(), held(&model, &recorded(*p, n)?, share)?))).collect()
}

/// Runs the example.
pub fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1).filter_map(|text| text.parse::<f64>().ok());
    let motors = arguments.next().unwrap_or(8.0) as u64;
    let share = arguments.next().unwrap_or(95.0) / 100.0;
    println!(
        "share of samples within the band of {:.1} %, mean over {motors} motors (least … greatest)",
        100.0 * share
    );
    println!("and half the band's mean width over the RMS of the signal\n");
    println!(
        "| motor | model | profile | current | | speed | | extrapolated |\n| --- | --- | --- | --- | --- | --- | --- | --- |"
    );
    let mut all: [[Vec<f64>; 2]; 2] = Default::default();
    for bench in &BENCHES {
        for effects in bench.effects {
            for with in [true, false].into_iter().filter(|with| *with || !effects.is_empty()) {
                let of = |seed: u64| motor(bench, effects, with, seed, share);
                let runs: Vec<Vec<(String, Held)>> = (1..=motors).into_par_iter().map(of).collect::<Result<_>>()?;
                for (k, (profile, _)) in runs[0].iter().enumerate() {
                    let held: Vec<Held> = runs.iter().map(|run| run[k].1).collect();
                    let mean = |of: &dyn Fn(&Held) -> f64| held.iter().map(of).sum::<f64>() / held.len() as f64;
                    let told = |of: &dyn Fn(&Held) -> f64| {
                        let values: Vec<f64> = held.iter().map(of).collect();
                        let [low, high] = [f64::min, f64::max].map(|f| values.iter().copied().reduce(f).unwrap_or(0.0));
                        format!("{:.1} % ({:.1} … {:.1})", 100.0 * mean(of), 100.0 * low, 100.0 * high)
                    };
                    let name = if effects.is_empty() { "base".to_owned() } else { effects.join(", ") };
                    println!(
                        "| {} {name} | {} | {profile} | {} | {:.2} % | {} | {:.2} % | {:.1} % |",
                        bench.kind.name(),
                        if with { "complete" } else { "without" },
                        told(&|h| h.current),
                        100.0 * mean(&|h| h.width[0]),
                        told(&|h| h.speed),
                        100.0 * mean(&|h| h.width[1]),
                        100.0 * mean(&|h| h.extrapolated)
                    );
                    if k < bench.fitted.len() {
                        for h in &held {
                            all[usize::from(!with)][0].push(h.current);
                            all[usize::from(!with)][1].push(h.speed);
                        }
                    }
                }
            }
        }
    }
    for (name, [current, speed]) in ["complete", "without"].into_iter().zip(&all) {
        let mean = |values: &[f64]| 100.0 * values.iter().sum::<f64>() / values.len().max(1) as f64;
        println!("\nprofiles of the fit, {name}: current {:.1} %, speed {:.1} %", mean(current), mean(speed));
    }
    Ok(())
}
