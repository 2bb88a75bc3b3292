//! Circles of arrows.

use std::collections::{BTreeMap, BTreeSet};

use super::arrows::Arrow;

/// The circles, each with all arrows among its files.
pub fn among(arrows: &[Arrow]) -> Vec<Vec<&Arrow>> {
    let files: BTreeSet<usize> = arrows.iter().flat_map(|arrow| [arrow.from, arrow.to]).collect();
    let reached: BTreeMap<usize, BTreeSet<usize>> =
        files.iter().map(|file| (*file, reached_from(*file, arrows))).collect();
    let mut done = BTreeSet::new();
    let mut circles = Vec::new();
    for file in files {
        // Files are of one circle where each is reached from the other.
        let circle: BTreeSet<usize> =
            reached[&file].iter().copied().filter(|other| reached[other].contains(&file)).collect();
        if circle.contains(&file) && done.insert(file) {
            done.extend(&circle);
            circles.push(arrows.iter().filter(|a| circle.contains(&a.from) && circle.contains(&a.to)).collect());
        }
    }
    circles
}

/// All files that a way along arrows leads to; the one that it begins at only if it leads back.
fn reached_from(file: usize, arrows: &[Arrow]) -> BTreeSet<usize> {
    let mut reached = BTreeSet::new();
    let mut next = vec![file];
    while let Some(at) = next.pop() {
        for to in arrows.iter().filter(|arrow| arrow.from == at).map(|arrow| arrow.to) {
            if reached.insert(to) {
                next.push(to);
            }
        }
    }
    reached
}
