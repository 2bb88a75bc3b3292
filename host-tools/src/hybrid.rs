//! The hybrid model on the host: what the learned correction is trained on, and what it has to do with.
//!
//! The target is the error of the model's current, measured − modelled, before the filter; the inputs are those of
//! [`greyrig::hybrid`]: the voltage, the modelled current and the modelled speed. The model runs freely through each
//! recording, as it will on the rig.

use greyrig::motor::State;

use crate::anfis::{self, Builder, Method, Ridge, Settings, Trained};
use crate::compare::Comparison;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::experiment::{Drive, Experiment, Imposed};
use crate::forecast::remembered_with_correction;
use crate::model::Model;
use crate::recording::Recording;
use crate::segments;

/// Names of the inputs.
pub const INPUTS: [&str; 3] = ["u_v", "modelled i_a", "modelled omega_rad_s"];
/// Name of the target.
pub const TARGET: &str = "measured - modelled i_a";
/// How far outside the trained box the correction fades to zero, as a fraction of the box.
pub const MARGIN: f64 = 0.1;
/// Ridge over rows/columns: a hundredth of the trainer's own. Voltage, current and speed of a running motor fill a thin
/// part of their box, and a larger ridge costs accuracy there.
pub const RIDGE: f64 = 1e-8;
/// Membership functions of each input: those of the rig's network.
const FUNCTIONS: usize = 3;
/// Length of the pieces of time of which every fifth is kept back to tell when to stop, s: some periods of the mains,
/// and of each voltage that is held for a second.
const PIECE_S: f64 = 0.1;
const EVERY: usize = 5;

/// The usual settings of a training.
pub fn settings(method: Method, epochs: usize) -> Settings {
    Settings { ridge: Ridge::Relative(RIDGE), threads: 0, ..Settings::new(method, FUNCTIONS, epochs) }
}

/// Hands the rows of recordings, without the first `blanking_s` seconds of each, s, to `take`: inputs, target, and
/// whether the row belongs to a piece that may be kept back. With a delay, s, the modelled current so long ago is a
/// fourth input: what a map with memory could use of a hysteresis.
fn rows(
    model: &Model,
    recordings: &[Recording],
    blanking_s: f64,
    delay_s: Option<f64>,
    mut take: impl FnMut(&[f64], f64, bool) -> Result<()>,
) -> Result<()> {
    let motor = model
        .motor::<f32>()
        .map_err(|e| Error::usage(format!("the model cannot be run: {e}"), "check its parameters"))?;
    for recording in segments::apart(recordings, &model.filter).iter() {
        let e = Experiment::new(recording, &model.filter)?.through(&model.chain);
        let (Drive::Voltage, Some(current)) = (e.drive, e.current.as_ref()) else {
            return Err(Error::usage(
                format!("{} holds no voltage and current", e.name),
                "the correction is learnt from u_v, i_a and what the model makes of u_v",
            ));
        };
        let refused = |error| Error::usage(format!("{}: {error}", e.name), "check the model's parameters");
        let mut modelled: Vec<State<f32>> = Vec::with_capacity(e.len());
        let substeps = e.substeps(&motor).map_err(refused)?;
        e.run(&motor, substeps, Imposed::Nothing, |_, state| modelled.push(state)).map_err(refused)?;
        let piece = (PIECE_S / e.interval_s).max(1.0) as usize;
        for (n, model) in modelled.iter().enumerate() {
            if !e.counted[n] || e.is_open(n) || (n as f64) < blanking_s / e.interval_s {
                continue;
            }
            let mut inputs = vec![e.input[n], f64::from(model.current), f64::from(model.speed)];
            if let Some(delay) = delay_s {
                let ago = (delay / e.interval_s).round() as usize;
                inputs.push(f64::from(modelled[n.saturating_sub(ago)].current));
            }
            take(&inputs, current[n] - f64::from(model.current), n / piece % EVERY == EVERY - 1)?;
        }
    }
    Ok(())
}

/// Trains on four fifths of the rows and judges on the fifth, with the modelled current of a while ago as a fourth
/// input or without. (With it, it is for comparing inputs only: the microcontroller's network has no memory.)
///
/// # Errors
/// As [`train`].
pub fn with_rows_kept_back(
    model: &Model,
    recordings: &[Recording],
    blanking_s: f64,
    delay_s: Option<f64>,
    settings: &Settings,
    ctx: &Context,
) -> Result<Trained> {
    let bare = Model { correction: None, detector: None, ..model.clone() };
    let inputs = INPUTS.len() + usize::from(delay_s.is_some());
    let (mut training, mut checking) = (Builder::new(inputs), Builder::new(inputs));
    rows(&bare, recordings, blanking_s, delay_s, |inputs, target, kept_back| {
        if kept_back { checking.push(inputs, target) } else { training.push(inputs, target) }
    })?;
    anfis::train(&training.finish()?, Some(&checking.finish()?), settings, ctx)
}

/// Trains the correction of a model on recordings: first with rows kept back, which tell after how many epochs to stop,
/// then as many epochs on all rows, since what is kept back is voltages that the network would not have learnt. The
/// learning curve and the checking error that are given are those of the first training, all else is of the second.
///
/// # Errors
/// Recordings that cannot be used, an interrupt.
pub fn train(
    model: &Model,
    recordings: &[Recording],
    blanking_s: f64,
    settings: &Settings,
    ctx: &Context,
) -> Result<(Model, Trained)> {
    let bare = Model { correction: None, detector: None, ..model.clone() };
    let checked = with_rows_kept_back(&bare, recordings, blanking_s, None, settings, ctx)?;
    let mut table = Builder::new(INPUTS.len());
    rows(&bare, recordings, blanking_s, None, |inputs, target, _| table.push(inputs, target))?;
    let as_many = Settings { epochs: checked.best + 1, ..settings.clone() };
    let all = anfis::train(&table.finish()?, None, &as_many, ctx)?;
    let Trained { epochs, best, stopped, rmse_chk, .. } = checked;
    let trained = Trained { epochs, best, stopped, rmse_chk, ..all };
    let names = INPUTS.map(str::to_owned);
    let correction = trained.file(settings.method, MARGIN, &names, TARGET);
    let mut corrected = Model { correction: Some(correction), ..bare };
    corrected.fitted = remembered_with_correction(&corrected, recordings)?;
    Ok((corrected, trained))
}

/// A recording whose begin does not count, though the model runs through it.
pub fn without_start(recording: &Recording, blanking_s: f64) -> Recording {
    let mut judged = recording.clone();
    let blank = ((blanking_s / recording.sample_time_s()) as usize).min(recording.len());
    judged.exclude(0..blank);
    judged
}

/// RMS of what the correction adds to the current, over the RMS of the measured current: what is black box. `before`
/// and `after` are comparisons of the model without and with it.
pub fn share_of_correction(before: &Comparison, after: &Comparison) -> Option<f64> {
    let (mut added, mut signal) = (0.0, 0.0);
    for (b, a) in before.per_recording.iter().zip(&after.per_recording) {
        let pairs = b.traces.modelled_current.iter().zip(&a.traces.modelled_current);
        for ((x, y), (measured, counted)) in pairs.zip(a.traces.measured_current.iter().zip(&a.traces.counted)) {
            if *counted {
                added += (y - x).powi(2);
                signal += measured.powi(2);
            }
        }
    }
    (signal > 0.0).then(|| (added / signal).sqrt())
}
