//! Formulas: an error of one line, or a formula whose text gives the same again and whose value can be asked for
//! anywhere.

use greyrig_host::term::Formula;

use crate::Seen;
use crate::recordings::one_line;

/// A formula.
pub fn parse(data: &[u8]) -> Seen {
    let Ok(text) = std::str::from_utf8(data) else { return Seen::of(()) };
    let formula = match Formula::parse(text) {
        Err(error) => return one_line(&error),
        Ok(formula) => formula,
    };
    assert_eq!(Formula::parse(formula.text()).as_ref().ok(), Some(&formula));
    let values = [0.0, -1.5, 2.0, 1e30];
    let (single, double) = (formula.term::<f32>(&values), formula.term::<f64>(&values));
    for [i, w, u] in [[0.0, 0.0, 0.0], [1.0, -2.0, 3.0], [-1e30, 1e30, -1e-30], [f64::NAN, f64::INFINITY, 0.0]] {
        // NaN where there is no value; that is its author's business.
        let _ = single.value(i as f32, w as f32, u as f32);
        let _ = double.value(i, w, u);
    }
    let operations: Vec<_> = formula.ops().iter().map(std::mem::discriminant).collect();
    Seen::of(operations)
}
