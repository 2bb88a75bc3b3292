//! Names that users type: what was meant by one that there is not.

use std::path::{Path, PathBuf};

/// Likeness from which on a name passes for a misspelling of another one: a letter wrong in three, or two in ten. A
/// judgement by what people mistype.
const ALIKE: f64 = 0.8;
/// Names that are listed beside the one that was meant.
const LISTED: usize = 14;
/// Files of a folder that are looked at.
const FILES: usize = 10_000;

/// How alike two names are, from 0 to 1, whatever their capitals (Winkler, 1990), and with or without what is no letter
/// or digit. A name that holds the other one whole is alike, too: `friction` and `coulomb_friction`.
fn alike(given: &str, known: &str) -> f64 {
    let [given, known] = [given, known].map(str::to_lowercase);
    let holds = given.chars().count() > 2 && known.contains(&given);
    let [bare, other] = [&given, &known].map(|name| name.chars().filter(|c| c.is_alphanumeric()).collect::<String>());
    let likeness = strsim::jaro_winkler(&given, &known).max(strsim::jaro_winkler(&bare, &other));
    likeness.max(if holds { ALIKE } else { 0.0 })
}

/// Names by how alike they are to what was given, the nearest first.
pub fn nearest_first<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let mut known: Vec<&str> = known.into_iter().collect();
    known.sort_by(|a, b| alike(given, b).total_cmp(&alike(given, a)));
    known
}

/// The name that was meant, if one is near enough.
pub fn meant<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    nearest_first(given, known).first().copied().filter(|name| alike(given, name) >= ALIKE)
}

/// What to do about a name that there is not: `did you mean saturation? known are …`, the nearest first; a long list
/// only where no name is near.
pub fn advice<'a>(given: &str, known: impl IntoIterator<Item = &'a str>, introduction: &str) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let list = |names: &[&str]| format!("{introduction} {}", names.join(", "));
    match meant(given, known.iter().copied()) {
        Some(name) if known.len() > LISTED => format!("did you mean {name}?"),
        Some(name) => format!("did you mean {name}? {}", list(&nearest_first(given, known))),
        // In their own order.
        None => list(&known),
    }
}

/// The file that was meant by one that there is not: one of its folder, of the same extension before others.
pub fn file(given: &Path) -> Option<PathBuf> {
    let name = given.file_name()?.to_str()?;
    let folder = match given.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let there = std::fs::read_dir(folder).ok()?.take(FILES).flatten();
    let mut names: Vec<String> = there.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    // An extension that all have in common makes no two names alike.
    let (same, others): (Vec<&str>, Vec<&str>) =
        names.iter().map(String::as_str).partition(|name| Path::new(name).extension() == given.extension());
    let found = nearest_stem(given, &same).or_else(|| meant(name, others))?;
    Some(given.with_file_name(found))
}

/// The name that was meant among those of the same extension.
fn nearest_stem<'a>(given: &Path, names: &[&'a str]) -> Option<&'a str> {
    let stem = given.file_stem()?.to_str()?;
    let stems = names.iter().filter_map(|name| Path::new(name).file_stem()?.to_str());
    let found = meant(stem, stems)?;
    names.iter().copied().find(|name| Path::new(name).file_stem().is_some_and(|stem| stem == found))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_is_nearly_right_is_meant() {
        let known = ["saturation", "coulomb_friction", "i_a", "u_v", "K"];
        for (given, name) in [
            ("satration", Some("saturation")),
            ("Saturation", Some("saturation")),
            ("friction", Some("coulomb_friction")),
            ("i_b", Some("i_a")),
            ("uv", Some("u_v")),
            ("k", Some("K")),
            ("gremlins", None),
            ("", None),
        ] {
            assert_eq!(meant(given, known), name, "{given}");
        }
    }

    #[test]
    fn a_short_list_stands_beside_what_was_meant_and_a_long_one_only_where_nothing_is_near() {
        assert_eq!(advice("u_w", ["t_s", "u_v"], "the file has"), "did you mean u_v? the file has u_v, t_s");
        assert_eq!(advice("xyz", ["t_s", "u_v"], "the file has"), "the file has t_s, u_v");
        let many: Vec<String> = (0..40).map(|n| format!("effect_{n}")).collect();
        let many = || many.iter().map(String::as_str);
        assert_eq!(advice("efect_7", many(), "known are"), "did you mean effect_7?");
        assert!(advice("gremlins", many(), "known are").contains("effect_39"));
    }

    #[test]
    fn a_file_is_looked_for_in_its_own_folder() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for name in ["model.toml", "model.csv", "run.csv"] {
            std::fs::write(folder.path().join(name), "").expect("a file");
        }
        let meant = |name: &str| file(&folder.path().join(name)).map(|path| path.file_name().map(|n| n.to_owned()));
        assert_eq!(meant("modl.toml"), Some(Some("model.toml".into())));
        assert_eq!(meant("runn.csv"), Some(Some("run.csv".into())));
        assert_eq!(meant("rum.cvs"), Some(Some("run.csv".into())));
        assert_eq!(meant("else.csv"), None);
        assert_eq!(file(&folder.path().join("none/model.toml")), None);
    }
}
