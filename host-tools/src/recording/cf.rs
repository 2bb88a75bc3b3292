//! What the CF Conventions 1.11 say of a variable beside its numbers: sections 2.5 (missing data), 4.4 (time) and 8.1
//! (packed data). NetCDF files carry it, and HDF5 files of others do, too.

/// The attributes by which the numbers of a file are no values yet.
pub(super) const CHANGES_VALUES: [&str; 7] =
    ["scale_factor", "add_offset", "_FillValue", "missing_value", "valid_range", "valid_min", "valid_max"];

/// How values were packed into numbers: value = number · `scale_factor` + `add_offset`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Packing {
    /// Numbers that stand for "nothing here".
    absent: Vec<f64>,
    /// Smallest and largest number that stands for a value.
    valid: (f64, f64),
    scale: f64,
    offset: f64,
}

impl Packing {
    /// By the attributes, whose numbers `attribute` gives, and the fill value that the file declares for what was never
    /// written.
    pub fn of(attribute: impl Fn(&str) -> Option<Vec<f64>>, declared: Option<f64>) -> Self {
        let first = |name: &str| attribute(name).and_then(|numbers| numbers.first().copied());
        let mut absent = attribute("missing_value").unwrap_or_default();
        absent.extend(first("_FillValue"));
        // Zero is what is declared where nothing is.
        absent.extend(declared.filter(|fill| *fill != 0.0));
        let range = attribute("valid_range").filter(|range| range.len() == 2);
        let bound = |k: usize, name: &str| range.as_ref().map(|range| range[k]).or_else(|| first(name));
        Self {
            absent,
            valid: (bound(0, "valid_min").unwrap_or(f64::NEG_INFINITY), bound(1, "valid_max").unwrap_or(f64::INFINITY)),
            scale: first("scale_factor").unwrap_or(1.0),
            offset: first("add_offset").unwrap_or(0.0),
        }
    }

    /// What is packed is unpacked, what is missing becomes NaN.
    pub fn unpack(&self, numbers: &mut [f64]) {
        let plain = self.scale == 1.0 && self.offset == 0.0;
        for x in numbers {
            if self.absent.contains(x) || *x < self.valid.0 || *x > self.valid.1 {
                *x = f64::NAN;
            } else if !plain {
                *x = *x * self.scale + self.offset;
            }
        }
    }
}

/// The unit of a time that is counted since an instant: `s` of `s since 2026-03-01`.
pub(super) fn since(unit: &str) -> Option<&str> {
    unit.split_once(" since ").map(|(unit, _)| unit.trim())
}

/// Counts the values from the first one that is there.
pub(super) fn count_from_first(values: &mut [f64]) {
    let first = values.iter().copied().find(|x| x.is_finite()).unwrap_or(0.0);
    values.iter_mut().for_each(|x| *x -= first);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_and_missing() {
        let attribute = |name: &str| match name {
            "scale_factor" => Some(vec![0.5]),
            "add_offset" => Some(vec![10.0]),
            "_FillValue" => Some(vec![-1.0]),
            "missing_value" => Some(vec![-2.0, -3.0]),
            "valid_max" => Some(vec![100.0]),
            _ => None,
        };
        let mut numbers = [0.0, 4.0, -1.0, -3.0, 101.0, 77.0];
        Packing::of(attribute, Some(77.0)).unpack(&mut numbers);
        assert_eq!(numbers[..2], [10.0, 12.0]);
        assert!(numbers[2..].iter().all(|x| x.is_nan()), "{numbers:?}");
    }

    #[test]
    fn times_since() {
        assert_eq!(since("milliseconds since 2026-03-01T00:00:00"), Some("milliseconds"));
        assert_eq!(since("V"), None);
    }
}
