//! Samples that are missing.

use std::ops::Range;

/// Replaces each NaN by the straight line between the finite values around it, and by the nearest one at an end. What
/// it has replaced, or nothing where there is no finite value at all.
pub(super) fn bridge(values: &mut [f64]) -> Option<Vec<usize>> {
    let mut last = values.iter().position(|x| !x.is_nan())?;
    let mut missing: Vec<usize> = (0..last).collect();
    let first = values[last];
    values[..last].fill(first);
    for k in last + 1..values.len() {
        if values[k].is_nan() {
            missing.push(k);
            continue;
        }
        let (a, b, span) = (values[last], values[k], (k - last) as f64);
        for (step, x) in values[last + 1..k].iter_mut().enumerate() {
            let share = (step + 1) as f64 / span;
            // Each end with its own weight: their difference can overflow.
            *x = a * (1.0 - share) + b * share;
        }
        last = k;
    }
    let end = values[last];
    values[last + 1..].fill(end);
    Some(missing)
}

/// Lets each masked value be the last one that is not masked; the first such one before it.
pub(super) fn hold<T: Copy>(values: &mut [T], masked: &[usize]) {
    let mut open = vec![true; values.len()];
    masked.iter().for_each(|&k| open[k] = false);
    let Some(first) = open.iter().position(|open| *open) else { return };
    let mut last = values[first];
    for (value, open) in values.iter_mut().zip(open) {
        if open {
            last = *value;
        }
        *value = last;
    }
}

/// Stretches of samples as a part of them has them.
pub(super) fn within(gaps: &[Range<usize>], part: &Range<usize>) -> Vec<Range<usize>> {
    let inside = |gap: &Range<usize>| gap.start.max(part.start)..gap.end.min(part.end);
    let all = gaps.iter().map(inside).filter(|gap| !gap.is_empty());
    all.map(|gap| gap.start - part.start..gap.end - part.start).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_has_what_lies_in_it_of_a_gap() {
        assert_eq!(within(&[2..4, 6..9, 12..13], &(3..8)), [0..1, 3..5]);
    }

    #[test]
    fn a_line_bridges_a_gap_and_the_nearest_value_an_end() {
        let mut values = [f64::NAN, 1.0, f64::NAN, f64::NAN, 4.0, f64::NAN];
        assert_eq!(bridge(&mut values), Some(vec![0, 2, 3, 5]));
        for (value, expected) in values.iter().zip([1.0, 1.0, 2.0, 3.0, 4.0, 4.0]) {
            // Thirds are rounded in the last bit.
            assert!((value - expected).abs() < 1e-15, "{values:?}");
        }
        assert_eq!(bridge(&mut [f64::NAN; 3]), None);
        let mut large = [-1.5e308, f64::NAN, 1.5e308];
        assert_eq!(bridge(&mut large), Some(vec![1]));
        assert_eq!(large[1], 0.0);
    }

    #[test]
    fn a_masked_flag_holds_the_one_before() {
        let mut flags = [true, false, true, false, true];
        hold(&mut flags, &[0, 2, 4]);
        assert_eq!(flags, [false; 5]);
    }
}
