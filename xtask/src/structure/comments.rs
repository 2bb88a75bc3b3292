//! Comments that are too wide to be read.

use std::path::Path;

/// Widest comment line, in columns.
pub const WIDTH: usize = 120;

/// Comment lines of all Rust files in some folders that are too wide, but for what cannot be broken: a row of a table,
/// and a line of a single word, such as an address.
pub fn too_wide(root: &Path, folders: &[&str]) -> Result<Vec<String>, String> {
    let mut found = Vec::new();
    for folder in folders {
        look(root, Path::new(folder), &mut found)?;
    }
    Ok(found)
}

fn look(root: &Path, folder: &Path, found: &mut Vec<String>) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("{}: it cannot be read: {error}", folder.display());
    let mut entries: Vec<_> =
        std::fs::read_dir(root.join(folder)).map_err(failed)?.collect::<Result<_, _>>().map_err(failed)?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let path = folder.join(entry.file_name());
        if entry.file_type().map_err(failed)?.is_dir() {
            look(root, &path, found)?;
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = std::fs::read_to_string(root.join(&path)).map_err(failed)?;
            found.extend(lines(&text).map(|(line, columns)| {
                format!("{}:{line}: a comment of {columns} columns, at most {WIDTH}", path.display())
            }));
        }
    }
    Ok(())
}

/// The comment lines of a text that are too wide: their numbers and widths.
fn lines(text: &str) -> impl Iterator<Item = (usize, usize)> {
    text.lines().enumerate().filter_map(|(k, line)| {
        let columns = line.chars().count();
        let comment = line.trim_start().strip_prefix("//")?.trim_start_matches(['/', '!']).trim_start();
        let breaks = !comment.starts_with('|') && comment.contains(' ');
        (columns > WIDTH && breaks).then_some((k + 1, columns))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_comments_are_found_and_nothing_else() {
        let (just, wide) = ("word ".repeat(24).trim_end().to_owned(), "word ".repeat(25));
        let text = format!(
            "// {}\n    //! {wide}\nlet x = \"{wide}\";\n/// | {wide} |\n// {}\n",
            &just[..117],
            "w".repeat(200)
        );
        assert_eq!(lines(&text).collect::<Vec<_>>(), [(2, 133)]);
    }
}
