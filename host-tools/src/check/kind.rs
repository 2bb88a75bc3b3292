//! A magnet motor taken for a universal one, or the other way round.
//!
//! Both balances of the voltage have as many coefficients, and differ in one regressor: ω or i ω. The one that leaves
//! several times less has the likelihood on its side.

use super::evidence::Evidence;
use super::signals::Signals;
use crate::model::Kind;
use crate::recording::finding::{Code, DataFinding, Severity};

/// What to look for.
pub fn look(s: &Signals<'_>, e: &Evidence, kind: Kind, found: &mut Vec<DataFinding>) {
    let Some(told) = e.told.filter(|told| *told != kind) else { return };
    let (Some(better), Some(worse)) = (e.unexplained(told), e.unexplained(kind)) else { return };
    let (is, as_if) = match told {
        Kind::PmDc => ("a magnet motor's (the back-EMF goes with the speed alone)", "a universal motor's"),
        Kind::Universal => ("a universal motor's (the back-EMF goes with current and speed)", "a magnet motor's"),
    };
    found.push(
        s.finding(
            Code::WrongKind,
            Severity::Stop,
            format!(
                "this recording is {is}: {:.1} % of the voltage is left unexplained, as {as_if} {:.0} %",
                100.0 * better,
                100.0 * worse
            ),
        )
        .value(worse, "")
        .remedy(format!("--kind {}", told.name())),
    );
}
