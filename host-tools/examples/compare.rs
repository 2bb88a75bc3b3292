//! A model against a recording that it has not seen: `cargo run --release -p greyrig-host --example compare`.

use greyrig_host::compare::compare;
use greyrig_host::context::Context;
use greyrig_host::identify::{Settings, identify};
use greyrig_host::model::Kind;
use greyrig_host::rig::Setup;

/// Runs the example.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let recorded = |seed| Setup::new(Kind::PmDc).seconds(6.0).seed(seed).run().map(|run| run.recording);
    let model = identify(&[recorded(1)?], &Settings::new(Kind::PmDc), &Context::quiet())?.model;

    let comparison = compare(&model, &[recorded(2)?], &Context::quiet())?;
    // RMS(model − measured)/RMS(measured) in free run, and what a perfect model would have.
    println!("error-to-signal ratio {:?}", comparison.esr);
    println!("noise floor           {:?}", comparison.noise_floor);
    assert!(comparison.esr.speed.is_some_and(|ratio| ratio < 0.05), "{:?}", comparison.esr);
    Ok(())
}
