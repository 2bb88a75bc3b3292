//! What dependencies bring: licences, sources, versions side by side, and the Rust that they ask for.
//!
//! The rules stand in `deny.toml`, whose form is cargo-deny's. Advisories are cargo-deny's own: they need its database.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use cargo_metadata::{CargoOpt, DependencyKind, Metadata, MetadataCommand, Package, PackageId};
use serde::Deserialize;
use spdx::{Expression, ParseMode};

use crate::packages::PUBLISHED;

/// The part of `deny.toml` that is held against the metadata here.
#[derive(Deserialize)]
struct Rules {
    licenses: Licences,
    bans: Bans,
    sources: Sources,
}

#[derive(Deserialize)]
struct Licences {
    allow: BTreeSet<String>,
    exceptions: Vec<Exception>,
}

#[derive(Deserialize)]
struct Exception {
    #[serde(rename = "crate")]
    name: String,
    allow: BTreeSet<String>,
}

#[derive(Deserialize)]
struct Bans {
    skip: Vec<Skipped>,
}

/// A crate of which there may be several versions.
#[derive(Deserialize)]
struct Skipped {
    #[serde(rename = "crate")]
    name: String,
}

#[derive(Deserialize)]
struct Sources {
    #[serde(rename = "allow-registry")]
    registries: BTreeSet<String>,
}

/// Holds the rules against all packages of the lock file, those for other systems included.
///
/// # Errors
/// Everything that breaks a rule, a line each; a rule that nothing needs any longer is one, too.
pub fn check() -> Result<(), String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let text = std::fs::read_to_string(root.join("deny.toml")).map_err(|error| format!("deny.toml: {error}"))?;
    let rules: Rules = toml::from_str(&text).map_err(|error| format!("deny.toml: {error}"))?;
    let mut command = MetadataCommand::new();
    command.current_dir(root).features(CargoOpt::AllFeatures).other_options(["--locked".to_owned()]);
    let metadata = command.exec().map_err(|error| error.to_string())?;
    let mut broken = Vec::new();
    for package in &metadata.packages {
        broken.extend(licence(&rules.licenses, &package.name, package.license.as_deref()));
        broken.extend(source(&rules.sources, package));
        broken.extend(newer_rust(package, &metadata));
    }
    broken.extend(side_by_side(&rules.bans, &versions(&metadata)));
    broken.extend(unneeded(&rules.licenses, &metadata));
    if broken.is_empty() { Ok(()) } else { Err(format!("{} against deny.toml\n{}", broken.len(), broken.join("\n"))) }
}

/// Whether the licence that a package states lets itself be met by those that are allowed.
fn licence(rules: &Licences, name: &str, stated: Option<&str>) -> Option<String> {
    let Some(stated) = stated else { return Some(format!("{name} states no licence")) };
    let expression = match Expression::parse_mode(stated, ParseMode::LAX) {
        Ok(expression) => expression,
        Err(error) => return Some(format!("{name}: {stated:?} is no licence: {}", error.reason)),
    };
    let exceptions = || rules.exceptions.iter().filter(|exception| exception.name == name);
    let met = expression.evaluate(|requirement| {
        let licence = requirement.to_string();
        rules.allow.contains(&licence) || exceptions().any(|exception| exception.allow.contains(&licence))
    });
    (!met).then(|| format!("{name}: the licence {stated} is not allowed"))
}

/// Whether a package comes from where packages may come from: this repository or an allowed registry.
fn source(rules: &Sources, package: &Package) -> Option<String> {
    let source = package.source.as_ref()?.repr.as_str();
    let allowed = source.strip_prefix("registry+").is_some_and(|registry| rules.registries.contains(registry));
    (!allowed).then(|| format!("{} comes from {source}", package.name))
}

/// Whether a package asks for a newer Rust than the workspace does. One that states none cannot be judged.
fn newer_rust(package: &Package, metadata: &Metadata) -> Option<String> {
    let ours = metadata.workspace_packages().iter().filter_map(|member| member.rust_version.clone()).min()?;
    let theirs = package.rust_version.clone().filter(|theirs| *theirs > ours)?;
    Some(format!("{} {} asks for Rust {theirs}, newer than `rust-version` {ours}", package.name, package.version))
}

/// The versions of each package that the published crates link, tests and tools left out.
fn versions(metadata: &Metadata) -> BTreeMap<String, BTreeSet<String>> {
    let nodes = metadata.resolve.iter().flat_map(|resolve| &resolve.nodes);
    let nodes: BTreeMap<&PackageId, _> = nodes.map(|node| (&node.id, node)).collect();
    let members = metadata.workspace_packages().into_iter();
    let mut waiting: Vec<&PackageId> =
        members.filter(|member| PUBLISHED.contains(&member.name.as_str())).map(|member| &member.id).collect();
    let mut linked = BTreeSet::new();
    while let Some(id) = waiting.pop() {
        if linked.insert(id) {
            let links = nodes.get(id).into_iter().flat_map(|node| &node.deps);
            let links = links.filter(|link| link.dep_kinds.iter().any(|kind| kind.kind == DependencyKind::Normal));
            waiting.extend(links.map(|link| &link.pkg));
        }
    }
    let mut versions: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for id in linked {
        versions.entry(metadata[id].name.to_string()).or_default().insert(metadata[id].version.to_string());
    }
    versions
}

fn side_by_side(rules: &Bans, versions: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let several: BTreeMap<_, _> = versions.iter().filter(|(_, versions)| versions.len() > 1).collect();
    let skipped: BTreeSet<&String> = rules.skip.iter().map(|skipped| &skipped.name).collect();
    let new = several.iter().filter(|(name, _)| !skipped.contains(**name));
    let new = new.map(|(name, versions)| format!("{name} is linked in the versions {versions:?}; see `cargo tree -d`"));
    let gone = skipped.iter().filter(|name| !several.contains_key(**name));
    new.chain(gone.map(|name| format!("bans.skip: {name} is linked in one version"))).collect()
}

fn unneeded(rules: &Licences, metadata: &Metadata) -> Vec<String> {
    let names: BTreeSet<&str> = metadata.packages.iter().map(|package| package.name.as_str()).collect();
    let gone = rules.exceptions.iter().filter(|exception| !names.contains(exception.name.as_str()));
    gone.map(|exception| format!("licenses.exceptions: {} is no dependency", exception.name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn licences_are_met_as_their_expressions_say() {
        let set = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect::<BTreeSet<_>>();
        let exceptions = vec![Exception { name: "odd".into(), allow: set(&["GPL-2.0"]) }];
        let rules = Licences { allow: set(&["MIT", "Unicode-3.0"]), exceptions };
        let allowed = |name: &str, stated| licence(&rules, name, stated).is_none();
        assert!(allowed("a", Some("MIT OR Apache-2.0")) && allowed("a", Some("MIT/Apache-2.0")));
        assert!(allowed("a", Some("(MIT OR Apache-2.0) AND Unicode-3.0")));
        assert!(!allowed("a", Some("MIT AND Apache-2.0")) && !allowed("a", Some("GPL-2.0")));
        assert!(allowed("odd", Some("GPL-2.0")));
        assert!(!allowed("a", None) && !allowed("a", Some("a licence of our own")));
    }

    #[test]
    fn versions_side_by_side_need_a_reason_and_reasons_need_versions() {
        let rules = Bans { skip: ["known", "gone"].map(|name| Skipped { name: name.into() }).into() };
        let of = |versions: &[&str]| versions.iter().map(|&version| version.to_owned()).collect::<BTreeSet<_>>();
        let versions = [("known", of(&["1.0.0", "2.0.0"])), ("new", of(&["1.0.0", "1.1.0"])), ("gone", of(&["1.0.0"]))];
        let versions = versions.map(|(name, versions)| (name.to_owned(), versions)).into();
        let broken = side_by_side(&rules, &versions);
        assert!(broken.len() == 2 && broken[0].starts_with("new") && broken[1].contains("gone"), "{broken:?}");
    }
}
