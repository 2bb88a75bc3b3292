//! The step `structure`: the arrows between modules, and the width of comments.
//!
//! An *arrow* goes from a file to another one of the same crate that defines what it names: in a `use`, or in a path
//! within the code (`crate::a::b`, `super::b`, `b::c`). Names are followed through re-exports to the file that defines
//! them. What stands under `#[cfg(test)]` draws no arrow, nor do doc links.
//!
//! 1. No circle: from no file a way along arrows leads back to it. A module's own children are its parts: an arrow from
//!    a
//!    `mod.rs` down to a file of its folder, whether it declares, re-exports or uses it, does not count; the one from
//!    the part up to its `mod.rs` does.
//! 2. No arrow up: the modules of a crate have an order ([`order::ORDERS`]), and each names only what stands before it.
//! 3. No comment line is wider than [`comments::WIDTH`] columns.

mod arrows;
mod circles;
mod comments;
mod order;
mod tree;

use std::path::Path;

use arrows::Arrow;
use tree::Tree;

/// Where the crates begin: the name by which their code is known to others, and the root file.
const CRATES: [(&str, &str); 8] = [
    ("greyrig", "src/lib.rs"),
    ("nucleo_g474re", "src/bin/nucleo_g474re/main.rs"),
    ("mps2_an386", "src/bin/mps2_an386/main.rs"),
    ("greyrig_fmi", "host-tools/fmi/src/lib.rs"),
    ("greyrig_python", "host-tools/python/src/lib.rs"),
    ("greyrig_host", "host-tools/src/lib.rs"),
    ("greyrig_command", "host-tools/src/main.rs"),
    ("xtask", "xtask/src/main.rs"),
];

/// Folders whose comments are looked at.
const FOLDERS: [&str; 4] = ["src", "host-tools", "xtask", "tests"];

/// Looks at the repository in a folder.
///
/// # Errors
/// All that does not hold, a line each; or a file that cannot be read.
pub fn check(root: &Path) -> Result<(), String> {
    let read = |path: &str| std::fs::read_to_string(root.join(path)).ok();
    let mut faults = faults(&CRATES, order::ORDERS, &read)?;
    faults.extend(comments::too_wide(root, &FOLDERS)?);
    if faults.is_empty() { Ok(()) } else { Err(format!("the structure does not hold:\n{}", faults.join("\n"))) }
}

/// Circles and arrows up of some crates.
fn faults(
    crates: &[(&str, &str)],
    orders: &[(&str, &[&str])],
    read: &dyn Fn(&str) -> Option<String>,
) -> Result<Vec<String>, String> {
    let mut faults = Vec::new();
    for (name, root) in crates {
        let tree = Tree::of(name, root, read)?;
        let arrows = arrows::of(&tree);
        faults.extend(circles::among(&arrows).iter().map(|circle| described(&tree, circle)));
        if let Some((_, order)) = orders.iter().find(|(of, _)| of == name) {
            faults.extend(order::against(&tree, &arrows, order));
        }
    }
    Ok(faults)
}

/// A circle, an arrow a line.
fn described(tree: &Tree, circle: &[&Arrow]) -> String {
    let lines: Vec<String> = circle.iter().map(|arrow| format!("  {}", arrow.shown(tree))).collect();
    format!("circle:\n{}", lines.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is wrong with a crate of these files, whose modules have this order.
    fn faults_of(files: &[(&str, &str)], order: &[&str]) -> Vec<String> {
        let read = |path: &str| files.iter().find(|(name, _)| *name == path).map(|(_, text)| (*text).to_owned());
        faults(&[("house", "src/lib.rs")], &[("house", order)], &read).expect("a tree")
    }

    const LIB: (&str, &str) = ("src/lib.rs", "pub mod a; pub mod b;");

    #[test]
    fn a_circle_is_told_with_its_names() {
        let a = ("src/a.rs", "use crate::b::Wall; pub struct Door(Wall);");
        let b = ("src/b.rs", "pub struct Wall; pub fn knock() { crate::a::Door; }");
        let faults = faults_of(&[LIB, a, b], &["b", "a"]);
        assert_eq!(
            faults,
            [
                "circle:\n  src/a.rs -> src/b.rs: Wall\n  src/b.rs -> src/a.rs: Door",
                "arrow up: src/b.rs -> src/a.rs: Door (a stands above b)"
            ]
        );
    }

    #[test]
    fn names_are_followed_to_where_they_are_defined() {
        // `b` takes `Key` by way of `a`, whose part `a::key` defines it: no circle with `a`, which stands on `b`.
        let a = ("src/a/mod.rs", "mod key; pub use key::Key; use crate::b::turn; fn f() { turn(); }");
        let key = ("src/a/key.rs", "pub struct Key;");
        let b = ("src/b.rs", "use crate::a::Key; pub fn turn() { let _ = Key; }");
        assert_eq!(faults_of(&[LIB, a, key, b], &["a::key", "b", "a"]), Vec::<String>::new());
        let by_module = ("src/b.rs", "use crate::a; pub fn turn() { let _ = a::Key; }");
        assert_eq!(faults_of(&[LIB, a, key, by_module], &["a::key", "b", "a"]), Vec::<String>::new());
        let itself = ("src/a/mod.rs", "mod key; pub struct Key; use crate::b::turn; fn f() { turn(); }");
        assert_eq!(faults_of(&[LIB, itself, key, b], &["a::key", "b", "a"]).len(), 2, "a circle, and an arrow up");
    }

    #[test]
    fn parts_belong_to_their_module_but_circles_among_them_count() {
        let a = ("src/a/mod.rs", "mod one; mod two; pub struct Head; fn f() { one::one(); two::two(); }");
        let one = ("src/a/one.rs", "use super::Head; pub fn one() { super::two::two(); }");
        let two = ("src/a/two.rs", "pub fn two() {}");
        let b = ("src/b.rs", "");
        assert_eq!(faults_of(&[LIB, a, one, two, b], &["b", "a"]), Vec::<String>::new());
        let two = ("src/a/two.rs", "pub fn two() { let one = super::one::one; }");
        assert_eq!(faults_of(&[LIB, a, one, two, b], &["b", "a"]).len(), 1);
    }

    #[test]
    fn macros_are_read_and_tests_are_not() {
        let a = (
            "src/a.rs",
            "#[cfg(test)] mod tests { use crate::b::Wall; } #[cfg(test)] use crate::b::Wall; pub struct Door;",
        );
        let b = ("src/b.rs", "pub struct Wall; fn f() { println!(\"{}\", g(crate::a::Door)); }");
        assert_eq!(faults_of(&[LIB, a, b], &["a", "b"]), Vec::<String>::new());
        assert_eq!(faults_of(&[LIB, a, b], &["b", "a"]), ["arrow up: src/b.rs -> src/a.rs: Door (a stands above b)"]);
    }

    #[test]
    fn a_module_without_a_place_is_told() {
        let files = [LIB, ("src/a.rs", ""), ("src/b.rs", "")];
        let faults = faults_of(&files, &["a"]);
        assert!(faults.len() == 1 && faults[0].contains("b has no place"), "{faults:?}");
    }

    #[test]
    fn a_file_that_is_missing_is_told() {
        let read = |path: &str| (path == "src/lib.rs").then(|| "mod a;".to_owned());
        let error = faults(&[("house", "src/lib.rs")], &[], &read).expect_err("no file of a");
        assert!(error.contains("src/lib.rs") && error.contains("mod a"), "{error}");
    }
}
