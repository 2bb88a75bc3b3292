//! Seeds and reproducers run through their targets, and the folders are those of the targets.

use std::collections::BTreeSet;
use std::path::Path;

use greyrig_fuzz::mutate::Mutator;
use greyrig_fuzz::{TARGETS, inputs, target};

#[test]
fn no_input_in_the_tree_fails() {
    let mut failed = Vec::new();
    for target in TARGETS {
        let paths = inputs(target).unwrap();
        assert!(!paths.is_empty(), "{} has no seed", target.name);
        for path in paths {
            if let Err(panic) = target.run(&std::fs::read(&path).unwrap()) {
                failed.push(format!("{}: {panic}", path.display()));
            }
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn every_folder_is_of_a_target() {
    let names: BTreeSet<String> = TARGETS.iter().map(|target| target.name.to_owned()).collect();
    assert_eq!(names.len(), TARGETS.len());
    for kind in ["corpus", "reproducers"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(kind);
        for entry in std::fs::read_dir(folder).into_iter().flatten() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            assert!(names.contains(&name), "{kind}/{name} is of no target");
        }
    }
}

/// The same seed gives the same inputs, another one others; and what does something new leads on.
#[test]
fn inputs_can_be_repeated() {
    let target = target("term").unwrap();
    let draw = |seed: u64| {
        let mut mutator = Mutator::new(seed, vec![b"k*i*abs(i)".to_vec()]);
        (0..2000)
            .map(|_| {
                let input = mutator.next();
                mutator.tell(&input, target.run(&input).unwrap());
                input
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(draw(1), draw(1));
    assert_ne!(draw(1), draw(2));
    let mut mutator = Mutator::new(1, vec![b"k*i*abs(i)".to_vec()]);
    for input in draw(1) {
        mutator.tell(&input, target.run(&input).unwrap());
    }
    assert!(mutator.kept() > 20, "{}", mutator.kept());
}
