//! From recordings to physical parameters.
//!
//! 1. Linear least squares in continuous time gives start values ([`regression`]).
//! 2. Output error refines them: the free-run simulation against the measurement, all recordings jointly
//!    ([`output_error`]). Recordings of torque and motion alone are fitted by [`inverse_dynamics`] instead.
//! 3. Intervals come from blocks of time, so that autocorrelated residuals do not make them too narrow ([`intervals`]).
//! 4. Directions in which the data leave the parameters open are closed, one by one, by holding a parameter; each is
//!    reported in words with the excitation that would tell ([`identifiability`]).

mod by_simulation;
mod by_torque;
pub mod cross_validation;
mod determined;
pub mod equation_error;
pub mod flux;
pub mod identifiability;
mod identification;
pub mod intervals;
pub mod inverse_dynamics;
pub mod minimise;
pub mod output_error;
pub mod refitted;
pub mod regression;
pub mod scales;
mod settings;
pub mod slow_sampling;
pub mod space;

use greyrig::motor::BaseParameter;

use crate::context::Context;
use crate::error::{Error, Place, Result};
use crate::experiment::{Drive, Experiment};
use crate::forecast::remembered;
use crate::model::Filter;
use crate::recording::Recording;
use crate::segments;
use crate::speed_sensor::Chain;
use flux::FluxAtPeak;
use space::{Freedom, Space};

pub(crate) use determined::{intervals_of, intervals_of_fit};
pub use identification::{Estimate, Identification};
pub use settings::{Method, Settings, build_space};

/// Identifies a model from recordings of one motor type.
///
/// # Errors
/// Recordings or settings from which nothing can be identified, with the reason; an interrupt.
///
/// # Examples
/// ```
/// use greyrig_host::{context::Context, identify::{Settings, identify}, model::Kind, rig::Setup};
///
/// // A magnet motor on steps of a direct voltage, on the virtual rig.
/// let recording = Setup::new(Kind::PmDc).seconds(4.0).seed(1).run()?.recording;
/// let found = identify(&[recording], &Settings::new(Kind::PmDc), &Context::quiet())?;
/// assert!(found.parameters.iter().any(|p| p.name == "K" && p.identifiable));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn identify(recordings: &[Recording], settings: &Settings, ctx: &Context) -> Result<Identification> {
    ctx.install(|| identified(recordings, settings, None, ctx))
}

/// `beside` is a motor that the same recordings have told before, with which slow samples are asked again.
fn identified(
    recordings: &[Recording],
    settings: &Settings,
    beside: Option<&Space>,
    ctx: &Context,
) -> Result<Identification> {
    let mut filter = settings.filter;
    let mut experiments = prepare(recordings, &filter, &settings.chain)?;
    let mut space = build_space(settings)?;
    let mut notes = Vec::new();
    let drive = experiments[0].drive;
    if experiments.iter().any(|e| e.drive != drive) {
        return Err(Error::usage(
            "some recordings have a voltage and others only a torque",
            "identify the two sorts separately",
        ));
    }
    let outcome = match drive {
        Drive::Torque => {
            space.hold(BaseParameter::ELECTRICAL, Freedom::Absent);
            if !settings.cutoff_given {
                filter.cutoff_hz = by_torque::cutoff_hz(&experiments);
            }
            by_torque::fit(space, &experiments, filter.cutoff_hz)?
        }
        Drive::Voltage => {
            let unasked = slow_sampling::is_slow(&experiments).then(|| experiments.clone());
            let out_of_reach =
                slow_sampling::prepare(&mut space, &mut experiments, settings.course, beside, &ctx.quietly())?;
            let fitted = by_simulation::fit(
                space,
                &experiments,
                settings.method,
                out_of_reach,
                &settings.known,
                &mut notes,
                ctx,
            )?;
            let is_more_than_bare = !(settings.effects.is_empty() && settings.terms.is_empty());
            let asks_again = beside.is_none() && settings.course.is_none() && is_more_than_bare;
            if let Some(unasked) = unasked.filter(|_| asks_again)
                && slow_sampling::tells_otherwise(&fitted.space, unasked, &experiments, &ctx.quietly())?
                    .course_or_inductance
            {
                return identified(recordings, settings, Some(&fitted.space), ctx);
            }
            fitted
        }
    };
    // Of slow recordings the filter passes what they can carry.
    filter.cutoff_hz = experiments.iter().map(|e| e.filter.cutoff_hz).fold(filter.cutoff_hz, f64::min);
    notes.extend(outcome.implausible(settings.kind));
    let flux = outcome.covariance.as_ref().and_then(|c| FluxAtPeak::of(&outcome.space, c, &experiments));
    let uncertainty = outcome.uncertainty();
    let mut identification = outcome.into_identification(recordings, settings, filter, flux, notes);
    identification.model.chain = Chain::common(experiments.iter().map(|e| e.sensor));
    identification.model.fitted = remembered(&identification.model, &experiments, uncertainty);
    // Of a known course nothing is left to see at a rate at which it is a delay.
    if let (Some(fitted), Some(course)) = (&mut identification.model.fitted, settings.course) {
        fitted.input = Some(course);
    }
    Ok(identification)
}

/// Prepares recordings of one motor type, as a chain has shown them where they do not tell it themselves; of one with
/// gaps, its parts.
///
/// # Errors
/// No recording, recordings of different types, or one that cannot be used.
pub fn prepare(recordings: &[Recording], filter: &Filter, chain: &Chain) -> Result<Vec<Experiment>> {
    if recordings.is_empty() {
        return Err(Error::usage("no recording was given", "name at least one file"));
    }
    let types: Vec<(&Recording, &String)> =
        recordings.iter().filter_map(|r| Some((r, r.metadata().get("motor")?))).collect();
    if let Some((odd, other)) = types.iter().find(|(_, t)| *t != types[0].1) {
        return Err(Error::input(
            Place::file(odd.path()),
            format!(
                "this is a recording of motor type {other:?}, and {} is of type {:?}",
                types[0].0.path().display(),
                types[0].1
            ),
            "identify each motor type by itself",
        ));
    }
    let prepared = |r: &Recording| Ok(Experiment::new(r, filter)?.through(chain).with_edges_placed());
    segments::apart(recordings, filter).iter().map(prepared).collect()
}
