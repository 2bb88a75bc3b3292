//! Which physical effect does a model lack? Find it, add it, and see the error fall on data held out:
//! `cargo run --release -p greyrig-host --example diagnose_and_add`.

use greyrig_host::addition::{Additions, add_to};
use greyrig_host::compare::compare;
use greyrig_host::context::Context;
use greyrig_host::diagnose::{Options, diagnose};
use greyrig_host::identify::{Settings, identify};
use greyrig_host::model::Kind;
use greyrig_host::rig::Setup;

/// Runs the example.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A motor whose brushes take a voltage, which nobody has told the model.
    let recorded = |seed| {
        let rig = Setup::new(Kind::PmDc).effect("brush_drop")?.seconds(8.0).seed(seed);
        rig.run().map(|run| run.recording)
    };
    let (training, held_out) = ([recorded(1)?], [recorded(2)?]);
    let ctx = Context::quiet();
    let settings = Settings::new(Kind::PmDc);
    let without = identify(&training, &settings, &ctx)?.model;

    let options = Options { settings, exclude: Vec::new(), candidates_refined: false };
    let verdict = diagnose(&training, &options, &ctx)?.verdict;
    println!("{:?} {:?}\n{}", verdict.kind, verdict.effects, verdict.text);

    let with = add_to(&without, Additions::effects(&verdict.effects), &training, &ctx)?.identification.model;
    let [before, after] = [&without, &with].map(|model| compare(model, &held_out, &ctx).map(|c| c.esr.current));
    let (before, after) = (before?.unwrap_or_default(), after?.unwrap_or_default());
    println!("error of the current on data held out: {:.2} % -> {:.2} %", 100.0 * before, 100.0 * after);
    assert!(after < before);
    Ok(())
}
