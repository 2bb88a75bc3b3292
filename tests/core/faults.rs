//! The table of faults.

use greyrig::faults::TABLE;

#[test]
fn numbers_rise_and_faults_find_their_place() {
    assert!(TABLE.windows(2).all(|pair| pair[0].fault.number() < pair[1].fault.number()));
    for (place, description) in TABLE.iter().enumerate() {
        assert_eq!(description.fault.place(), place);
    }
}

#[test]
fn the_documentation_has_the_table() {
    let page = include_str!("../../docs/firmware.md");
    for d in TABLE {
        let row = format!("| {} | {} | {} |\n", d.fault.number(), d.what, d.remedy);
        assert!(page.contains(&row), "docs/firmware.md lacks: {row}");
    }
}
