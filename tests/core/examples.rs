//! The examples run, and what they assert holds.

#[path = "../../examples/anfis.rs"]
mod anfis;
#[path = "../../examples/filter.rs"]
mod filter;
#[path = "../../examples/own_effect.rs"]
mod own_effect;
#[path = "../../examples/simulate.rs"]
mod simulate;
#[path = "../../examples/tick.rs"]
mod tick;

#[test]
fn examples_hold() {
    anfis::main().unwrap();
    filter::main();
    own_effect::main().unwrap();
    simulate::main().unwrap();
    tick::main();
}
