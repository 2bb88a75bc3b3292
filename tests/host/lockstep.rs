//! Residuals of several models at once.

use std::collections::BTreeSet;

use greyrig_host::experiment::Experiment;
use greyrig_host::identify::equation_error::EquationError;
use greyrig_host::identify::minimise::Residuals;
use greyrig_host::identify::output_error::{OutputError, Rows};
use greyrig_host::identify::space::Space;
use greyrig_host::identify::{Settings, build_space, prepare};
use greyrig_host::model::{Filter, Kind};
use greyrig_host::rig::Setup;
use greyrig_host::speed_sensor::Chain;
use nalgebra::DVector;

/// The bits of residuals at many points, at once and one by one.
fn bits(problem: &impl Residuals, space: &Space, thetas: &[Vec<f64>]) -> [Vec<u64>; 2] {
    let of = |rows: Vec<DVector<f64>>| rows.iter().flatten().map(|x| x.to_bits()).collect();
    [of(problem.at_each(space, thetas)), of(thetas.iter().map(|theta| problem.at(space, theta)).collect())]
}

/// Points that differ by little and by much, more than there are lanes and no multiple of them: each has the residuals
/// that it has alone, with effects of circuit, iron and measuring chain, on the mains, on steps with hard edges, locked
/// and coasting.
#[test]
fn points_at_once_have_the_bits_of_each_alone() {
    let run = |profile: &str, seconds: f64, seed: u64| {
        let setup = Setup::new(Kind::Universal).profile(profile).unwrap().seconds(seconds).seed(seed);
        setup.effect("saturation=0.3").unwrap().run().unwrap().recording
    };
    let recordings =
        [run("staircase", 2.0, 1), run("dc-steps", 2.0, 2), run("locked", 1.0, 3), run("coast-down", 3.0, 4)];
    let full = prepare(&recordings, &Filter::default(), &Chain::default()).unwrap();
    let experiments: Vec<Experiment> = full.iter().map(Experiment::coarse).collect();
    for effects in [
        &["saturation", "hysteresis", "brush_drop", "bearing_warmup"][..],
        &["supply_dead_zone", "eddy_current", "windage_exponent"],
        &["channel_delay", "speed_lag", "brush_drop"],
    ] {
        let settings = Settings {
            effects: effects.iter().map(|id| id.parse().expect("an effect")).collect(),
            ..Settings::new(Kind::Universal)
        };
        let mut space = build_space(&settings).unwrap();
        space.take_typical_values();
        space.take_scales(&space.scales(&experiments));
        let theta = space.coordinates();
        let rows = experiments.iter().map(|e| Rows::new(e, 1)).collect();
        let (free_run, balances) = (OutputError::new(rows).unwrap(), EquationError::new(&experiments).unwrap());
        for difference in [1e-6, 0.05] {
            let moved =
                |k: usize| theta.iter().enumerate().map(move |(j, x)| x + if j == k { difference } else { 0.0 });
            let thetas: Vec<Vec<f64>> = (0..theta.len().min(11)).map(|k| moved(k).collect()).collect();
            for [at_once, alone] in [bits(&free_run, &space, &thetas), bits(&balances, &space, &thetas)] {
                assert!(at_once == alone, "{effects:?}, {difference}");
                // Residuals that could not be computed would agree as well; they are all one number.
                let distinct = alone.iter().collect::<BTreeSet<_>>().len();
                assert!(distinct > alone.len() / 4, "{effects:?}, {difference}: {distinct} of {}", alone.len());
            }
        }
    }
}
