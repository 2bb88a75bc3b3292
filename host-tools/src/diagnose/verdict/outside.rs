//! Real structure that no effect of the catalogue explains.

use super::{Verdict, VerdictKind};
use crate::diagnose::completeness::Completeness;
use crate::diagnose::holds::Holds;
use crate::diagnose::ladder::Ladder;
use crate::diagnose::lead::Lead;
use crate::diagnose::sizes::Size;

/// Where structure can be left.
const BALANCES: [&str; 2] = ["voltage balance", "torque balance"];
const FREE_RUN: [&str; 2] = ["current of the free run", "speed of the free run"];

/// Something is left that no effect explains; `text` tells what was found beside it.
pub fn unexplained(ladder: &Ladder, lead: &Lead, sizes: Vec<Size>, mut text: Vec<String>, holds: Holds) -> Verdict {
    let judges = |(without, with): &(Completeness, Completeness)| {
        if ladder.found.is_empty() { ladder.after.is_complete() } else { !with.explains(without) }
    };
    let free_run = ladder.free_run.filter(judges);
    let (names, left) = free_run.map_or((BALANCES, ladder.after), |(_, with)| (FREE_RUN, with));
    let (side, times) =
        if left.electrical > left.mechanical { (names[0], left.electrical) } else { (names[1], left.mechanical) };
    if !text.is_empty() {
        text.insert(0, "part of the error looks like an effect of the catalogue, but not all of it:".to_owned());
    }
    text.push(format!(
        "structure is left in the {side}, {times:.1} times what does not repeat, that no effect of the catalogue explains"
    ));
    verdict(lead, sizes, text, holds)
}

/// Nothing is left, but one of the effects does not explain its part as what it is; `text` tells which.
pub fn strained(lead: &Lead, sizes: Vec<Size>, mut text: Vec<String>, holds: Holds) -> Verdict {
    text.insert(0, "the error looks like effects of the catalogue, but not within their physical range:".to_owned());
    verdict(lead, sizes, text, holds)
}

fn verdict(lead: &Lead, sizes: Vec<Size>, mut text: Vec<String>, holds: Holds) -> Verdict {
    if !lead.terms.is_empty() {
        let formula: Vec<String> =
            lead.terms.iter().map(|t| format!("{:+.3e} {} ({})", t.coefficient, t.formula, t.balance)).collect();
        text.push(format!(
            "a formula of generic terms takes {:.0} % of it: {}",
            100.0 * lead.held_out_gain,
            formula.join("  ")
        ));
    }
    Verdict {
        kind: VerdictKind::OutsideCatalogue,
        effects: Vec::new(),
        classes: Vec::new(),
        sizes,
        probability: None,
        text: text.join("\n"),
        next_experiment: Some(holds.each_part_alone()),
        remaining: None,
    }
}
