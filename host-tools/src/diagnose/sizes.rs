//! Parameters of effects, with their intervals.

use std::collections::BTreeMap;

use greyrig::effects::EffectId;
use serde::Serialize;

use crate::identify::Settings;
use crate::identify::space::{Key, Space};
use crate::recording::Recording;

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Size {
    /// Which parameter.
    #[serde(skip)]
    pub key: Key,
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
    intervals: &BTreeMap<Key, [f64; 2]>,
    settings: &Settings,
    recordings: &[Recording],
) -> Vec<Size> {
    let size = |key: Key| {
        Some(Size {
            key,
            name: key.of_effect()?.name.to_owned(),
            value: space.value(key),
            unit: key.unit(settings.kind, recordings[0].motion()).to_owned(),
            ci95: intervals.get(&key).copied(),
        })
    };
    ids.iter().flat_map(|id| Key::all_of(*id)).filter_map(size).collect()
}

/// Number of parameters of an effect.
pub fn parameters_of(id: EffectId) -> usize {
    id.description().parameters.len()
}
