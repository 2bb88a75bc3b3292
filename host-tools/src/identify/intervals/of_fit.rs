//! What the intervals of a fit need: which rows make a block, what a limit does, and the way from the optimiser's
//! coordinates to the parameters.

use std::collections::BTreeMap;

use super::{SYSTEMATIC, block_length_s, slowest_correlation_time_s};
use crate::identify::minimise::Fit;
use crate::identify::output_error::{OutputError, Rows};
use crate::identify::space::{Entry, Freedom, Key};

/// Distance from a limit, in the optimiser's coordinates, at which a shape is at it.
const AT_LIMIT: f64 = 1e-4;

/// Half a 95 % interval of the normal distribution, in standard deviations.
const NORMAL_95: f64 = 1.96;

/// The block of each row, for the covariance of a fit by output error: several times as long as the residuals'
/// correlation.
pub fn blocks_of_rows(problem: &OutputError<'_>, fit: &Fit) -> Vec<usize> {
    let rows = problem.rows();
    let interval = rows.iter().map(Rows::row_interval_s).fold(0.0f64, f64::max);
    let total: f64 = rows.iter().map(Rows::covered_s).sum();
    let correlation = slowest_correlation_s(rows, fit.residuals.as_slice(), interval);
    let block = block_length_s(correlation, total, fit.jacobian.ncols());
    numbered(rows.iter().enumerate().flat_map(|(r, rows)| rows.blocks(block).into_iter().map(move |b| (r, b))))
}

fn slowest_correlation_s(rows: &[Rows<'_>], residuals: &[f64], interval_s: f64) -> f64 {
    let flags: Vec<bool> = rows.iter().flat_map(Rows::speed_rows).collect();
    let mut slowest = interval_s;
    let mut from = 0;
    while from < flags.len() {
        let to = (from..flags.len()).find(|k| flags[*k] != flags[from]).unwrap_or(flags.len());
        slowest = slowest.max(slowest_correlation_time_s(&residuals[from..to], interval_s));
        from = to;
    }
    slowest
}

/// Numbers arbitrary keys in the order in which they first appear.
pub fn numbered<K: Ord>(keys: impl Iterator<Item = K>) -> Vec<usize> {
    let mut seen = BTreeMap::new();
    keys.map(|key| {
        let next = seen.len();
        *seen.entry(key).or_insert(next)
    })
    .collect()
}

/// Shapes of effects that have run into their physical limits no longer answer to the data: they stay there, without an
/// interval.
pub fn pin_shapes_at_limits(refined: &mut Fit) {
    let theta = refined.space.coordinates();
    let at_limit = |(entry, theta): (&Entry, &f64)| {
        let (low, high) = entry.limits();
        let is_there = *theta - low < AT_LIMIT || high - *theta < AT_LIMIT;
        (entry.is_shape() && is_there).then_some(entry.key)
    };
    let at_limit: Vec<Key> = refined.space.free().zip(&theta).filter_map(at_limit).collect();
    at_limit.into_iter().for_each(|key| refined.hold(key));
}

/// 95 % interval of a free parameter from half that of its coordinate.
pub fn interval(entry: &Entry, theta: f64, half: f64) -> [f64; 2] {
    if entry.positive && entry.freedom == Freedom::Free(None) {
        let half = half_width(half, 1.0);
        [entry.value * (-half).exp(), entry.value * half.exp()]
    } else {
        let half = half_width(half * entry.slope(theta).abs(), entry.value);
        [entry.value - half, entry.value + half]
    }
}

/// Half a 95 % interval with what the computation itself adds.
pub fn half_width(half: f64, value: f64) -> f64 {
    half.hypot(NORMAL_95 * SYSTEMATIC * value)
}

#[cfg(test)]
mod tests {
    use std::sync::OnceLock;

    use greyrig::effects::EffectId;
    use greyrig::motor::BaseParameter;
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::identify::scales::Scales;
    use crate::identify::space::Space;
    use crate::model::{Base, Kind};

    fn space() -> Space {
        let scales = Scales { voltage: 300.0, current: 10.0, heat: 100.0, speed: 3000.0, friction: 0.1 };
        Space::new(Kind::Universal, Base::Full, &[]).with_effect(EffectId::TransformerEmf, &scales)
    }

    #[test]
    fn keys_are_numbered_as_they_come() {
        assert_eq!(numbered("baacab".chars()), [0, 1, 1, 2, 1, 0]);
    }

    /// √(3² + 3.92²) of 1e-4 for a value of 2: 1.96 · 1e-4 · 2 is the computation's share.
    #[test]
    fn the_computation_adds_its_own_uncertainty() {
        assert!((half_width(3e-4, 2.0) - 4.936_233e-4).abs() < 1e-9, "{}", half_width(3e-4, 2.0));
        assert_eq!(half_width(0.0, -1.0), 1.96e-4);
    }

    /// A resistance of 2 Ω, known to a tenth in its logarithm: from 2/e^0.1 to 2 e^0.1, and 1.96e-4 of it hardly adds.
    #[test]
    fn what_is_positive_has_an_interval_in_its_logarithm() {
        let mut entry = space().get(BaseParameter::R).unwrap().clone();
        (entry.value, entry.freedom) = (2.0, Freedom::Free(None));
        assert!(entry.positive);
        let [low, high] = interval(&entry, 2f64.ln(), 0.1);
        assert!((low - 1.809_674_8).abs() < 1e-6 && (high - 2.210_341_8).abs() < 1e-6, "{low} {high}");
    }

    /// What may pass zero goes by its scale; between bounds 0 and 8, at θ = 0 in the middle of the sine, by 4.
    #[test]
    fn other_intervals_go_by_the_slope() {
        let mut entry = space().get(Key::size_of(EffectId::TransformerEmf)).unwrap().clone();
        (entry.value, entry.scale, entry.positive, entry.freedom) = (5.0, 2.0, false, Freedom::Free(None));
        // √(0.6² + (1.96e-4 · 5)²).
        let half = 0.600_000_8;
        let [low, high] = interval(&entry, 2.5, 0.3);
        assert!((low - (5.0 - half)).abs() < 1e-7 && (high - (5.0 + half)).abs() < 1e-7, "{low} {high}");
        (entry.value, entry.freedom) = (4.0, Freedom::Free(Some((0.0, 8.0))));
        let [low, high] = interval(&entry, 0.0, 0.3);
        assert!((low - 2.8).abs() < 1e-6 && (high - 5.2).abs() < 1e-6, "{low} {high}");
        // A positive one between bounds goes by them, too.
        entry.positive = true;
        assert_eq!(interval(&entry, 0.0, 0.3), [low, high]);
    }

    #[test]
    fn a_shape_at_either_limit_is_held_and_no_size() {
        let (size, shape) = (Key::size_of(EffectId::TransformerEmf), Key::Effect(EffectId::TransformerEmf, 1));
        let pinned = |value: f64| {
            let mut space = space();
            let (low, high) = space.get(shape).unwrap().range;
            space.start(shape, value.clamp(low, high));
            let least = space.get(size).unwrap().range.0;
            space.start(size, least.max(0.0));
            let columns = space.free().count();
            let mut fit = Fit {
                space,
                residuals: DVector::zeros(3),
                jacobian: DMatrix::zeros(3, columns),
                rms: [1.0; 2],
                ended: true,
                known_held_out: OnceLock::new(),
            };
            pin_shapes_at_limits(&mut fit);
            let free = |key: Key| matches!(fit.space.get(key).unwrap().freedom, Freedom::Free(_));
            assert!(free(size), "a size stays free");
            assert_eq!(fit.jacobian.ncols(), columns - usize::from(!free(shape)));
            !free(shape)
        };
        let (low, high) = space().get(shape).unwrap().range;
        assert!(pinned(low) && pinned(high));
        // A ten-thousandth in the logarithm is near enough, a thousandth is not.
        assert!(pinned(low * 1.00005) && pinned(high * 0.99995));
        assert!(!pinned(low * 1.001) && !pinned(high * 0.999));
        assert!(!pinned((low * high).sqrt()));
    }
}
