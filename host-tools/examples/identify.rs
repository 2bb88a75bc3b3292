//! R, L, K, J and friction of a motor from a recording: `cargo run --release -p greyrig-host --example identify`.

use greyrig_host::context::Context;
use greyrig_host::identify::{Settings, identify};
use greyrig_host::model::Kind;
use greyrig_host::rig::Setup;

/// Runs the example.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The virtual rig in place of a file: a magnet motor on steps of a direct voltage.
    let rig = Setup::new(Kind::PmDc).seconds(6.0).seed(1).run()?;

    let found = identify(&[rig.recording], &Settings::new(Kind::PmDc), &Context::quiet())?;
    for parameter in &found.parameters {
        println!("{:4} {:?} {}, 95 %: {:?}", parameter.name, parameter.value, parameter.unit, parameter.ci95);
    }
    found.notes.iter().for_each(|note| println!("{note}"));
    assert!(found.parameters.iter().any(|p| p.name == "K" && p.identifiable));
    Ok(())
}
