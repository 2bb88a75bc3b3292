//! Statistics of the lot against published figures.

use greyrig_exam::roc::{area, characteristic, size_for};
use greyrig_exam::share::Share;

#[test]
fn intervals_are_those_of_clopper_and_pearson() {
    // Tables of C. J. Clopper and E. S. Pearson's intervals, as printed in most books of statistics.
    for (hits, cases, low, high) in [
        (0, 10, 0.0, 0.3085),
        (5, 10, 0.1871, 0.8129),
        (10, 10, 0.6915, 1.0),
        (1, 10, 0.0025, 0.4450),
        (8, 8, 0.6306, 1.0),
    ] {
        let [a, b] = Share { hits, cases }.clopper_pearson();
        // Half a digit of the print.
        assert!((a - low).abs() <= 5e-5 && (b - high).abs() <= 5e-5, "{hits} of {cases}: {a} … {b}");
    }
}

#[test]
fn characteristics_of_known_scores() {
    // Faulty beats healthy in 5 of 6 pairs.
    let curve = characteristic(&[1.0, 3.0], &[2.0, 4.0, 5.0]);
    assert!((area(&curve) - 5.0 / 6.0).abs() < 1e-12, "{curve:?}");
    assert_eq!(curve.last(), Some(&(1.0, 1.0)));
    // Scores that tell nothing.
    assert!((area(&characteristic(&[1.0, 1.0], &[1.0])) - 0.5).abs() < 1e-12);
}

#[test]
fn sizes_lie_between_those_that_were_tried() {
    // Half way between 0.1 and 0.4, whose geometric mean is 0.2.
    let tried = [(-0.1, 0.0), (-0.4, 1.0)];
    assert!((size_for(0.5, &tried).unwrap() - 0.2).abs() < 1e-12);
    assert_eq!(size_for(0.9, &[(0.1, 0.2), (0.2, 0.5)]), None);
    assert_eq!(size_for(0.9, &[(0.1, 1.0), (0.2, 1.0)]), Some(0.1));
}
