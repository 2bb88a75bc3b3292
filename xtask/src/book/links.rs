//! Links in Markdown.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::{Component, Path, PathBuf};

use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd};

use super::slug::Slugs;

/// What a page holds.
#[derive(Debug, Default)]
struct Page {
    /// Line and target of each link and picture.
    links: Vec<(usize, String)>,
    /// Anchors of its headings.
    anchors: HashSet<String>,
}

impl Page {
    fn of(text: &str) -> Self {
        let mut page = Self::default();
        let mut slugs = Slugs::default();
        let mut heading: Option<String> = None;
        let options = Options::ENABLE_TABLES | Options::ENABLE_STRIKETHROUGH | Options::ENABLE_FOOTNOTES;
        for (event, range) in Parser::new_ext(text, options).into_offset_iter() {
            match event {
                Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                    let line = 1 + text[..range.start].matches('\n').count();
                    page.links.push((line, dest_url.into_string()));
                }
                Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
                Event::End(TagEnd::Heading(_)) => {
                    page.anchors.extend(heading.take().map(|heading| slugs.next(&heading)));
                }
                Event::Text(words) | Event::Code(words) => {
                    if let Some(heading) = &mut heading {
                        heading.push_str(&words);
                    }
                }
                _ => (),
            }
        }
        page
    }

    fn read(root: &Path, path: &Path) -> Result<Self, String> {
        let text = std::fs::read_to_string(root.join(path));
        text.map(|text| Self::of(&text)).map_err(|error| format!("{} cannot be read: {error}", path.display()))
    }
}

/// The files that a page links to, from the root.
pub fn targets(root: &Path, path: &Path) -> Result<BTreeSet<PathBuf>, String> {
    let page = Page::read(root, path)?;
    let near = page.links.iter().filter(|(_, target)| !is_far(target));
    Ok(near.filter_map(|(_, target)| resolved(path, target.split('#').next().unwrap_or_default())).collect())
}

/// Links of these files that lead nowhere, a line each: file and line, target, what is wrong.
pub fn broken(root: &Path, files: &[PathBuf]) -> Result<Vec<String>, String> {
    let mut known: HashMap<PathBuf, Page> = HashMap::new();
    let mut faults = Vec::new();
    for path in files {
        let page = Page::read(root, path)?;
        for (line, target) in &page.links {
            if is_far(target) {
                continue;
            }
            let told = |what: String| format!("{}:{line}: {target}: {what}", path.display());
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let place = if file.is_empty() { Some(path.clone()) } else { resolved(path, file) };
            let Some(place) = place else {
                faults.push(told("leads out of the repository".to_owned()));
                continue;
            };
            if !root.join(&place).exists() {
                faults.push(told(format!("there is no {}", place.display())));
            } else if !anchor.is_empty() && place.extension().is_some_and(|extension| extension == "md") {
                if !known.contains_key(&place) {
                    known.insert(place.clone(), Page::read(root, &place)?);
                }
                if !known[&place].anchors.contains(anchor) {
                    faults.push(told(format!("{} has no heading {anchor}", place.display())));
                }
            }
        }
    }
    Ok(faults)
}

/// Whether a target lies on another machine.
fn is_far(target: &str) -> bool {
    ["http://", "https://", "mailto:"].iter().any(|scheme| target.starts_with(scheme))
}

/// The file that a page's link names, from the root; none outside of it.
fn resolved(from: &Path, target: &str) -> Option<PathBuf> {
    let mut path = from.parent()?.to_path_buf();
    for part in Path::new(target).components() {
        match part {
            Component::Normal(name) => path.push(name),
            Component::CurDir => (),
            Component::ParentDir if path.pop() => (),
            _ => return None,
        }
    }
    Some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_leads_nowhere_is_told_with_its_line() {
        let folder = std::env::temp_dir().join(format!("greyrig-links-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("docs/figures")).expect("a folder");
        let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("a file");
        write("README.md", "# A `b` c\n\n[x](docs/a.md#two-words) [y](docs/b.md) [z](#a-b-c)\n");
        write(
            "docs/a.md",
            "# Two words\n\n[up](../README.md#d)\n![p](figures/p.png)\n[far](https://example.org/x.md) [out](../../x.md)\n\n```\n[code](no.md)\n```\n",
        );
        let files = [PathBuf::from("README.md"), PathBuf::from("docs/a.md")];
        let faults = broken(&folder, &files).expect("they are read");
        std::fs::remove_dir_all(&folder).expect("the folder goes");
        assert_eq!(
            faults,
            [
                "README.md:3: docs/b.md: there is no docs/b.md",
                "docs/a.md:3: ../README.md#d: README.md has no heading d",
                "docs/a.md:4: figures/p.png: there is no docs/figures/p.png",
                "docs/a.md:5: ../../x.md: leads out of the repository",
            ]
        );
    }
}
