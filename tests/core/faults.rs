//! The table of faults.

use greyrig::faults::TABLE;

#[test]
fn numbers_rise_and_faults_find_their_place() {
    assert!(TABLE.windows(2).all(|pair| pair[0].fault.number() < pair[1].fault.number()));
    for (place, description) in TABLE.iter().enumerate() {
        assert_eq!(description.fault.place(), place);
    }
}
