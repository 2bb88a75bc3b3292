//! The narrowest numbers that bring samples back bit for bit.
//!
//! | stored as | where | value of a sample |
//! | --- | --- | --- |
//! | 16-bit counts | every sample lies on one grid of at most 65,536 values | `(count + zero) · gain / divisor + offset` |
//! | 32-bit floats | each sample is one | itself |
//! | 64-bit floats | else | itself |
//!
//! "Lies on" means: computed in doubles, in the order of the formula, the value has the same bits. A converter's counts
//! are on such a grid, and so are numbers that were printed with a fixed number of decimals: 12.34 is 1234 / 100 to the
//! last bit, and not 1234 · 0.01.

use super::grid::{self, Grid, same};
use crate::recording::SourceColumn;

/// Samples of a channel; none: there is no value (masked, or in a gap).
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// Counts of a grid.
    Int16(Grid, Vec<Option<i16>>),
    /// Floats.
    Float32(Vec<Option<f32>>),
    /// Doubles.
    Float64(Vec<Option<f64>>),
}

impl Samples {
    /// The narrowest form of values. `source`: the column that they were computed from, whose gain and offset are tried
    /// as a grid.
    pub fn narrowest(values: &[Option<f64>], source: Option<&SourceColumn>) -> Self {
        let mut distinct: Vec<f64> = values.iter().flatten().copied().collect();
        distinct.sort_by(f64::total_cmp);
        distinct.dedup_by_key(|x| x.to_bits());
        if let Some(grid) = grid::of(&distinct, source) {
            return Self::Int16(grid, values.iter().map(|x| x.and_then(|x| grid.count(x))).collect());
        }
        if distinct.iter().all(|x| same(f64::from(*x as f32), *x)) {
            return Self::Float32(values.iter().map(|x| x.map(|x| x as f32)).collect());
        }
        Self::Float64(values.to_vec())
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        match self {
            Self::Int16(_, counts) => counts.len(),
            Self::Float32(values) => values.len(),
            Self::Float64(values) => values.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A sample; none: there is no value.
    pub fn value(&self, n: usize) -> Option<f64> {
        match self {
            Self::Int16(grid, counts) => counts[n].map(|count| grid.value(count)),
            Self::Float32(values) => values[n].map(f64::from),
            Self::Float64(values) => values[n],
        }
    }

    /// All values; NaN: there is none.
    pub fn values(&self) -> Vec<f64> {
        (0..self.len()).map(|n| self.value(n).unwrap_or(f64::NAN)).collect()
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Int16(_, counts) => size_of_val(counts.as_slice()),
            Self::Float32(values) => size_of_val(values.as_slice()),
            Self::Float64(values) => size_of_val(values.as_slice()),
        }
    }

    /// What it is called in the store.
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Int16(..) => "int16",
            Self::Float32(_) => "float32",
            Self::Float64(_) => "float64",
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn narrowest(values: &[f64]) -> Samples {
        Samples::narrowest(&values.iter().copied().map(Some).collect::<Vec<_>>(), None)
    }

    fn comes_back(values: &[f64], samples: &Samples) {
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&samples.values()), bits(values), "{}", samples.name());
    }

    #[test]
    fn counts_decimals_and_scaled_integers_are_counts() {
        let codes: Vec<f64> = (0..4000).map(|k| f64::from((k * 7919) % 4096)).collect();
        type Made = (&'static str, fn(f64) -> f64);
        let made: [Made; 6] = [
            ("as they are", |c| c),
            ("a power of two", |c| (c - 2048.0) * 0.1953125),
            ("a power of two and an offset", |c| c * 1.251220703125 + 0.1220703125),
            ("any gain", |c| (c - 2048.0) * 0.0123),
            ("printed with two decimals", |c| format!("{:.2}", (c - 7.0) / 100.0).parse().unwrap()),
            ("beyond sixteen bits, shifted", |c| c + 1e6),
        ];
        for (what, of) in made {
            let values: Vec<f64> = codes.iter().map(|c| of(*c)).collect();
            let samples = narrowest(&values);
            assert_eq!(samples.name(), "int16", "{what}");
            comes_back(&values, &samples);
        }
    }

    #[test]
    fn the_mapping_of_a_column_is_a_grid() {
        let source = SourceColumn { gain: 0.0371, offset: -1.3, ..SourceColumn::new("CH1") };
        let values: Vec<Option<f64>> = (0..500).map(|k| Some(f64::from(k * 13 % 499) * 0.0371 - 1.3)).collect();
        let samples = Samples::narrowest(&values, Some(&source));
        assert_eq!(samples.name(), "int16");
        comes_back(&values.iter().map(|x| x.unwrap()).collect::<Vec<_>>(), &samples);
    }

    #[test]
    fn what_is_on_no_grid_is_as_wide_as_it_has_to_be() {
        let floats: Vec<f64> = (1..1000).map(|k| f64::from((k as f32).sqrt())).collect();
        assert_eq!(narrowest(&floats).name(), "float32");
        comes_back(&floats, &narrowest(&floats));
        let doubles: Vec<f64> = (1..1000).map(|k| f64::from(k).sqrt()).collect();
        assert_eq!(narrowest(&doubles).name(), "float64");
        comes_back(&doubles, &narrowest(&doubles));
        // Counts have no minus zero.
        let zeros = [0.0, -0.0, 1.0];
        assert_eq!(narrowest(&zeros).name(), "float32");
        comes_back(&zeros, &narrowest(&zeros));
        // More values than counts.
        let many: Vec<f64> = (0..70_000).map(f64::from).collect();
        assert_eq!(narrowest(&many).name(), "float32");
    }

    #[test]
    fn a_missing_sample_stays_missing() {
        let samples = Samples::narrowest(&[Some(1.0), None, Some(3.0)], None);
        assert_eq!((samples.name(), samples.value(1)), ("int16", None));
        assert_eq!(Samples::narrowest(&[None, None], None).value(0), None);
    }

    proptest! {
        #[test]
        fn anything_comes_back(values in prop::collection::vec(any::<f64>().prop_filter("finite", |x| x.is_finite()), 1..200)) {
            comes_back(&values, &narrowest(&values));
        }

        #[test]
        fn any_grid_comes_back(
            counts in prop::collection::vec(-40_000_i32..40_000, 1..200),
            gain in prop::num::f64::POSITIVE | prop::num::f64::NORMAL,
            offset in -1e3..1e3,
        ) {
            let gain = gain.clamp(1e-9, 1e9);
            let values: Vec<f64> = counts.iter().map(|c| f64::from(*c) * gain + offset).collect();
            comes_back(&values, &narrowest(&values));
        }
    }
}
