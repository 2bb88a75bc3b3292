//! Links in the pages that mdBook has made.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// A page that mdBook makes beside those of the book: all chapters in one, for printers, with the links of each.
const OF_ITS_OWN: [&str; 3] = ["print.html", "404.html", "toc.html"];

/// Links of the book in a folder that lead nowhere, a line each.
pub fn broken(book: &Path) -> Result<Vec<String>, String> {
    let mut texts: HashMap<PathBuf, String> = HashMap::new();
    let mut folders = vec![book.to_path_buf()];
    while let Some(folder) = folders.pop() {
        let unreadable = |error: std::io::Error| format!("{} cannot be read: {error}", folder.display());
        for entry in std::fs::read_dir(&folder).map_err(unreadable)? {
            let path = entry.map_err(unreadable)?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "html") {
                let text = std::fs::read_to_string(&path).map_err(unreadable)?;
                texts.insert(path, text);
            }
        }
    }
    if texts.is_empty() {
        return Err(format!("{} holds no page", book.display()));
    }
    let anchors: HashMap<PathBuf, HashSet<&str>> = texts
        .iter()
        .filter_map(|(path, text)| Some((path.canonicalize().ok()?, values(text, " id=\"").collect())))
        .collect();
    let mut faults = Vec::new();
    for (path, text) in &texts {
        if path.parent() == Some(book) && path.file_name().is_some_and(|name| OF_ITS_OWN.iter().any(|own| name == *own))
        {
            continue;
        }
        for target in values(text, " href=\"").chain(values(text, " src=\"")) {
            if target.is_empty() || target.contains(':') {
                continue;
            }
            let target = target.replace("&amp;", "&");
            let (file, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let folder = path.parent().unwrap_or(book);
            let place = if file.is_empty() { path.clone() } else { folder.join(file) };
            let told = |what: &str| format!("{}: {target}: {what}", path.strip_prefix(book).unwrap_or(path).display());
            match place.canonicalize() {
                Err(_) => faults.push(told("there is no such file")),
                Ok(place) => {
                    if !anchor.is_empty() && anchors.get(&place).is_some_and(|known| !known.contains(anchor)) {
                        faults.push(told("the page has no such anchor"));
                    }
                }
            }
        }
    }
    faults.sort();
    Ok(faults)
}

/// The values of an attribute, which begins with this.
fn values<'a>(text: &'a str, begin: &'a str) -> impl Iterator<Item = &'a str> {
    text.split(begin).skip(1).filter_map(|rest| rest.split_once('"').map(|(value, _)| value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dead_links_of_a_book_are_told() {
        let folder = std::env::temp_dir().join(format!("greyrig-book-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("a")).expect("a folder");
        let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("a file");
        write(
            "b.html",
            "<h1 id=\"one\">One</h1> <a href=\"a/c.html#two\">c</a> <a href=\"https://example.org\">far</a>",
        );
        write("a/c.html", "<a href=\"../b.html#one\">b</a> <img src=\"no.png\"> <a href=\"#three\">3</a>");
        let faults = broken(&folder).expect("a book");
        std::fs::remove_dir_all(&folder).expect("the folder goes");
        assert_eq!(
            faults,
            [
                "a/c.html: #three: the page has no such anchor",
                "a/c.html: no.png: there is no such file",
                "b.html: a/c.html#two: the page has no such anchor",
            ]
        );
    }
}
