//! The step `book`: the documentation as a book, and no link in it that leads nowhere.
//!
//! 1. Each page below `docs` has a line in `docs/SUMMARY.md`.
//! 2. Each link of a Markdown file of the repository leads to a file, a folder or a heading that is there ([`links`]).
//! 3. mdBook builds the book without a warning, and each link of what it has made leads to a file and an anchor
//!    ([`made`]). The book lies at the root of the repository, as deep as `docs`, so that its links into the tree
//!    hold, too.

mod links;
mod made;
mod slug;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::cargo::{not_started, shown};

/// Markdown files outside `docs`.
const OUTSIDE: [&str; 5] =
    ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "src/README.md", "host-tools/python/README.md"];

/// Where the documentation is.
const DOCS: &str = "docs";

/// The book's table of contents.
const SUMMARY: &str = "docs/SUMMARY.md";

/// Where the book is made, from the root.
const BOOK: &str = "book";

/// Checks the pages, builds the book, and checks that.
///
/// # Errors
/// All links that lead nowhere and all pages that the table of contents lacks, a line each; what mdBook complains of.
pub fn check(root: &Path) -> Result<(), String> {
    let pages = pages(root)?;
    let outside = OUTSIDE.iter().map(PathBuf::from).filter(|path| root.join(path).is_file());
    let files: Vec<PathBuf> = outside.chain(pages.iter().cloned()).collect();
    let mut faults = links::broken(root, &files)?;
    let listed = links::targets(root, Path::new(SUMMARY))?;
    let unlisted = pages.iter().filter(|page| page.as_path() != Path::new(SUMMARY) && !listed.contains(*page));
    faults.extend(unlisted.map(|page| format!("{}: not in {SUMMARY}; add a line there", page.display())));
    if !faults.is_empty() {
        return Err(format!("the documentation does not hold:\n{}", faults.join("\n")));
    }
    let made = build(root)?;
    let faults = made::broken(&made)?;
    if faults.is_empty() { Ok(()) } else { Err(format!("the book does not hold:\n{}", faults.join("\n"))) }
}

/// Builds the book and says where it is.
///
/// # Errors
/// mdBook cannot be started, fails, or warns.
pub fn build(root: &Path) -> Result<PathBuf, String> {
    let book = root.join(BOOK);
    // What an earlier version has left is no page of this one.
    let _ = std::fs::remove_dir_all(&book);
    let mut command = Command::new("mdbook");
    command.arg("build").current_dir(root);
    let output = command.output().map_err(|error| not_started(&command, &error))?;
    let said = String::from_utf8_lossy(&output.stderr);
    let complains = said.lines().any(|line| line.contains("WARN") || line.contains("ERROR"));
    if !output.status.success() || complains {
        return Err(format!("{} ended with {}:\n{said}", shown(&command), output.status));
    }
    Ok(book)
}

/// The pages of the documentation, from the root, in order.
fn pages(root: &Path) -> Result<BTreeSet<PathBuf>, String> {
    let mut pages = BTreeSet::new();
    let mut folders = vec![PathBuf::from(DOCS)];
    while let Some(folder) = folders.pop() {
        let unreadable = |error: std::io::Error| format!("{} cannot be read: {error}", folder.display());
        for entry in std::fs::read_dir(root.join(&folder)).map_err(unreadable)? {
            let entry = entry.map_err(unreadable)?;
            let path = folder.join(entry.file_name());
            if entry.path().is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                pages.insert(path);
            }
        }
    }
    Ok(pages)
}
