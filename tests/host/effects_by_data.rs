//! A new effect is one file and one line: what the host knows of an effect it has from its description.

use std::path::{Path, PathBuf};

use greyrig::effects::EffectId;

/// Files that name effects in their code, and why.
const NAMES_ITS_OWN: [(&str, &str); 2] = [
    ("diagnose/samples.rs", "a look at the samples has to say which effect it has seen"),
    ("plan/rivals.rs", "the pairs that a plan begins with are a choice of the plan"),
];

fn sources(path: &Path, found: &mut Vec<PathBuf>) {
    if path.is_dir() {
        let entries = std::fs::read_dir(path).expect("a folder");
        entries.for_each(|entry| sources(&entry.expect("an entry").path(), found));
    } else if path.extension().is_some_and(|e| e == "rs") {
        found.push(path.to_owned());
    }
}

#[test]
fn host_code_knows_no_effect_by_name() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    for part in ["diagnose", "identify", "plan", "model", "addition.rs", "challenge.rs"] {
        sources(&root.join(part), &mut files);
    }
    assert!(files.len() > 60, "{} files", files.len());
    let mut wrong = Vec::new();
    for file in &files {
        let text = std::fs::read_to_string(file).expect("a source");
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        // A documented example is no knowledge.
        let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
        let code = lines.collect::<Vec<&str>>().join("\n");
        let name = file.strip_prefix(&root).expect("below the root").display().to_string();
        for id in EffectId::ALL {
            if code.contains(&format!("\"{id}\"")) {
                wrong.push(format!("{name} holds \"{id}\""));
            }
        }
        let may = NAMES_ITS_OWN.iter().any(|(exception, _)| *exception == name);
        let after = code.split("EffectId::").skip(1).filter(|after| !after.starts_with("ALL"));
        let named = after.filter(|after| after.starts_with(char::is_uppercase));
        if !may {
            wrong.extend(named.map(|after| format!("{name} names {}", after.lines().next().unwrap_or_default())));
        }
    }
    assert!(wrong.is_empty(), "knowledge of an effect belongs into its description: {wrong:#?}");
}
