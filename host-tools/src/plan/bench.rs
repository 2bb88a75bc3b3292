//! The model that is simulated, with each effect at its size, and what a recording shows of them.

use std::collections::BTreeMap;
use std::f64::consts::{PI, SQRT_2};

use greyrig::butterworth;
use greyrig::effects::{Description, EffectId, InWords};
use greyrig::motor::{BaseParameter, Stepper};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::trial::{Drawn, SIGNALS, Trial, draw};
use super::{Contest, Limits, Proposal, Set, Take, USUAL};
use crate::context::Context;
use crate::diagnose::screening::Complement;
use crate::error::{Error, Result};
use crate::identify::minimise::{Residuals, jacobian_at};
use crate::identify::scales::Scales;
use crate::identify::space::{Key, Space};
use crate::identify::{self, Settings};
use crate::model::{Filter, Kind, Model};
use crate::rig::motor::Nameplate;
use crate::rig::{ChainSetup, Profile, SAMPLE_RATE_HZ};

/// Error of the current, relative, that an effect causes there.
const ERROR: f64 = 0.01;
/// Size from which that is extrapolated, in typical sizes.
const SMALL: f64 = 0.01;
/// Factor to a neighbouring shape.
const NEIGHBOUR: f64 = 1.5;
/// Noise after the filter over noise before it.
const FILTERED: f64 = 0.2;
/// Step of the differences, in the optimiser's coordinates: well above the jolts of the friction at standstill.
const DIFFERENCE: f64 = 1e-3;
/// Mains frequency, Hz.
const MAINS_HZ: f64 = 50.0;
/// Times that a profile is scaled down before it counts as impossible.
const SCALINGS: usize = 12;
/// By how much a profile is scaled down further than in proportion.
const MARGIN: f64 = 0.005;

/// What one recording shows of parameters and effects.
pub struct Piece {
    /// How it is taken.
    pub take: Take,
    /// ∂y/∂θ.
    base: DMatrix<f64>,
    /// d of each effect at its usual shape, then its changes with the shape.
    effects: BTreeMap<EffectId, Vec<DVector<f64>>>,
}

/// The model that is simulated, and the effects at their sizes.
pub struct Bench {
    space: Space,
    kind: Kind,
    limits: Limits,
    filter: Filter,
    noise: [f64; 3],
    scales: Scales,
    effects: Vec<(&'static Description, f64)>,
}

impl Bench {
    /// Prepares a model for pairs of rivals.
    ///
    /// # Errors
    /// A model that cannot be run within the limits.
    pub fn new(
        model: &Model,
        pairs: &[[&'static Description; 2]],
        seconds: f64,
        limits: Limits,
        ctx: &Context,
    ) -> Result<Self> {
        let in_question: Vec<EffectId> = pairs.iter().flatten().map(|d| d.id).collect();
        let mut bench = Self::without(model, &in_question, seconds, limits)?;
        bench.size(model, pairs, seconds, ctx)?;
        Ok(bench)
    }

    /// Prepares a model that lacks what is in question, with no effects at their sizes.
    ///
    /// # Errors
    /// A model without a parameter that it takes.
    pub fn without(model: &Model, in_question: &[EffectId], seconds: f64, limits: Limits) -> Result<Self> {
        let missing = BaseParameter::POSITIVE.into_iter().filter(|p| model.base_parameter(*p).is_none());
        let missing: Vec<&str> = missing.map(BaseParameter::name).collect();
        if !missing.is_empty() {
            return Err(Error::usage(
                format!("the model has no {}, without which no voltage can be planned", missing.join(", ")),
                "identify it from recordings of the whole motor",
            ));
        }
        let mut space = identify::build_space(&Settings::of_model(model))?;
        let scales = Scales {
            voltage: limits.voltage_v,
            current: limits.current_a,
            heat: limits.current_a.powi(2) * seconds,
            speed: 1.0,
            friction: 0.1
                * model.value(BaseParameter::K)
                * limits.current_a
                * if model.kind == Kind::Universal { limits.current_a } else { 1.0 },
        };
        take(&mut space, model, &scales);
        // A rival that the model has already is in question: it is no part of the base.
        for id in in_question {
            space = space.without_effect(*id);
        }
        let nominal = crate::rig::Motor::nominal(model.kind);
        let noise = ChainSetup::for_motor(&nominal, false).channels.map(|c| FILTERED * c.noise);
        Ok(Self { space, kind: model.kind, limits, filter: model.filter, noise, scales, effects: Vec::new() })
    }

    /// Gives each effect the size at which it changes the current of the usual staircase by 1 %.
    fn size(&mut self, model: &Model, pairs: &[[&'static Description; 2]], seconds: f64, ctx: &Context) -> Result<()> {
        let usual = Profile::find(USUAL)?;
        let refused =
            |what: &str| Error::usage(format!("the model cannot be run on a {USUAL}: {what}"), "check its parameters");
        let waveform =
            self.waveform(usual, seconds, ctx)?.ok_or_else(|| refused("it does not stay within the limits"))?;
        self.scales.speed = waveform.peak_speed.max(1e-9);
        take(&mut self.space, model, &self.scales);
        let trial = self.trial(waveform, &self.space, ctx)?;
        let plain = trial.at(&self.space, &self.space.coordinates());
        let mut all: Vec<&'static Description> = pairs.iter().flatten().copied().collect();
        all.sort_by_key(|d| d.id);
        all.dedup_by_key(|d| d.id);
        for d in all {
            let typical = self.space.with_effect(d.id, &self.scales).value(Key::size_of(d.id));
            let there = self.with(d, SMALL * typical, 1.0, 0);
            let changed = trial.at(&there, &there.coordinates()) - &plain;
            let [current, reference] = [&changed, &plain].map(|y| trial.currents(y).map(|i| i * i).sum::<f64>().sqrt());
            let factor = if current > 0.0 { ERROR * reference / current } else { 1.0 / SMALL };
            ctx.check()?;
            let size = (SMALL * typical * factor).clamp(d.size().range.0, d.size().range.1);
            self.effects.push((d, size));
        }
        Ok(())
    }

    /// The model with an effect of a size, a shape parameter (0: none) being `factor` times as usual.
    fn with(&self, d: &'static Description, size: f64, factor: f64, shape: usize) -> Space {
        let mut space = self.space.with_effect(d.id, &self.scales);
        if let Some(entry) = space.get_mut(Key::size_of(d.id)) {
            entry.value = size;
        }
        if shape > 0
            && let Some(entry) = space.get_mut(Key::Effect(d.id, shape))
        {
            let (low, high) = d.parameters[shape].range;
            let there = entry.value * factor;
            entry.value = if there > high { entry.value / factor } else { there.max(low) };
        }
        space
    }

    /// Simulates a profile with all that may happen; `None` if no voltage keeps the current within its limit.
    pub fn piece(&self, profile: &'static Profile, seconds: f64, ctx: &Context) -> Result<Option<Piece>> {
        let Some(waveform) = self.waveform(profile, seconds, ctx)? else { return Ok(None) };
        let take = Take {
            profile: profile.id,
            seconds,
            peak_voltage_v: waveform.peak_voltage,
            peak_current_a: waveform.peak_current,
        };
        let trial = self.trial(waveform, &self.space, ctx)?;
        let theta = self.space.coordinates();
        let plain = trial.at(&self.space, &theta);
        let base = jacobian_at(&self.space, &trial, &theta, &plain, DIFFERENCE);
        let effects = self.effects.iter().map(|(d, size)| {
            let shown = |space: Space| trial.at(&space, &space.coordinates()) - &plain;
            let usual = shown(self.with(d, *size, 1.0, 0));
            let shapes = (1..d.parameters.len()).map(|k| shown(self.with(d, *size, NEIGHBOUR, k)) - &usual);
            let all: Vec<_> = std::iter::once(usual.clone()).chain(shapes).collect();
            (d.id, all)
        });
        let effects = effects.collect();
        // What was stopped is no piece.
        ctx.check()?;
        Ok(Some(Piece { take, base, effects }))
    }

    /// How well each set of recordings tells two rivals apart.
    ///
    /// # Errors
    /// An interrupt.
    pub fn contest(&self, pair: [&'static Description; 2], sets: &[Set<'_>], ctx: &Context) -> Result<Contest> {
        let mut proposals: Vec<Proposal> = sets
            .par_iter()
            .map(|set| {
                ctx.check()?;
                let each = [remains(&set.pieces, pair[0].id, pair[1].id), remains(&set.pieces, pair[1].id, pair[0].id)];
                Ok(Proposal { recordings: set.takes.clone(), separation: each[0].min(each[1]), each })
            })
            .collect::<Result<_>>()?;
        proposals.sort_by(|a, b| b.separation.total_cmp(&a.separation));
        let size = |d: &Description| self.effects.iter().find(|(e, _)| e.id == d.id).map_or(0.0, |e| e.1);
        Ok(Contest {
            rivals: pair.map(|d| d.id),
            sizes: pair.map(size),
            separated_by: InWords(pair[0].separated_by).to_string(),
            proposals,
        })
    }

    fn trial(&self, waveform: Drawn, space: &Space, ctx: &Context) -> Result<Trial> {
        let refused = |e: String| Error::usage(format!("the model cannot be run: {e}"), "check its parameters");
        let motor = space.motor().map_err(|e| refused(e.to_string()))?;
        let substeps = Stepper::build(motor, 1.0 / SAMPLE_RATE_HZ).map_err(|e| refused(e.to_string()))?.substeps();
        let settings = butterworth::Settings {
            order: self.filter.order,
            cutoff_hz: self.filter.cutoff_hz,
            sample_rate_hz: SAMPLE_RATE_HZ,
        };
        let coefficients =
            settings.build().map_err(|e| refused(format!("its filter does not fit {SAMPLE_RATE_HZ} Hz: {e}")))?;
        let cutoff_hz = self.filter.cutoff_hz;
        Ok(Trial::new(waveform, substeps, coefficients, cutoff_hz, self.noise, ctx.cancel_flag().clone()))
    }

    /// The voltage of a profile, scaled down until the limits are kept.
    ///
    /// # Errors
    /// A model that cannot be run, an interrupt.
    pub fn waveform(&self, profile: &'static Profile, seconds: f64, ctx: &Context) -> Result<Option<Drawn>> {
        let refused = |e: greyrig::motor::ParameterError| {
            Error::usage(format!("the model cannot be run: {e}"), "check its parameters")
        };
        let motor = self.space.motor().map_err(refused)?;
        let mut scale = 1.0;
        for _ in 0..SCALINGS {
            ctx.check()?;
            let segments = profile.segments(&self.nameplate(scale), MAINS_HZ, seconds)?;
            let stepper = Stepper::build(motor.clone(), 1.0 / SAMPLE_RATE_HZ).map_err(refused)?;
            let drawn = draw(stepper, &segments);
            let share = (self.limits.current_a / drawn.peak_current).min(self.limits.voltage_v / drawn.peak_voltage);
            if share >= 1.0 {
                return Ok(Some(drawn));
            }
            if !share.is_finite() {
                return Ok(None);
            }
            scale *= (1.0 - MARGIN) * share;
        }
        Ok(None)
    }

    /// The model as the rig's profiles want to know it.
    fn nameplate(&self, scale: f64) -> crate::rig::Motor {
        let value = |parameter: BaseParameter| self.space.value(parameter);
        let voltage_v = self.limits.voltage_v / if self.kind == Kind::Universal { SQRT_2 } else { 1.0 };
        let impedance = value(BaseParameter::R).hypot(2.0 * PI * MAINS_HZ * value(BaseParameter::L));
        let peak_current_a = self.limits.current_a.min(self.limits.voltage_v / impedance);
        crate::rig::Motor {
            r: value(BaseParameter::R),
            l: value(BaseParameter::L),
            k: value(BaseParameter::K),
            j: value(BaseParameter::J),
            mu0: value(BaseParameter::Mu0),
            mu1: value(BaseParameter::Mu1),
            mu2: value(BaseParameter::Mu2),
            nameplate: Nameplate {
                voltage_v: scale * voltage_v,
                peak_current_a: scale * peak_current_a,
                rms_current_a: scale * peak_current_a / SQRT_2,
                speed_rad_s: self.scales.speed,
            },
            ..crate::rig::Motor::nominal(self.kind)
        }
    }
}

/// Typical sizes, and the model's values.
fn take(space: &mut Space, model: &Model, scales: &Scales) {
    space.take_scales(scales);
    space.take_model(model);
}

/// s(A|B) over several recordings.
fn remains(pieces: &[&Piece], a: EffectId, b: EffectId) -> f64 {
    let stacked = |column: &dyn Fn(&Piece) -> DVector<f64>| {
        DVector::from_vec(pieces.iter().flat_map(|p| column(p).iter().copied().collect::<Vec<f64>>()).collect())
    };
    let mut columns: Vec<DVector<f64>> =
        (0..pieces[0].base.ncols()).map(|c| stacked(&|p| p.base.column(c).into_owned())).collect();
    let of_b = pieces[0].effects.get(&b).map_or(0, Vec::len);
    columns.extend((0..of_b).map(|k| stacked(&|p| p.effects[&b][k].clone())));
    let effect = stacked(&|p| p.effects[&a][0].clone());
    let left = Complement::of(&DMatrix::from_columns(&columns)).project(&effect);
    (left.norm_squared() * SIGNALS as f64 / left.len() as f64).sqrt()
}
