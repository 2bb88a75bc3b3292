//! Parameters of effects, with their intervals.

use std::collections::BTreeMap;

use greyrig::effects::EffectId;
use serde::Serialize;

use crate::identify::Settings;
use crate::identify::space::Space;
use crate::model::unit;
use crate::recording::Recording;

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Size {
    /// Name.
    pub name: String,
    /// Value, SI.
    pub value: f64,
    /// Unit.
    pub unit: String,
    /// 95 % interval, for what was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ci95: Option<[f64; 2]>,
}

impl Size {
    /// Whether its interval holds zero.
    pub fn may_be_zero(&self) -> bool {
        self.ci95.is_some_and(|[from, to]| from <= 0.0 && to >= 0.0)
    }
}

/// The parameters of effects with their intervals, as far as these are known.
pub fn sizes(
    ids: &[EffectId],
    space: &Space,
    intervals: &BTreeMap<String, [f64; 2]>,
    settings: &Settings,
    recordings: &[Recording],
) -> Vec<Size> {
    ids.iter()
        .flat_map(|id| id.description().parameters)
        .map(|p| Size {
            name: p.name.to_owned(),
            value: space.value(p.name),
            unit: unit(p.name, settings.kind, recordings[0].motion()).to_owned(),
            ci95: intervals.get(p.name).copied(),
        })
        .collect()
}

/// Number of parameters of an effect.
pub fn parameters_of(id: EffectId) -> usize {
    id.description().parameters.len()
}

/// Name of the size of an effect.
pub fn size_of(id: EffectId) -> &'static str {
    id.description().size().name
}
