//! The order of the modules of each crate.

use std::collections::BTreeSet;

use super::arrows::Arrow;
use super::tree::Tree;

/// Crates and their modules from the lowest on: each may name only what stands before it. A part of a module that
/// stands lower than the rest has a line of its own.
pub const ORDERS: &[(&str, &[&str])] = &[
    (
        "greyrig",
        &[
            "scalar",
            "hardware",
            "units",
            "motor::parameters",
            "motor::balance",
            "term",
            "effects",
            "motor",
            "butterworth",
            "anfis",
            "hybrid",
            "tick",
            "detector",
            "sequence",
            "faults",
            "parameters",
            "exchange",
            "incident",
            "link",
            "app",
        ],
    ),
    ("greyrig_python", &["trouble", "work", "table", "options", "model", "recording", "answers", "fleet"]),
    ("greyrig_fmi", &["instance", "resources", "importer", "fmi2", "fmi3"]),
    (
        "greyrig_host",
        &[
            "context",
            "spelling",
            "error",
            "output",
            "journal",
            "numbers",
            "term",
            "network",
            "noise",
            "averaging",
            "mains",
            "edges",
            "between",
            "counts",
            "filtering",
            "spectra",
            "recording",
            "speed_sensor",
            "segments",
            "held_out",
            "model",
            "check",
            "experiment",
            "repeats",
            "lockstep",
            "prediction",
            "free_run",
            "rig",
            "device",
            "export",
            "compare",
            "forecast",
            "identify",
            "planes",
            "anfis",
            "hybrid",
            "report",
            "monitor",
            "diagnose",
            "plan",
            "challenge",
            "addition",
            "handbook",
            "answers",
            "store",
            "demo",
            "serve",
            "commands",
        ],
    ),
    (
        "xtask",
        &[
            "tally",
            "cargo",
            "needs",
            "firmware",
            "size",
            "packages",
            "book",
            "new_effect",
            "page",
            "python",
            "semver",
            "dependencies",
            "mutation",
            "structure",
            "fuzz",
            "checks",
        ],
    ),
];

/// What does not agree with an order.
pub fn against(tree: &Tree, arrows: &[Arrow], order: &[&str]) -> Vec<String> {
    let own = |file: usize| tree.files[file].module[1..].join("::");
    let place = |file: usize| {
        let module = own(file);
        let holds =
            |entry: &&str| module == *entry || module.strip_prefix(*entry).is_some_and(|rest| rest.starts_with("::"));
        // The longest one, since a part may have a place of its own.
        (0..order.len()).filter(|k| holds(&order[*k])).max_by_key(|k| order[*k].len())
    };
    let top = |file: usize| tree.files[file].module[1..].first().cloned();
    let placeless: BTreeSet<String> =
        (0..tree.files.len()).filter(|file| place(*file).is_none()).filter_map(top).collect();
    let placeless = placeless
        .iter()
        .map(|module| format!("the module {module} has no place in the order (xtask/src/structure/order.rs)"));
    let up = arrows.iter().filter_map(|arrow| {
        let (from, to) = (place(arrow.from)?, place(arrow.to)?);
        (to > from).then(|| format!("arrow up: {} ({} stands above {})", arrow.shown(tree), order[to], order[from]))
    });
    placeless.chain(up).collect()
}
